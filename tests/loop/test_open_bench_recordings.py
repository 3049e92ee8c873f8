"""Recordings that mean harm, sent to a real server or on its disk; and how fast it ends."""

from __future__ import annotations

import resource
import signal
import subprocess
import threading
import time
from contextlib import contextmanager, suppress

import httpx
import psutil
import pytest
from bench_page import running
from hostile_recordings import HOSTILE, SECRET, write_hostile, write_zeros

from recognizer.command import run as recognize_object

PATIENCE_S = 30.0
SOON_S = 2.0  #: of CPU, as other programs may be at work
LONG = 1_900_000  #: frames, which take 20 s of CPU to read


@contextmanager
def started(folder):
    """Start a server on an empty folder; gives the process and its client."""
    words = ("--folder", "recordings", "--port", "sim:")
    with (
        running(*words, folder=folder, errors=subprocess.DEVNULL) as (address, process),
        httpx.Client(base_url=address, timeout=PATIENCE_S) as client,
    ):
        yield process, client


@pytest.fixture
def folder(tmp_path):
    (tmp_path / SECRET).write_bytes(b"kept to itself " * 80)
    (tmp_path / "recordings").mkdir()
    return tmp_path


def send(client, path):
    """Send a recording in; return the answer."""
    return client.post("/api/recordings", params={"name": "sent.h5"}, content=path.read_bytes())


def refused(answer, kind):
    assert answer.status_code == 400, answer.text
    error = answer.json()["error"]
    assert HOSTILE[kind][1] in error["cause"]
    assert error["fix"]
    return error["place"]


def test_what_means_harm_is_refused_and_the_server_ends(folder):
    kept = folder / "recordings"
    with started(folder) as (process, client):
        for kind in HOSTILE:
            path = write_hostile(kind, folder / "mine.h5")
            assert refused(send(client, path), kind) == "sent.h5"
            assert list(kept.iterdir()) == []
            path.rename(kept / "mine.h5")  # by another way, or from an earlier version
            assert refused(client.post("/api/replay", json={"name": "mine.h5"}), kind)
            assert client.post("/api/port", json={"url": "sim:"}).status_code == 200
            (kept / "mine.h5").unlink()
        seconds, code = ended(process, signal.SIGTERM)
    assert code == 0
    assert seconds < SOON_S


def test_the_server_ends_while_it_reads_long_recordings(folder):
    path = write_zeros(folder / "long.h5", LONG)
    (folder / "recordings" / "long.h5").write_bytes(path.read_bytes())
    with started(folder) as (process, client):
        base = client.base_url

        def ask(where, given):
            with httpx.Client(base_url=base, timeout=PATIENCE_S) as other:
                try:
                    answers.append(other.post(where, **given))
                except httpx.HTTPError as error:  # the line was closed
                    answers.append(error)

        answers = []
        works = (
            ("/api/replay", {"json": {"name": "long.h5"}}),
            ("/api/recordings", {"params": {"name": "a.h5"}, "content": path.read_bytes()}),
        )
        asking = [threading.Thread(target=ask, args=work, daemon=True) for work in works]
        for thread in asking:
            thread.start()
        time.sleep(3.0)
        assert answers == []  # it reads
        seconds, code = ended(process, signal.SIGINT)
        for thread in asking:
            thread.join(PATIENCE_S)
    assert code == 0
    assert seconds < SOON_S
    for answer in answers:
        assert isinstance(answer, httpx.HTTPError) or answer.status_code == 409, answer
    assert [path.name for path in (folder / "recordings").iterdir()] == ["long.h5"]


def test_recognize_object_refuses_it(folder, lab, capsys, monkeypatch):
    kind = "external storage in a group"
    monkeypatch.chdir(folder / "recordings")
    write_hostile(kind, folder / "recordings" / "a.h5")
    for words in (("a.h5",), ("check", "a.h5", "--at", "Cube/F1"), ("--port", "file:a.h5")):
        assert recognize_object([*words, "--database", str(lab / "lab.db")]) == 2, words
        err = capsys.readouterr().err
        assert HOSTILE[kind][1] in err
        assert "a.h5" in err
        assert "fix: " in err


def ended(process, number):
    """Send a signal; return how many seconds of CPU it took to end, and the exit code."""
    others_s = children_s()
    server = psutil.Process(process.pid)
    before_s = sum(server.cpu_times()[:4])
    for child in server.children(recursive=True):
        with suppress(psutil.NoSuchProcess):
            before_s += sum(child.cpu_times()[:4])
    process.send_signal(number)
    code = process.wait(PATIENCE_S)
    return children_s() - others_s - before_s, code


def children_s():
    """Return the CPU seconds of all processes that this one has waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
