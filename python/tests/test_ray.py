"""The example over Ray: a local cluster of two workers, one of which is killed in the middle."""

import importlib.util
import sys
import threading
import time

import pytest

import divmerge
from conftest import ROOT
from needed import needed

ray = needed("ray")
cluster_utils = needed("ray.cluster_utils")


@pytest.fixture(scope="module")
def example():
    """examples/ray_annotate.py as a module, known to the workers by value."""
    path = ROOT / "examples" / "ray_annotate.py"
    specification = importlib.util.spec_from_file_location("ray_annotate", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules["ray_annotate"] = module
    specification.loader.exec_module(module)
    ray.cloudpickle.register_pickle_by_value(module)
    return module


@pytest.fixture
def cluster():
    """Two workers of one core each, beside a head without any."""
    cluster = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    workers = [cluster.add_node(num_cpus=1) for _ in range(2)]
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster, workers
    ray.shutdown()
    cluster.shutdown()


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    """A folder with two drives, one of them in a folder below."""
    folder = tmp_path_factory.mktemp("drives")
    (folder / "day").mkdir()
    divmerge.simulate(folder / "a.mcap", sensor="hdl-64e", frames=60)
    divmerge.simulate(folder / "day" / "b.mcap", sensor="vlp-16", frames=16)
    return folder


@ray.remote(num_cpus=1)
def meet(folder, number):
    """Ends when both workers have come to it, so that both are awake."""
    (folder / f"{number}").touch()
    while not all((folder / f"{other}").exists() for other in range(2)):
        time.sleep(0.01)


def kill_when_both_work(cluster, worker, slices, killed):
    """Kills a worker at the first moment at which two slices are being written."""
    while not killed.is_set():
        if len(list(slices.rglob(".*.partial"))) >= 2:
            cluster.remove_node(worker, allow_graceful=False)
            killed.set()
        time.sleep(0.01)


def test_a_worker_that_is_killed_changes_nothing(cluster, example, drives, tmp_path):
    cluster, workers = cluster
    output, killed, told = tmp_path / "annotated", threading.Event(), []
    ray.get([meet.remote(tmp_path, number) for number in range(2)])
    hunter = threading.Thread(
        target=kill_when_both_work, args=(cluster, workers[0], output / ".slices", killed), daemon=True
    )
    hunter.start()
    recordings = example.run([str(drives)], output, 8, {"semantics": "auto"}, tell=told.append)
    assert killed.is_set(), "no worker was killed: all was done before two slices were under way"
    # The cluster hears of it by and by.
    while len([node for node in ray.nodes() if node["Alive"]]) > 2:
        time.sleep(0.1)
    assert [recording.problem for recording in recordings] == [None, None]
    for name in ("a.mcap", "day/b.mcap"):
        whole = tmp_path / "whole.mcap"
        divmerge.annotate(drives / name, whole, force=True)
        assert (output / name).read_bytes() == whole.read_bytes(), name
    assert not (output / ".slices").exists()
    assert sum(line.startswith("joined") for line in told) == 2
    table = example.table(recordings).splitlines()
    assert table[1].split()[:3] == ["a.mcap", str(len(recordings[0].pieces)), "60"]
    assert table[-1].split()[0] == "all"


def test_a_broken_recording_does_not_keep_the_others(cluster, example, drives, tmp_path):
    broken = tmp_path / "broken.mcap"
    whole = (drives / "day" / "b.mcap").read_bytes()
    # A byte in the middle of a chunk: the index is whole, so there is a plan.
    broken.write_bytes(whole[:200_000] + bytes([whole[200_000] ^ 255]) + whole[200_001:])
    recordings = example.run([str(broken), str(drives / "a.mcap")], tmp_path / "out", 3, tell=lambda line: None)
    assert "broken.mcap" in recordings[0].problem and recordings[0].report is None
    assert recordings[1].problem is None and (tmp_path / "out" / "a.mcap").exists()
    assert "broken.mcap" in example.table(recordings)
    with pytest.raises(FileExistsError):
        example.run([str(drives / "a.mcap")], tmp_path / "out", 3)
