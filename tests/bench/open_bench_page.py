"""What an operator sees of `open-bench`: stale pictures, clicks on a mantle, click to answer.

    python tests/bench/open_bench_page.py --database lab.db --touches 40 --round Cylinder

A picture is stale that shows an answer, a lit face or a pose while the touch at hand is not read
yet: every picture that the browser paints is looked at. Clicks on a round face are compared with
what the reader says of the same places without a page. Server, browser (software drawing) and
simulated probe share the machine.
"""

from __future__ import annotations

import argparse
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import sync_playwright

from encoded_objects import Reader, open_lab, simulate

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_page import CHROMIUM, FLAGS, opened, rest, shown, until

NEAR_MM = 0.5  #: a click that is read this near is read right
FORCE_N = 80.0
WATCH = """() => { window.seen = []; let before = performance.now(); const look = () => {
    const now = performance.now();
    window.seen.push([bench.touch, bench.state, bench.lit,
      document.getElementById('answer').innerText, document.getElementById('pose').innerText,
      now - before]);
    before = now; requestAnimationFrame(look); }; look(); }"""


@contextmanager
def served(database):
    """Run a server with the simulated probe; yields its address."""
    with tempfile.TemporaryDirectory() as folder:
        words = ("--database", database, "--folder", folder, "--web-port", "0",
                 "--port", "touch:?hold=0.6")  # fmt: skip
        command = [sys.executable, "-m", "recognizer.bench.command", *words]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                yield process.stdout.readline().split()[-1]
            finally:
                process.terminate()
                process.wait()


def clicked(page, across, down):
    """Click on the part; returns the place that was asked for and the one that was read."""
    answers = page.evaluate("bench.answers")
    box = page.get_by_test_id("part").bounding_box()
    page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])
    until(page, f"bench.answers > {answers}")
    asked = [float(page.locator(f"#touch-{axis}").input_value()) for axis in "xy"]
    face = page.get_by_test_id("touch-face").input_value()
    read = re.search(r"x (-?[\d.]+), y (-?[\d.]+) mm", page.locator("#pose").inner_text())
    return face, asked, read and [float(value) for value in read.groups()]


def near(asked, read):
    """Tell whether a place was read where it was asked for."""
    return bool(read) and max(abs(a - b) for a, b in zip(asked, read, strict=True)) < NEAR_MM


def touches(page, name, number, rng):
    """Print stale pictures, and the time from a click to its answer."""
    shown(page, name)
    rest(page)
    first = page.evaluate("bench.touch")
    page.evaluate(WATCH)
    page.evaluate("bench.click_ms.length = 0")
    for _ in range(number):
        clicked(page, rng.uniform(0.38, 0.6), rng.uniform(0.4, 0.65))
        rest(page)
    seen = page.evaluate("window.seen")
    new = [one for one in seen if one[0] > first and one[1] in ("felt", "reading")]
    stale = [one for one in new if one[2] or one[4] or name in one[3]]
    took = sorted(page.evaluate("bench.click_ms"))
    print(f"{number} touches, {len(seen):,} pictures, {len(new)} of touches not read yet; "
          f"stale: {len(stale)} pictures, {sum(one[5] for one in stale):.0f} ms")  # fmt: skip
    print(f"click to answer: median {statistics.median(took):.0f} ms, "
          f"p95 {took[int(0.95 * (len(took) - 1))]:.0f} ms, {len(took)} clicks")  # fmt: skip


def mantle(page, database, name, number, rng):
    """Print how many clicks on a round face are read right, with the page and without."""
    shown(page, name)
    reader = Reader(open_lab(database))
    round_face = page.evaluate(
        f"fetch('/api/objects/{name}').then((a) => a.json())"
        ".then((o) => o.faces.find((f) => f.round).name)"
    )
    tried = right = alone = 0
    while tried < number:
        theta = rng.randint(-180, 180)
        page.locator("#touch-theta").fill(str(theta))
        face, asked, read = clicked(page, rng.uniform(0.36, 0.64), rng.uniform(0.42, 0.72))
        rest(page)
        if face != round_face:
            continue
        tried += 1
        right += near(asked, read)
        frame = simulate(
            f"{database}#{name}/{face}", x=asked[0], y=asked[1], theta=theta, force=FORCE_N
        )
        answer = reader.read(frame.counts)
        alone += bool(answer) and near(asked, [answer.x_mm, answer.y_mm])
    print(f"clicks on the mantle of {name}: {right} of {tried} read within {NEAR_MM} mm; "
          f"the same places without a page: {alone} of {tried}")  # fmt: skip


def main():
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--database", default="lab.db")
    asked.add_argument("--object", default="Cube")
    asked.add_argument("--round", default="Cylinder")
    asked.add_argument("--touches", type=int, default=40)
    asked.add_argument("--seed", type=int, default=1)
    given = asked.parse_args()
    rng = random.Random(given.seed)
    began = time.monotonic()
    with sync_playwright() as playwright, served(given.database) as address:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        with opened(browser, address) as page:
            touches(page, given.object, given.touches, rng)
            mantle(page, given.database, given.round, given.touches, rng)
        browser.close()
    print(f"{time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
