"""The documentation as a site in target/site, from the pages of docs/ and what the program says.

    pip install -r docs/site/requirements.txt
    python docs/site/build.py target/release/divmerge

Pages are gathered in target/site-pages: those of docs/, README, CONTRIBUTING and CHANGELOG, with
links to other files of the repository led to copies of these; the reference of commands and
parameters, as the given program prints it; and that of the Python package, from its stubs and
sources. MkDocs then builds the site. A dead link or anchor is an error, and so is anything in a
page that a browser would fetch from elsewhere.
"""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "target"
PAGES = TARGET / "site-pages"
SITE = TARGET / "site"
# Files at the root that are pages, by the name of the page.
AT_ROOT = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "CHANGELOG.md": "CHANGELOG.md",
}
LANGUAGES = {".py": "python", ".rs": "rust", ".toml": "toml", ".yml": "yaml", "": "sh"}
LINK = re.compile(r"\]\(([^)#\s]*)((?:#[^)\s]*)?)\)")


def place_of(path: str) -> str | None:
    """Where a file of the repository stands among the pages."""
    if path in AT_ROOT:
        return AT_ROOT[path]
    if path == "docs/decisions":
        return "decisions/index.md"
    if path.startswith("docs/") and not path.startswith("docs/site/"):
        return path.removeprefix("docs/")
    return None


def source_page(path: str) -> str:
    """Makes a page of a file that is no page, and says where it stands."""
    page = "source/" + path.lstrip(".").replace("/", "-") + ".md"
    text = (ROOT / path).read_text()
    language = LANGUAGES.get(Path(path).suffix, "")
    write(page, f"# {path}\n\n````{language}\n{text}\n````\n")
    return page


def write(page: str, text: str) -> None:
    target = PAGES / page
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text)


def gather(path: str, page: str) -> None:
    """Copies a page of the repository, with its links led to where their targets stand."""

    def led(match: re.Match) -> str:
        target, anchor = match.groups()
        if not target or "://" in target:
            return match.group(0)
        named = os.path.normpath(os.path.join(os.path.dirname(path), target))
        place = place_of(named) or source_page(named)
        relative = os.path.relpath(place, os.path.dirname(page) or ".")
        return f"]({PurePosixPath(relative)}{anchor})"

    parts = re.split(r"(^```.*?^```$)", (ROOT / path).read_text(), flags=re.DOTALL | re.MULTILINE)
    parts[::2] = [LINK.sub(led, part) for part in parts[::2]]
    write(page, "".join(parts))


def gather_all() -> None:
    shutil.rmtree(PAGES, ignore_errors=True)
    for file in sorted((ROOT / "docs").rglob("*")):
        path = file.relative_to(ROOT).as_posix()
        place = place_of(path)
        if file.is_dir() or place is None:
            continue
        if file.suffix == ".md":
            gather(path, place)
        else:
            (PAGES / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, PAGES / place)
    for path, page in AT_ROOT.items():
        gather(path, page)
    shutil.copy(ROOT / "docs/site/site.css", PAGES / "site.css")


def list_decisions() -> None:
    lines = [
        "# Decisions",
        "",
        "Large choices, each with its date, its reasons and what it cost.",
        "",
    ]
    for file in sorted((ROOT / "docs/decisions").glob("*.md")):
        number, title = re.match(r"# (\d+)\. (.*)", file.read_text()).groups()
        date = re.search(r"\d{4}-\d{2}-\d{2}", file.read_text())
        lines.append(f"{number}. [{title}]({file.name}){f' ({date[0]})' if date else ''}")
    write("decisions/index.md", "\n".join(lines) + "\n")


def printed(program: Path, *arguments: str) -> str:
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=True)
    return done.stdout


def names_of(help_text: str) -> list[str]:
    """The commands that a help lists."""
    block = re.search(r"^Commands:\n((?:  .*\n)+)", help_text, flags=re.MULTILINE)
    names = re.findall(r"^  ([a-z]+)\b", block[1], flags=re.MULTILINE) if block else []
    return [name for name in names if name != "help"]


def commands(program: Path) -> None:
    """What `--help` prints, of every command."""
    overview = printed(program, "--help")
    text = "# Commands\n\nWhat `divmerge --help` and `divmerge COMMAND --help` print.\n"
    text += f"\n```text\n{overview}```\n"
    for name in names_of(overview):
        help_text = printed(program, name, "--help")
        text += f"\n## `{name}`\n\n```text\n{help_text}```\n"
        for own in names_of(help_text):
            text += f"\n### `{name} {own}`\n\n```text\n{printed(program, name, own, '--help')}```\n"
    write("reference/commands.md", text)


def read_parameters(text: str) -> dict[str, tuple[str, str]]:
    """Paths of `divmerge params` with what is said of each, and its value; tables without one."""
    found, table, comment = {}, "", []
    for line in text.splitlines():
        head = re.fullmatch(r"(?:# )?\[([a-z_.]+)\]", line)
        value = re.fullmatch(r"(# )?([a-z_]+) = (.*)", line)
        if head:
            table = head[1] + "."
            found[head[1]] = ("\n".join(comment), "")
        elif value and not line.startswith("##"):
            off = " (off)" if value[1] else ""
            found[table + value[2]] = ("\n".join(comment), value[3] + off)
        elif line.startswith("#"):
            comment.append(re.sub(r"^#+ ?", "", line))
            continue
        comment = []
    return found


def parameters(program: Path) -> None:
    """Every parameter with its meaning, and its value in each preset."""
    presets = ["best", "paper", "authors"]
    values = {
        preset: read_parameters(printed(program, "params", "--preset", preset))
        for preset in presets
    }
    text = (
        "# Parameters\n\nWhat `divmerge params` prints. Each is set by `--set PATH=VALUE`, in a file"
        " for `--config`, and as a\nkeyword in Python ([guide](../guide.md#parameters)).\n"
    )
    for path, (says, value) in values["best"].items():
        says = re.sub(r"^(- [^\n]*)$", r"\1", says, flags=re.MULTILINE)
        says = re.sub(r"\n(?=- )", "\n\n", says, count=1).replace("\nSource: ", "\n\nSource: ")
        if not value:
            text += f"\n## `{path}`\n\n{says}\n"
            continue
        level = "##" if "." not in path else "###"
        shown = [
            f"{preset} `{values[preset][path][1]}`" for preset in presets if path in values[preset]
        ]
        text += f"\n{level} `{path}`\n\n{says}\n\nPresets: {', '.join(shown)}.\n"
    write("reference/parameters.md", text)


def docstrings() -> dict[str, str]:
    """What the sources of the Python package say of functions and classes, by name."""
    found = {}
    item = re.compile(
        r"((?:^[ ]*///.*\n)+)(?:^[ ]*#\[.*\n)*^[ ]*(?:pub )?(?:fn|struct) (\w+)", re.MULTILINE
    )
    for file in sorted((ROOT / "python/src").rglob("*.rs")):
        for lines, name in item.findall(file.read_text()):
            found.setdefault(name, re.sub(r"^ */// ?", "", lines, flags=re.MULTILINE))
    return found


def python() -> None:
    """The stubs, with what the sources say."""
    stub = (ROOT / "python/divmerge/_divmerge.pyi").read_text()
    lines, says = stub.splitlines(), docstrings()
    text = (
        "# Python reference\n\nSignatures are those of the stubs (`python/divmerge/_divmerge.pyi`), the"
        " words those of `help()`.\n[Python](../python.md) is an introduction.\n"
    )
    signatures: dict[str, list[str]] = {}
    for node in ast.parse(stub).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
            first = min([node.lineno, *(mark.lineno for mark in node.decorator_list)])
            signatures.setdefault(node.name, []).append(
                "\n".join(lines[first - 1 : node.end_lineno])
            )
    for name, codes in signatures.items():
        code = "\n".join(codes)
        text += f"\n## `{name}`\n\n{says.get(name, '')}\n```python\n{code}\n```\n"
    write("reference/python.md", text)


def fetched_from_elsewhere() -> list[str]:
    """What pages have a browser fetch from other machines: scripts, styles, pictures, frames."""
    fetches = re.compile(
        r"<(?:script|img|iframe|source)\b[^>]*\bsrc=[\"']?(?:https?:)?//[^\"' >]+"
        r"|<link\b(?=[^>]*rel=[\"']?(?:stylesheet|preload|preconnect|icon))[^>]*href=[\"']?(?:https?:)?//[^\"' >]+"
        r"|@import[^;]*//[^;]+|url\([\"']?(?:https?:)?//[^)]+"
    )
    files = [file for file in SITE.rglob("*") if file.suffix in (".html", ".css")]
    return [f"{file}: {found}" for file in files for found in fetches.findall(file.read_text())]


def main() -> None:
    program = Path(sys.argv[1]).resolve()
    gather_all()
    list_decisions()
    commands(program)
    parameters(program)
    python()
    config = shutil.copy(Path(__file__).with_name("mkdocs.yml"), TARGET / "site.yml")
    mkdocs = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", config]
    # Without the theme's note on its successor (docs/decisions/0029-true-documents.md).
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        mkdocs, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    )
    if done.returncode != 0:
        sys.exit(done.stdout)
    if fetched := fetched_from_elsewhere():
        sys.exit("pages fetch from elsewhere:\n" + "\n".join(fetched))
    pages = sum(1 for _ in SITE.rglob("*.html"))
    print(f"wrote {SITE.relative_to(ROOT)} ({pages} pages)")


if __name__ == "__main__":
    main()
