"""Classes from networks: point for point those of the published pipeline in numpy, on both runtimes.

Needs the release binary (`cargo build --release`) and `pip install -r tests/python/requirements.txt`.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import yaml

import range_view
from needed import skip_or_fail
from test_independent_readers import BINARY

NETWORK = Path(__file__).resolve().parents[1] / "data" / "network"
MODEL, CONFIG = NETWORK / "network.onnx", NETWORK / "network.yaml"
# Without smoothing, and without any instance: every point keeps the class that the network gave it.
AS_GIVEN = ["--preset", "paper", "--min-points", str(10**9)]


def run(*arguments):
    environment = dict(os.environ, ORT_DYLIB_PATH=str(Path(onnxruntime.__file__).parent / "capi"))
    command = [BINARY, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if "built without tract" in done.stderr:
        skip_or_fail("the binary was built without the feature tract")
    assert done.returncode == 0, done.stderr
    return done.stdout


def annotated(path):
    """The annotated clouds of a recording."""
    return [cloud for cloud in range_view.clouds(path) if "confidence" in cloud.dtype.names]


def raw_ids(config):
    inverse = config["learning_map_inv"]
    return np.array([inverse[number] for number in sorted(inverse)])


@pytest.mark.parametrize("runtime", ["tract", "onnxruntime"])
@pytest.mark.parametrize("sensor", ["hdl-64e", "vlp-16"])
@pytest.mark.parametrize("vote", [True, False])
def test_classes_are_those_of_the_published_pipeline(tmp_path, runtime, sensor, vote):
    drive, config_file = tmp_path / "drive.mcap", tmp_path / "network.yaml"
    run("simulate", "--sensor", sensor, "--frames", 2, "--seed", 7, "-o", drive)
    config = yaml.safe_load(CONFIG.read_text())
    config["post"]["KNN"]["use"] = vote
    config_file.write_text(yaml.safe_dump(config))
    output = tmp_path / "out.mcap"
    network = ["--semantics", f"onnx:{MODEL}", "--model-config", config_file, "--runtime", runtime]
    run("annotate", drive, "-o", output, *network, *AS_GIVEN)
    session, _ = range_view.load(MODEL, CONFIG)
    clouds = annotated(output)
    assert len(clouds) == 2
    for cloud in clouds:
        columns = [cloud[name] for name in ("x", "y", "z", "intensity")]
        alone, voted = range_view.segment(session, config, *columns)
        expected = raw_ids(config)[voted if vote else alone]
        # Rounding moves a point in a hundred thousand across the border of a pixel.
        assert np.mean(cloud["semantic"] == expected) > 0.9999
        assert len(np.unique(expected)) > 4
        returns = (cloud["x"] != 0) | (cloud["y"] != 0) | (cloud["z"] != 0)
        # The class that most neighbours have need not be the likeliest on average, but it mostly is.
        assert np.mean(cloud["confidence"][returns] > 127) > 0.9
        sure = cloud["confidence"] > 240
        assert cloud["entropy"][sure].mean() < cloud["entropy"][returns & ~sure].mean()


def test_a_recording_says_what_gave_its_classes(tmp_path):
    drive, output = tmp_path / "drive.mcap", tmp_path / "out.mcap"
    run("simulate", "--sensor", "vlp-16", "--frames", 1, "-o", drive)
    run("annotate", drive, "-o", output, "--semantics", f"onnx:{MODEL}", "--runtime", "onnxruntime")
    from mcap.reader import make_reader

    with open(output, "rb") as file:
        records = [record for record in make_reader(file).iter_metadata() if record.name == "divmerge"]
    said = records[0].metadata["network"]
    assert "sha256" in said and "64 x 1024" in said
    assert f"ONNX Runtime {onnxruntime.__version__}" in said
