"""Frames by number and by slice."""

import numpy as np
import pytest

import divmerge
from conftest import TOPIC


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Six clouds, two in a chunk."""
    path = tmp_path_factory.mktemp("frames") / "drive.mcap"
    divmerge.simulate(path, sensor="hdl-64e", scene="parking", frames=6)
    return path


def numbers(frames):
    return [frame.number for frame in frames]


def same(a, b):
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.classes, b.classes)
    assert (a.number, a.topic, a.stamp_ns, a.log_time_ns) == (b.number, b.topic, b.stamp_ns, b.log_time_ns)


def test_by_number_as_one_after_the_other(drive):
    frames = divmerge.frames(drive, fields="true_instance")
    in_order = list(divmerge.frames(drive, fields="true_instance"))
    assert len(frames) == len(in_order) == 6
    for number in (4, 0, 5, 0):
        same(frames[number], in_order[number])
        same(frames[number - 6], in_order[number])
        np.testing.assert_array_equal(
            frames[number].fields["true_instance"], in_order[number].fields["true_instance"]
        )
    same(frames[np.int64(3)], in_order[3])


def test_the_iterator_stays_where_it_is(drive):
    frames = divmerge.frames(drive)
    assert next(frames).number == 0
    assert frames[-1].number == 5 and numbers(frames[2:4]) == [2, 3]
    assert next(frames).number == 1
    assert numbers(frames) == [2, 3, 4, 5]


@pytest.mark.parametrize(
    "index",
    [
        slice(2, 5),
        slice(None),
        slice(-2, None),
        slice(None, -4),
        slice(1, None, 2),
        slice(0, 99, 4),
        slice(4, 2),
        slice(99, None),
        slice(5, 6),
    ],
)
def test_slices_are_those_of_a_list(drive, index):
    frames, expected = divmerge.frames(drive), list(range(6))
    part = frames[index]
    assert isinstance(part, divmerge.Frames) and part.topic == TOPIC
    assert len(part) == len(expected[index])
    assert [part[place].number for place in range(len(part))] == expected[index]
    assert numbers(part) == expected[index]
    assert numbers(frames[index][::2]) == expected[index][::2]
    assert numbers(frames[index][1:-1]) == expected[index][1:-1]


def test_numbers_count_from_the_start(drive):
    frames = divmerge.frames(drive, start=2, stop=5)
    assert len(frames) == 3 and frames[0].number == 2 and frames[-1].number == 4
    assert numbers(frames[1:]) == [3, 4]


def test_what_is_not_there(drive):
    frames = divmerge.frames(drive)
    for index in (6, -7, 10**30):
        with pytest.raises(IndexError, match=f"no frame {index}: {TOPIC} has 6 here"):
            frames[index]
    with pytest.raises(ValueError, match="step: must be 1 or more, got -1"):
        frames[::-1]
    for index in ("3", 1.0, None):
        with pytest.raises(TypeError, match="index: expected an int or a slice, got"):
            frames[index]


def test_a_frame_is_read_without_those_before_it(drive, tmp_path):
    """All other chunks are destroyed, which the index does not tell."""
    whole = drive.read_bytes()
    cloud = list(divmerge.frames(drive))[4]
    broken = bytearray(whole)
    plan = divmerge.plan(drive, 6)
    assert [part["clouds"] for part in plan] == [2, 2, 2]
    for number, part in enumerate(plan):
        if number != 2:
            middle = (part["start"] + min(part["end"], len(whole))) // 2
            broken[middle : middle + 1000] = bytes(1000)
    path = tmp_path / "broken.mcap"
    path.write_bytes(broken)
    frames = divmerge.frames(path)
    assert len(frames) == 6
    same(frames[4], cloud)
    same(frames[-2], cloud)
    with pytest.raises(divmerge.Error):
        frames[3]


def test_without_an_index_frames_are_found_all_the_same(drive, tmp_path):
    whole = drive.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: len(whole) * 4 // 5])
    frames, expected = divmerge.frames(path), list(divmerge.frames(drive))
    assert 1 < len(frames) < 6
    for number in (len(frames) - 1, 0):
        same(frames[number], expected[number])
