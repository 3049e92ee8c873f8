"""Who must not get at `open-bench`: other pages and names, paths that lead out, floods, files."""

import json
import socket
import time
from contextlib import suppress

import httpx
import pytest
from hostile_recordings import HOSTILE, SECRET, write_hostile
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from recognizer.command import run as recognize_object

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
        for code, headers in (
            (403, {"origin": "http://evil.example"}), (403, {"sec-fetch-site": "cross-site"}),
            (400, {"origin": f"http://{host}.evil.example"}), (400, {"host": "[::1"}),
            (421, {"host": "evil.example"}),
        ):  # fmt: skip
            assert status("POST", "/api/touch", json=touch, headers=headers) == code
        assert status("POST", "/api/port", json={"url": "file:/etc/passwd"}) == 404
        assert status("POST", "/api/port", json={"url": f"serial://{lab}/lab.db"}) == 404
        assert status("POST", "/api/touch", json=touch | {"z": 1}) == 422
        kind = {"content-type": "application/json"}
        assert status("POST", "/api/touch", content=b"{" * 10, headers=kind) == 422
        assert status("POST", "/api/touch", json=touch | {"x_mm": 1e9}) == 400
        assert status("POST", "/api/touch", content=(b" " * 1000 for _ in range(70))) == 413
        assert status("POST", "/api/recordings?name=..%2Fx.h5", content=b"x") == 404
        assert status("POST", "/api/recordings?name=x.h5", content=b"no recording") == 400
        assert not (lab / "recordings" / "x.h5").exists()
        for host_name in (host, "evil.example"):
            headers = client.get("/", headers={"host": host_name}).headers
            policy = headers["content-security-policy"]
            assert "default-src 'none'" in policy
            assert "script-src 'self'" in policy
            assert "unsafe" not in policy
            assert headers["x-content-type-options"] == "nosniff"
        assert status("GET", "/api/bench") == 200
    head = f"POST /api/recordings?name=b.h5 HTTP/1.1\r\nhost: {host}\r\ncontent-length: {2**40}"
    with socket.create_connection(host.split(":"), timeout=PATIENCE_S) as line:
        line.sendall(f"{head}\r\n\r\n".encode())  # refused before a byte of it is sent
        assert line.recv(12) == b"HTTP/1.1 413"


@pytest.mark.parametrize("origin", [None, "http://evil.example"])
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


def refused(answer, kind):
    assert answer.status_code == 400, answer.text
    error = answer.json()["error"]
    assert HOSTILE[kind][1] in error["cause"]
    assert error["fix"]
    return error["place"]


def test_recordings_that_mean_harm_are_refused(bench, lab):
    (lab / SECRET).write_bytes(b"kept to itself " * 80)
    kept, before = lab / "recordings", sorted((lab / "recordings").iterdir())
    with httpx.Client(base_url=bench, timeout=PATIENCE_S) as client:
        for kind in HOSTILE:
            content = write_hostile(kind, lab / "mine.h5").read_bytes()
            sent = client.post("/api/recordings", params={"name": "sent.h5"}, content=content)
            assert refused(sent, kind) == "sent.h5"
            assert sorted(kept.iterdir()) == before
            (lab / "mine.h5").rename(kept / "mine.h5")  # by another way, or an earlier version
            assert refused(client.post("/api/replay", json={"name": "mine.h5"}), kind)
            assert client.post("/api/port", json={"url": "sim:"}).status_code == 200
            (kept / "mine.h5").unlink()


def test_recognize_object_refuses_them(lab, tmp_path, capsys, monkeypatch):
    kind = "external storage in a group"
    monkeypatch.chdir(tmp_path)
    write_hostile(kind, tmp_path / "a.h5")
    for words in (("a.h5",), ("check", "a.h5", "--at", "Cube/F1"), ("--port", "file:a.h5")):
        assert recognize_object([*words, "--database", str(lab / "lab.db")]) == 2, words
        err = capsys.readouterr().err
        assert HOSTILE[kind][1] in err
        assert "a.h5" in err
        assert "fix: " in err
