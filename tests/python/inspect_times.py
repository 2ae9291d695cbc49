"""How quick the inspector is, for docs/inspect.md: medians (and the slowest) in milliseconds.

    target/release/divmerge simulate --frames 20 -o drive.mcap
    python tests/python/inspect_times.py drive.mcap

Needs what check_inspect.py needs. The browser draws without a graphics unit. Times are of this machine and of what
else it does: nothing is checked.
"""

import argparse
import statistics
import struct
import subprocess
import tempfile
import time
from pathlib import Path

from check_inspect import BROWSER, DEFINITION, FLAGS, ROOT, cloud_message, inspected, large, opened, until
from playwright.sync_api import sync_playwright

STARTS, CHANGES, DRAWS = 5, 24, 20
FRAMES = 20_001

# Draws the points that are shown in space with nothing but their positions and one colour, through the same matrix
# into an area of the same size: the least that any viewer does.
BARE = """(times) => {
  const box = document.getElementById("space").getBoundingClientRect();
  const canvas = Object.assign(document.createElement("canvas"), { width: innerWidth, height: innerHeight });
  const gl = canvas.getContext("webgl2", { antialias: false });
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, `#version 300 es
      layout(location = 0) in vec3 position; uniform mat4 matrix;
      void main() { gl_Position = matrix * vec4(position, 1.0); gl_PointSize = 1.0; }`],
    [gl.FRAGMENT_SHADER, `#version 300 es
      precision mediump float; out vec4 colour; void main() { colour = vec4(1.0); }`],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(program, shader);
  }
  gl.linkProgram(program); gl.useProgram(program);
  const points = inspector.state.points.position;
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, points, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  gl.enable(gl.DEPTH_TEST); gl.viewport(0, 0, box.width, box.height);
  const took = [], pixel = new Uint8Array(4);
  for (let n = 0; n < times; n++) {
    const began = performance.now();
    gl.uniformMatrix4fv(gl.getUniformLocation(program, "matrix"), false,
      inspector.views.matrixOf({ view: "space", area: box }));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawArrays(gl.POINTS, 0, points.length / 3);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    took.push(performance.now() - began);
  }
  return took.sort((a, b) => a - b)[times >> 1];
}"""


def first_picture(browser, binary, recording, *options):
    """From the command to the first picture, with the browser open."""
    took = []
    for _ in range(STARTS):
        context = browser.new_context(viewport={"width": 1400, "height": 900})
        page = context.new_page()
        began = time.time()
        command = [binary, "inspect", recording, "--no-open", *options]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        page.goto(process.stdout.readline().strip(), wait_until="commit")
        until(page, "window.inspector?.measured.firstPicture")
        took.append(page.evaluate("performance.timeOrigin + inspector.measured.firstPicture") - 1000 * began)
        context.close()
        process.send_signal(2)
        process.wait()
    return took


def changes(browser, binary, recording, path, *options):
    """From a slider to the picture."""
    took = []
    with inspected(binary, recording, *options) as address, opened(browser, address) as page:
        until(page, "inspector.state.survey?.is_over", 300)
        slider = page.locator(f'[data-slider="{path}"]')
        slider.focus()
        for _ in range(CHANGES):
            page.evaluate("inspector.latency.ms = null")
            slider.press("ArrowRight")
            took.append(until(page, "inspector.latency.ms"))
        size = page.evaluate("(({ rows, columns }) => `${rows} x ${columns}`)(inspector.state.pictures.A.run)")
    return took, size


def draws(browser, binary, recording):
    """A turn of all points, and the bare draw of the same points."""
    with inspected(binary, recording) as address, opened(browser, address) as page:
        until(page, "inspector.state.survey?.is_over", 300)
        own = page.evaluate(f"inspector.views.measureDraw({DRAWS})")
        return own, page.evaluate(BARE, DRAWS), page.evaluate("inspector.state.points.position.length / 3")


def long_recording(path):
    """Many small clouds, each a wall with posts before it."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("sensor_msgs/msg/PointCloud2", "ros2msg", DEFINITION)
        channel = writer.register_channel("/points", "cdr", schema)
        for number in range(FRAMES):
            points = [(10.0 - (column % 40 < 3) * 2, 0.05 * column - 5, 0.3 * row - 1 + 1e-4 * number % 0.1)
                      for row in range(6) for column in range(100)]
            data = b"".join(struct.pack("<fff", *point) for point in points)
            writer.add_message(channel, number * 100_000_000, cloud_message("", data), number * 100_000_000)
        writer.finish()


def row(what, took):
    print(f"| {what} | {statistics.median(took):.0f} ({max(took):.0f}) |", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("recording", type=Path)
    arguments.add_argument("--binary", type=Path, default=ROOT / "target" / "release" / "divmerge")
    arguments = arguments.parse_args()
    binary, recording = arguments.binary, arguments.recording
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        folder = Path(folder)
        browser = playwright.chromium.launch(executable_path=BROWSER, args=FLAGS)
        print("| what | ms |\n| --- | --- |")
        for words, path, options in (("with classes", "cluster.voxel", ()),
                                     ("without classes", "cluster.tree.nearest", ("--semantics", "ground"))):
            row(f"command to first picture, {words}", first_picture(browser, binary, recording, *options))
            took, size = changes(browser, binary, recording, path, *options)
            row(f"slider to picture, {size}, {words}", took)
        long_recording(folder / "long.mcap")
        for frame in (10, FRAMES - 1):
            took = first_picture(browser, binary, folder / "long.mcap", "--frame", str(frame))
            row(f"command to first picture, frame {frame} of {FRAMES}", took)
        large(folder / "large.mcap")
        own, bare, count = draws(browser, binary, folder / "large.mcap")
        row(f"a turn of {count:,} points in software", [own])
        row("the bare draw of the same points", [bare])
        browser.close()


if __name__ == "__main__":
    main()
