"""The inspector as a person uses it, in a real browser: sliders, clicks, keys alone, a saved case without a network.

Needs a binary, `pip install -r tests/python/requirements-inspect.txt` and a Chromium (Debian's package). Nothing is
asked of the page but what it shows, and `window.inspector` for what it measured.
"""

import argparse
import json
import math
import re
import struct
import subprocess
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[2]
BROWSER = "/usr/bin/chromium"
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
         "--disable-component-update", "--disable-sync"]
SIZES = [(1400, 900), (900, 700)]


@contextmanager
def inspected(binary, recording, *options):
    """A running inspector, as its address."""
    command = [binary, "inspect", recording, "--no-open", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        address = process.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/", address), address + process.stderr.read()
        yield address
    finally:
        process.send_signal(2)
        assert process.wait(timeout=10) == 0, "Ctrl-C is how it ends"


def until(page, question, seconds=60):
    """What the page answers, once that is true. (The page forbids `eval`, which wait_for_function is.)"""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        answer = page.evaluate(question)
        if answer:
            return answer
        page.wait_for_timeout(20)
    raise AssertionError(f"never: {question}; status: {page.locator('#status').text_content()}")


@contextmanager
def opened(browser, address, size=SIZES[0], scheme="light"):
    """The page, shown; fails on any error in it and on any request to elsewhere."""
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme,
                                  accept_downloads=True)
    page = context.new_page()
    errors, asked = [], []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type in ("error", "warning")
            and "GPU stall" not in message.text else None)
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    until(page, "window.inspector?.measured.firstPicture")
    yield page
    context.close()
    assert not errors, errors
    elsewhere = [url for url in asked if not url.startswith((address, "data:", "blob:"))]
    assert not elsewhere, elsewhere


def points_of_two(page):
    """Two points of the largest object, as far apart as the image has them."""
    return page.evaluate("""() => {
      const { run, arrays } = inspector.state.pictures.A;
      const objects = run.instances.filter((one) => one.is_object);
      const largest = objects.reduce((a, b) => (a.points > b.points ? a : b)).id;
      const isOfIt = (point) => point !== 0xffffffff && arrays.instance[point] === largest;
      const seen = [...arrays.point_of_pixel].filter(isOfIt);
      return [seen[0], seen[seen.length - 1]];
    }""")


def place_of(page, point):
    """Where a point is in the range image, in pixels of the page."""
    return page.evaluate("""(point) => {
      const { run, arrays } = inspector.state.pictures.A, pixel = arrays.pixel_of_point[point];
      const box = document.getElementById("range").getBoundingClientRect(), bar = 30;
      const row = Math.floor(pixel / run.columns), top = run.top_row_first ? row : run.rows - 1 - row;
      return [box.left + ((pixel % run.columns) + 0.5) / run.columns * box.width,
              box.top + bar + (top + 0.5) / run.rows * (box.height - bar)];
    }""", point)


def lit(page):
    """How many points are lit up."""
    return page.evaluate("""() => {
      const colours = inspector.views.painted.A;
      let count = 0;
      for (let n = 3; n < colours.length; n += 4) count += colours[n] === 255;
      return count;
    }""")


def pictures(page):
    """The three views as they are drawn."""
    page.wait_for_timeout(300)
    return [page.locator(f"#{view}").screenshot() for view in ("space", "plane", "range")]


def check_nodes(page):
    """Without classes: the chain of merges is drawn in all views, and a node lights up its points."""
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("Escape")
    a, b = points_of_two(page)
    for point in (a, b):
        page.mouse.click(*place_of(page, point))
        page.wait_for_timeout(150)
    until(page, "inspector.state.explanation?.nodes.length > 1 && inspector.state.selected.length === 2")
    page.keyboard.press("f")
    nodes = page.evaluate("inspector.state.explanation.nodes")
    assert page.locator("#nodes tbody tr").count() == len(nodes)
    assert {tuple(node["holds"]) for node in nodes} >= {(0, 1)}, "they join nowhere"
    before = pictures(page)
    button = page.locator("#nodes button.node").first
    place = int(button.get_attribute("data-node"))
    button.focus()
    until(page, f"inspector.state.node === {place}")
    assert lit(page) == nodes[place]["pixels"], (lit(page), nodes[place]["pixels"])
    assert all(one != other for one, other in zip(before, pictures(page))), "a view shows nothing of a node"
    page.locator("#tab-why").focus()
    until(page, "inspector.state.node === null")
    button.hover()
    until(page, f"inspector.state.node === {place}")
    page.mouse.move(5, 5)
    until(page, "inspector.state.node === null")
    # What is pressed stays lit, and a node in the words is the same one.
    chosen = next(number for number, node in enumerate(nodes) if node["is_chosen"])
    page.locator(f"#explanation button[data-node='{chosen}']").first.click()
    page.mouse.move(5, 5)
    page.locator("#tab-why").focus()
    assert page.evaluate("inspector.state.node") == chosen
    assert lit(page) == nodes[chosen]["pixels"]
    check_accessible(page)
    page.locator("#tab-parameters").click()
    words = page.locator("#over-time").inner_text()
    assert "tracks" in words and "ego_motion" in words, words
    idle = page.locator(".group").filter(has_text="cluster.fragments")
    assert "No effect" in idle.text_content() and idle.locator("input").count() == 0, idle.text_content()
    assert page.locator("[data-slider='cluster.tree.nearest'], [data-path='cluster.tree.nearest']").count() > 0


def check_slider(page):
    """A slider clusters again, says how long that took, and can be taken back."""
    slider = page.locator('[data-slider="cluster.voxel"]')
    before = page.evaluate("inspector.state.pictures.A.run.components")
    slider.focus()
    for _ in range(40):
        slider.press("ArrowRight")
    until(page, "inspector.latency.ms")
    until(page, f"inspector.state.pictures.A.run.components !== {before}")
    page.wait_for_timeout(500)
    changed = page.evaluate("inspector.state.settings.A.set")
    assert list(changed) == ["cluster.voxel"], changed
    page.locator('[aria-label="reset cluster.voxel"]').click()
    until(page, f"inspector.state.pictures.A.run.components === {before}")
    assert page.evaluate("Object.keys(inspector.state.settings.A.set).length") == 0


def check_rasterizer(page):
    """Without a graphics unit the page draws points itself: the same picture as WebGL's."""
    differing, drawn = page.evaluate("""async () => {
      const scene = inspector.views.sceneOf();
      const pixels = async () => {
        inspector.views.snapshot();
        const { gl, canvas } = scene, { width, height } = canvas;
        const out = new Uint32Array(width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(out.buffer));
        return out;
      };
      const own = await pixels(), { rasterizer } = scene;
      scene.rasterizer = null;
      const other = await pixels();
      scene.rasterizer = rasterizer;
      if (!rasterizer) throw new Error("no rasterizer where WebGL is software");
      const panel = own.reduce((counts, one) => counts.set(one, (counts.get(one) ?? 0) + 1), new Map());
      const [most] = [...panel].sort((a, b) => b[1] - a[1])[0];
      return [own.filter((one, n) => one !== other[n]).length, other.filter((one) => one !== most).length];
    }""")
    assert drawn > 20_000, drawn
    assert differing < 0.01 * drawn, (differing, drawn)


def check_compared(page):
    """A second setting beside the first: what differs is counted."""
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("b")
    page.locator("select[data-path=preset]").select_option("paper")
    until(page, "inspector.state.pictures.B?.run.setting.preset === 'paper'")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("c")
    until(page, "inspector.state.compared?.differences.length > 0")
    counts = page.evaluate("inspector.state.compared.counts")
    words = page.locator("#figures").inner_text()
    assert all(f"{count} {name}" in words for name, count in counts), (counts, words)
    page.keyboard.press("9")
    assert page.evaluate("inspector.state.layer") == "difference"
    page.keyboard.press("c")
    page.keyboard.press("a")
    page.keyboard.press("6")
    until(page, "inspector.state.slot === 'A' && !inspector.state.compare")


def check_explained(page, binary, recording):
    """Two clicks in the range image: the answer is that of `explain`, word for word."""
    a, b = points_of_two(page)
    page.keyboard.press("Escape")
    for point in (a, b):
        page.mouse.click(*place_of(page, point))
        page.wait_for_timeout(150)
    until(page, "inspector.state.explanation && inspector.state.selected.length === 2")
    at = page.evaluate("inspector.state.explanation.at")
    topic = page.evaluate("inspector.state.topic")
    command = [binary, "explain", recording, "--topic", topic, "--at", at[0], "--at", at[1]]
    page.keyboard.press("w")
    until(page, "inspector.state.explanation?.report.what_if", 240)
    printed = subprocess.run([*command, "--json"], check=True, capture_output=True, text=True).stdout
    # Numbers of JavaScript have 53 bits: a time in nanoseconds has more.
    shown, expected = page.evaluate("inspector.state.explanation.report"), json.loads(printed)
    assert float(shown.pop("log_time_ns")) == float(expected.pop("log_time_ns"))
    assert shown == expected, "the page and explain --json differ"
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert page.locator("#explanation").text_content() == printed
    page.keyboard.press("y")
    until(page, "document.getElementById('command')?.value")
    assert all(f"--at {place}" in page.locator("#command").input_value() for place in at)
    page.keyboard.press("Escape")
    return len(page.evaluate("inspector.state.explanation.changes"))


def check_figures(page):
    """Each form of a figure is what its name says, and light and dark ones differ."""
    page.keyboard.press("y")
    starts, drawn = {"svg": b"<", "png": b"\x89PNG", "pdf": b"%PDF-"}, {}
    for form, start in starts.items():
        for side in ("light", "dark"):
            with page.expect_download() as download:
                page.locator(f'[data-figure="{form}-{side}"]').click()
            drawn[form, side] = Path(download.value.path()).read_bytes()
            assert drawn[form, side].startswith(start), (form, side, drawn[form, side][:20])
    assert len(set(drawn.values())) == len(drawn), "light and dark figures are alike"
    page.keyboard.press("Escape")


def check_case(browser, page, folder):
    """A saved case opens from the disk without a network, with the explanation and a change that was run."""
    page.keyboard.press("y")
    with page.expect_download(timeout=240_000) as download:
        page.locator("#save-case").click()
    path = folder / "case.html"
    download.value.save_as(path)
    page.keyboard.press("Escape")
    text = page.locator("#explanation").text_content()
    assert path.stat().st_size < 6_000_000, path.stat().st_size
    context = browser.new_context(viewport={"width": 1400, "height": 900}, offline=True)
    saved, errors = context.new_page(), []
    saved.on("pageerror", lambda error: errors.append(str(error)))
    saved.on("request", lambda request: errors.append(request.url) if request.url.startswith("http") else None)
    saved.goto(path.as_uri())
    until(saved, "window.inspector?.measured.firstPicture && inspector.state.explanation")
    assert saved.locator("#explanation").text_content() == text
    change = saved.locator("[data-change]").first
    answer = saved.evaluate("inspector.state.pictures.A.run.instances.length")
    change.click()
    until(saved, "Object.keys(inspector.state.pictures.A.run.setting.set).length > 0")
    assert saved.evaluate("inspector.state.pictures.A.arrays.instance.length") > 0 and answer > 0
    assert not errors, errors
    context.close()
    return path.stat().st_size


def check_keys(page):
    """Keyboard alone: Tab comes to every control, and the range image can be asked with arrows and Enter."""
    page.keyboard.press("Escape")
    page.evaluate("document.activeElement.blur()")
    page.locator("#range").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")
    for _ in range(60):
        if page.evaluate("inspector.state.selected.length") == 1:
            break
        page.keyboard.press("Shift+ArrowDown")
        page.keyboard.press("Enter")
    until(page, "inspector.state.selected.length === 1")
    for _ in range(40):
        page.keyboard.press("Shift+ArrowLeft")
    page.keyboard.press("Shift+Enter")
    until(page, "inspector.state.selected.length === 2")
    for name in ("space", "plane"):
        page.locator(f"#{name}").focus()
        page.keyboard.press("+")
        page.keyboard.press("ArrowLeft")
    page.evaluate("document.activeElement.blur()")
    reached, wanted = set(), page.evaluate("""() => [...document.querySelectorAll(
      "button, select, input, summary, [tabindex='0']")].filter((one) => !one.disabled && one.tabIndex >= 0
      && one.checkVisibility() && !one.closest("dialog") && !one.closest("#cases, #instances")).length""")
    for _ in range(wanted + 400):
        page.keyboard.press("Tab")
        mark = page.evaluate("""() => { const one = document.activeElement;
          if (!one || one === document.body) return null;
          one.dataset.reached ??= String(document.querySelectorAll("[data-reached]").length);
          return one.closest("#cases, #instances") ? null : one.dataset.reached; }""")
        if mark is not None:
            reached.add(mark)
        if len(reached) >= wanted:
            break
    assert len(reached) >= wanted, f"Tab reaches {len(reached)} of {wanted} controls"
    page.evaluate("document.activeElement.blur()")
    frame = page.evaluate("inspector.state.frame")
    page.keyboard.press("j")
    until(page, f"inspector.state.frame === {frame + 1} && inspector.state.pictures.A")
    page.keyboard.press("k")
    until(page, f"inspector.state.frame === {frame} && inspector.state.pictures.A")
    page.keyboard.press("?")
    assert page.locator("#help").is_visible()
    page.keyboard.press("Escape")


def check_accessible(page):
    """axe-core finds nothing serious."""
    from axe_playwright_python.base import AXE_FILE_PATH

    found = page.evaluate(f"(async () => {{ {AXE_FILE_PATH.read_text()}\n return (await axe.run()).violations; }})()")
    serious = [(one["id"], [node["html"] for node in one["nodes"][:3]]) for one in found
               if one["impact"] in ("serious", "critical")]
    assert not serious, serious


def check_looks(browser, address, keep):
    """Fits both sizes, light and dark; pictures are kept to be looked at."""
    for size in SIZES:
        for scheme in ("light", "dark"):
            with opened(browser, address, size, scheme) as page:
                until(page, "document.querySelectorAll('#cases button').length")
                page.keyboard.press("n")
                page.wait_for_timeout(800)
                assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "wider than the window"
                assert page.evaluate("document.documentElement.dataset.theme") == scheme
                check_accessible(page)
                if keep:
                    page.screenshot(path=keep / f"inspect-{size[0]}-{scheme}.png")


def check_survey(page):
    """Cases of several frames; a click goes to one."""
    until(page, "inspector.state.survey?.is_over", 240)
    page.locator("#survey-to").fill("3")
    page.locator("#survey").click()
    until(page, "inspector.state.survey?.is_over && inspector.state.survey.done === 4", 240)
    assert page.evaluate("inspector.state.survey.is_followed")
    assert len(until(page, "inspector.state.tracks")) > 3
    cases = page.locator("#cases button")
    assert cases.count() > 3
    kinds = set(page.evaluate("inspector.state.survey.cases.map((one) => one.source)"))
    assert kinds == {"triage", "failures"} or kinds == {"triage"}, kinds
    cases.nth(1).click()
    until(page, "inspector.state.selected.length > 0")


DEFINITION = b"std_msgs/Header header\nuint32 height\nuint32 width\n"


def cloud_message(frame_id, data):
    """A PointCloud2 in CDR of points of x, y, z in single precision."""

    def text(words):
        encoded = words.encode() + b"\0"
        return struct.pack("<I", len(encoded)) + encoded

    def aligned(body, to):
        return body + b"\0" * (-len(body) % to)

    count = len(data) // 12
    body = struct.pack("<iI", 0, 0) + text(frame_id)
    body = aligned(body, 4) + struct.pack("<II", 1, count) + struct.pack("<I", 3)
    for field, offset in (("x", 0), ("y", 4), ("z", 8)):
        body = aligned(body, 4) + text(field)
        body = aligned(body, 4) + struct.pack("<IBxxxI", offset, 7, 1)
    body += struct.pack("<B", 0)
    body = aligned(body, 4) + struct.pack("<II", 12, len(data)) + struct.pack("<I", len(data)) + data + b"\1"
    return b"\0\1\0\0" + body


def hostile(path):
    """A recording of one cloud whose names are markup and whose points are no numbers, written here by hand."""
    from mcap.writer import Writer

    name = '/x"><img src=x onerror=alert(1)><script>alert(2)</script>\u202e'
    points = [(float("nan"), 1.0, 2.0), (float("inf"), 0, 0), (1e30, -1e30, 1e-30), (3.0, 1.0, 0.5)] * 50
    body = cloud_message(name, b"".join(struct.pack("<fff", *point) for point in points))
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("sensor_msgs/msg/PointCloud2", "ros2msg", DEFINITION)
        channel = writer.register_channel(name, "cdr", schema)
        writer.add_message(channel, 5, body, 5)
        writer.finish()
    return name


def large(path, rows=122, columns=8200):
    """A recording of one cloud of a million returns: uneven ground, and posts on it."""
    from array import array

    from mcap.writer import Writer

    points = array("f")
    for row in range(rows):
        down = math.radians(1.2 + 24 * (row / rows) ** 1.5)
        for column in range(columns):
            turn = 2 * math.pi * column / columns
            uneven = 0.01 * math.sin(91 * turn) + 0.003 * ((row * 7919 + column * 104729) % 97) / 97
            away = 1.9 / math.tan(down) * (1 + uneven)
            if column % 400 < 12 and away > 9:
                away = 9 + 0.01 * (column % 7)
            points.extend((away * math.cos(turn), away * math.sin(turn), -away * math.tan(down)))
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("sensor_msgs/msg/PointCloud2", "ros2msg", DEFINITION)
        channel = writer.register_channel("/large", "cdr", schema)
        writer.add_message(channel, 5, cloud_message("", points.tobytes()), 5)
        writer.finish()
    return len(points) // 3


def check_large(browser, binary, folder):
    """A million points are shown, and their case is small, opens alone and says what it leaves out."""
    path = folder / "large.mcap"
    count = large(path)
    assert count > 1_000_000, count
    with inspected(binary, path) as address, opened(browser, address) as page:
        assert page.evaluate("inspector.state.points.position.length") == 3 * count
        page.keyboard.press("y")
        with page.expect_download(timeout=240_000) as download:
            page.locator("#save-case").click()
        case = folder / "large.html"
        download.value.save_as(case)
    assert case.stat().st_size <= 6_000_000, case.stat().st_size
    context = browser.new_context(viewport={"width": 1400, "height": 900}, offline=True)
    saved, errors = context.new_page(), []
    saved.on("pageerror", lambda error: errors.append(str(error)))
    saved.goto(case.as_uri())
    until(saved, "window.inspector?.measured.firstPicture && inspector.state.points")
    kept = saved.evaluate("inspector.state.points.position.length / 3")
    assert 50_000 < kept < count, kept
    saved.locator("#tab-about").click()
    words = saved.locator(".left-out").inner_text()
    assert f"{int(kept):,} of {count:,} are in it" in words, words
    assert not errors, errors
    context.close()
    return case.stat().st_size, int(kept)


def check_hostile(browser, binary, folder):
    """Markup in names is text; points that are no numbers are not drawn."""
    path = folder / "hostile.mcap"
    name = hostile(path)
    with inspected(binary, path) as address:
        context = browser.new_context()
        page, alerts = context.new_page(), []
        page.on("dialog", lambda dialog: (alerts.append(dialog.message), dialog.dismiss()))
        page.goto(address)
        until(page, "window.inspector?.measured.firstPicture")
        assert page.evaluate("inspector.state.topic") == name
        assert page.locator("img").count() == 0 and not alerts
        assert "<script>" in page.locator("#topic").inner_text()
        context.close()


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("recording", type=Path)
    arguments.add_argument("--binary", type=Path, default=ROOT / "target" / "release" / "divmerge")
    arguments.add_argument("--keep", type=Path, help="folder for pictures of the page")
    arguments = arguments.parse_args()
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        folder = Path(folder)
        browser = playwright.chromium.launch(executable_path=BROWSER, args=FLAGS)
        with inspected(arguments.binary, arguments.recording) as address:
            with opened(browser, address) as page:
                check_rasterizer(page)
                check_slider(page)
                check_compared(page)
                check_figures(page)
                changes = check_explained(page, arguments.binary, arguments.recording)
                size = check_case(browser, page, folder)
                check_keys(page)
                check_survey(page)
                first, draw = page.evaluate("[inspector.measured.firstPicture, inspector.views.measureDraw()]")
            check_looks(browser, address, arguments.keep)
        with inspected(arguments.binary, arguments.recording, "--semantics", "ground") as address:
            with opened(browser, address) as page:
                check_nodes(page)
        check_hostile(browser, arguments.binary, folder)
        large_size, kept = check_large(browser, arguments.binary, folder)
        browser.close()
    print(f"inspector: {changes} changes, a case of {size / 1e6:.1f} MB; first picture {first:.0f} ms after the page, "
          f"all views drawn in {draw:.0f} ms in software; a case of a million points {large_size / 1e6:.1f} MB "
          f"with {kept:,} of them")


if __name__ == "__main__":
    main()
