"""Figures of `open-bench`: rates, latency, CPU, memory, many pages, stale pictures.

    python tests/bench/open_bench.py --database lab.db [--touches 40]
    python tests/bench/open_bench.py --database lab.db --rates --touches 0 --pages --soak 600

Server, browser (software drawing) and the simulated probe share the machine; CPU is that of the
server's process, in percent of one core, without the browser. The database needs an object. A
picture is stale that shows an answer, a lit face or a pose while the touch at hand is not read yet:
every picture that the browser paints is looked at.
"""

import asyncio
import json
import random
import statistics
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import httpx
from playwright.sync_api import sync_playwright
from websockets.asyncio.client import connect

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner
from bench_loads import cpu_s, memory_mb
from bench_page import CHROMIUM, FLAGS, WATCH, opened, rest, running, touched

STATIC = Path(__file__).parents[2] / "recognizer" / "bench" / "static"


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
    """CPU and memory of a server, since it was begun."""

    def __init__(self, pid):
        self.pid, self.cpu_s, self.began_s = pid, cpu_s(pid), time.monotonic()

    def __str__(self):
        used = 100 * (cpu_s(self.pid) - self.cpu_s) / (time.monotonic() - self.began_s)
        return f"server CPU {used:.1f} %, memory {memory_mb(self.pid):.0f} MB"


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


def touches(page, number, rng):
    """Print stale pictures, and the time from a click to its answer."""
    name = page.evaluate("bench.shown")
    rest(page)
    first = page.evaluate("bench.touch")
    page.evaluate(WATCH)
    page.evaluate("bench.click_ms.length = 0")
    for _ in range(number):
        touched(page, rng.uniform(0.38, 0.6), rng.uniform(0.4, 0.65))
        rest(page)
    seen = page.evaluate("window.seen")
    new = [one for one in seen if one[0] > first and one[1] in ("felt", "reading")]
    stale = [one for one in new if one[2] or one[4] or name in one[3]]
    print(f"{number} touches, {len(seen):,} pictures, {len(new)} of touches not read yet; "
          f"stale: {len(stale)} pictures, {sum(one[5] for one in stale):.0f} ms\n"
          f"click to answer: {spread(page.evaluate('bench.click_ms'))}")  # fmt: skip


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


def soak(database, seconds):
    """Print CPU and memory, minute by minute, while one page listens and touches go on."""
    rng, end_s = random.Random(1), time.monotonic() + seconds
    with (
        served(database, "touch:?rate=100") as (address, pid),
        httpx.Client(base_url=address) as client,
        ThreadPoolExecutor(1) as pool,
    ):
        meter, told_s = Meter(pid), 0.0
        pool.submit(asyncio.run, listen(address, seconds))
        name = client.get("/api/objects").json()["objects"][0]["name"]
        faces = [one for one in client.get(f"/api/objects/{name}").json()["faces"]
                 if not one["blank"]]  # fmt: skip
        while time.monotonic() < end_s:
            face = rng.choice(faces)
            x, y = rng.choice(face["centres"])
            place = {"x_mm": x, "y_mm": y, "theta_deg": rng.uniform(-180, 180)}
            client.post("/api/touch", json={"object": name, "face": face["name"], **place})
            time.sleep(3)
            if time.monotonic() > told_s + 60:
                told_s = time.monotonic()
                print(f"  {meter}", flush=True)
        print(f"{seconds:.0f} s of touches at 100 Hz: {meter}")


def main():
    """Print the figures."""
    given = runner.asked(
        __doc__, database="lab.db", seconds=15.0, rates=[50.0, 100.0, 200.0], touches=20,
        pages=[0, 1, 20], soak=0.0,
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
        browser.close()
    if given.soak:
        soak(given.database, given.soak)
    for pages in given.pages:
        many(given.database, pages, min(given.seconds, 15.0))


if __name__ == "__main__":
    main()
