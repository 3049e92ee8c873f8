"""Who may ask, from where, and how much; and what the page may load.

Local by default: on a loopback address only names of this machine are answered, so that no
foreign name can be led here; elsewhere every request needs the token. Whatever changes
something, and the live line, must come from the page itself (`Origin`). Bodies are bounded in
length and time, requests of one kind are answered a few at a time, and the page may load nothing
from anywhere else.

No library holds these rules: starlette's `TrustedHostMiddleware` answers in plain text and, in
versions that fastapi still admits, cuts a host at its first colon ([::1] becomes [); its CORS
refuses no request; and neither starlette nor uvicorn bounds a body.
"""

from __future__ import annotations

import asyncio
import hmac
import re
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from urllib.parse import urlsplit
from weakref import WeakValueDictionary

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from encoded_objects.base.network import is_loopback
from recognizer.bench.files import UPLOAD

COOKIE = "open-bench"
UPLOADS = "/api/recordings"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-cache",
}
BODY_S = 10.0  #: that the body of a request may take, uploads aside
AT_ONCE = 4
"""Requests of one kind (`/api/touch`) that are answered at a time; others wait.

Each takes a thread of 40: those of one kind leave threads for all others.
"""

_SAFE = ("GET", "HEAD")
_HOST = r"(?:[A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\])(?::[0-9]{1,5})?"
_ORIGIN = re.compile(rf"null|[a-z][a-z0-9+.-]*://{_HOST}")


@dataclass(frozen=True, slots=True)
class AccessRules:
    """What is let in."""

    hosts: frozenset[str]  #: names that a request may be for; empty: any (a token guards)
    token: str = ""  #: empty: none is asked for
    body: int = 64 * 1024  #: bytes of a request
    upload: int = UPLOAD  #: bytes of a recording that is sent in


def access_rules(host: str, token: str) -> AccessRules:
    """Return the rules of a server that listens on this address."""
    if is_loopback(host):
        return AccessRules(frozenset({"localhost", "127.0.0.1", "::1", host}), token)
    return AccessRules(frozenset(), token)


class RequestGuard:
    """The rules before an application (ASGI)."""

    def __init__(self, app: ASGIApp, rules: AccessRules) -> None:
        self._app, self._rules = app, rules
        self._turns: WeakValueDictionary[str, asyncio.Semaphore] = WeakValueDictionary()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        asker = HTTPConnection(scope)
        refusal = self._refusal(asker)
        token = self._given_in_address(asker)
        if scope["type"] == "websocket":
            if refusal is not None:
                await WebSocketClose(1008, refusal[1])(scope, receive, send)
            else:
                await self._app(scope, receive, send)
        elif refusal is not None:
            await _refuse(*refusal)(scope, receive, send)
        elif token:
            await _let_in(token)(scope, receive, send)
        elif scope["method"] == "POST" and scope["path"] == UPLOADS:
            await self._app(scope, receive, _with_headers(send))
        else:
            await self._answer(scope, receive, send)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Wait for the whole body, then for a turn; a body that is slow takes no turn."""
        body, limit = bytearray(), self._rules.body
        try:
            async with asyncio.timeout(BODY_S):
                more = True
                while more:
                    message = await receive()
                    if message["type"] == "http.disconnect":
                        return
                    body += message.get("body", b"")
                    more = message.get("more_body", False)
                    if len(body) > limit:
                        await _refuse(*too_long(limit))(scope, receive, send)
                        return
        except TimeoutError:
            slow = 408, f"the request took more than {BODY_S:g} s to come", "send it at once"
            await _refuse(*slow)(scope, receive, send)
            return
        whole: list[Message] = [{"type": "http.request", "body": bytes(body), "more_body": False}]

        async def replay() -> Message:
            return whole.pop() if whole else await receive()

        kind = "/".join(scope["path"].split("/")[:3])
        turns = self._turns.setdefault(kind, asyncio.Semaphore(AT_ONCE))
        await turns.acquire()
        turn = ExitStack()  # ends with the work: a client that is slow to read keeps none
        turn.callback(turns.release)
        with turn:
            await self._app(scope, replay, _with_headers(send, turn.close))

    def _refusal(self, asker: HTTPConnection) -> tuple[int, str, str] | None:
        """Return status, cause and fix of what is refused."""
        headers = asker.headers
        host, origin = headers.get("host", ""), headers.get("origin")
        if not re.fullmatch(_HOST, host):
            return 400, "the request names no host", "open the address that open-bench printed"
        if origin is not None and not _ORIGIN.fullmatch(origin):
            return 400, "the request comes from no page's address", "open the bench's own page"
        if self._rules.hosts and urlsplit(f"//{host}").hostname not in self._rules.hosts:
            return 421, "this server has another name", "open it by its own address"
        live = asker.scope["type"] == "websocket"
        foreign = origin is not None and urlsplit(origin).netloc != host
        if foreign or (live and origin is None):
            return 403, "a request from another page", "open the bench's own page"
        if not live and asker.scope["method"] not in _SAFE and headers.get("sec-fetch-site") in (
            "cross-site", "same-site",
        ):  # fmt: skip
            return 403, "a request from another page", "open the bench's own page"
        if not self._known(asker):
            return 401, "the token is missing or wrong", "open the address that open-bench printed"
        if not live and _length(headers.get("content-length", "0")) > self._limit(asker.scope):
            return too_long(self._limit(asker.scope))
        return None

    def _known(self, asker: HTTPConnection) -> bool:
        wanted = self._rules.token
        if not wanted:
            return True
        scheme, _, bearer = asker.headers.get("authorization", "").partition(" ")
        given = [bearer] if scheme.lower() == "bearer" else []
        given += [asker.cookies.get(COOKIE, ""), self._given_in_address(asker)]
        return any(hmac.compare_digest(one.encode(), wanted.encode()) for one in given)

    def _given_in_address(self, asker: HTTPConnection) -> str:
        """Return the token of the address that open-bench prints; the cookie takes its place."""
        scope = asker.scope
        if not self._rules.token or scope["type"] != "http" or scope["path"] != "/":
            return ""
        return asker.query_params.get("token", "")

    def _limit(self, scope: Scope) -> int:
        uploading = scope["method"] == "POST" and scope["path"] == UPLOADS
        return self._rules.upload if uploading else self._rules.body


def _with_headers(send: Send, begun: Callable[[], None] = lambda: None) -> Send:
    """Return a way to send that adds the headers of every answer; calls `begun` as it begins."""

    async def send_with(message: Message) -> None:
        if message["type"] == "http.response.start":
            begun()
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with


def _length(given: str) -> int:
    return int(given) if given.isascii() and given.isdecimal() and len(given) < 19 else 2**63


def too_long(limit: int) -> tuple[int, str, str]:
    """Return the refusal of a body beyond a limit, bytes."""
    return 413, f"more than {limit:,} bytes", "send less"


def _refuse(status: int, cause: str, fix: str) -> JSONResponse:
    return JSONResponse({"error": {"cause": cause, "fix": fix}}, status, headers=HEADERS)


def _let_in(token: str) -> RedirectResponse:
    """Keep the token in a cookie that only this page gets, and take it off the address."""
    answer = RedirectResponse("/", 303, headers=HEADERS)
    answer.set_cookie(COOKIE, token, httponly=True, samesite="strict")
    return answer
