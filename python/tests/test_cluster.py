"""Arrays in, arrays out."""

import numpy as np
import pytest

import divmerge
from divmerge import Reason
from needed import needed


def same(a, b):
    for name in ("instance", "component", "semantic", "reason"):
        np.testing.assert_array_equal(
            getattr(a, name).reshape(-1), getattr(b, name).reshape(-1), err_msg=name
        )


def test_shapes_and_dtypes(frame):
    result = divmerge.cluster(frame.points, frame.classes)
    count = len(frame.points)
    dtypes = dict(instance="u4", component="u4", semantic="u2", reason="u1", pixel_of_point="i8")
    for name, dtype in dtypes.items():
        array = getattr(result, name)
        assert array.shape == (count,) and array.dtype == dtype, name
    assert result.ground is None
    image = result.range_image
    assert image.ndim == 2 and image.dtype == np.float32
    assert result.point_of_pixel.shape == image.shape and result.point_of_pixel.dtype == np.int64
    assert result.instance is result.instance and result.range_image is result.range_image
    assert result.instance.flags.writeable


def test_instances_agree_with_points(frame):
    result = divmerge.cluster(frame.points, frame.classes)
    instances = result.instances
    np.testing.assert_array_equal(instances["id"], np.arange(1, len(instances) + 1))
    np.testing.assert_array_equal(
        instances["points"], np.bincount(result.instance, minlength=len(instances) + 1)[1:]
    )
    assert set(instances["class_name"]) <= set(divmerge.Taxonomy().classes)
    assert np.isnan(instances["confidence"]).all() and np.isnan(instances["probability"]).all()
    for instance in instances:
        members = frame.points[result.instance == instance["id"]].astype(float)
        assert (result.semantic[result.instance == instance["id"]] == instance["semantic"]).all()
        c, s = np.cos(instance["yaw"]), np.sin(instance["yaw"])
        own = (members - instance["centre"]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        assert (np.abs(own) <= instance["size"] / 2 + 1e-6).all()
    reasons = np.unique(result.reason)
    assert set(reasons) <= set(Reason)
    np.testing.assert_array_equal(result.instance > 0, result.reason == Reason.NONE)


def test_range_image_and_pixels(frame):
    result = divmerge.cluster(frame.points, frame.classes)
    pixels, points = result.range_image.reshape(-1), result.point_of_pixel.reshape(-1)
    seen = points >= 0
    np.testing.assert_array_equal(np.isnan(pixels), ~seen)
    ranges = np.linalg.norm(frame.points[points[seen]].astype(float), axis=1)
    np.testing.assert_allclose(pixels[seen], ranges, rtol=1e-6)
    np.testing.assert_array_equal(result.pixel_of_point[points[seen]], np.flatnonzero(seen))


def test_votes_and_merges(frame):
    result = divmerge.cluster(frame.points, frame.classes)
    votes, merges = result.votes, result.merges
    assert len(votes) and len(merges)
    assert (votes["a"] < votes["b"]).all() and (votes["a"] >= 1).all()
    assert votes["b"].max() <= result.component.max()
    assert (votes["positive"] + votes["negative"] > 0).all()
    order = np.lexsort((votes["b"], votes["a"]))
    np.testing.assert_array_equal(order, np.arange(len(votes)))
    assert (merges["positive"] > 0).all()
    assert result.joins.dtype.names == ("target", "query", "gap")
    first = result.component == merges["query"][0]
    second = result.component == merges["target"][0]
    joined = {*result.instance[first], *result.instance[second]}
    assert len(joined) == 1


@pytest.mark.parametrize("change", ["float64", "fortran", "columns", "strided", "four", "list", "big"])
def test_any_layout_gives_the_same(frame, change):
    points = frame.points
    given = {
        "float64": lambda: points.astype(np.float64),
        "fortran": lambda: np.asfortranarray(points),
        "columns": lambda: np.hstack([np.zeros_like(points), points])[:, 3:],
        "strided": lambda: np.repeat(points, 2, axis=0)[::2],
        "four": lambda: np.hstack([points, np.full((len(points), 1), np.nan, np.float32)]),
        "list": lambda: points.tolist(),
        "big": lambda: points.astype(">f4"),
    }[change]()
    same(divmerge.cluster(given, frame.classes), divmerge.cluster(points, frame.classes))


def test_four_columns_that_are_a_part_of_more(frame):
    wide = np.zeros((len(frame.points), 6), np.float32)
    wide[:, 1:4] = frame.points
    same(
        divmerge.cluster(wide[:, 1:5], frame.classes), divmerge.cluster(frame.points, frame.classes)
    )


def test_a_row_of_points_that_is_flipped(frame):
    turned = divmerge.cluster(frame.points[::-1], frame.classes[::-1])
    straight = divmerge.cluster(np.ascontiguousarray(frame.points[::-1]), frame.classes[::-1].copy())
    same(turned, straight)


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", ">u2"])
def test_classes_of_any_integer_type(frame, dtype):
    # Classes below 128 that the taxonomy knows.
    classes = np.where(frame.classes < 128, frame.classes, 10)
    same(
        divmerge.cluster(frame.points, classes.astype(dtype)),
        divmerge.cluster(frame.points, classes.astype("u2")),
    )


def test_words_of_semantic_kitti_hold_the_class_in_their_low_bits(frame):
    words = frame.classes.astype(np.uint32) | (7 << 16)
    same(
        divmerge.cluster(frame.points, words), divmerge.cluster(frame.points, frame.classes)
    )


def test_what_is_given_stays_as_it_is(frame):
    points, classes = frame.points.copy(), frame.classes.copy()
    points.setflags(write=False)
    classes.setflags(write=False)
    before = points.tobytes(), classes.tobytes()
    result = divmerge.cluster(points, classes, sensor_frame="180,0,0")
    assert (points.tobytes(), classes.tobytes()) == before
    assert not np.shares_memory(result.instance, points)


def test_a_result_outlives_what_it_came_from(frame):
    points = frame.points.copy()
    result = divmerge.cluster(points, frame.classes)
    expected = divmerge.cluster(frame.points, frame.classes).range_image
    points[:] = 0
    instance = result.instance
    image = result.range_image
    del result
    divmerge.cluster(np.ones((50_000, 3), np.float32))
    np.testing.assert_array_equal(image, expected)
    same(divmerge.cluster(frame.points, frame.classes), frame.cluster())
    assert instance.max() > 0


def test_organised_points_give_organised_arrays(drives):
    frame = next(divmerge.frames(drives("organised")))
    height, width = frame.shape
    no_return = (frame.points == 0).all(axis=1)
    assert height > 1 and no_return.any()
    result = divmerge.cluster(
        frame.points.reshape(height, width, 3),
        frame.classes.reshape(height, width),
        ring=None if frame.ring is None else frame.ring.reshape(height, width),
    )
    for name in ("instance", "component", "semantic", "reason", "pixel_of_point"):
        assert getattr(result, name).shape == (height, width), name
    same(result, frame.cluster())
    assert (frame.cluster().reason[no_return] == Reason.NO_RETURN).all()


@pytest.mark.parametrize("shape", [(0, 3), (0, 4), (0, 0, 3), (4, 0, 3), (0, 7, 4)])
@pytest.mark.parametrize("semantics", [None, "all", "classes", "marks"])
def test_no_points(shape, semantics):
    points = np.zeros(shape, np.float32)
    given = {
        "classes": np.zeros(shape[:-1], np.uint16),
        "marks": np.zeros(shape[:-1], bool),
    }.get(semantics, semantics)
    result = divmerge.cluster(points, given)
    assert result.instance.shape == shape[:-1] and len(result.instances) == 0
    assert result.instances.dtype.names[0] == "id" and len(result.votes) == 0


def test_nothing_came_back():
    points = np.full((100, 3), np.nan, np.float32)
    points[::2] = 0
    points[::3] = np.inf
    result = divmerge.cluster(points)
    assert (result.reason == Reason.NO_RETURN).all() and (result.pixel_of_point == -1).all()
    with np.errstate(over="ignore"):
        far = divmerge.cluster(np.full((3, 3), 1e300))
    assert far.reason.tolist() == [Reason.NO_RETURN] * 3


def test_ground_all_and_marks(frame):
    ground = divmerge.cluster(frame.points)
    assert ground.ground.dtype == np.float32 and ground.ground.shape == ground.instance.shape
    assert 0 <= ground.ground.min() and ground.ground.max() <= 1
    assert (ground.reason == Reason.GROUND).any() and not ground.semantic.any()
    same(ground, divmerge.cluster(frame.points, "ground"))
    instances = ground.instances
    assert (instances["class_name"] == "").all() and (instances["likeness"] != "").any()

    everything = divmerge.cluster(frame.points, "all")
    assert everything.ground is None and not (everything.reason == Reason.GROUND).any()
    marks = np.ones(len(frame.points), bool)
    same(everything, divmerge.cluster(frame.points, marks))
    marks[::2] = False
    marked = divmerge.cluster(frame.points, marks)
    assert (marked.reason[::2] == Reason.NOT_AN_OBJECT).mean() > 0.99 or (
        marked.instance[::2] == 0
    ).all()


def test_confidence_is_voted_by(frame):
    sure = np.ones(len(frame.points))
    certain = divmerge.cluster(frame.points, frame.classes, confidence=sure)
    np.testing.assert_allclose(certain.instances["confidence"].max(), 1.0)
    odd = np.where(np.arange(len(sure)) % 2, np.nan, 5.0)
    clamped = np.where(np.arange(len(sure)) % 2, 0.0, 1.0)
    same(
        divmerge.cluster(frame.points, frame.classes, confidence=odd),
        divmerge.cluster(frame.points, frame.classes, confidence=clamped),
    )


def test_parameters_do_something(frame):
    def of(**parameters):
        return divmerge.cluster(frame.points, frame.classes, **parameters)

    usual = of()
    assert of(voxel=2.0).component.max() < usual.component.max()
    assert (of(min_points=50).reason == Reason.TOO_SMALL).any()
    assert of(preset="paper").component.tolist() != of(preset="authors").component.tolist()
    assert len(of(bev="off").joins) == 0 < len(usual.joins)
    assert of(method="euclidean").votes.size == 0
    assert of(rows=30, columns=900).range_image.shape == (30, 900)
    assert of(rows=30, fov=(3, -25)).range_image.shape[0] == 30
    same(of(voxel=None, preset="best", method="divide-and-merge"), usual)
    assert set(usual.times) == {
        *("projection_ms", "mask_ms", "divide_ms", "merge_ms", "labels_ms", "run_ms")
    }
    assert "instances" in repr(usual)


def test_rings_and_sources_are_heeded(frame):
    count = len(frame.points)
    assert frame.cluster().projection == "ring field"
    assert divmerge.cluster(frame.points, frame.classes).projection != "ring field"
    rings = divmerge.cluster(frame.points, frame.classes, ring=frame.ring.max() - frame.ring)
    assert rings.projection == "ring field"
    two = divmerge.cluster(frame.points, frame.classes, source=np.arange(count) % 2)
    assert two.projection == "an image for each sensor"


def test_a_sensor_frame_is_turned_away(frame):
    # x to the right, y ahead.
    x, y, z = frame.points.T
    turned = np.stack([-y, x, z], axis=1)
    result = divmerge.cluster(turned, frame.classes, sensor_frame="rfu")
    np.testing.assert_allclose(turned @ result.rotation.T, frame.points, atol=1e-4)
    # Rotated in double precision, points fall into the same pixels but for those at their edges.
    expected = divmerge.cluster(frame.points, frame.classes)
    assert (result.reason == expected.reason).mean() > 0.99
    np.testing.assert_array_equal(expected.rotation, np.eye(3))


def test_an_image_and_a_mask(drives):
    frame = next(divmerge.frames(drives("organised")))
    height, width = frame.shape
    x, y, z = frame.points.reshape(height, width, 3).transpose(2, 0, 1)
    mask = np.isin(frame.classes, [10, 30]).reshape(height, width)
    result = divmerge.cluster_image(x, y, z, mask)
    assert result.instance.shape == (height, width) and len(result.instances) > 0
    assert not result.instance[~mask].any()
    same(result, divmerge.cluster_image(x, y, z, mask.astype(np.int64) * 3))
    organised = frame.points.reshape(height, width, 3)
    same(result, divmerge.cluster(organised, mask))
    paper = divmerge.cluster_image(x, y, z, mask, preset="paper")
    same(paper, divmerge.cluster(organised, mask, preset="paper"))


class OnlyDLPack:
    """An array of a library without `__array__`."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


class OnlyArray:
    """An array of a library that NumPy asks for one."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return self.array if dtype is None else self.array.astype(dtype)


@pytest.mark.parametrize("kind", [OnlyDLPack, OnlyArray])
def test_arrays_of_other_libraries(frame, kind):
    given = divmerge.cluster(kind(frame.points.copy()), kind(frame.classes.copy()))
    same(given, divmerge.cluster(frame.points, frame.classes))


@pytest.mark.torch
def test_torch_tensors(frame):
    torch = needed("torch")
    points = torch.from_numpy(frame.points.copy())
    classes = torch.from_numpy(frame.classes.astype(np.int64))
    same(divmerge.cluster(points, classes), divmerge.cluster(frame.points, frame.classes))


def test_torch_is_not_imported():
    import subprocess
    import sys

    code = (
        "import divmerge, numpy, sys; divmerge.cluster(numpy.ones((9, 3)));"
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_taxonomies(frame, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("labels: {0: nothing, 10: thing, 40: road}\nthing_class: {10: true}\n")
    taxonomy = divmerge.Taxonomy(path)
    assert taxonomy.name == "mine" and taxonomy.things == [10] and taxonomy.ids == {0: 0, 10: 10, 40: 40}
    assert divmerge.Taxonomy().classes[1] == "car" and "semantic-kitti" in repr(divmerge.Taxonomy())
    by_object = divmerge.cluster(frame.points, frame.classes, taxonomy=taxonomy)
    same(by_object, divmerge.cluster(frame.points, frame.classes, taxonomy=path))
    same(by_object, divmerge.cluster(frame.points, frame.classes, taxonomy=str(path)))
    assert set(by_object.instances["class_name"]) == {"thing"}


def test_parameters_are_listed_and_set():
    listed = {one["path"]: one for one in divmerge.parameters()}
    voxel = listed["cluster.voxel"]
    assert (voxel["value"], voxel["unit"], voxel["kind"]) == (0.5, "m", "number")
    assert all(one["doc"] for one in listed.values())
    paper = {one["path"]: one["value"] for one in divmerge.parameters("paper")}
    assert paper["cluster.tree"] is False and paper["cluster.tree.gap"] is None
