"""Panoptic quality: the figures of the command line."""

import json

import numpy as np
import pytest

import divmerge
from conftest import TOPIC


@pytest.fixture(scope="module")
def scans(drives):
    """Truth and prediction of each scan."""
    scans = []
    for frame in divmerge.frames(drives("small"), fields="true_instance"):
        truth = (frame.classes, frame.fields["true_instance"])
        scans.append((truth, frame.cluster()))
    return scans


def test_the_figures_of_the_command_line(drives, scans, command_line, tmp_path):
    annotated, figures = tmp_path / "annotated.mcap", tmp_path / "figures.json"
    divmerge.annotate(drives("small"), annotated, track="off")
    command_line("evaluate", annotated, "--json", figures, "--over-time", "--min-points", "10")
    [expected] = json.loads(figures.read_text())["topics"]
    assert expected.pop("topic") == f"{TOPIC}/instances"
    of_arrays = divmerge.evaluate(scans, over_time=True, min_points=10)
    assert of_arrays == expected
    of_recording = divmerge.evaluate(annotated, over_time=True, min_points=10)
    assert of_recording == {f"{TOPIC}/instances": expected}
    assert divmerge.evaluate(annotated, topic=TOPIC, over_time=True, min_points=10) == of_recording


def test_tracks_are_scored_where_there_are_some(drives, command_line, tmp_path):
    annotated, figures = tmp_path / "annotated.mcap", tmp_path / "figures.json"
    divmerge.annotate(drives("small"), annotated)
    command_line("evaluate", annotated, "--json", figures, "--over-time")
    [expected] = json.loads(figures.read_text())["topics"]
    assert expected.pop("topic") == f"{TOPIC}/instances"
    found = divmerge.evaluate(annotated, over_time=True)
    assert found == {f"{TOPIC}/instances": expected}
    divmerge.annotate(drives("small"), annotated, track="off", force=True)
    untracked = divmerge.evaluate(annotated, over_time=True)[f"{TOPIC}/instances"]
    assert untracked["over_time"]["s_assoc"] < expected["over_time"]["s_assoc"]


def test_truth_against_itself(scans):
    figures = divmerge.evaluate((truth, truth) for truth, _ in scans)
    assert figures["scans"] == 3 and "over_time" not in figures
    there = [one for one in figures["classes"] if one["true_points"]]
    assert there and all(one["pq"] == 1 for one in there)


def test_any_integer_type_and_shape(scans):
    expected = divmerge.evaluate(scans)
    wide = [
        ((t[0].astype(np.int32)[None], t[1].astype(np.uint16)[None]),
         (r.semantic.astype(np.int64)[None], r.instance.astype(np.int32)[None]))
        for t, r in scans
    ]
    assert divmerge.evaluate(wide) == expected


def test_what_does_not_fit_is_named(scans):
    (truth, result) = scans[0]
    short = (result.semantic[:5], result.instance[:5])
    with pytest.raises(ValueError, match="scan 1: a prediction of 5 points for a truth of"):
        divmerge.evaluate([(truth, result), (truth, short)])
    with pytest.raises(ValueError, match=r"instances of truth of scan 0: expected \(5,\), got \(4,\)"):
        divmerge.evaluate([((truth[0][:5], truth[1][:4]), short)])
    with pytest.raises(TypeError, match="scan 0 is no pair"):
        divmerge.evaluate([truth[0]])
    with pytest.raises(TypeError, match="scans: expected a path, or pairs"):
        divmerge.evaluate(3)
    with pytest.raises(TypeError, match="classes of truth of scan 0: expected integers"):
        divmerge.evaluate([((truth[0] * 1.0, truth[1]), result)])
    unknown = (np.full_like(result.semantic, 7), result.instance)
    with pytest.raises(divmerge.Error, match="prediction of scan 0: class 7 .* is not in taxonomy"):
        divmerge.evaluate([(truth, unknown)])


def test_no_scan():
    assert divmerge.evaluate([])["scans"] == 0
