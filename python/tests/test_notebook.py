"""What a notebook shows of a result."""

import base64
import re
from collections import Counter
from html.parser import HTMLParser

import numpy as np
import pytest

import divmerge


def cells(html):
    """The rows of the table."""
    rows = re.findall(r"<tr>(.*?)</tr>", html)
    return [re.findall(r"<t[hd]>(.*?)</t[hd]>", row) for row in rows]


@pytest.mark.parametrize("semantics, name", [("auto", "class_name"), ("ground", "likeness")])
def test_counts_classes_and_figure(drives, semantics, name):
    result = divmerge.frames(drives("small"), semantics=semantics)[0].cluster()
    html = result._repr_html_()
    head, *rows = cells(html)
    assert head == ["class", "instances", "points"]
    counts, points = Counter(), Counter()
    for one in result.instances:
        counts[str(one[name])] += 1
        points[str(one[name])] += int(one["points"])
    listed = {name: (int(instances), int(points)) for name, instances, points in rows}
    assert listed == {name: (counts[name], points[name]) for name in listed}
    assert len(rows) == min(12, len(counts)) > 1
    assert [int(row[2]) for row in rows] == sorted(points.values(), reverse=True)[:12]
    assert html.startswith(f"<p>{result!r}</p>")
    png = result._repr_png_()
    assert png == divmerge.figure(result, dpi=96)
    assert base64.b64decode(re.search(r"base64,([^\"]*)", html)[1]) == png


def test_names_of_classes_are_text(tmp_path):
    """A taxonomy is a file of anybody's."""
    taxonomy = tmp_path / "odd.yaml"
    taxonomy.write_text(
        "labels: {0: none, 7: '<script>x'}\nlearning_map: {0: 0, 7: 1}\n"
        "learning_map_inv: {0: 0, 1: 7}\nlearning_ignore: {0: true, 1: false}\nthing_class: {1: true}\n"
    )
    points = np.random.default_rng(1).normal([10, 0, 0], 0.3, (500, 3)).astype(np.float32)
    result = divmerge.cluster(points, np.full(500, 7), taxonomy=divmerge.Taxonomy(taxonomy))
    assert result.instances["class_name"][0] == "<script>x"
    html = result._repr_html_()
    assert "<script" not in html and "&lt;script&gt;x" in html
    HTMLParser().feed(html)


def test_a_cloud_without_anything():
    result = divmerge.cluster(np.full((4, 3), np.nan, np.float32), "all")
    assert cells(result._repr_html_()) == []
    assert result._repr_png_().startswith(b"\x89PNG")
