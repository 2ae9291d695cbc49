"""Explanations, figures, suspects, failures and comparisons: what the command prints and writes."""

import csv
import functools
import json
import re
import os
import signal
import threading

import numpy as np
import pytest

import divmerge
from conftest import TOPIC


def same(a, b):
    """Whether two values are the same but for the last digit of floats, which the command reads from another process."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return a == pytest.approx(b, rel=1e-14) if isinstance(a, float) else a == b


def words_of(point):
    """A position as the command reads it back to the bit."""
    return ",".join(repr(float(along)) for along in point)


@pytest.fixture(scope="module")
def pair(drives):
    """A drive, one of its clouds, and two neighbouring instances in it."""
    drive = drives("small")
    frame = divmerge.frames(drive, semantics="ground")[1]
    result = frame.cluster()
    centres = result.instances["centre"]
    apart = np.linalg.norm(centres[0] - centres, axis=1)
    other = np.argsort(apart)[1]
    points = [np.flatnonzero(result.instance.reshape(-1) == number + 1)[0] for number in (0, other)]
    return drive, frame, result, [int(point) for point in points]


@pytest.mark.parametrize(
    "words, parameters",
    [
        ([], {}),
        (["--semantics", "ground"], dict(semantics="ground")),
        ("--preset paper --voxel 0.7".split(), dict(preset="paper", voxel=0.7)),
        ("--set cluster.tree.gap=0.02 --no-what-if".split(), dict(set={"cluster.tree.gap": 0.02}, what_if=False)),
        (["--assemble", "2"], dict(assemble="2")),
    ],
)
def test_explain_says_what_the_command_says(pair, command_line, words, parameters):
    drive, frame, _, (a, b) = pair
    at = [frame.points[a], frame.points[b]]
    for points in (at, at[:1]):
        placed = [f"--at={words_of(point)}" for point in points]
        asked = ["explain", drive, "--frame", 1, *placed, *words]
        found = divmerge.explain(drive, *points, frame=1, **parameters)
        assert found.pop("text") == command_line(*asked)
        assert found == json.loads(command_line(*asked, "--json"))


def test_points_positions_and_instances_are_one_question(pair, command_line):
    drive, frame, result, (a, b) = pair
    by_number = divmerge.explain(frame, a, b)
    by_position = divmerge.explain(drive, frame.points[a], list(map(float, frame.points[b])), frame=1, semantics="ground")
    assert by_number == by_position and by_number["away"] == [0, 0]
    assert [point["index"] for point in by_number["points"]] == [a, b]
    assert divmerge.explain(result, a, b) == by_number
    ids = [int(result.instance[point]) for point in (a, b)]
    by_ids = divmerge.explain(result, instances=ids)
    asked = ["explain", drive, "--frame", 1, "--semantics", "ground", *[f"--instance={id}" for id in ids]]
    assert by_ids.pop("text") == command_line(*asked)
    assert by_ids == json.loads(command_line(*asked, "--json"))
    assert by_ids["answer"] == "apart"


def test_arrays_are_explained_and_drawn_too(pair):
    _, frame, result, (a, b) = pair
    of_arrays = divmerge.cluster(frame.points, "ground", ring=frame.ring)
    np.testing.assert_array_equal(of_arrays.instance, result.instance)
    ours, of_frame = (divmerge.explain(one, a, b) for one in (of_arrays, result))
    assert (ours["topic"], of_frame["topic"]) == ("", TOPIC)
    for name in ("answer", "decided_by", "points", "votes", "later", "what_if"):
        assert ours[name] == of_frame[name], name
    assert divmerge.figure(of_arrays).startswith(b"\x89PNG\r\n")


@pytest.mark.parametrize("form", ["png", "svg", "pdf"])
@pytest.mark.parametrize(
    "words, parameters",
    [
        ([], {}),
        (["--semantics", "ground", "--theme", "light"], dict(semantics="ground", theme="light")),
        (
            "--panels range,intensity,bev --dpi 96 --aspect 1:4 --window 500..900/2..9 --view=-10..40/-15..15".split(),
            dict(
                panels=["range", "intensity", "bev"],
                dpi=96,
                aspect=0.25,
                window=((500, 900), (2, 9)),
                view=((-10, 40), (-15, 15)),
            ),
        ),
        (["--method", "dbscan"], dict(method="dbscan")),
        (["--assemble", "2"], dict(assemble="2")),
    ],
)
def test_figures_are_the_commands_bytes(drives, command_line, tmp_path, form, words, parameters):
    drive, theirs, ours = drives("small"), tmp_path / f"theirs.{form}", tmp_path / f"ours.{form}"
    command_line("figure", drive, "--frame", 1, "-o", theirs, *words)
    assert divmerge.figure(drive, ours, frame=1, **parameters) is None
    assert ours.read_bytes() == theirs.read_bytes()
    assert divmerge.figure(drive, format=form, frame=1, **parameters) == theirs.read_bytes()


def test_figures_of_frames_results_and_explanations(pair, command_line, tmp_path):
    drive, frame, result, (a, b) = pair
    theirs = tmp_path / "theirs.svg"
    command_line("figure", drive, "--semantics", "ground", "--frame", 1, "-o", theirs)
    for cloud in (frame, result):
        assert divmerge.figure(cloud, format="svg") == theirs.read_bytes()
    command_line("figure", drive, "--time", 0.11, "-o", theirs, "--force")
    assert divmerge.figure(drive, format="svg", time=0.11) == theirs.read_bytes()
    at = [f"--at={words_of(frame.points[point])}" for point in (a, b)]
    command_line("explain", drive, "--semantics", "ground", "--frame", 1, *at, "-o", theirs, "--force")
    assert divmerge.figure(result, format="svg", a=a, b=b) == theirs.read_bytes()


def test_objects_over_time_are_drawn_and_explained_as_by_the_command(drives, command_line, tmp_path):
    drive, theirs, ours = drives("small"), tmp_path / "theirs.svg", tmp_path / "ours.svg"
    options = ["--frames", "1..3", "--lag", 0, "--ego-motion", "none"]
    over_time = dict(start=1, stop=3, lag=0, ego_motion="none")
    command_line("figure", drive, "--tracks", "-o", theirs, *options, "--theme", "light")
    assert divmerge.figure(drive, ours, tracks=True, theme="light", **over_time) is None
    assert ours.read_bytes() == theirs.read_bytes()
    assert divmerge.figure(drive, format="svg", tracks=True) != theirs.read_bytes()

    words = ["explain", drive, "--track", 2, *options]
    explained = json.loads(command_line(*words, "--json"))
    link = explained["links"][-1]["cloud"]
    ours = divmerge.explain(drive, track=2, link=link, **over_time)
    assert ours.pop("text") == command_line(*words, "--link", link)
    assert ours == explained

    words = ["explain", drive, "--link", link, *options]
    ours = divmerge.explain(drive, link=link, **over_time)
    assert ours.pop("text") == command_line(*words)
    assert ours == json.loads(command_line(*words, "--json"))
    assert {2} <= {each["track"] for each in ours["links"]}


def test_what_cannot_be_said_about_objects_over_time(drives, frame):
    drive = drives("small")
    for call, problem in [
        (lambda: divmerge.figure(drive, lag=1), "lag: only with tracks=True"),
        (lambda: divmerge.explain(drive, 1, start=2), "start: only with track or link"),
        (lambda: divmerge.explain(drive, 1, track=2), "track: not together with a and b"),
        (lambda: divmerge.figure(drive, tracks=True, stop=0), "stop: must be above start"),
        (lambda: divmerge.figure(drive, tracks=True, ego_motion="/odom"), "ego_motion: "),
    ]:
        with pytest.raises(ValueError, match=problem):
            call()
    with pytest.raises(TypeError, match="followed in a recording"):
        divmerge.figure(frame, tracks=True)
    with pytest.raises(TypeError, match="panels"):
        divmerge.figure(drive, tracks=True, panels="mask")
    with pytest.raises(divmerge.Error, match="is of track 9999"):
        divmerge.explain(drive, track=9999)
    with pytest.raises(divmerge.Error, match="track 1 is not seen in frame 77"):
        divmerge.explain(drive, track=1, link=77)


def test_a_figure_is_not_replaced_unless_that_is_said(frame, tmp_path):
    out = tmp_path / "figure.svg"
    out.write_text("mine")
    with pytest.raises(FileExistsError, match="force=True"):
        divmerge.figure(frame, out)
    assert out.read_text() == "mine"
    divmerge.figure(frame, out, force=True)
    assert out.read_text().startswith("<svg")
    assert [path.name for path in tmp_path.iterdir()] == ["figure.svg"]


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
def test_ctrl_c_is_noticed_while_changes_are_searched(pair):
    _, _, result, (a, b) = pair

    class Stopped(Exception):
        pass

    def stop(number, frame):
        raise Stopped

    before, done = signal.signal(signal.SIGUSR1, stop), []
    # No bytecode runs between these calls, so that Python itself would notice only behind the last.
    calls = map(functools.partial(divmerge.explain, result), [a] * 5, [b] * 5)
    try:
        threading.Timer(0.01, os.kill, [os.getpid(), signal.SIGUSR1]).start()
        with pytest.raises(Stopped):
            done.extend(calls)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert len(done) < 5


def test_triage_ranks_as_the_command_does(drives, command_line, tmp_path):
    drive, table = drives("organised"), tmp_path / "all.csv"
    theirs, ours = tmp_path / "theirs.mcap", tmp_path / "ours.mcap"
    words = ["triage", drive, "--semantics", "ground", "--limit", 4]
    printed = command_line(*words, "--csv", table, "-o", theirs)
    found = divmerge.triage(drive, semantics="ground", limit=4, out=ours)
    assert ours.read_bytes() == theirs.read_bytes()
    assert found["output_bytes"] == theirs.stat().st_size
    rows = list(csv.DictReader(table.open()))
    assert found["suspects"] == len(rows) > 0
    assert found["frames"] == 2 and len(found["cases"]) == 4
    summary = printed.splitlines()[0]
    assert f"{found['instances']} instances, {found['suspects']} suspects; 4 cases" in summary
    for rank, case in enumerate(found["cases"], 1):
        first = case["suspects"][0]
        assert f"{rank:>3}. {100 * case['score']:3.0f} %  {case['topic']} frame {case['frame']}," in printed
        assert first["sentence"] in printed
        at = " ".join(",".join(f"{along:.3f}" for along in point) for point in case["at"])
        assert all(point in printed for point in at.split())
        explained = divmerge.explain(
            drive, *case["at"], topic=case["topic"], frame=case["frame"], semantics="ground", what_if=False
        )
        assert [point["index"] for point in explained["points"]] == first["points"]
    one = divmerge.triage(drive, semantics="ground", start=1, topics=TOPIC)
    assert one["frames"] == 1 and {case["frame"] for case in one["cases"]} == {1}


def test_tables_and_pages_of_triage_are_the_commands_but_for_the_call(drives, command_line, tmp_path):
    drive = drives("organised")
    words = ["triage", drive, "--semantics", "ground", "--limit", 2]
    theirs, ours = tmp_path / "theirs", tmp_path / "ours"
    for folder in (theirs, ours):
        folder.mkdir()
    command_line(*words, "--csv", theirs / "all.csv", "--report", theirs / "pages")
    command_line(*words, "--report", theirs / "one.html")
    asked = dict(semantics="ground", limit=2, tree_gap=None)
    divmerge.triage(drive, csv=ours / "all.csv", report=ours / "pages", **asked)
    divmerge.triage(drive, report=str(ours / "one.html"), **asked)

    tables = [list(csv.DictReader((folder / "all.csv").open())) for folder in (ours, theirs)]
    without = [[{**row, "command": ""} for row in rows] for rows in tables]
    assert without[0] == without[1] and len(tables[0]) > 2
    first = tables[0][0]["command"]
    assert first.startswith(f'divmerge.explain("{drive}", (') and first.endswith(", semantics='ground')")
    explained = eval(first, {"divmerge": divmerge})
    assert explained["topic"] == TOPIC and explained["semantics"] == "ground"

    names = sorted(path.name for path in (theirs / "pages").iterdir())
    assert names == sorted(path.name for path in (ours / "pages").iterdir()) and len(names) == 3
    for name in ["one.html", *(f"pages/{name}" for name in names)]:
        pages = [(folder / name).read_text() for folder in (ours, theirs)]
        figures = [re.findall("<svg.*?</svg>", page, re.DOTALL) for page in pages]
        assert figures[0] == figures[1] and (figures[0] or "index" in name)
        assert "divmerge.explain(" in pages[0] or "index" in name

    for taken in ("csv", "report"):
        with pytest.raises(FileExistsError, match="force=True"):
            divmerge.triage(drive, **{taken: ours / {"csv": "all.csv", "report": "pages"}[taken]})
    divmerge.triage(drive, csv=ours / "all.csv", report=ours / "pages", force=True, **asked)
    with pytest.raises(ValueError, match="csv: .* is the recording itself"):
        divmerge.triage(drive, csv=drive, force=True)


@pytest.mark.parametrize(
    "words, parameters",
    [(["--preset", "paper", "--steps-by", "decision"], dict(preset="paper", steps_by="decision")), ([], {})],
)
def test_steps_are_the_commands_pictures(drives, command_line, tmp_path, words, parameters):
    drive = drives("organised")
    theirs, ours, figure = tmp_path / "theirs", tmp_path / "ours", tmp_path / "figure.png"
    objects = [] if words else ["--semantics", "ground"]
    command_line("figure", drive, "--steps", theirs, "--dpi", 40, *words, *objects)
    if objects:
        parameters = dict(semantics="ground")
    divmerge.figure(drive, figure, steps=ours, dpi=40, **parameters)
    names = sorted(path.name for path in theirs.iterdir())
    assert names == sorted(path.name for path in ours.iterdir()) and len(names) > 3
    assert all((ours / name).read_bytes() == (theirs / name).read_bytes() for name in names)
    assert figure.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(FileExistsError, match="step_00001.png"):
        divmerge.figure(drive, steps=ours, **parameters)
    assert divmerge.figure(drive, steps=ours, dpi=40, force=True, **parameters).startswith(b"\x89PNG")


def test_what_has_no_steps(frame):
    with pytest.raises(ValueError, match="steps_by: `decision` draws merges by votes"):
        divmerge.figure(frame.cluster("ground"), steps="never", steps_by="decision")
    with pytest.raises(ValueError, match="steps: not together with a, b, instances"):
        divmerge.figure(frame.cluster("ground"), steps="never", a=0)
    with pytest.raises(ValueError, match="steps_by: `decisoin` is none of .*did you mean `decision`"):
        divmerge.figure(frame.cluster("ground"), steps="never", steps_by="decisoin")


def test_compare_sets_parameters_of_the_methods_that_have_them(drives, command_line, tmp_path):
    drive, file = drives("organised"), tmp_path / "rows.json"
    methods = ["paper", "dbscan"]
    words = ["--set", "dbscan:method.reach=3", "--set", "cluster.voxel=0.1"]
    command_line("compare", drive, "--methods", ",".join(methods), "-o", file, *words)
    theirs = [row["things"]["pq"] for row in json.loads(file.read_text())]
    both = {"dbscan:method.reach": 3}
    ours = divmerge.compare(drive, methods=methods, set=both, voxel=0.1)
    assert [row["things"]["pq"] for row in ours] == pytest.approx(theirs, rel=1e-12)
    usual = divmerge.compare(drive, methods=methods)
    assert all(ours["things"]["pq"] != was["things"]["pq"] for ours, was in zip(ours, usual))
    for wrong, problem in [
        (dict(set={"dbscn:method.reach": 3}), "set: .*did you mean `dbscan`"),
        (dict(set={"alpine:method.margin": 3}), "`alpine` is not among the methods"),
        (dict(set={"cluster.voxle": 3}), "did you mean `cluster.voxel`"),
        (dict(merge_ratio=-1), "^merge_ratio: must be a number"),
        (dict(methods="dbscam"), "methods: `dbscam` is no method: .*did you mean `dbscan`"),
    ]:
        with pytest.raises(ValueError, match=problem):
            divmerge.compare(drive, **{"methods": methods, **wrong})


@pytest.mark.parametrize(
    "words, parameters",
    [
        ([], {}),
        (["--semantics", "ground", "--small", "20"], dict(semantics="ground", small=20)),
        (["--preset", "paper", "--frames", "1.."], dict(preset="paper", start=1)),
        (["--method", "euclidean"], dict(method="euclidean")),
    ],
)
def test_failures_are_the_commands(drives, command_line, tmp_path, words, parameters):
    drive, file = drives("organised"), tmp_path / "failures.json"
    command_line("failures", drive, "--json", file, *words)
    expected = json.loads(file.read_text())
    for failure in expected["failures"]:
        del failure["explain"], failure["figure"]
    found = divmerge.failures(drive, **parameters)
    assert found == expected
    if parameters.get("semantics") == "ground":
        assert found["failures"]


def test_compare_scores_as_the_command_does(drives, command_line, tmp_path):
    drive, file = drives("rings"), tmp_path / "compared.json"
    methods = ["best", "paper", "dbscan", "divide-and-merge"]
    command_line("compare", drive, "--methods", ",".join(methods), "--voxels", 0.2, "--min-points", 20, "-o", file)
    expected = json.loads(file.read_text())
    found = divmerge.compare(drive, methods=methods, voxels=[0.2], min_points=20)
    assert [row["method"] for row in found] == ["best", "paper", "dbscan", "best", "paper, 0.2 m"]
    for row, other in zip(found, expected, strict=True):
        del other["peak_memory"]
        for times in ("cut_ms", "frame_ms", "slowest_ms"):
            assert row.pop(times) > 0 and other.pop(times) > 0
        assert same(row, other), (row, other)


@pytest.mark.parametrize(
    "arguments, parameters, error, problem",
    [
        ((), {}, ValueError, "a: say what to explain"),
        ((10**9,), {}, ValueError, "a: there is no point 1000000000: the cloud has"),
        ((-1,), {}, TypeError, "a: expected the number of a point"),
        ((5, 5), {}, ValueError, "b: point 5 is a as well"),
        (([1.0, 2.0],), {}, ValueError, "a: expected x, y and z, got 2 numbers"),
        (("here",), {}, TypeError, "a: expected the number of a point, or x, y and z .* got str"),
        (([1e3, 0, 0],), {}, divmerge.Error, "1000"),
        ((5,), dict(within=0), ValueError, "within: must be above 0"),
        ((5,), dict(instances=(1, 2)), ValueError, "instances: not together with a and b"),
        ((), dict(instances=(2, 2)), ValueError, "instances: 2 twice"),
        ((), dict(instances=(1, 999999)), divmerge.Error, "999999"),
        ((), dict(instances=7), TypeError, "instances: expected two ids"),
        ((5,), dict(method="dbscan"), ValueError, "method: dbscan has no votes"),
        ((5,), dict(topic=TOPIC), TypeError, "unexpected keyword argument 'topic'"),
    ],
)
def test_what_is_no_question(frame, arguments, parameters, error, problem):
    with pytest.raises(error, match=problem):
        divmerge.explain(frame, *arguments, **parameters)


@pytest.mark.parametrize(
    "parameters, error, problem",
    [
        (dict(panels="fire"), ValueError, "panels: `fire` is none of range, intensity"),
        (dict(theme="grey"), ValueError, "theme: `grey` is none of dark, light"),
        (dict(dpi=5), ValueError, r"dpi: must be in 24\.\.=1200, got 5"),
        (dict(aspect=20), ValueError, "aspect: must be in"),
        (dict(window=5), TypeError, "window: expected"),
        (dict(view=((0, 0), (0, 9))), ValueError, "view: must be 1 m to 2 km wide"),
        (dict(format="gif"), ValueError, "format: `gif` is none of png, svg, pdf"),
        (dict(out="figure.gif"), ValueError, r"out: figure.gif: must end in .png, .svg or .pdf"),
        (dict(frame=2, time=3), ValueError, "time: not together with frame"),
        (dict(frame=99), divmerge.Error, "99"),
        (dict(topic="/none"), divmerge.Error, "/none"),
    ],
)
def test_what_is_no_figure(drives, parameters, error, problem):
    with pytest.raises(error, match=problem):
        divmerge.figure(drives("small"), **parameters)


def test_what_is_no_cloud():
    with pytest.raises(TypeError, match="cloud: expected a Result, a Frame or the path of a recording, got int"):
        divmerge.figure(3)


def test_results_have_their_parameters(pair):
    with pytest.raises(TypeError, match="voxel"):
        divmerge.explain(pair[2], 0, voxel=0.5)


def test_truth_that_is_not_there(drives, tmp_path):
    annotated = tmp_path / "annotated.mcap"
    divmerge.annotate(drives("small"), annotated, only=True)
    for function in (divmerge.failures, divmerge.compare):
        with pytest.raises(divmerge.Error, match="true_class_field and true_instance_field name"):
            function(drives("small"), true_class_field="none")
    with pytest.raises(ValueError, match="methods: `magic` is no method: use some of best"):
        divmerge.compare(drives("small"), methods="magic")
