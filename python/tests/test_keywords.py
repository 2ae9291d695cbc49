"""Every parameter as a keyword, what is misspelt, and warnings in Python's words."""

import ast
from pathlib import Path

import numpy as np
import pytest

import divmerge

NAMED = {"voxel", "gap_columns", "gap_rows"}
COLUMNS = ("instance", "component", "reason")


def test_each_parameter_has_one_keyword():
    rows = divmerge.parameters()
    keywords = [row["keyword"] for row in rows]
    assert len(set(keywords)) == len(keywords) == len(rows) and all(map(str.isidentifier, keywords))
    by_path = {row["path"]: row["keyword"] for row in rows}
    assert by_path["cluster.tree.gap"] == "tree_gap" and by_path["ground.step"] == "ground_step"
    stub = ast.parse(Path(divmerge.__file__).with_name("_divmerge.pyi").read_text())
    typed = next(node for node in stub.body if getattr(node, "name", None) == "_Parameters")
    assert [node.target.id for node in typed.body if isinstance(node, ast.AnnAssign)] == [
        keyword for keyword in keywords if keyword not in NAMED
    ]
    arguments = {
        argument.arg
        for node in ast.walk(stub)
        if isinstance(node, ast.FunctionDef)
        for argument in [*node.args.args, *node.args.kwonlyargs]
    }
    assert arguments & set(keywords) == NAMED


@pytest.mark.parametrize(
    "path, keyword, value",
    [
        ("cluster.tree.gap", "tree_gap", 0.02),
        ("ground.step", "ground_step", 0.5),
        ("cluster.min_pixels", "min_pixels", 40),
        ("cluster.tree", "tree", False),
        ("projection.columns", "projection_columns", "auto"),
        ("cluster.condition.angle", "condition_angle", "20 deg"),
    ],
)
def test_a_keyword_sets_what_its_path_sets(frame, path, keyword, value):
    points = frame.points
    by_path = divmerge.cluster(points, "ground", ring=frame.ring, set={path: value})
    by_name = divmerge.cluster(points, "ground", ring=frame.ring, **{keyword: value})
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(by_name, column), getattr(by_path, column))


def test_keywords_follow_set_and_none_says_nothing(frame):
    both = frame.cluster("ground", set={"cluster.tree.gap": 0.5}, tree_gap=0.02)
    alone = frame.cluster("ground", tree_gap=0.02, ground_step=None)
    np.testing.assert_array_equal(both.instance, alone.instance)
    other = frame.cluster("ground", tree_gap=0.5)
    assert (other.instance != alone.instance).any()


def test_recordings_take_them_too(drives, tmp_path):
    ours, theirs = tmp_path / "ours.mcap", tmp_path / "theirs.mcap"
    divmerge.annotate(drives("small"), ours, semantics="ground", tree_gap=0.02, tracks_lag_s=0.2)
    divmerge.annotate(
        drives("small"), theirs, semantics="ground", set={"cluster.tree.gap": 0.02}, lag=0.2
    )
    assert ours.read_bytes() == theirs.read_bytes()
    by_name = divmerge.triage(drives("small"), semantics="ground", tree_gap=0.02)
    assert by_name == divmerge.triage(drives("small"), semantics="ground", set={"cluster.tree.gap": 0.02})
    assert by_name != divmerge.triage(drives("small"), semantics="ground")


@pytest.mark.parametrize(
    "name, near",
    [
        ("voxl", "; did you mean `voxel`?"),
        ("tree_gapp", "; did you mean `tree_gap`?"),
        ("merge_rate", "; did you mean `merge_ratio`?"),
        ("Preset", "; did you mean `preset`?"),
        ("zzzzzz", ""),
    ],
)
def test_what_is_misspelt(frame, name, near):
    problem = f"cluster() got an unexpected keyword argument '{name}'{near}"
    for call in (divmerge.cluster, type(frame).cluster):
        with pytest.raises(TypeError) as raised:
            call(frame, **{name: 1})
        assert str(raised.value) == problem


def test_functions_without_a_method_take_none(drives):
    with pytest.raises(TypeError, match="frames.. got an unexpected keyword argument 'tree_gap'$"):
        divmerge.frames(drives("small"), tree_gap=0.1)
    with pytest.raises(TypeError, match="did you mean `methods`"):
        divmerge.compare(drives("small"), metods="best")


def test_wrong_values_are_named(frame):
    with pytest.raises(ValueError, match="tree_gap: must be a number above 0 to 1 .*, got -1"):
        frame.cluster("ground", tree_gap=-1)
    with pytest.raises(TypeError, match="tree_gap: cannot be of type object"):
        frame.cluster("ground", tree_gap=object())


@pytest.mark.parametrize(
    "name, value, near",
    [
        ("bev", "sise", "size"),
        ("preset", "papers", "paper"),
        ("method", "dbscam", "dbscan"),
        ("seeding", "at_onec", "at_once"),
    ],
)
def test_of_a_wrong_name_the_nearest_is_said(frame, name, value, near):
    with pytest.raises(ValueError, match=f"^{name}: .*; did you mean `{near}`\\?$"):
        frame.cluster("ground", **{name: value})


def test_of_a_wrong_panel_the_nearest_is_said(frame):
    with pytest.raises(ValueError, match="^panels: .*; did you mean `votes`"):
        divmerge.figure(frame.cluster("ground"), panels="vots")


def test_warnings_name_keywords(drives, tmp_path):
    """Three clouds are too few to tell the vehicle from what is around it."""
    calls = [
        lambda: divmerge.annotate(drives("small"), tmp_path / "out.mcap", ego="auto"),
        lambda: divmerge.triage(drives("small"), ego="auto"),
        lambda: divmerge.explain(drives("small"), 0, ego="auto", what_if=False),
    ]
    for call in calls:
        with pytest.warns(UserWarning, match="`ego='X0..X1,Y0..Y1,Z0..Z1'` leaves out a block") as warned:
            call()
        assert not any("--" in str(one.message) for one in warned)
