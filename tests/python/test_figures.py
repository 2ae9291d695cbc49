"""Figures as other programs draw them: librsvg draws the SVG and Poppler the PDF as our PNG shows them.

Needs `rsvg-convert` (Debian's librsvg2-bin) and `pdftoppm` (poppler-utils) besides what all tests need.
"""

import shutil
import subprocess

import numpy as np
import pytest

from needed import needed, skip_or_fail
from test_independent_readers import run

Image = needed("PIL.Image")
DPI = 192
# Channels that differ by more than this are of another colour, not of another smoothing of an edge.
OTHER = 64


def tool(name, package):
    if shutil.which(name) is None:
        skip_or_fail(f"no {name}: apt-get install {package}")
    return name


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    path = tmp_path_factory.mktemp("drive") / "drive.mcap"
    run("simulate", "--sensor", "vlp-16", "--scene", "street", "--frames", 4, "-o", path)
    return path


@pytest.fixture(params=["frame", "light", "tracks"])
def page(request, drive, tmp_path):
    """A figure as a file of each kind."""
    arguments = {
        "frame": ["--panels", "mask,votes,bev"],
        "light": ["--panels", "mask,votes,bev", "--theme", "light"],
        "tracks": ["--tracks"],
    }[request.param]
    files = {kind: tmp_path / f"figure.{kind}" for kind in ("png", "svg", "pdf")}
    for file in files.values():
        run("figure", drive, *arguments, "--dpi", DPI, "-o", file)
    return files


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def share_of_others(a, b):
    assert a.shape == b.shape
    return (np.abs(a - b).max(axis=2) > OTHER).mean()


def assert_same(drawn, ours):
    # Letters and signs above the panels: headings that collide would be other pixels.
    head = round(58 * DPI / 96)
    assert share_of_others(drawn[:head], ours[:head]) < 0.004
    # The axis below the panels.
    assert share_of_others(drawn[-50:], ours[-50:]) < 0.01
    # Panels, whose pixels each program brings to the page's in its own way.
    assert share_of_others(drawn, ours) < 0.05


def test_librsvg_draws_the_svg_as_our_png(page, tmp_path):
    rsvg = tool("rsvg-convert", "librsvg2-bin")
    drawn = tmp_path / "rsvg.png"
    subprocess.run([rsvg, "-z", str(DPI / 96), page["svg"], "-o", drawn], check=True)
    assert_same(pixels(drawn), pixels(page["png"]))


def test_poppler_draws_the_pdf_as_our_png(page, tmp_path):
    poppler = tool("pdftoppm", "poppler-utils")
    command = [poppler, "-r", str(DPI), "-singlefile", "-png", page["pdf"], tmp_path / "poppler"]
    subprocess.run(command, check=True)
    assert_same(pixels(tmp_path / "poppler.png"), pixels(page["png"]))


def test_a_pdf_has_one_page_of_its_size_with_its_fonts_and_words(page):
    def said(name, *arguments):
        command = [tool(name, "poppler-utils"), page["pdf"], *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    facts = dict(line.split(":", 1) for line in said("pdfinfo").splitlines())
    assert facts["Pages"].strip() == "1"
    width, height = (float(word) for word in facts["Page size"].split()[0:3:2])
    rows, columns, _ = pixels(page["png"]).shape
    assert abs(width * DPI / 72 - columns) <= 1 and abs(height * DPI / 72 - rows) <= 1
    fonts = said("pdffonts").splitlines()[2:]
    assert len(fonts) == 2 and all("TrueType" in font and " yes " in font for font in fonts)
    words = said("pdftotext", "-")
    assert "bird's-eye view" in words or "objects over time" in words
