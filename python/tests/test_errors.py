"""Wrong arguments are named, and what they should be."""

import numpy as np
import pytest

import divmerge

POINTS = np.ones((5, 3), np.float32)


@pytest.mark.parametrize(
    "arguments, problem",
    [
        ((np.ones((5, 2), np.float32),), r"points: expected \(N, 3\), \(N, 4\).* got \(5, 2\)"),
        ((np.ones(5),), r"points: .* got \(5,\)"),
        ((np.ones((2, 2, 2, 3)),), r"points: .* got \(2, 2, 2, 3\)"),
        ((np.ones((2, 2, 5)),), r"points: .* got \(2, 2, 5\)"),
        ((np.float32(1),), r"points: .* got \(\)"),
        ((POINTS, np.ones(4, int)), r"semantics: expected \(5,\), got \(4,\)"),
        ((POINTS, np.ones((5, 1), int)), r"semantics: expected \(5,\), got \(5, 1\)"),
        ((POINTS, -np.ones(5, int)), r"semantics: expected numbers of 0 to .*, got -1"),
        ((POINTS, np.full(5, 2**32)), r"semantics: expected numbers of 0 to .*, got 4294967296"),
        ((POINTS, np.full(5, 2**64 - 1, "u8")), r"semantics: expected .*, got 18446744073709551615"),
        ((POINTS, np.full(5, -3, "i1")), r"semantics: expected numbers of 0 to .*, got -3"),
        ((POINTS, "grond"), r"semantics: `grond` is neither ground nor all"),
    ],
)
def test_arrays_of_wrong_values(arguments, problem):
    with pytest.raises(ValueError, match=problem):
        divmerge.cluster(*arguments)


@pytest.mark.parametrize(
    "arguments, problem",
    [
        ((None,), "points: expected an array, got NoneType"),
        (({},), "points: expected an array, got dict"),
        ((POINTS, {}), "semantics: expected an array, got dict"),
        ((np.ones((5, 3), complex),), "points: expected real numbers, got dtype complex128"),
        ((np.ones((5, 3), bool),), "points: expected real numbers, got dtype bool"),
        ((np.ones((5, 3), object),), "points: expected real numbers, got dtype object"),
        ((np.full((5, 3), "a"),), "points: expected real numbers, got dtype <U1"),
        ((np.zeros((5, 3), "f4,f4"),), "points: expected real numbers"),
        ((POINTS, np.ones(5)), "semantics: expected integers, got dtype float64"),
        ((POINTS, np.full(5, None)), "semantics: expected integers, got dtype object"),
    ],
)
def test_arrays_of_wrong_types(arguments, problem):
    with pytest.raises(TypeError, match=problem):
        divmerge.cluster(*arguments)


@pytest.mark.parametrize(
    "parameters, problem",
    [
        (dict(voxel=0), "voxel: must be above 0"),
        (dict(voxel=float("nan")), "voxel: not a finite number"),
        (dict(angle=90), r"angle: must be in 0\.\.90"),
        (dict(gap_columns=0), "gap_columns: must be a whole number from 1 on"),
        (dict(gap_rows=-1), "gap_rows: expected a whole number from 0 on"),
        (dict(min_points=-1), "min_points: expected a whole number from 0 on"),
        (dict(rows=1025), "rows: must be 1024 at most"),
        (dict(columns=20000), "columns: must be 16384 at most"),
        (dict(fov=(-25, 3)), "fov: the upper edge must lie above the lower one"),
        (dict(fov=(100, 3)), "fov: both must lie in"),
        (dict(preset="bets"), "preset: `bets` is none of best, paper, authors; did you mean `best`"),
        (dict(bev="hulls"), "bev: `hulls` is none of off, size, .*; did you mean `hull`"),
        (dict(preset="authors", bev="hull"), "bev: preset `authors` merges"),
        (dict(tree_gap=-1), "tree_gap: must be a number above 0 to 1 .*, got -1"),
        (dict(ground_step=float("nan")), "ground_step: must be a number from 0 .*, got NaN"),
        (dict(set={"cluster.voxle": 1}), "set: no parameter `cluster.voxle`; did you mean"),
        (dict(set={"cluster.voxel": 0}), "set: `cluster.voxel` = 0: must be a number above 0"),
        (dict(method="magic"), "method: `magic` is no method"),
        (dict(method="boxes"), "method: `boxes` needs boxes"),
        (dict(sensor_frame="uuu"), "sensor_frame: "),
        (dict(sensor_frame="tf"), "sensor_frame: `tf` is for recordings"),
        (dict(confidence=np.ones(4)), r"confidence: expected \(5,\), got \(4,\)"),
        (dict(ring=np.full(5, 70000)), "ring: expected numbers of 0 to 65535, got 70000"),
        (dict(source=np.full(5, -1)), "source: expected numbers of 0 to .*, got -1"),
    ],
)
def test_parameters_of_wrong_values(parameters, problem):
    with pytest.raises(ValueError, match=problem):
        divmerge.cluster(POINTS, **parameters)


@pytest.mark.parametrize(
    "parameters, problem",
    [
        (dict(vexel=1), r"cluster\(\) got an unexpected keyword argument 'vexel'"),
        (dict(topics=None), r"cluster\(\) got an unexpected keyword argument 'topics'"),
        (dict(voxel="1"), "voxel: expected a number, got str"),
        (dict(gap_rows=1.5), "gap_rows: expected a whole number, got float"),
        (dict(set=[1]), "set: expected a dict of paths of parameters and their values"),
        (dict(set={"cluster.voxel": None}), "cluster.voxel: cannot be of type NoneType"),
        (dict(preset=1), "preset: expected str, got int"),
        (dict(fov=3), "fov: expected two numbers"),
        (dict(taxonomy=3), "taxonomy: expected a Taxonomy or a path, got int"),
        (dict(ring=np.ones(5)), "ring: expected integers, got dtype float64"),
        (dict(ring=np.ones(5, bool)), "ring: expected integers, got dtype bool"),
        (dict(confidence=["a"] * 5), "confidence: expected real numbers"),
    ],
)
def test_parameters_of_wrong_types(parameters, problem):
    with pytest.raises(TypeError, match=problem):
        divmerge.cluster(POINTS, **parameters)


def test_images_of_wrong_shapes():
    axis, mask = np.ones((4, 6)), np.ones((4, 6), bool)
    with pytest.raises(ValueError, match=r"x: expected \(H, W\) float32, got \(24,\)"):
        divmerge.cluster_image(axis.ravel(), axis, axis, mask)
    with pytest.raises(ValueError, match=r"z: expected \(4, 6\), got \(6, 4\)"):
        divmerge.cluster_image(axis, axis, axis.T, mask)
    with pytest.raises(ValueError, match=r"mask: expected \(4, 6\), got \(4, 5\)"):
        divmerge.cluster_image(axis, axis, axis, mask[:, :5])
    with pytest.raises(TypeError, match="mask: expected integers, got dtype float64"):
        divmerge.cluster_image(axis, axis, axis, axis)
    with pytest.raises(TypeError, match="unexpected keyword argument 'taxonomy'"):
        divmerge.cluster_image(axis, axis, axis, mask, taxonomy=divmerge.Taxonomy())


def test_an_array_that_raises_says_what_it_said():
    class Broken:
        def __array__(self, dtype=None, copy=None):
            raise RuntimeError("on another device")

    with pytest.raises(RuntimeError, match="on another device"):
        divmerge.cluster(Broken())


def test_files_that_are_not_there(tmp_path):
    missing = tmp_path / "missing.mcap"
    for call in (
        lambda: divmerge.frames(missing),
        lambda: divmerge.topics(missing),
        lambda: divmerge.annotate(missing, tmp_path / "out.mcap"),
        lambda: divmerge.evaluate(missing),
        lambda: divmerge.Taxonomy(missing),
    ):
        with pytest.raises(FileNotFoundError) as raised:
            call()
        assert raised.value.filename == str(missing)


def test_files_that_are_something_else(tmp_path):
    other = tmp_path / "other.mcap"
    other.write_bytes(b"no recording at all, whatever its name says")
    with pytest.raises(divmerge.Error, match="other.mcap"):
        divmerge.frames(other)
    with pytest.raises(divmerge.Error, match="taxonomy"):
        divmerge.Taxonomy(other)
    assert issubclass(divmerge.Error, Exception) and not issubclass(divmerge.Error, OSError)


def test_recordings_asked_for_what_they_do_not_have(drives, tmp_path):
    drive, out = drives("small"), tmp_path / "out.mcap"
    with pytest.raises(divmerge.Error, match="/lidar/points"):
        divmerge.frames(drive, "/camera")
    with pytest.raises(divmerge.Error, match="has 3 clouds, numbered 0 to 2"):
        divmerge.frames(drive, start=9)
    with pytest.raises(divmerge.Error, match="no field `made_up`"):
        next(divmerge.frames(drive, fields="made_up"))
    with pytest.raises(divmerge.Error, match="no field `made_up`"):
        next(divmerge.frames(drive, semantics="field:made_up"))
    with pytest.raises(divmerge.Error):
        divmerge.annotate(drive, out, topics="/camera")
    with pytest.raises(divmerge.Error, match="the input itself"):
        divmerge.annotate(drive, drive, force=True)
    with pytest.raises(divmerge.Error, match="annotated topic"):
        divmerge.evaluate(drive)
    with pytest.raises(divmerge.Error, match="frame"):
        divmerge.annotate(drive, out, from_="frame:77")
    assert not out.exists()


@pytest.mark.parametrize(
    "parameters, problem, kind",
    [
        (dict(semantics="auto:x"), "semantics: use auto, field:NAME", ValueError),
        (dict(semantics=np.ones(3)), "semantics: expected str, got ndarray", TypeError),
        (dict(tolerance=-1), "tolerance: must not be below 0", ValueError),
        (dict(from_="noon"), "from_: use seconds from the start", ValueError),
        (dict(from_=2, to=1), "from: must lie before the end", ValueError),
        (dict(topics=3), "topics: expected str or several, got int", TypeError),
        (dict(objects="cubes"), "objects: `cubes` is none of markers, detection3d, autoware, all", ValueError),
        (dict(compression="zip"), "compression: `zip` is none of zstd, lz4, none", ValueError),
        (dict(threads=0), "threads: expected 1 to 1024, got 0", ValueError),
        (dict(only=True, in_place=True), "in_place: not together with only", ValueError),
        (dict(resume=True, force=True), "force: not together with resume", ValueError),
        (dict(force="yes"), "force: expected a bool", TypeError),
        (dict(progress=3), "progress: expected True, or a function", TypeError),
        (dict(start=1), "unexpected keyword argument 'start'", TypeError),
    ],
)
def test_annotate_with_wrong_arguments(drives, tmp_path, parameters, problem, kind):
    with pytest.raises(kind, match=problem):
        divmerge.annotate(drives("small"), tmp_path / "out.mcap", **parameters)
    assert list(tmp_path.iterdir()) == []


def test_outputs_are_not_replaced_unasked(drives, tmp_path):
    out = tmp_path / "out.mcap"
    out.write_text("mine")
    with pytest.raises(FileExistsError, match="force=True replaces it"):
        divmerge.annotate(drives("small"), out)
    with pytest.raises(FileExistsError, match="force=True replaces it"):
        divmerge.simulate(out)
    assert out.read_text() == "mine"


def test_frames_are_not_turned_twice(frame):
    with pytest.raises(ValueError, match=r"sensor_frame: .* frames\(\) takes it"):
        frame.cluster(sensor_frame="rfu")
