"""Figures of `open-bench`: rates, latency, CPU, memory, many pages, clicks, stale pictures.

    python tests/bench/open_bench.py --database lab.db [--touches 40] [--round Cylinder]
    python tests/bench/open_bench.py --database lab.db --rates --touches 0 --pages --soak 600

Server, browser (software drawing) and the simulated probe share the machine; CPU is that of the
server's process, in percent of one core, without the browser. The database needs an object, and a
round one for `--round`. A picture is stale that shows an answer, a lit face or a pose while the
touch at hand is not read yet: every picture that the browser paints is looked at. Clicks on a round
face are compared with the reader's answers at the same places without a page.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import socket
import statistics
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import httpx
from playwright.sync_api import sync_playwright
from websockets.asyncio.client import connect

from encoded_objects import Reader, open_lab, simulate

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner
from bench_page import CHROMIUM, FLAGS, opened, rest, running, shown, until

STATIC = Path(__file__).parents[2] / "recognizer" / "bench" / "static"
NEAR_MM = 0.5  #: a click that is read this near is read right
FORCE_N = 80.0
WATCH = """() => { window.seen = []; let before = performance.now(); const look = () => {
    const now = performance.now();
    window.seen.push([bench.touch, bench.state, bench.lit,
      document.getElementById('answer').innerText, document.getElementById('pose').innerText,
      now - before]);
    before = now; requestAnimationFrame(look); }; look(); }"""
UPGRADE = (
    "GET /live HTTP/1.1\r\nHost: {0}\r\nOrigin: http://{0}\r\nUpgrade: websocket\r\n"
    "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)


@contextmanager
def served(database, port):
    """Run a server at a simulated probe until its lab is read; yields its address and number."""
    with (
        tempfile.TemporaryDirectory() as folder,
        running("--database", database, "--folder", folder, "--port", port) as (address, process),
    ):
        while not httpx.get(address + "api/lab").json()["encodings"]:
            time.sleep(0.2)
        yield address, process.pid


class Meter:
    """CPU and memory of a process, since it was begun."""

    def __init__(self, pid):
        self.folder = Path(f"/proc/{pid}")
        self.cpu, self.began = self._cpu_s(), time.monotonic()

    def _cpu_s(self):
        fields = (self.folder / "stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory_mb(self):
        status = (self.folder / "status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) / 1024

    def __str__(self):
        used = 100 * (self._cpu_s() - self.cpu) / (time.monotonic() - self.began)
        return f"server CPU {used:.1f} %, memory {self.memory_mb():.0f} MB"


def spread(times_ms):
    """Return median and 95 % of times."""
    found = sorted(times_ms)
    late = found[round(0.95 * (len(found) - 1))]
    return f"median {statistics.median(found):.0f} ms, p95 {late:.0f} ms"


def at_rate(browser, database, rate, seconds):
    """Print a line for a rate of the source."""
    with (
        served(database, f"touch:?rate={rate}") as (address, pid),
        opened(browser, address) as page,
    ):
        time.sleep(2)
        before = page.evaluate("[bench.frames, bench.paints]")
        page.evaluate("bench.latency_ms.length = 0")
        meter = Meter(pid)
        time.sleep(seconds)
        frames, paints, late = page.evaluate("[bench.frames, bench.paints, bench.latency_ms]")
        print(f"{rate:3.0f} Hz: {(frames - before[0]) / seconds:.1f}/s to the page, "
              f"{(paints - before[1]) / seconds:.1f}/s painted, latency {spread(late)}, "
              f"{meter}")  # fmt: skip


def clicked(page, across, down):
    """Click on the part; returns the face, the place that was asked for and the one read."""
    answers = page.evaluate("bench.answers")
    box = page.get_by_test_id("part").bounding_box()
    page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])
    until(page, f"bench.answers > {answers}")
    asked = [float(page.locator(f"#touch-{axis}").input_value()) for axis in "xy"]
    face = page.get_by_test_id("touch-face").input_value()
    read = re.search(r"x (-?[\d.]+), y (-?[\d.]+) mm", page.locator("#pose").inner_text())
    rest(page)
    return face, asked, read and [float(value) for value in read.groups()]


def near(asked, read):
    """Tell whether a place was read where it was asked for."""
    return bool(read) and max(abs(a - b) for a, b in zip(asked, read, strict=True)) < NEAR_MM


def touches(page, number, rng):
    """Print stale pictures, and the time from a click to its answer."""
    name = page.evaluate("bench.shown")
    rest(page)
    first = page.evaluate("bench.touch")
    page.evaluate(WATCH)
    page.evaluate("bench.click_ms.length = 0")
    for _ in range(number):
        clicked(page, rng.uniform(0.38, 0.6), rng.uniform(0.4, 0.65))
    seen = page.evaluate("window.seen")
    new = [one for one in seen if one[0] > first and one[1] in ("felt", "reading")]
    stale = [one for one in new if one[2] or one[4] or name in one[3]]
    print(f"{number} touches, {len(seen):,} pictures, {len(new)} of touches not read yet; "
          f"stale: {len(stale)} pictures, {sum(one[5] for one in stale):.0f} ms\n"
          f"click to answer: {spread(page.evaluate('bench.click_ms'))}")  # fmt: skip


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
        if face != round_face:
            continue
        tried += 1
        right += near(asked, read)
        where = f"{database}#{name}/{face}"
        frame = simulate(where, x=asked[0], y=asked[1], theta=theta, force=FORCE_N)
        answer = reader.read(frame.counts)
        alone += bool(answer) and near(asked, [answer.x_mm, answer.y_mm])
    print(f"clicks on the mantle of {name}: {right} of {tried} read within {NEAR_MM} mm; "
          f"the same places without a page: {alone} of {tried}")  # fmt: skip


async def listen(address, seconds):
    """Return the frames a second that one page gets."""
    host = address.split("/")[2]
    frames, end = 0, time.monotonic() + seconds
    async with connect(f"ws://{host}/live", origin=f"http://{host}") as line:
        await line.send(json.dumps({"filter": "median"}))
        while time.monotonic() < end:
            frames += isinstance(await line.recv(), bytes)
    return frames / seconds


def many(database, pages, seconds):
    """Print what many pages at once get, and cost."""

    async def all_of_them(address):
        return await asyncio.gather(*(listen(address, seconds) for _ in range(pages)))

    with served(database, "touch:?rate=100") as (address, pid):
        time.sleep(0 if pages else 8)  # until the port is let go
        meter = Meter(pid)
        got = asyncio.run(all_of_them(address)) if pages else [0.0]
        time.sleep(0 if pages else seconds)
        print(f"{pages} pages at 100 Hz: {min(got):.0f} ... {max(got):.0f} frames/s each, {meter}")


def never_read(database, pages, seconds):
    """Print what pages cost that never read, and what one that reads gets meanwhile."""
    with served(database, "touch:?rate=100") as (address, pid):
        host = address.split("/")[2]
        name, port = host.split(":")
        deaf = []
        for _ in range(pages):
            line = socket.create_connection((name, int(port)))
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            line.sendall(UPGRADE.format(host).encode())
            deaf.append(line)
        meter = Meter(pid)
        before, got = meter.memory_mb(), asyncio.run(listen(address, seconds))
        print(f"{pages} pages that never read, 100 Hz: one that reads gets {got:.0f} frames/s, "
              f"{meter}, {before:.0f} MB before")  # fmt: skip
        for line in deaf:
            line.close()


def soak(database, seconds):
    """Print CPU and memory, minute by minute, while one page listens and touches go on."""

    async def one(address):
        await asyncio.gather(listen(address, seconds), touching(address))

    async def touching(address):
        rng, end, due = random.Random(1), time.monotonic() + seconds, 0.0
        async with httpx.AsyncClient(base_url=address) as client:
            named = (await client.get("/api/objects")).json()["objects"][0]["name"]
            shape = (await client.get(f"/api/objects/{named}")).json()
            faces = [face for face in shape["faces"] if not face["blank"]]
            while time.monotonic() < end:
                face = rng.choice(faces)
                x, y = rng.choice(face["centres"])
                touch = {"object": named, "face": face["name"], "x_mm": x, "y_mm": y,
                         "theta_deg": rng.uniform(-180, 180)}  # fmt: skip
                await client.post("/api/touch", json=touch)
                await asyncio.sleep(3)
                if time.monotonic() > due:
                    due = time.monotonic() + 60
                    print(f"  {meter.memory_mb():.0f} MB", flush=True)

    with served(database, "touch:?rate=100") as (address, pid):
        meter = Meter(pid)
        asyncio.run(one(address))
        print(f"{seconds:.0f} s of touches at 100 Hz: {meter}")


def main():
    """Print the figures; `--round NAME` a round object, `--deaf` pages that never read."""
    given = runner.asked(
        __doc__, database="lab.db", seconds=15.0, rates=[50.0, 100.0, 200.0], touches=20, round="",
        pages=[0, 1, 20], deaf=64, soak=0.0,
    )  # fmt: skip
    rng = random.Random(1)
    print(f"the page: {sum(file.stat().st_size for file in STATIC.iterdir()) / 1000:.0f} kB")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        for rate in given.rates:
            at_rate(browser, given.database, rate, given.seconds)
        if given.touches:
            with (
                served(given.database, "touch:?hold=0.6") as (address, _),
                opened(browser, address) as page,
            ):
                touches(page, given.touches, rng)
                if given.round:
                    mantle(page, given.database, given.round, given.touches, rng)
        browser.close()
    if given.soak:
        soak(given.database, given.soak)
    for pages in given.pages:
        many(given.database, pages, min(given.seconds, 15.0))
    if given.deaf:
        never_read(given.database, given.deaf, given.seconds)


if __name__ == "__main__":
    main()
