"""Loads that hold `open-bench`, and what a server does meanwhile and after a signal.

For the campaign `held.py` and the tests of how the server ends. All is on loopback, and bounded in
number and time.
"""

import os
import signal
import socket
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path

import httpx
from bench_page import running
from hostile_recordings import write_zeros
from programs import wait_for

PATIENCE_S = 20.0  #: for a server that does not end, or answer
LONG = 1_900_000  #: frames, which take 20 s of CPU to read
UPGRADE = (
    "GET /live HTTP/1.1\r\nHost: {0}\r\nOrigin: http://{0}\r\nUpgrade: websocket\r\n"
    "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)
CLOCK = "GET /api/clock HTTP/1.1\r\nHost: {0}\r\n\r\n"
LARGE = "name: Can\nshape: {cylinder: {diameter: 200 mm, height: 240 mm}}\n"  #: 10 s of CPU
TOUCH = {"object": "Cube", "face": "F1", "x_mm": 30, "y_mm": 30}


class Load:
    """A load on a server, which ends with it: sockets, and threads that send without end."""

    def __init__(self, host: str, folder: Path) -> None:
        self.host, self.folder = host, folder
        self.ended = threading.Event()
        self.lines: list[socket.socket] = []

    def connect(self, count: int, first: str = "") -> None:
        """Open lines that send `first`."""
        name, port = self.host.split(":")
        for _ in range(count):
            line = socket.create_connection((name, int(port)), timeout=5.0)
            line.sendall(first.format(self.host).encode())
            self.lines.append(line)

    def drip(self, byte: bytes) -> None:
        """Send a byte on every line, five times a second."""

        def send() -> None:
            while not self.ended.wait(0.2):
                for line in self.lines:
                    with suppress(OSError):
                        line.send(byte)

        threading.Thread(target=send, daemon=True).start()

    def ask(self, count: int, method: str, path: str, **more: object) -> None:
        """Ask for something again and again on so many threads."""

        def send() -> None:
            with httpx.Client(base_url=f"http://{self.host}", timeout=60.0) as client:
                while not self.ended.is_set():
                    with suppress(httpx.HTTPError):
                        client.request(method, path, **more)

        for _ in range(count):
            threading.Thread(target=send, daemon=True).start()

    def close(self) -> None:
        self.ended.set()
        for line in self.lines:
            line.close()


def dripping_heads(load: Load) -> None:
    load.connect(400, CLOCK)
    for line in load.lines:
        line.recv(4096)
        line.send(b"GET /")
    load.drip(b"x")


def dripping_bodies(load: Load) -> None:
    head = "POST /api/touch HTTP/1.1\r\nHost: {0}\r\nContent-Type: application/json\r\n"
    load.connect(400, head + "Content-Length: 60000\r\n\r\n")
    load.drip(b" ")


def dripping_uploads(load: Load) -> None:
    for number in range(4):
        head = f"POST /api/recordings?name=d{number}.h5 HTTP/1.1\r\nHost: {{0}}\r\n"
        load.connect(1, head + "Content-Length: 60000000\r\n\r\n")
    load.drip(b"x")


def uploads(load: Load) -> None:
    content = (load.folder / "recordings" / "long.h5").read_bytes()
    for name in ("a", "b"):
        load.ask(1, "POST", f"/api/recordings?name={name}.h5", content=content)


def playing(load: Load) -> None:
    write_zeros(load.folder / "recordings" / "short.h5", 20_000)
    httpx.post(f"http://{load.host}/api/replay", json={"name": "short.h5"}, timeout=60.0)
    load.connect(20, UPGRADE)


def messages(load: Load) -> None:
    from websockets.sync.client import connect

    def send() -> None:
        with suppress(Exception), connect(
            f"ws://{load.host}/live", origin=f"http://{load.host}"
        ) as line:  # fmt: skip
            while not load.ended.is_set():
                line.send('{"filter": "sobel"}')

    for _ in range(20):
        threading.Thread(target=send, daemon=True).start()


def downloads(load: Load) -> None:
    with (load.folder / "recordings" / "large.h5").open("wb") as file:
        file.truncate(200_000_000)
    load.connect(200, "GET /api/recordings/large.h5 HTTP/1.1\r\nHost: {0}\r\n\r\n")


def asking(*works: tuple[int, str, str], **more: object) -> Callable[[Load], None]:
    """Return a load of requests: on how many threads, method, path."""

    def start(load: Load) -> None:
        for work in works:
            load.ask(*work, **more)

    return start


def connecting(count: int, first: str = "") -> Callable[[Load], None]:
    """Return a load of lines that send `first`, and never read."""
    return lambda load: load.connect(count, first)


MAKE = {"name": "Can", "spec": LARGE, "keep": False}
LOADS: dict[str, Callable[[Load], None]] = {
    "nothing": lambda _: None, "half-open": connecting(800), "dripping heads": dripping_heads,
    "dripping bodies": dripping_bodies, "dripping uploads": dripping_uploads, "uploads": uploads,
    "replays": asking((8, "POST", "/api/replay"), json={"name": "long.h5"}), "playing": playing,
    "promises": asking((40, "GET", "/api/promise/Cube")),
    "example": asking((4, "POST", "/api/example")),
    "making": asking((4, "POST", "/api/make"), (20, "POST", "/api/make/try"), json=MAKE),
    "touches": asking((60, "POST", "/api/touch"), json=TOUCH),
    "loads": asking((60, "POST", "/api/load"), json={"newtons": 100}),
    "sockets": connecting(300, UPGRADE), "messages": messages, "downloads": downloads,
    "pictures": asking((20, "GET", "/api/objects/Cube/picture.svg"),
                       (20, "GET", "/api/objects/Cube")),
    "silent port": connecting(1, UPGRADE),
}  # fmt: skip
EMPTY = ("example",)  #: loads of a server without objects


class Meter:
    """Memory and CPU of a process and its children."""

    def __init__(self, pid: int) -> None:
        self.pid, self.top_mb, self.ended = pid, 0.0, threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def _watch(self) -> None:
        while not self.ended.wait(0.05):
            self.top_mb = max(self.top_mb, sum(map(memory_mb, family(self.pid))))

    def cpu_s(self) -> float:
        return sum(map(cpu_s, family(self.pid)))


def family(pid: int) -> list[int]:
    """Return a process and all that it has begun."""
    known = [pid]
    for one in known:
        with suppress(OSError):  # it has ended meanwhile
            for task in Path(f"/proc/{one}/task").glob("*/children"):
                with suppress(OSError):  # a thread of it
                    known += map(int, task.read_text().split())
    return known


def memory_mb(pid: int) -> float:
    with suppress(OSError, IndexError):
        text = Path(f"/proc/{pid}/status").read_text()
        return int(text.split("VmRSS:")[1].split()[0]) / 1024
    return 0.0


def cpu_s(pid: int) -> float:
    with suppress(OSError):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def held(root: Path, name: str, number: signal.Signals, seconds: float) -> dict[str, object]:
    """Hold a server for some seconds; return the figures."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        (folder / "recordings").mkdir()
        if (root / "long.h5").exists():
            os.link(root / "long.h5", folder / "recordings" / "long.h5")
        words: tuple[object, ...] = () if name in EMPTY else ("--database", root / "lab.db")
        if name == "silent port":
            ends = os.openpty()
            stack.callback(lambda: [os.close(one) for one in ends])
            words += ("--port", f"serial://{os.ttyname(ends[1])}")
        errors = stack.enter_context((folder / "errors.txt").open("w+"))
        address, process = stack.enter_context(running(*words, folder=folder, errors=errors))
        load = Load(address.split("/")[2], folder)
        stack.callback(load.close)
        if name not in EMPTY:
            wait_for(lambda: httpx.get(address + "api/lab").json()["encodings"], PATIENCE_S)
        meter = Meter(process.pid)
        stack.callback(meter.ended.set)
        LOADS[name](load)
        cpu_s, began_s = meter.cpu_s(), time.monotonic()
        time.sleep(seconds)
        asked_s = time.monotonic()
        answered = -1.0
        with suppress(httpx.HTTPError):
            if httpx.get(address + "api/clock", timeout=PATIENCE_S).status_code == 200:
                answered = time.monotonic() - asked_s
        cpu = (meter.cpu_s() - cpu_s) / (time.monotonic() - began_s)
        begun = family(process.pid)
        sent_s = time.monotonic()
        process.send_signal(number)
        try:
            code: object = process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            code = "none"
        ended_s = time.monotonic() - sent_s
        left = [one for one in begun[1:] if Path(f"/proc/{one}").exists()]
        for one in left:
            os.kill(one, signal.SIGKILL)
        errors.seek(0)
        kept = {"long.h5", "short.h5", "large.h5"}
        drafts = [one.name for one in (folder / "recordings").iterdir() if one.name not in kept]
        return {
            "load": name, "signal": number.name, "memory_mb": meter.top_mb, "cpu": cpu,
            "answered_s": answered, "ended_s": ended_s, "code": code, "processes": len(left),
            "files": len(drafts), "tracebacks": errors.read().count("Traceback"),
        }  # fmt: skip
