"""Who is let in: hosts, origins, tokens, sizes; and the command that says so."""

from __future__ import annotations

import asyncio
import socket

import pytest

from encoded_objects.base.network import is_loopback
from recognizer.bench.command import main
from recognizer.bench.guard import AT_ONCE, COOKIE, AccessRules, RequestGuard, access_rules
from recognizer.bench.serve import _address

LOCAL = access_rules("127.0.0.1", "")
OPEN = access_rules("0.0.0.0", "a-long-token")


async def echo(scope, receive, send):
    """Say how many bytes came."""
    came, more = 0, scope["type"] == "http"
    while more:
        message = await receive()
        if message["type"] == "http.disconnect":
            break
        came += len(message.get("body", b""))
        more = message.get("more_body", False)
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": str(came).encode()})


async def answers(
    guard, method="GET", path="/api/x", *, body=(b"",), pause_s=0.0, query="", kind="http",
    **headers,
):  # fmt: skip
    """Return the messages that a guarded application answers with."""
    headers = {"host": "127.0.0.1:8080"} | headers
    scope = {
        "type": kind, "method": method, "path": path, "query_string": query.encode(),
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()],
    }  # fmt: skip
    waiting = [{"type": "http.request", "body": part, "more_body": True} for part in body]
    waiting[-1]["more_body"] = False
    sent = []

    async def receive():
        await asyncio.sleep(pause_s)
        return waiting.pop(0)

    async def send(message):
        sent.append(message)

    await guard(scope, receive, send)
    return sent


def asked(rules, *args, **named):
    return asyncio.run(answers(RequestGuard(echo, rules), *args, **named))


def status(*args, **named):
    return asked(*args, **named)[0]["status"]


def test_loopback_addresses():
    assert all(map(is_loopback, ("127.0.0.1", "127.9.9.9", "::1", "localhost")))
    assert not any(map(is_loopback, ("0.0.0.0", "192.168.1.2", "::", "bench.example")))


@pytest.mark.parametrize(
    ("host", "code"),
    [
        ("127.0.0.1:8080", 200), ("localhost:9", 200), ("[::1]:8080", 200), ("LOCALHOST", 200),
        ("evil.example", 421), ("127.0.0.1.evil.example", 421), ("", 400), ("[", 400), ("]", 400),
        ("[::1", 400), ("[::1]x", 400), ("[evil]", 400), ("127.0.0.1:x", 400), (":8080", 400),
        ("evil.example@127.0.0.1", 400), ("127.0.0.1/evil", 400), ("127.0.0.1\\@evil", 400),
        ("127.0.0.1\x00", 400), ("127.0.0.1\xe9", 400), ("127.0.0.1\n", 400),
    ],
)  # fmt: skip
def test_a_local_server_answers_to_local_names_alone(host, code):
    assert status(LOCAL, host=host) == code
    assert status(OPEN, host=host, authorization="Bearer a-long-token") in (200, code)


@pytest.mark.parametrize(
    ("origin", "code"),
    [
        ("http://127.0.0.1:8080", 200), ("http://127.0.0.1:8081", 403), ("null", 403),
        ("http://evil.example", 403), ("http://localhost:8080", 403),
        *((one, 400) for one in ("http://[", "http://]", "http://[::1", "http://a b", "",
                                 "http://", "//127.0.0.1:8080",
                                 "http://127.0.0.1:8080.evil.example")),
    ],
)  # fmt: skip
def test_other_pages_change_nothing(origin, code):
    assert status(LOCAL, "POST", origin=origin) == code
    (first, *_) = asked(LOCAL, kind="websocket", origin=origin)
    assert (first["type"] == "websocket.close") == (code != 200)


def test_a_token_is_known_by_header_by_cookie_and_by_the_printed_address():
    for code, given in (
        (401, {}), (200, {"authorization": "Bearer a-long-token"}),
        (401, {"authorization": "Bearer a-long-toke"}),
        (401, {"authorization": "Basic a-long-token"}),
        (200, {"cookie": f"a=b; {COOKIE}=a-long-token"}), (401, {"cookie": f"{COOKIE}=other"}),
        (401, {"query": "token=a-long-token"}),  # only on the page itself
        (401, {"path": "/", "query": "token="}),
        (200, {"host": "bench.example", "authorization": "Bearer a-long-token"}),
    ):  # fmt: skip
        assert status(OPEN, **given) == code
    start, _ = asked(OPEN, path="/", query="token=a-long-token")
    headers = dict(start["headers"])
    assert (start["status"], headers[b"location"]) == (303, b"/")
    assert b"HttpOnly" in headers[b"set-cookie"]
    assert b"SameSite=strict" in headers[b"set-cookie"]


@pytest.mark.parametrize("length", ["101", "99999999999999999999999", "-1", "ten", "1_0", "²"])
def test_a_declared_length_beyond_the_limit_is_refused_before_it_comes(length):
    rules = AccessRules(frozenset({"127.0.0.1"}), body=100)
    sent = asked(rules, "POST", content_length=length)
    assert [sent[0]["status"], len(sent)] == [413, 2]


def test_a_body_that_grows_beyond_the_limit_ends_there():
    rules = AccessRules(frozenset({"127.0.0.1"}), body=100, upload=300)
    assert asked(rules, "POST", body=(b"x" * 60, b"x" * 40))[1]["body"] == b"100"
    sent = asked(rules, "POST", body=(b"x" * 60, b"x" * 41, b"x" * 1000))
    assert [sent[0]["status"], len(sent)] == [413, 2]  # and nothing after it
    assert asked(rules, "POST", "/api/recordings", body=(b"x" * 300,))[1]["body"] == b"300"


def test_a_body_that_drips_is_refused(monkeypatch):
    monkeypatch.setattr("recognizer.bench.guard.BODY_S", 0.05)
    sent = asked(LOCAL, "POST", body=(b"x",) * 1000, pause_s=0.01)
    assert [sent[0]["status"], len(sent)] == [408, 2]


def test_requests_of_a_kind_are_answered_a_few_at_a_time():
    """Others wait without a thread, and other kinds do not wait for them."""
    working, most, go_on = 0, 0, asyncio.Event()

    async def work(scope, receive, send):
        nonlocal working, most
        working, most = working + 1, max(most, working + 1)
        if scope["path"].startswith("/api/touch"):
            await go_on.wait()
        working -= 1
        await echo(scope, receive, send)

    async def ask_all():
        guard = RequestGuard(work, LOCAL)
        waiting = [asyncio.create_task(answers(guard, path=f"/api/touch/{i}")) for i in range(20)]
        while working < AT_ONCE:
            await asyncio.sleep(0)
        await answers(guard, path="/api/load")  # which is answered meanwhile
        assert not any(task.done() for task in waiting)
        go_on.set()
        return [sent[0]["status"] for sent in await asyncio.gather(*waiting)]

    assert asyncio.run(ask_all()) == [200] * 20
    assert most == AT_ONCE + 1


def refused(capsys, *words):
    """Run the command, which refuses; returns what it said."""
    with pytest.raises(SystemExit) as leaving:
        main([*words, "--web-port", "0"] if "--web-port" not in words else list(words))
    said = capsys.readouterr().err
    assert (leaving.value.code, "Traceback" in said) == (2, False)
    return said


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--token", "short", "12 or more"), ("--token", "a;b=c, with spaces in it", "12 or more"),
        ("--port", "touch:?rate=0", "give 1 to 500"), ("--port", "file:none.h5", "none.h5"),
        ("--host", "", "127.0.0.1"), ("--host", "999.1.1.1", "not known\n  fix: give --host"),
        ("--host", "192.0.2.1", "address\n  fix: give --host"), ("--host", "\xfc..b", "no address"),
        ("--folder", "spec/recordings", "a file stands where"),
        ("--parts", "spec", "no such folder\n  fix: give --parts"),
    ],
)  # fmt: skip
def test_what_cannot_be_met_is_refused(option, value, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec").touch()
    assert said in refused(capsys, option, value)


def test_a_port_of_the_page_that_is_taken(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.create_server(("127.0.0.1", 0)) as other:
        assert "--web-port" in refused(capsys, "--web-port", str(other.getsockname()[1]))


def test_the_address_that_is_printed():
    assert _address("127.0.0.1", 8080, "") == "open-bench: http://127.0.0.1:8080/"
    assert _address("fd00::1", 80, "secret") == "open-bench: http://[fd00::1]:80/?token=secret"
    for everywhere in ("::", "0.0.0.0"):
        told = _address(everywhere, 80, "secret")
        assert told.startswith("open-bench: http://")
        assert everywhere not in told.split(":80/")[0].split("//")[1].strip("[]").split()
