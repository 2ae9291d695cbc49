"""Progress: a function, or a bar of tqdm."""

import sys

import pytest

import divmerge
from needed import needed


def runs(drive, folder):
    """Everything that tells its progress."""
    part = divmerge.plan(drive, 1)[0]
    done = divmerge.annotate_slice(part, folder)["output"]
    return [
        lambda **how: divmerge.annotate(drive, folder / "out.mcap", force=True, **how),
        lambda **how: divmerge.annotate_slice(part, folder, force=True, **how),
        lambda **how: divmerge.join([done], folder / "joined.mcap", force=True, **how),
        lambda **how: divmerge.triage(drive, **how),
    ]


def test_a_function_is_told_the_bytes(drives, tmp_path):
    drive = drives("small")
    for run in runs(drive, tmp_path):
        told = []
        run(progress=lambda done, total: told.append((done, total)))
        assert told and {total for _, total in told} == {drive.stat().st_size}
        assert told == sorted(told)


def test_a_bar_comes_if_it_is_asked_for(drives, tmp_path, capsys):
    needed("tqdm")
    for run in runs(drives("small"), tmp_path):
        capsys.readouterr()
        run(progress=True)
        said = capsys.readouterr().err
        assert "divmerge: " in said and "B/s" in said and said.endswith("\n")
        for nothing in (False, None):
            run(progress=nothing)
            assert capsys.readouterr().err == ""


def test_without_tqdm_there_is_no_bar(drives, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    with pytest.raises(ImportError, match="progress=True needs tqdm: pip install tqdm"):
        divmerge.triage(drives("small"), progress=True)


def test_what_a_function_raises_ends_the_run(drives):
    class Enough(Exception):
        pass

    def stop(done, total):
        raise Enough

    with pytest.raises(Enough):
        divmerge.triage(drives("small"), progress=stop)
    with pytest.raises(TypeError, match="progress: expected True, or a function"):
        divmerge.triage(drives("small"), progress=3)
