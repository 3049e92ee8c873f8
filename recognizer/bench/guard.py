"""Who may ask, from where, and how much; and what the page may load.

Local by default: on a loopback address only names of this machine are answered, so that no
foreign name can be led here; elsewhere every request needs the token. Whatever changes
something, and the live line, must come from the page itself (`Origin`). Bodies are bounded,
and the page may load nothing from anywhere else.
"""

from __future__ import annotations

import hmac
import ipaddress
import json
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from starlette.requests import ClientDisconnect

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

COOKIE = "open-bench"
BODY = 64 * 1024  #: bytes of a request
UPLOAD = 64 * 1024 * 1024  #: bytes of a recording that is sent in
UPLOADS = "/api/recordings"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-cache"),
)
_SAFE = ("GET", "HEAD")


@dataclass(frozen=True, slots=True)
class Rules:
    """What is let in."""

    hosts: frozenset[str]  #: names that a request may be for; empty: any (a token guards)
    token: str = ""  #: empty: none is asked for
    body: int = BODY
    upload: int = UPLOAD


def is_loopback(host: str) -> bool:
    """Tell whether an address is reached from this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def rules_for(host: str, token: str) -> Rules:
    """Return the rules of a server that listens on this address."""
    if is_loopback(host):
        return Rules(frozenset({"localhost", "127.0.0.1", "::1", host}), token)
    return Rules(frozenset(), token)


class Guard:
    """The rules before an application (ASGI)."""

    def __init__(self, app: App, rules: Rules) -> None:
        self._app, self._rules = app, rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._refusal(scope, headers)
        if refusal is not None:
            status, cause, fix = refusal
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008, "reason": cause})
            else:
                await _say(send, status, cause, fix)
            return
        if scope["type"] == "websocket":
            await self._app(scope, receive, send)
            return
        token = self._given_in_address(scope)
        if token:
            await _let_in(send, token)
            return
        bounded = _Bounded(receive, send, self._limit(scope))
        try:
            await self._app(scope, bounded.receive, bounded.send)
        except ClientDisconnect:
            if not bounded.refused:
                raise

    def _refusal(self, scope: Scope, headers: dict[bytes, str]) -> tuple[int, str, str] | None:
        host = headers.get(b"host", "")
        name = urlsplit(f"//{host}").hostname if _is_host(host) else None
        if not name or (self._rules.hosts and name not in self._rules.hosts):
            return 421, "this server has another name", "open it by its own address"
        live = scope["type"] == "websocket"
        origin = headers.get(b"origin")
        foreign = origin is not None and urlsplit(origin).netloc != host
        if foreign or (live and origin is None):
            return 403, "a request from another page", "open the bench's own page"
        if not live and scope["method"] not in _SAFE and headers.get(b"sec-fetch-site") in (
            "cross-site", "same-site",
        ):  # fmt: skip
            return 403, "a request from another page", "open the bench's own page"
        if not self._known(scope, headers):
            return 401, "the token is missing or wrong", "open the address that open-bench printed"
        if not live and _length(headers) > self._limit(scope):
            return 413, f"more than {self._limit(scope):,} bytes", "send less"
        return None

    def _known(self, scope: Scope, headers: dict[bytes, str]) -> bool:
        wanted = self._rules.token
        if not wanted:
            return True
        scheme, _, bearer = headers.get(b"authorization", "").partition(" ")
        given = [bearer] if scheme.lower() == "bearer" else []
        given += list(_cookies(headers))
        given += [self._given_in_address(scope)]
        return any(hmac.compare_digest(one.encode(), wanted.encode()) for one in given)

    def _given_in_address(self, scope: Scope) -> str:
        """Return the token of the address that open-bench prints; the cookie takes its place."""
        if not self._rules.token or scope["type"] != "http" or scope["path"] != "/":
            return ""
        query = parse_qs(bytes(scope["query_string"]).decode("latin-1"))
        return query.get("token", [""])[0]

    def _limit(self, scope: Scope) -> int:
        uploading = scope["method"] == "POST" and scope["path"] == UPLOADS
        return self._rules.upload if uploading else self._rules.body


class _Bounded:
    """A conversation whose body ends where its limit is, with the headers of every answer."""

    def __init__(self, receive: Receive, send: Send, limit: int) -> None:
        self._receive, self._send, self._limit, self._came = receive, send, limit, 0
        self.refused = False

    async def receive(self) -> Message:
        message = await self._receive()
        self._came += len(message.get("body", b""))
        if self._came > self._limit and not self.refused:
            self.refused = True
            await _say(self._send, 413, f"more than {self._limit:,} bytes", "send less")
        return {"type": "http.disconnect"} if self.refused else message

    async def send(self, message: Message) -> None:
        if self.refused:
            return
        if message["type"] == "http.response.start":
            there = {name.lower() for name, _ in message.get("headers", [])}
            more = [pair for pair in HEADERS if pair[0] not in there]
            message["headers"] = [*message.get("headers", []), *more]
        await self._send(message)


def _is_host(host: str) -> bool:
    return bool(host) and not set(host) & set("/\\@ ?#")


def _length(headers: dict[bytes, str]) -> int:
    given = headers.get(b"content-length", "0")
    return int(given) if given.isascii() and given.isdecimal() and len(given) < 19 else 2**63


def _cookies(headers: dict[bytes, str]) -> Iterable[str]:
    jar: SimpleCookie = SimpleCookie()
    try:
        jar.load(headers.get(b"cookie", ""))
    except CookieError:
        return []
    return [jar[COOKIE].value] if COOKIE in jar else []


async def _say(send: Send, status: int, cause: str, fix: str) -> None:
    body = json.dumps({"error": {"cause": cause, "fix": fix}}).encode()
    headers = [(b"content-type", b"application/json"), *HEADERS]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


async def _let_in(send: Send, token: str) -> None:
    """Keep the token in a cookie that only this page gets, and take it off the address."""
    cookie = f"{COOKIE}={token}; Path=/; HttpOnly; SameSite=Strict"
    headers = [(b"location", b"/"), (b"set-cookie", cookie.encode()), *HEADERS]
    await send({"type": "http.response.start", "status": 303, "headers": headers})
    await send({"type": "http.response.body", "body": b""})
