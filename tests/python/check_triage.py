"""The pages of `divmerge triage` in a real browser: sorting, keys, no request to anywhere.

Needs the release binary, `pip install -r tests/python/requirements.txt` and a Chromium (Debian's package). The page
is driven by a script that is put at its end, and what it found is read out of the dumped document.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BINARY = ROOT / "target" / "release" / "divmerge"

# Asked of the index, once its own script has run.
PROBE = """
<pre id="probe"></pre>
<script>
window.addEventListener("load", () => {
  const key = (name) => (document.activeElement || document.body)
    .dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
  const column = (n) => [...document.querySelectorAll("#cases tbody tr")].map((row) => row.cells[n].textContent);
  const here = () => { const row = document.querySelector("tr.here"); return row && row.cells[0].textContent; };
  const found = { before: column(0), script: document.scripts.length };
  document.querySelectorAll("#cases th button")[4].click();
  found.kinds = column(4);
  found.sorted = document.querySelectorAll("#cases th")[4].getAttribute("aria-sort");
  document.querySelectorAll("#cases th button")[4].click();
  found.kinds_down = column(4);
  key("1"); found.again = column(0);
  key("1"); found.down = column(0);
  key("1");
  key("j"); found.first = here();
  key("j"); found.second = here();
  key("ArrowDown"); key("k"); key("ArrowUp"); found.back = here();
  key("ArrowUp"); found.stays = here();
  const link = document.querySelector("tr.here a");
  link.addEventListener("click", (event) => { found.opened = link.getAttribute("href"); event.preventDefault(); });
  key("Enter");
  key("?"); found.help = document.getElementById("help").open;
  document.querySelector("#help button").click(); found.closed = !document.getElementById("help").open;
  found.loaded = performance.getEntriesByType("resource").map((entry) => entry.name);
  // Luminance of colours, and how much text stands out (WCAG 2.2).
  const linear = (part) => (part /= 255) <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  const luminance = (colour) => { const [r, g, b] = colour.match(/[\\d.]+/g).map(Number).map(linear);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const style = (one, name) => getComputedStyle(one)[name];
  const page = luminance(style(document.body, "backgroundColor"));
  const contrast = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  found.page = page;
  found.texts = [...document.querySelectorAll("h1, p, td, th button, pre, nav a")]
    .filter((one) => one.checkVisibility())
    .map((one) => contrast(luminance(style(one, "color")), page));
  const figures = [...document.querySelectorAll("figure > svg")];
  found.figures = figures.map((one) => luminance(style(one.querySelector("rect"), "fill")));
  found.headings = figures.map((one, n) =>
    contrast(luminance(style(one.querySelector("g[aria-label]"), "fill")), found.figures[n]));
  found.screen = [...document.styleSheets[0].cssRules].filter((rule) => /dark/.test(rule.conditionText ?? ""))
    .map((rule) => rule.conditionText);
  found.fits = document.documentElement.scrollWidth <= window.innerWidth;
  document.getElementById("probe").textContent = "PROBE" + JSON.stringify(found) + "END";
});
</script>
</body>"""


def browser():
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if shutil.which(name):
            return name
    sys.exit("no Chromium found")


def chromium(folder, *arguments):
    command = [browser(), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/profile"]
    done = subprocess.run([*command, *map(str, arguments)], capture_output=True, timeout=120)
    assert done.returncode == 0, done.stderr.decode(errors="replace")
    return done.stdout.decode()


# Colours that the reader wants, as Chromium is told.
DARK, LIGHT = "--blink-settings=preferredColorScheme=0", "--blink-settings=preferredColorScheme=1"


def probed(folder, page, scheme=LIGHT):
    text = page.read_text()
    copy = page.with_name(f"probe-{page.name}")
    assert text.count("</body>") == 1
    copy.write_text(text.replace("</body>", PROBE))
    dumped = chromium(folder, scheme, "--virtual-time-budget=5000", "--dump-dom", copy.as_uri())
    copy.unlink()
    found = dumped.split("PROBE{")[-1].split("}END")[0]
    return json.loads("{" + found.replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">") + "}")


def check_index(found, cases, link):
    ranks = [str(number + 1) for number in range(cases)]
    assert found["before"] == ranks == found["again"], found
    assert found["down"] == ranks[::-1], found
    assert found["kinds"] == sorted(found["kinds"]) and found["sorted"] == "ascending", found
    assert len(set(found["kinds"])) > 1, "one kind alone: sorting by it shows nothing"
    assert found["kinds_down"] == found["kinds"][::-1], found
    assert (found["first"], found["second"], found["back"], found["stays"]) == ("1", "2", "1", "1"), found
    assert found["opened"] == link, found
    assert found["help"] and found["closed"], found
    assert not [name for name in found["loaded"] if not name.startswith("data:")], found["loaded"]
    assert found["fits"], "wider than the window"


def check_colours(light, dark):
    """The page and its figures follow the reader's colours, on the screen alone, and text stands out in both."""
    assert light["page"] > 0.8 and dark["page"] < 0.05, (light["page"], dark["page"])
    for found in (light, dark):
        assert min(found["texts"]) >= 4.5, sorted(found["texts"])[:5]
        assert found["screen"] and all("screen" in condition for condition in found["screen"]), found["screen"]
    assert light["figures"] and min(light["figures"]) > 0.8 and max(dark["figures"]) < 0.05, "figures do not follow"
    assert min(light["headings"] + dark["headings"]) >= 4.5, (light["headings"], dark["headings"])


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("recording", type=Path)
    arguments.add_argument("--keep", type=Path, help="folder for pictures of the pages")
    arguments = arguments.parse_args()
    cases = 12
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for name in ("pages", "one.html"):
            command = [BINARY, "triage", arguments.recording, "--limit", str(cases), "--report", folder / name]
            subprocess.run(command, check=True, capture_output=True)
        check_index(probed(folder, folder / "pages" / "index.html"), cases, "case-001.html")
        light, dark = (probed(folder, folder / "one.html", scheme) for scheme in (LIGHT, DARK))
        check_index(light, cases, "#case-1")
        check_colours(light, dark)
        # Without scripts the table stands there with its links.
        plain = (folder / "pages" / "index.html").read_text().split("<script>")[0]
        assert plain.count("<tr tabindex") == cases and plain.count('href="case-') == cases
        if arguments.keep:
            arguments.keep.mkdir(parents=True, exist_ok=True)
            for name, size in (("index", "1400,900"), ("case-001", "1400,900")):
                for side, scheme in (("light", LIGHT), ("dark", DARK)):
                    picture = arguments.keep / f"triage-{name}-{side}.png"
                    page = folder / "pages" / f"{name}.html"
                    chromium(folder, scheme, f"--screenshot={picture}", f"--window-size={size}", page.as_uri())
                    assert picture.stat().st_size > 20_000, picture
            chromium(folder, DARK, f"--print-to-pdf={arguments.keep / 'triage.pdf'}", (folder / "one.html").as_uri())
    print("triage pages: sorted, moved, opened; light and dark; nothing loaded")


if __name__ == "__main__":
    main()
