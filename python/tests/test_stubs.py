"""The stubs say what is there."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import divmerge
from divmerge import _divmerge
from needed import needed

FOLDER = Path(divmerge.__file__).parent


def test_the_package_is_typed():
    assert (FOLDER / "py.typed").exists() and (FOLDER / "_divmerge.pyi").exists()


def test_every_public_name_is_in_the_stub():
    tree = ast.parse((FOLDER / "_divmerge.pyi").read_text())
    named = {node.name: node for node in tree.body if hasattr(node, "name")}
    for name in divmerge.__all__:
        if name in ("Reason", "__version__"):
            continue
        assert name in named, name
        thing = getattr(divmerge, name)
        assert thing.__doc__, name
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            members = {node.name for node in named[name].body if hasattr(node, "name")}
            public = {member for member in vars(thing) if not member.startswith("_")}
            assert public <= members, public - members
            for member in public:
                assert getattr(thing, member).__doc__, f"{name}.{member}"
    public = {name for name in dir(_divmerge) if not name.startswith("_")} - {"REASONS"}
    assert public <= set(divmerge.__all__)


def test_reasons_are_those_of_the_library():
    assert [(reason.name, reason.value) for reason in divmerge.Reason] == _divmerge.REASONS


def test_the_version_is_that_of_the_package():
    from importlib.metadata import version

    assert divmerge.__version__ == version("divmerge")


def test_stubtest_agrees(tmp_path):
    needed("mypy")
    command = [sys.executable, "-m", "mypy.stubtest", "divmerge"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_users_are_checked(tmp_path):
    needed("mypy")
    program = tmp_path / "program.py"
    program.write_text(
        """
import numpy as np
import divmerge

result = divmerge.cluster(np.zeros((3, 3), np.float32), "ground", voxel=0.5)
ids: np.ndarray = result.instance
for frame in divmerge.frames("a.mcap", start=3):
    print(frame.points.shape, divmerge.Reason(frame.cluster().reason[0]).name)
figures = divmerge.evaluate([((ids, ids), result)])
print(figures["things"]["pq"])
part: divmerge.Frames = divmerge.frames("a.mcap")[2:5]
picture: bytes = divmerge.figure(part[-1], panels=["bev"], tree_gap=0.02)
divmerge.figure("a.mcap", "figure.svg", frame=3, a=5)
for case in divmerge.triage("a.mcap", progress=True)["cases"]:
    print(divmerge.explain("a.mcap", *case["at"])["text"], divmerge.failures("a.mcap")["causes"])
print(divmerge.compare("a.mcap", methods="best")[0]["things"], result._repr_html_())
divmerge.cluster(ids, presett="best")
"""
    )
    command = [sys.executable, "-m", "mypy", "--strict", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert '"presett"' in done.stdout and "Found 1 error" in done.stdout, done.stdout


def test_the_version_is_that_of_the_command_line(command_line):
    assert command_line("--version").split() == ["divmerge", divmerge.__version__]
