"""Recordings cut into slices, annotated one by one, and joined."""

import json
import random

import pytest

import divmerge


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A drive of several chunks."""
    path = tmp_path_factory.mktemp("slices") / "drive.mcap"
    divmerge.simulate(path, sensor="vlp-16", scene="parking", frames=24)
    return path


def test_joined_slices_are_the_whole(drive, tmp_path):
    pieces = divmerge.plan(drive, 3)
    assert [piece["number"] for piece in pieces] == [0, 1, 2] and sum(piece["clouds"] for piece in pieces) == 24
    # As they come from another machine.
    pieces = json.loads(json.dumps(pieces))
    random.Random(1).shuffle(pieces)
    parameters = dict(semantics="ground", preset="paper", threads=1)
    reports = [divmerge.annotate_slice(piece, tmp_path / "slices", **parameters) for piece in pieces]
    files = [report["output"] for report in reports]
    seen = []
    report = divmerge.join(files, tmp_path / "joined.mcap", progress=lambda done, total: seen.append(done))
    divmerge.annotate(drive, tmp_path / "whole.mcap", **parameters)
    assert (tmp_path / "joined.mcap").read_bytes() == (tmp_path / "whole.mcap").read_bytes()
    assert report["topics"]["/lidar/points"]["frames"] == 24 and seen


def test_the_command_line_joins_them_too(drive, tmp_path, command_line):
    pieces = divmerge.plan([drive], 2)
    for piece in pieces:
        divmerge.annotate_slice(piece, str(tmp_path / "slices"))
    command_line("join", tmp_path / "slices", "-o", tmp_path / "joined.mcap")
    command_line("annotate", drive, "-o", tmp_path / "whole.mcap")
    assert (tmp_path / "joined.mcap").read_bytes() == (tmp_path / "whole.mcap").read_bytes()
    command_line("plan", drive, "--shards", 2, "-o", tmp_path / "plan.json")
    assert json.loads((tmp_path / "plan.json").read_text())["slices"] == pieces


def test_what_is_wrong_is_named(drive, tmp_path):
    pieces = divmerge.plan(drive, 3)
    files = [divmerge.annotate_slice(piece, tmp_path)["output"] for piece in pieces]
    with pytest.raises(divmerge.Error, match="1 slice is missing: drive.slice-0001-of-0003.mcap"):
        divmerge.join([files[0], files[2]], tmp_path / "out.mcap")
    with pytest.raises(divmerge.Error, match="drive.slice-0000-of-0003.mcap is there twice"):
        divmerge.join(files + files[:1], tmp_path / "out.mcap")
    with pytest.raises(FileExistsError):
        divmerge.annotate_slice(pieces[0], tmp_path)
    with pytest.raises(TypeError, match="unexpected keyword argument 'voxels'"):
        divmerge.annotate_slice(pieces[0], tmp_path, voxels=1)
    with pytest.raises(ValueError, match="slice: .*number"):
        divmerge.annotate_slice({"input": str(drive)} | {k: pieces[0][k] for k in ("input_bytes", "name")}, tmp_path)
    with pytest.raises(TypeError, match="slice: expected one of plan()"):
        divmerge.annotate_slice(object(), tmp_path)
    with pytest.raises(ValueError, match="shards: expected 1 to"):
        divmerge.plan(drive, 0)
    with pytest.raises(FileNotFoundError):
        divmerge.plan(tmp_path / "nothing.mcap", 2)
    with pytest.raises(ValueError, match="slices: expected those of one recording, got 0"):
        divmerge.join([], tmp_path / "out.mcap")
