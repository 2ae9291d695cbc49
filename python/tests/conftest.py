"""Simulated drives, and the command line to compare with."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import divmerge
from divmerge import _environment

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from needed import skip_or_fail  # noqa: E402

TOPIC = "/lidar/points"


def _binary() -> Path | None:
    named = os.environ.get("DIVMERGE_BIN")
    if named:
        return Path(named)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    built = [target / profile / "divmerge" for profile in ("release", "debug")]
    built = [path for path in built if path.is_file()]
    return max(built, key=lambda path: path.stat().st_mtime, default=None)


@pytest.fixture(scope="session")
def binary() -> Path:
    """The built binary."""
    found = _binary()
    if found is None:
        skip_or_fail("no divmerge is built: cargo build, or DIVMERGE_BIN")
    return found


@pytest.fixture(scope="session")
def command_line(binary):
    """Runs the built binary: `command_line("annotate", ...)`, on the ONNX Runtime of this Python."""
    libraries = _environment.onnxruntime()
    environment = {**os.environ, "ORT_DYLIB_PATH": str(libraries)} if libraries else None

    def run(*arguments):
        words = [str(binary), *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, env=environment)
        assert done.returncode == 0, f"{words}: {done.stderr}"
        return done.stdout

    return run


@pytest.fixture(scope="session")
def drives(tmp_path_factory):
    """Simulated drives by name, made when they are asked for."""
    folder = tmp_path_factory.mktemp("drives")
    kinds = {
        # No rows and columns, rings from the highest beam on.
        "rings": dict(sensor="hdl-64e", scene="street", frames=2),
        # No rows, columns or rings.
        "small": dict(sensor="vlp-16", scene="parking", frames=3),
        # Rows and columns, the origin where nothing came back.
        "organised": dict(sensor="os1-128", scene="crowd", frames=2),
        # Solid state, no rings.
        "solid": dict(sensor="mid-360", scene="yard", frames=2),
        "ros1": dict(sensor="vlp-16", scene="street", frames=2, encoding="ros1"),
        "protobuf": dict(sensor="vlp-16", scene="street", frames=2, encoding="foxglove-protobuf"),
    }

    def drive(kind: str) -> Path:
        path = folder / f"{kind}.mcap"
        if not path.exists():
            divmerge.simulate(path, **kinds[kind])
        return path

    return drive


@pytest.fixture(scope="session")
def frame(drives):
    """The first cloud of a small drive."""
    return next(divmerge.frames(drives("small")))


@pytest.fixture(scope="session")
def shared():
    """Data beside the checkout."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no data in {folder}")
    return folder
