"""The Python in the documentation is run, or says why it is not.

Blocks of a page run in order in one namespace and one folder. Comments in the page's source are
those of `tests/integration/documents`: `<!-- not run: WHY -->`, `<!-- needs: MODULE -->`, and
`<!-- first`, lines of Python, `-->`.
"""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    "README.md",
    "docs/evaluation.md",
    "docs/networks.md",
    "docs/python.md",
    "python/README.md",
]

BLOCK = re.compile(
    r"((?:^<!--(?:(?!-->).)*-->\n)*)^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL
)
NOTE = re.compile(r"<!--(.*?)-->", re.DOTALL)


def blocks(page: str) -> list[tuple[int, str, list[str]]]:
    """Line, code and comments of each block."""
    text = (ROOT / page).read_text()
    found = []
    for match in BLOCK.finditer(text):
        line = text.count("\n", 0, match.start(2)) + 1
        notes = [note.strip() for note in NOTE.findall(match[1])]
        found.append((line, match[2], notes))
    assert text.count("\n```python\n") == len(found), page
    return found


def reason(notes: list[str]) -> str | None:
    """Why a block is not run."""
    for note in notes:
        if note.startswith("not run"):
            _, _, why = note.partition(":")
            assert why.strip(), f"a reason is missing: {note}"
            return " ".join(why.split())
    return None


def run(code: str, page: str, line: int, names: dict) -> None:
    """Runs code whose line numbers are those of the page."""
    exec(compile("\n" * (line - 1) + code, ROOT / page, "exec"), names)


@pytest.mark.parametrize("page", PAGES)
def test_blocks_run(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "page"}
    for line, code, notes in blocks(page):
        if why := reason(notes):
            with capsys.disabled():
                print(f"\nnot run: {page}:{line}: {why}")
            continue
        for note in notes:
            if note.startswith("first\n"):
                run(note.removeprefix("first\n"), page, line, names)
        run(code, page, line, names)


def test_every_page_with_python_is_run():
    pages = [*(ROOT / "docs").glob("*.md"), *ROOT.glob("*.md"), ROOT / "python/README.md"]
    with_python = {page for page in pages if "```python\n" in page.read_text()}
    assert with_python == {ROOT / page for page in PAGES}
    run_blocks = [notes for page in PAGES for _, _, notes in blocks(page) if reason(notes) is None]
    assert len(run_blocks) >= 6
