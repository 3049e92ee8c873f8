"""Who must not get at `open-bench`: other pages, other names, paths that lead out, floods."""

from __future__ import annotations

import json
import socket
import time
from contextlib import suppress

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

PATIENCE_S = 30.0


@pytest.fixture(scope="module")
def bench(served, tmp_path_factory):
    log = tmp_path_factory.mktemp("hostile") / "log"
    with log.open("w") as errors, served("--port", "touch:", errors=errors) as address:
        yield address
    assert log.read_text() in ("", "open-bench: ended\n")


def test_hostile_requests_are_refused(bench, lab):
    host = bench.split("/")[2]
    with httpx.Client(base_url=bench) as client:

        def status(method, path, **more):
            return client.request(method, path, **more).status_code

        for path in (
            "/static/../../command.py", "/static/%2e%2e/app.py", "/static/..%2f..%2fapp.py",
            "/api/recordings/..%2f..%2fsecret.txt", "/api/recordings/%2e%2e%2flab.db",
            "/api/recordings/lab.db", "/api/objects/Cube/parts/-1", "/api/objects/Cube/parts/999",
            "/api/objects/..%2f..%2fsecret/parts/0", "/etc/passwd", "//etc/passwd",
        ):  # fmt: skip
            answer = client.get(path)
            assert answer.status_code in (400, 404, 422), path
            assert "kept to itself" not in answer.text
        touch = {"object": "Cube", "face": "F1", "x_mm": 30, "y_mm": 30}
        for origin in ("http://evil.example", "null"):
            assert status("POST", "/api/touch", json=touch, headers={"origin": origin}) == 403
        for origin in ("http://[", "http://a b", f"http://{host}.evil.example"):
            assert status("POST", "/api/touch", json=touch, headers={"origin": origin}) == 400
        for name in ("[", "[::1", f"{host}/", f"{host}:"):
            assert status("GET", "/", headers={"host": name}) == 400
        cross = {"sec-fetch-site": "cross-site"}
        assert status("POST", "/api/touch", json=touch, headers=cross) == 403
        assert status("GET", "/", headers={"host": "evil.example"}) == 421
        assert status("POST", "/api/port", json={"url": "file:/etc/passwd"}) == 404
        assert status("POST", "/api/port", json={"url": f"serial://{lab}/lab.db"}) == 404
        assert status("POST", "/api/touch", json=touch | {"z": 1}) == 422
        kind = {"content-type": "application/json"}
        assert status("POST", "/api/touch", content=b"{" * 10, headers=kind) == 422
        assert status("POST", "/api/touch", json=touch | {"x_mm": 1e9}) == 400
        assert status("POST", "/api/touch", content=b" " * 70_000) == 413
        assert status("POST", "/api/touch", content=(b" " * 1000 for _ in range(70))) == 413
        assert status("POST", "/api/recordings?name=..%2Fx.h5", content=b"x") == 404
        assert status("POST", "/api/recordings?name=x.h5", content=b"no recording") == 400
        assert not (lab / "recordings" / "x.h5").exists()
        headers = client.get("/").headers
        assert "script-src 'self'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert status("GET", "/api/bench") == 200
    head = f"POST /api/recordings?name=b.h5 HTTP/1.1\r\nhost: {host}\r\ncontent-length: {2**40}"
    with socket.create_connection(host.split(":"), timeout=PATIENCE_S) as line:
        line.sendall(f"{head}\r\n\r\n".encode())  # refused before a byte of it is sent
        assert line.recv(12) == b"HTTP/1.1 413"


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null"])
def test_the_live_line_is_for_the_page_alone(bench, origin):
    host = bench.split("/")[2]
    with pytest.raises(InvalidStatus), connect(f"ws://{host}/live", origin=origin):
        pass


def test_nonsense_on_the_live_line_ends_it(bench):
    host = bench.split("/")[2]
    for words, text in (
        ("no json", None), (json.dumps({"filter": "evil"}), None), ("x" * 5000, None),
        (b"bytes", None), (b"no \xff UTF-8", True),
    ):  # fmt: skip
        with connect(f"ws://{host}/live", origin=f"http://{host}") as line:
            line.send(words, text=text)
            end_s = time.monotonic() + PATIENCE_S
            with suppress(ConnectionClosed):
                while time.monotonic() < end_s:
                    line.recv(timeout=PATIENCE_S)
            assert time.monotonic() < end_s


def test_silent_connections_lock_nobody_out_and_are_let_go(bench):
    host, port = bench.split("/")[2].split(":")
    silent = []
    try:
        for _ in range(600):
            silent.append(socket.create_connection((host, int(port)), timeout=PATIENCE_S))
        for line in silent[::30]:  # a whole request, then a part of one
            line.sendall(f"GET /api/clock HTTP/1.1\r\nhost: {host}\r\n\r\n".encode())
            while not line.recv(4096).endswith(b"}"):
                pass
            line.sendall(b"GET /api/clo")
        assert httpx.get(f"{bench}api/bench", timeout=PATIENCE_S).status_code == 200
        end_s = time.monotonic() + PATIENCE_S
        for line in silent:
            line.settimeout(max(0.1, end_s - time.monotonic()))
            with suppress(ConnectionResetError):
                assert line.recv(1) == b""  # the other side has closed it
    finally:
        for line in silent:
            line.close()
