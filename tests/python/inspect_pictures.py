"""The pictures of docs/inspect.md and README: a real browser shows a simulated drive in the inspector.

    target/release/divmerge simulate --frames 20 -o drive.mcap
    python tests/python/inspect_pictures.py drive.mcap docs/images

Needs what check_inspect.py needs, and Pillow.
"""

import argparse
import io
from pathlib import Path

from check_inspect import BROWSER, FLAGS, ROOT, inspected, opened, place_of, points_of_two, until
from PIL import Image
from playwright.sync_api import sync_playwright

SIZE = (1400, 900)
# The animation: pictures, their milliseconds, and how far the cloud turns between them, pixels of the mouse.
PICTURES, MILLISECONDS, TURN = 28, 110, 26


def still(page, path):
    page.wait_for_timeout(700)
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    picture.quantize(192, dither=Image.Dither.NONE).save(path, optimize=True)


def worst(page):
    """Goes to the failure of most points and shows why it is one."""
    until(page, "inspector.state.survey?.is_over", 240)
    page.locator("#survey-source").select_option("failures")
    page.locator("#cases button").first.click()
    until(page, "inspector.state.explanation")
    page.evaluate("document.activeElement.blur()")


def nodes(page):
    """Asks why two points of the largest object are one, where there are no classes."""
    until(page, "inspector.state.survey?.is_over", 240)
    for point in points_of_two(page):
        page.mouse.click(*place_of(page, point))
        page.wait_for_timeout(150)
    until(page, "inspector.state.explanation?.nodes.length > 1 && inspector.state.selected.length === 2")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("f")
    page.locator("#nodes").scroll_into_view_if_needed()
    page.evaluate("document.getElementById('nodes').scrollIntoView({ block: 'start' })")
    page.locator("#nodes button.node").first.hover()


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("recording", type=Path)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--binary", type=Path, default=ROOT / "target" / "release" / "divmerge")
    arguments = arguments.parse_args()
    folder = arguments.folder
    with sync_playwright() as playwright, inspected(arguments.binary, arguments.recording) as address:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=FLAGS)
        with opened(browser, address, SIZE) as page:
            until(page, "inspector.state.survey?.is_over", 240)
            still(page, folder / "inspect.png")
            worst(page)
            page.keyboard.press("w")
            until(page, "inspector.state.explanation?.report.what_if", 240)
            page.locator("#search-changes, .changes").first.scroll_into_view_if_needed()
            still(page, folder / "inspect-why.png")
            page.keyboard.press("b")
            page.wait_for_timeout(300)
            page.keyboard.press("c")
            page.wait_for_timeout(300)
            page.locator(".changes button[data-change]").first.click()
            until(page, "inspector.state.compared?.differences.length")
            page.locator("#tab-parameters").click()
            still(page, folder / "inspect-compare.png")
        with opened(browser, address, (1200, 750), "dark") as page:
            worst(page)
            page.keyboard.press("0")
            frames = []
            box = page.locator("#space").bounding_box()
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            for number in range(PICTURES):
                page.mouse.move(x, y)
                page.mouse.down()
                page.mouse.move(x + TURN, y, steps=2)
                page.mouse.move(x + TURN + 5, y)
                page.mouse.up()
                if number == PICTURES // 2:
                    page.evaluate("document.activeElement.blur()")
                    page.keyboard.press("f")
                page.wait_for_timeout(120)
                shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
                frames.append(shot.resize((900, 562), Image.Resampling.LANCZOS))
            palette = frames[0].quantize(160, dither=Image.Dither.NONE)
            frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
            frames[0].save(folder / "inspect.gif", save_all=True, append_images=frames[1:], duration=MILLISECONDS,
                           loop=0, optimize=True)
        with inspected(arguments.binary, arguments.recording, "--semantics", "ground") as tree:
            with opened(browser, tree, SIZE) as page:
                nodes(page)
                still(page, folder / "inspect-nodes.png")
        browser.close()
    for name in ("inspect.png", "inspect-why.png", "inspect-nodes.png", "inspect-compare.png", "inspect.gif"):
        size = (folder / name).stat().st_size
        assert size < 4_000_000, f"{name}: {size} bytes"
        print(f"{name}: {size} bytes")


if __name__ == "__main__":
    main()
