"""Requests to the page."""

import asyncio
import json
import random
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from encoded_objects.base.errors import EncodedObjectsError
from foreign.case import FIXTURES, LONGEST_S, SECRET, FaultError, Kind, kept
from foreign.damage import WORDS, anything, mutated, written_json
from foreign.databases import labs
from foreign.recordings import recorded_files, write_recording
from foreign.texts import state_text


class Page:
    """The application of a session behind its guard, asked without a server."""

    def __init__(self, folder):
        from encoded_objects.base.sensor_type import SensorType
        from recognizer.bench.app import application
        from recognizer.bench.broker import Broker
        from recognizer.bench.guard import RequestGuard, access_rules
        from recognizer.bench.routes import api_routes
        from recognizer.bench.session import Session

        folder.mkdir()
        (folder / "secret.txt").write_bytes(SECRET)
        (folder / "lab.db").write_bytes(labs()["lab"])
        for name in (kept()[0] / "lab").glob("*.stl"):
            shutil.copyfile(name, folder / name.name)
        (folder / "recordings").mkdir()
        (folder / "recordings" / "a.h5").write_bytes(recorded_files()["ours"])
        calibration = (FIXTURES / "recordings" / "calibration.json").read_bytes()
        (folder / "recordings" / "c.json").write_bytes(calibration)
        (folder / "recordings" / "link.h5").symlink_to("../secret.txt")
        (folder / "recordings" / "s.state.json").write_text(state_text())
        broker = Broker()
        self.session = Session(str(folder / "lab.db"), folder / "recordings", SensorType(), broker)
        app = application(self.session, broker, (("sim:touch", "simulated"),), None)
        self.session.open("sim:touch")
        made = [*api_routes(self.session, (), None).routes, *app.routes]
        self.routes = [(one.path, sorted(getattr(one, "methods", None) or ["GET"]))
                       for one in made if hasattr(one, "path")]  # fmt: skip
        self._app = RequestGuard(app, access_rules("127.0.0.1", ""))
        self._loop = asyncio.new_event_loop()
        self._life = app.router.lifespan_context(app)
        self._loop.run_until_complete(self._life.__aenter__())

    def ask(self, scope, bodies):
        """Return the messages of the answer."""
        sent: list[dict[str, Any]] = []
        kind = scope["type"]
        coming = list(bodies)

        async def receive() -> dict[str, Any]:
            if coming:
                return coming.pop(0)
            if kind == "websocket":
                await asyncio.sleep(0.02)
            elif bodies[-1].get("more_body") is not True:  # the asker stays for the answer
                await asyncio.Event().wait()
            return {"type": f"{kind}.disconnect", "code": 1001}

        async def send(message: Any) -> None:
            sent.append(dict(message))

        self._loop.run_until_complete(asyncio.wait_for(self._app(scope, receive, send), LONGEST_S))
        return sent

    def close(self):
        """End the session."""
        self._loop.run_until_complete(self._life.__aexit__(None, None, None))
        self._loop.close()
        self.session.close()


BODIES: dict[str, Any] = {
    "/api/port": {"url": "sim:touch", "sensor": 0}, "/api/sensor": {"sensor": 0},
    "/api/bias": {"on": True}, "/api/record": {"on": False}, "/api/scan": {"on": True},
    "/api/replay": {"name": "a.h5", "playing": True, "speed": 1.0, "at_s": 0.0},
    "/api/calibration": {"do": "begin", "newtons": [1.0, 2.0], "seconds": 1.0, "name": "c.json"},
    "/api/flip": {"changes": "columns"}, "/api/learned": {"do": "use", "name": "s.state.json"},
    "/api/mounting": {"touch": 1, "object": "Cube", "face": "F1"},
    "/api/as-built": {"do": "estimate", "after": 0, "material": "PLA"},
    "/api/touch": {"object": "Cube", "face": "F1", "x_mm": 30.0, "y_mm": 30.0, "force_n": 40.0},
    "/api/make/try": {"name": "Cube", "spec": "name: Cube\nshape: {cube: 40 mm}\n", "keep": False},
    "/api/load": {"newtons": 3.0}, "/api/unplug": {"seconds": 0.0},
    "/api/touches/{number}": {"name": "mine"},
}  # fmt: skip
NAMES = ("Cube", "Box", "a.h5", "link.h5", "..%2fsecret.txt", "../../secret.txt", "%2e%2e%2flab.db",
         "lab.db", "c.json", "0", "1", "-1", "99999999999999999999", "1e3", "F1", "x" * 3000,
         "é", "%00", "%ff", "a.h5%00.txt", "..", ".", "", "nan", "' or 1=1 --", "app.js",
         "index.html", "recordings%5ca.h5", "//etc/passwd", "con", "C:%5cx.h5")  # fmt: skip


def write_request(rng, _folder):
    """Return a request that the page would not make: method, address, headers, bodies."""
    made: dict[str, Any] = {"seed": rng.randrange(2**32), "kind": "http"}
    headers = {"host": "127.0.0.1:8080"}
    do = rng.random()
    if do < 0.12:
        name = rng.choice(("host", "origin", "content-length", "cookie", "authorization", "range",
                           "accept-encoding", "if-none-match", "if-modified-since", "content-type",
                           "sec-fetch-site", "x" * 3000, "if-range",
                           "transfer-encoding"))  # fmt: skip
        headers[name] = rng.choice(("[", "http://[", "[::1", "[::1]:8080", "127.0.0.1:8080:1", "::",
                                    "http://127.0.0.1:8080", "null", "bytes=0-,1-,2-,3-", "é",
                                    "bytes=-99999999999", "bytes=5-1", "gzip;q=nan", "-1", "1e9",
                                    "127.0.0.1:99999999", "127.0.0.1:x", "a b", "http://[::1]:x",
                                    "Bearer é", "application/json; charset=utf-99", "\t", "%",
                                    "http://127.0.0.1:8080@evil", *WORDS[:9]))  # fmt: skip
    made["headers"] = headers
    made["live"] = rng.random() < 0.1
    made["gone"] = rng.random() < 0.03  # before the body ended
    if made["live"]:
        headers.setdefault("origin", "http://127.0.0.1:8080")
    made["words"] = [
        rng.choice((
            lambda: json.dumps({"filter": rng.choice(("raw", "median", "sobel", "evil", None, 3))}),
            lambda: json.dumps(anything(rng)), lambda: "x" * 5000, lambda: "[" * 1000,
            lambda: '{"filter": ["raw"]}', lambda: '{"filter": {"a": 1}}', lambda: "1" * 999,
            lambda: b"bytes", lambda: "", lambda: "\ud800",
        ))() for _ in range(rng.choice((0, 1, 2)))
    ]  # fmt: skip
    made["upload"] = None
    if rng.random() < 0.05:
        folder = Path(tempfile.mkdtemp())
        path = write_recording(rng, folder)[0]
        made["upload"] = path.read_bytes()[: 1 << 20]
        shutil.rmtree(folder)
    return made


PAGE: list[Page] = []


def read_request(made, out):
    """Ask the page; no answer is an error of the server, none holds what is not meant to be."""
    if not PAGE:
        folder = out.parent.parent / "bench"
        shutil.rmtree(folder, ignore_errors=True)
        PAGE.append(Page(folder))
    page, rng = PAGE[0], random.Random(made["seed"])
    path, methods = rng.choice(page.routes)
    template = path
    method = rng.choice((*methods, *methods, *methods, "GET", "POST", "PUT", "OPTIONS", "X"))
    for mark in ("{name}", "{number}", "{number:int}", "{face}", "{path:path}"):
        path = path.replace(mark, rng.choice(NAMES))
    if path == "/static":
        path += "/" + rng.choice(NAMES) * rng.choice((1, 1, 3))
    query = b""
    if rng.random() < 0.1:
        query = rng.choice(
            (b"name=%2e%2e%2fx.h5", b"name=x.h5&name=y.h5", b"=&&", b"%ff", b"a" * 9999)
        )
    body: bytes = rng.choice((b"", b"{", b"null", b"[" * 60_000, b"\xff\xfe", b"{}" * 3))
    if template in BODIES and rng.random() < 0.85:
        value = mutated(rng, BODIES[template])
        body = written_json(rng, value)
    if made["upload"] is not None:
        path, method, body = "/api/recordings", "POST", made["upload"]
        query = b"name=up.h5"
        (page.session.folder / "up.h5").unlink(missing_ok=True)
    headers = dict(made["headers"])
    headers.setdefault("content-type", "application/json")
    raw = [
        (k.encode("latin-1", "replace"), v.encode("utf-8", "replace")) for k, v in headers.items()
    ]
    from urllib.parse import unquote

    scope = {
        "type": "http", "method": method, "path": unquote(path, errors="replace"),
        "raw_path": path.encode(), "query_string": query, "headers": raw, "scheme": "http",
        "http_version": "1.1", "server": ("127.0.0.1", 8080), "client": ("127.0.0.1", 5),
        "root_path": "",
        "asgi": {"version": "3.0"}, "extensions": {}, "subprotocols": [],
    }  # fmt: skip
    bodies: list[Any] = [{"type": "http.request", "body": body, "more_body": made["gone"]}]
    if made["live"]:
        scope |= {"type": "websocket", "path": "/live", "scheme": "ws"}
        bodies = [{"type": "websocket.connect"}] + [
            {"type": "websocket.receive", "bytes" if isinstance(word, bytes) else "text": word}
            for word in made["words"]
        ]
    sent = page.ask(scope, bodies)
    held = b"".join(m.get("body", b"") or b"" for m in sent)
    if b"kept to itself" in held or held.startswith((b"SQLite format", b"root:")):
        raise FaultError("leak", f"{method} {path[:60]}")
    status = [m["status"] for m in sent if m["type"] == "http.response.start"]
    if not status and (made["live"] or made["gone"]):
        return
    if len(status) != 1 or (status[0] >= 500 and status[0] != 503):
        raise AssertionError(f"{method} {template}: {status}")
    if status[0] >= 400:
        said: Any = held.decode("utf-8", "replace")  # text of the framework's: a malformed range
        with suppress(ValueError):
            said = json.loads(said)
        raise EncodedObjectsError(str(said)[:80], fix="-", place=path)


KINDS = {
    "page": Kind(write_request, read_request, file=False, sound=(labs, recorded_files, state_text))
}
