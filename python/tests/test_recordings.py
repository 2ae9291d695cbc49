"""Recordings: the same as the command line, bit for bit."""

import json
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest

import divmerge
from conftest import ROOT, TOPIC
from needed import skip_or_fail

COLUMNS = ("instance", "component", "semantic", "reason")
KINDS = ["rings", "small", "organised", "solid", "ros1", "protobuf"]


def annotated(path, topic):
    """The columns that an annotated recording holds, cloud by cloud."""
    clouds = divmerge.frames(
        path, f"{topic}/instances", semantics="all", sensor_frame="none", fields=COLUMNS
    )
    return [cloud.fields for cloud in clouds]


def same_as_annotated(result, fields):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(result, name).reshape(-1), fields[name], err_msg=name)


@pytest.mark.parametrize("semantics", ["auto", "ground"])
@pytest.mark.parametrize("kind", KINDS)
def test_frames_cluster_as_the_command_line_does(drives, command_line, tmp_path, kind, semantics):
    drive, out = drives(kind), tmp_path / "out.mcap"
    command_line("annotate", drive, "-o", out, "--semantics", semantics)
    expected = annotated(out, TOPIC)
    frames = list(divmerge.frames(drive, semantics=semantics))
    assert len(frames) == len(expected) > 0
    for frame, fields in zip(frames, expected):
        assert frame.semantics == ("field:label" if semantics == "auto" else "ground")
        same_as_annotated(divmerge.cluster(frame), fields)
        same_as_annotated(frame.cluster(), fields)
        shape = frame.shape if frame.shape[0] > 1 else (len(frame),)
        own = dict(ring=frame.ring, source=frame.source)
        own = {name: None if column is None else column.reshape(shape) for name, column in own.items()}
        classes = None if frame.classes is None else frame.classes.reshape(shape)
        points = frame.points.reshape(*shape, 3)
        same_as_annotated(divmerge.cluster(points, classes, **own), fields)


@pytest.mark.parametrize(
    "words, parameters",
    [
        ([], {}),
        (["--semantics", "ground", "--preset", "paper"], dict(semantics="ground", preset="paper")),
        (
            "--voxel 0.7 --angle 12.5 --gap-columns 3 --gap-rows 1 --min-points 5 --bev hull".split(),
            dict(voxel=0.7, angle=12.5, gap_columns=3, gap_rows=1, min_points=5, bev="hull"),
        ),
        (
            "--preset authors --rows 40 --columns 1000 --fov 10,-20".split(),
            dict(preset="authors", rows=40, columns=1000, fov=(10, -20)),
        ),
        (["--method", "alpine"], dict(method="alpine")),
        (
            "--semantics ground --set cluster.tree.gap=0.02 --set ground.step=0.3 --lag 0.2".split(),
            dict(semantics="ground", set={"cluster.tree.gap": 0.02, "ground.step": 0.3}, lag=0.2),
        ),
        (
            "--method dbscan --set method.reach=0.7 --set projection.rows=auto".split(),
            dict(method="dbscan", set={"method.reach": 0.7, "projection.rows": "auto"}),
        ),
        (["--sensor-frame", "180,0,0"], dict(sensor_frame="180,0,0")),
        (["--sensor-origin", f"{TOPIC}=0,0,0.5"], dict(sensor_origin=f"{TOPIC}=0,0,0.5")),
        (["--ego", "auto"], dict(ego="auto")),
        (["--only", "--objects", "detection3d"], dict(only=True, objects="detection3d")),
        (
            ["--semantics", "ground", "--objects", "detection3d,all"],
            dict(semantics="ground", objects=["detection3d", "all"]),
        ),
        (["--in-place-fields"], dict(in_place=True)),
        (["--compression", "lz4", "--threads", "3"], dict(compression="lz4", threads=1)),
        (["--from", "0.15"], dict(from_=0.15)),
        (["--from", "frame:1", "--to", "frame:2"], dict(from_="frame:1", to="frame:2")),
        (["--topic", TOPIC, "--unchecked"], dict(topics=[TOPIC], unchecked=True)),
        (["--assemble", "2"], dict(assemble="2")),
    ],
)
def test_annotate_writes_the_same_bytes(drives, command_line, tmp_path, words, parameters):
    drive, ours, theirs = drives("small"), tmp_path / "ours.mcap", tmp_path / "theirs.mcap"
    printed = command_line("annotate", drive, "-o", theirs, "--no-layout", "--json", *words)
    report = divmerge.annotate(drive, ours, **parameters)
    assert ours.read_bytes() == theirs.read_bytes()
    expected = json.loads(printed)
    for name in ("input", "output_bytes", "form", "from_ns", "to_ns", "messages", "annotations"):
        assert report[name] == expected[name], name
    of_topic, expected = report["topics"][TOPIC], expected["topics"][TOPIC]
    for name in ("frames", "points", "instances", "semantics", "projection", "reasons"):
        assert of_topic[name] == expected[name], name


@pytest.mark.parametrize("kind", KINDS)
def test_annotate_writes_the_same_bytes_of_every_kind(drives, command_line, tmp_path, kind):
    drive, ours, theirs = drives(kind), tmp_path / "ours.mcap", tmp_path / "theirs.mcap"
    command_line("annotate", drive, "-o", theirs, "--no-layout")
    divmerge.annotate(str(drive), str(ours))
    assert ours.read_bytes() == theirs.read_bytes()


def test_drives_are_simulated_as_at_the_command_line(drives, command_line, tmp_path):
    theirs = tmp_path / "theirs.mcap"
    command_line(
        *("simulate", "-o", theirs, "--sensor", "vlp-16", "--scene", "parking", "--frames", "3")
    )
    assert theirs.read_bytes() == drives("small").read_bytes()


def test_classes_of_files_and_taxonomies(drives, command_line, tmp_path):
    labels = tmp_path / "labels"
    labels.mkdir()
    for frame in divmerge.frames(drives("small")):
        frame.classes.astype(np.uint32).tofile(labels / f"{frame.number:06}.label")
    taxonomy = tmp_path / "mine.yaml"
    taxonomy.write_text("labels: {0: nothing, 10: car, 30: person, 40: road}\n")
    ours, theirs = tmp_path / "ours.mcap", tmp_path / "theirs.mcap"
    semantics = f"labels:{labels}"
    words = ("--semantics", semantics, "--taxonomy", taxonomy, "--no-layout")
    command_line("annotate", drives("small"), "-o", theirs, *words)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        divmerge.annotate(drives("small"), ours, semantics=semantics, taxonomy=taxonomy)
    assert ours.read_bytes() == theirs.read_bytes()
    frames = divmerge.frames(drives("small"), semantics=semantics, taxonomy=taxonomy)
    for frame, fields in zip(frames, annotated(ours, TOPIC)):
        assert frame.taxonomy.name == "mine"
        same_as_annotated(frame.cluster(), fields)


def test_recorded_data(shared, command_line, tmp_path):
    """Real sensors: several topics, classes, transforms, clouds merged of several sensors."""
    recordings = sorted((shared / "recordings").glob("*.mcap"))
    assert recordings, f"no recording in {shared}"
    for recording in recordings:
        ours, theirs = tmp_path / f"ours-{recording.name}", tmp_path / f"theirs-{recording.name}"
        command_line("annotate", recording, "-o", theirs, "--no-layout", "--to", "1")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            divmerge.annotate(recording, ours, to=1)
        assert ours.read_bytes() == theirs.read_bytes(), recording
        for topic in divmerge.topics(recording):
            # What is left out is behind.
            for frame, fields in zip(divmerge.frames(recording, topic), annotated(ours, topic)):
                same_as_annotated(frame.cluster(), fields)


def test_frames_say_what_they_are(drives):
    frames = divmerge.frames(drives("small"), fields=["true_instance", "intensity"])
    assert (len(frames), frames.topic) == (3, TOPIC)
    assert divmerge.topics(drives("small")) == [TOPIC]
    all_frames = list(frames)
    assert [frame.number for frame in all_frames] == [0, 1, 2]
    frame = all_frames[1]
    count = len(frame)
    assert (frame.topic, frame.frame_id) == (TOPIC, "lidar")
    assert 0 < all_frames[0].stamp_ns < frame.stamp_ns <= frame.log_time_ns
    assert frame.points.shape == (count, 3) and frame.points.dtype == np.float32
    assert frame.classes.shape == (count,) and frame.classes.dtype == np.uint16
    assert frame.ring.shape == (count,) and frame.ring.dtype == np.uint16
    assert frame.source is None and frame.confidence is None
    assert frame.fields["true_instance"].dtype == np.int64
    assert frame.fields["intensity"].dtype == np.float64
    assert frame.shape[0] * frame.shape[1] == count
    np.testing.assert_array_equal(frame.rotation, np.eye(3))
    assert "Frame(1 of /lidar/points" in repr(frame)
    assert next(frames, None) is None

    part = divmerge.frames(drives("small"), start=1, stop=2)
    assert len(part) == 1 and [frame.number for frame in part] == [1]
    without = next(divmerge.frames(drives("small"), semantics="ground"))
    assert without.classes is None and without.cluster().ground is not None
    everything = next(divmerge.frames(drives("small"), semantics="all"))
    assert everything.cluster().ground is None
    with pytest.raises(ValueError, match="stop: must be above start"):
        divmerge.frames(drives("small"), start=2, stop=2)


def test_a_frame_with_other_classes(drives):
    frame = next(divmerge.frames(drives("small")))
    other = np.where(frame.classes == 10, 0, frame.classes)
    given = frame.cluster(other)
    assert given.instance.max() < frame.cluster().instance.max()
    np.testing.assert_array_equal(given.reason, divmerge.cluster(frame.points, other, ring=frame.ring).reason)
    assert (frame.classes == 10).any()
    assert frame.cluster("ground").ground is not None


def test_progress_goes_to_the_end(drives, tmp_path):
    seen = []
    report = divmerge.annotate(
        drives("small"), tmp_path / "out.mcap", progress=lambda *bytes: seen.append(bytes)
    )
    assert seen and {total for _, total in seen} == {drives("small").stat().st_size}
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert report["input_bytes"] == drives("small").stat().st_size


def test_what_progress_raises_ends_the_run(drives, tmp_path):
    class Enough(Exception):
        pass

    def stop(done, total):
        raise Enough(done)

    with pytest.raises(Enough):
        divmerge.annotate(drives("rings"), tmp_path / "out.mcap", progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_was_cut_off_is_resumed(drives, tmp_path):
    out, whole = tmp_path / "out.mcap", tmp_path / "whole.mcap"
    size = drives("small").stat().st_size

    def stop(done, total):
        if done > size / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        divmerge.annotate(drives("small"), out, resume=True, progress=stop)
    assert not out.exists() and any(tmp_path.iterdir())
    divmerge.annotate(drives("small"), out, resume=True)
    divmerge.annotate(drives("small"), whole)
    assert out.read_bytes() == whole.read_bytes()
    assert sorted(tmp_path.iterdir()) == [out, whole]


def test_an_interrupt_leaves_nothing(drives, tmp_path):
    """The signal comes while the work is under way, and is heeded by itself."""
    out = tmp_path / "out.mcap"
    code = """
import os, signal, sys, divmerge
def progress(done, total):
    if done > total / 3:
        os.kill(os.getpid(), signal.SIGINT)
try:
    divmerge.annotate(sys.argv[1], sys.argv[2], progress=progress)
except KeyboardInterrupt:
    print("interrupted")
"""
    done = subprocess.run(
        [sys.executable, "-c", code, drives("rings"), out], capture_output=True, text=True
    )
    assert done.stdout == "interrupted\n", done.stderr
    assert list(tmp_path.iterdir()) == []


def another_thread_runs_during(work):
    """Whether a thread that waits for `work` to call its argument runs before `work` is over.

    The interpreter is told to take its lock from nobody, so that the thread runs only where the lock is given back. It may
    come too late even so: there are several tries.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e6)
    try:
        for _ in range(100):
            asked, answered = threading.Event(), threading.Event()
            other = threading.Thread(target=lambda: (asked.wait(), answered.set()), daemon=True)
            other.start()
            work(asked.set)
            was_answered = answered.is_set()
            asked.set()
            other.join()
            if was_answered:
                return True
        return False
    finally:
        sys.setswitchinterval(before)


def test_the_lock_is_kept_where_nothing_gives_it_back():
    assert not another_thread_runs_during(lambda begin: (begin(), sum(range(1000))))


def test_other_threads_run_while_a_recording_is_annotated(drives, tmp_path):
    out = tmp_path / "out.mcap"

    def work(begin):
        # By the first call the method and the window are known: what follows is the work itself.
        divmerge.annotate(drives("small"), out, force=True, progress=lambda done, total: begin())

    assert another_thread_runs_during(work)


def test_other_threads_run_while_a_cloud_is_clustered(drives):
    points = next(divmerge.frames(drives("rings"))).points

    def work(begin):
        begin()
        divmerge.cluster(points, "all")

    assert another_thread_runs_during(work)


def test_threads_at_once_find_the_same(drives):
    frames = list(divmerge.frames(drives("small")))
    expected = [frame.cluster() for frame in frames]
    found = {}

    def work(number):
        found[number] = [divmerge.cluster(f.points, f.classes, ring=f.ring) for f in frames]

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4
    for results in found.values():
        for one, other in zip(results, expected):
            for name in COLUMNS:
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_frames_are_shared_out_among_threads(drives):
    frames, seen = divmerge.frames(drives("small")), []

    def work():
        for frame in frames:
            seen.append(frame.number)

    threads = [threading.Thread(target=work) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(seen) == [0, 1, 2]


def test_what_is_odd_is_warned_of(drives, tmp_path):
    cut = tmp_path / "cut.mcap"
    whole = drives("small").read_bytes()
    cut.write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.warns(UserWarning, match="cut off"):
        report = divmerge.annotate(cut, tmp_path / "out.mcap")
    assert report["truncated"] and report["warnings"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning):
            divmerge.annotate(cut, tmp_path / "other.mcap")


def test_a_network_gives_the_same_classes_as_at_the_command_line(drives, command_line, tmp_path):
    model = ROOT / "tests" / "data" / "network" / "network.onnx"
    semantics = f"onnx:{model}"
    try:
        frames = list(divmerge.frames(drives("rings"), semantics=semantics))
    except divmerge.Error as error:
        if "ONNX Runtime" not in str(error):
            raise
        skip_or_fail("no ONNX Runtime: pip install onnxruntime, or ORT_DYLIB_PATH")
    command_line("annotate", drives("rings"), "-o", tmp_path / "out.mcap", "--semantics", semantics)
    divmerge.annotate(drives("rings"), tmp_path / "own.mcap", semantics=semantics)
    assert (tmp_path / "own.mcap").read_bytes() == (tmp_path / "out.mcap").read_bytes()
    for frame, fields in zip(frames, annotated(tmp_path / "out.mcap", TOPIC)):
        assert frame.semantics == "onnx" and frame.confidence is not None
        same_as_annotated(frame.cluster(), fields)


def test_an_address_is_taken_for_one_and_its_secrets_stay(tmp_path):
    with pytest.raises((divmerge.Error, OSError)) as raised:
        divmerge.annotate("http://127.0.0.1:9/a.mcap?signature=secret", tmp_path / "out.mcap")
    assert "http://127.0.0.1:9/a.mcap" in str(raised.value) and "secret" not in str(raised.value)
