"""Figures of `open-bench`: rates, latency, CPU, memory, many pages, touch to answer.

    python tests/bench/open_bench.py --database lab.db
    python tests/bench/open_bench.py --database lab.db --rates --touches 0 --pages --soak 600

Server, browser (software drawing) and the simulated probe share the machine; CPU is that of the
server's process, in percent of one core, without the browser. The database needs an object.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import httpx
from playwright.sync_api import sync_playwright
from websockets.asyncio.client import connect

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_page import CHROMIUM, FLAGS, until

STATIC = Path(__file__).parents[2] / "recognizer" / "bench" / "static"


@contextmanager
def served(database, *options):
    """Run the server; yields its address and its process."""
    with tempfile.TemporaryDirectory() as folder:
        words = ("--database", database, "--folder", folder, "--web-port", "0", *options)
        command = [sys.executable, "-m", "recognizer.bench.command", *words]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                address = process.stdout.readline().split()[-1]
                while not httpx.get(address + "api/lab").json()["encodings"]:
                    time.sleep(0.2)
                yield address, process.pid
            finally:
                process.terminate()
                process.wait()


def cpu_s(pid):
    """Return the seconds of CPU that a process has taken."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mb(pid):
    """Return the memory that a process holds."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


def at_rates(browser, database, rates, seconds):
    """Print a line per rate of the source."""
    print("source    to page   painted   latency median   p95     server CPU   memory")
    for rate in rates:
        with served(database, "--port", f"touch:?rate={rate}") as (address, pid):
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            asked = []
            page.on("request", lambda request, asked=asked: asked.append(request.url))
            page.goto(address)
            until(page, "bench.shown !== '' && bench.frames > 10")
            time.sleep(2)
            before = page.evaluate("[bench.frames, bench.paints]")
            page.evaluate("bench.latency_ms.length = 0")
            cpu, began = cpu_s(pid), time.monotonic()
            time.sleep(seconds)
            passed = time.monotonic() - began
            frames, paints, late = page.evaluate("[bench.frames, bench.paints, bench.latency_ms]")
            late.sort()
            foreign = [url for url in asked if not url.startswith((address, "ws://" + address[7:]))]
            print(
                f"{rate:3.0f} Hz {(frames - before[0]) / passed:9.1f}/s"
                f" {(paints - before[1]) / passed:8.1f}/s {statistics.median(late):11.1f} ms"
                f" {late[int(0.95 * len(late))]:9.1f} ms {100 * (cpu_s(pid) - cpu) / passed:9.1f} %"
                f" {memory_mb(pid):8.0f} MB   {len(foreign)} requests to others"
            )
            page.close()


def touches(browser, database, number):
    """Print how long a touch takes from the click to its answer on the page."""
    random.seed(1)
    with served(database, "--port", "touch:?hold=0.6") as (address, _):
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(address)
        until(page, "bench.shown !== '' && bench.frames > 10")
        faces = page.locator("#touch-face option").all_inner_texts()
        for i in range(number):
            page.locator("#touch-face").select_option(random.choice(faces))
            page.locator("#touch-theta").fill(str(random.randint(-180, 180)))
            page.locator("#touch button").click()
            until(page, f"bench.click_ms.length > {i}")
            until(page, "bench.contact === false")
        took = sorted(page.evaluate("bench.click_ms"))
        print(f"click to answer on the page: median {statistics.median(took):.0f} ms, "
              f"p95 {took[int(0.95 * len(took))]:.0f} ms, {number} touches")  # fmt: skip
        page.close()


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

    with served(database, "--port", "touch:?rate=100") as (address, pid):
        time.sleep(0 if pages else 8)  # until the port is let go
        cpu, began = cpu_s(pid), time.monotonic()
        got = asyncio.run(all_of_them(address)) if pages else [0.0]
        time.sleep(0 if pages else seconds)
        used = 100 * (cpu_s(pid) - cpu) / (time.monotonic() - began)
        print(f"{pages} pages at 100 Hz: {min(got):.0f} ... {max(got):.0f} frames/s each, "
              f"server CPU {used:.1f} %, memory {memory_mb(pid):.0f} MB")  # fmt: skip


def never_read(database, pages, seconds):
    """Print what pages cost that never read, and what one that reads gets meanwhile."""
    with served(database, "--port", "touch:?rate=100") as (address, pid):
        host = address.split("/")[2]
        name, port = host.split(":")
        deaf = []
        for _ in range(pages):
            line = socket.create_connection((name, int(port)))
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            line.sendall(
                f"GET /live HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n"
                "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
            )
            deaf.append(line)
        before, cpu, began = memory_mb(pid), cpu_s(pid), time.monotonic()
        got = asyncio.run(listen(address, seconds))
        used = 100 * (cpu_s(pid) - cpu) / (time.monotonic() - began)
        print(
            f"{pages} pages that never read, 100 Hz: one that reads gets {got:.0f} frames/s, "
            f"server CPU {used:.1f} %, memory {before:.0f} to {memory_mb(pid):.0f} MB"
        )
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
                    print(f"  {memory_mb(pid):.0f} MB", flush=True)

    with served(database, "--port", "touch:?rate=100") as (address, pid):
        cpu, began = cpu_s(pid), time.monotonic()
        asyncio.run(one(address))
        used = 100 * (cpu_s(pid) - cpu) / (time.monotonic() - began)
        print(f"{seconds:.0f} s of touches at 100 Hz: server CPU {used:.1f} %, "
              f"memory {memory_mb(pid):.0f} MB")  # fmt: skip


def main():
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--database", default="lab.db")
    asked.add_argument("--seconds", type=float, default=15.0)
    asked.add_argument("--rates", type=float, nargs="*", default=[50, 100, 200])
    asked.add_argument("--touches", type=int, default=20)
    asked.add_argument("--pages", type=int, nargs="*", default=[0, 1, 20])
    asked.add_argument("--deaf", type=int, default=64, help="pages that never read")
    asked.add_argument("--soak", type=float, default=0.0, metavar="SECONDS")
    given = asked.parse_args()
    size = sum(file.stat().st_size for file in STATIC.iterdir())
    print(f"the page: {size / 1000:.0f} kB")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        at_rates(browser, given.database, given.rates, given.seconds)
        if given.touches:
            touches(browser, given.database, given.touches)
        browser.close()
    if given.soak:
        soak(given.database, given.soak)
    for pages in given.pages:
        many(given.database, pages, min(given.seconds, 15.0))
    if given.deaf:
        never_read(given.database, given.deaf, given.seconds)


if __name__ == "__main__":
    main()
