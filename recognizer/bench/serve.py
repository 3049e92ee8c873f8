"""From the command's options to a server that runs: session, routes, guard, uvicorn."""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import logging
import os
import re
import secrets
import signal
import socket
import sys
import threading
import time
from contextlib import suppress
from types import FrameType
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from encoded_objects.base.network import is_loopback
from encoded_objects.base.sensor_type import choose_sensor_type
from generator.database import DatabaseError
from generator.database.open import database_exists
from probe.errors import ProbeError
from recognizer.bench.app import application
from recognizer.bench.broker import Broker
from recognizer.bench.errors import BenchError
from recognizer.bench.guard import RequestGuard, access_rules
from recognizer.bench.options import LAB, BenchOptions
from recognizer.bench.session import Session

SOFTWARE = ("sim:touch", "Simulated probe: click on the part")
PATTERN = ("sim:", "Moving pattern")

CONNECTIONS = 900  #: open at once, below the files that a process may have open
REQUEST_S = 5.0  #: that a connection may take for the head of its next request
UNREAD_MS = 30_000  #: after which a connection is cut whose other side takes nothing
ORDERLY_S, CLOSING_S = 1.5, 0.1  #: after a signal: to end in order; then for each thread

_TOKEN = re.compile(r"[A-Za-z0-9_-]{12,200}")


def serve(options: BenchOptions) -> int:
    """Serve until interrupted; returns the exit code.

    Raises BenchError, DatabaseError, ProbeError: an option cannot be met.
    """
    if options.token and not _TOKEN.fullmatch(options.token):
        raise BenchError(
            "this token can be guessed, or cannot stand in an address",
            fix="give 12 or more of letters, digits, - and _, or none: one is made",
        )
    _check_folders(options)
    chosen = choose_sensor_type(options.sensor_type, "", None, "--sensor-type")
    sensor = chosen.with_overlay(options.overlay)
    database = _database(options.database)
    token = options.token or ("" if is_loopback(options.host) else secrets.token_urlsafe(18))
    line = _open_socket(options.host, options.web_port)
    before = signal.signal(signal.SIGTERM, _end)
    broker = Broker()
    session = Session(database, options.folder, sensor, broker)
    try:
        if options.port or session.database:
            session.open(options.port or SOFTWARE[0])
        app = application(session, broker, _ports(options.port), options.parts)
        config = uvicorn.Config(
            RequestGuard(app, access_rules(options.host, token)),
            log_level="warning", access_log=False, server_header=False,
            ws_max_size=4096, ws_per_message_deflate=False, ws_ping_interval=20.0,
            timeout_graceful_shutdown=1, limit_concurrency=CONNECTIONS,
            http=_IdleTimeout,
        )  # fmt: skip
        logging.getLogger("uvicorn.error").addFilter(_is_no_bad_text)
        server = uvicorn.Server(config)
        end = server.handle_exit

        def begin_ending(number: int, frame: FrameType | None) -> None:
            session.end()
            logging.getLogger("uvicorn.error").disabled = True  # what is cut off is meant to be
            threading.Thread(target=_end_by_force, args=(session,), daemon=True).start()
            end(number, frame)

        server.handle_exit = begin_ending
        sys.stdout.write(_address(options.host, line.getsockname()[1], token) + "\n")
        sys.stdout.flush()
        server.run(sockets=[line])
    except KeyboardInterrupt:  # how it is ended
        sys.stderr.write("open-bench: ended\n")
    finally:
        signal.signal(signal.SIGTERM, before)
        session.close()
        line.close()
    return 0


def _check_folders(options: BenchOptions) -> None:
    """Refuse a folder that cannot be one, and parts that are not there."""
    folder = options.folder.absolute()
    if not next(place for place in (folder, *folder.parents) if place.exists()).is_dir():
        raise BenchError(
            "a file stands where recordings would go", fix="give --folder a folder", place=folder
        )
    if options.parts is not None and not options.parts.is_dir():
        raise BenchError(
            "there is no such folder",
            fix="give --parts the folder of the files",
            place=options.parts,
        )


def _is_no_bad_text(record: logging.LogRecord) -> bool:
    """Leave out of the log, with its traceback, that somebody sent what is no UTF-8."""
    return not str(record.msg).startswith("Invalid UTF-8")


def _end_by_force(session: Session) -> None:
    """End the process if it has not ended by itself: a request may be at work for long."""
    time.sleep(ORDERLY_S)
    session.close(CLOSING_S)
    sys.stderr.write("open-bench: ended; what was asked for last was not completed\n")
    os._exit(0)


class _IdleTimeout(H11Protocol):  # type: ignore[misc]  # uvicorn has no types
    """Close connections on which nothing is answered and no whole request comes (slow loris).

    uvicorn bounds the silence between two requests alone, neither the first nor a slow one.
    """

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._watch()

    def data_received(self, data: bytes) -> None:
        """Take what came; a whole request ends the waiting."""
        super().data_received(data)
        self._watch()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        self._watch()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection on, without a deadline."""
        self._cancel()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._cancel()
        super().connection_lost(exc)

    def _watch(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._cancel()
        elif self._deadline is None and self.transport.get_protocol() is self:
            self._deadline = self.loop.call_later(REQUEST_S, self.transport.abort)

    def _cancel(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


def _end(_number: int, _frame: FrameType | None) -> None:
    """Take a request to end like that of the operator, so that what is open is closed."""
    raise KeyboardInterrupt


def _database(url: str) -> str:
    """Return the database, or nothing if none was named and the usual one is not there."""
    try:
        if database_exists(url):
            return url
    except DatabaseError:
        if url != LAB:
            raise
    if url == LAB:
        sys.stderr.write(f"open-bench: there is no {LAB} here; images are shown, not recognised\n")
        return ""
    raise DatabaseError(
        "there is no such database", fix="register an object with encode-object first", place=url
    )


def _ports(port: str) -> tuple[tuple[str, str], ...]:
    always = (SOFTWARE, PATTERN)
    return ((port, port), *always) if port and port not in ("sim:touch", "touch:") else always


def _open_socket(host: str, port: int) -> socket.socket:
    if not host:
        raise BenchError(
            "--host is empty", fix="give 127.0.0.1, or 0.0.0.0 to let other machines in"
        )
    six = ":" in host
    family = socket.AF_INET6 if six else socket.AF_INET
    try:
        line = socket.create_server((host, port), family=family, backlog=128, dualstack_ipv6=six)
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, UNREAD_MS)
        return line
    except (OSError, TypeError) as error:  # TypeError: no host can have such a name
        said, number = getattr(error, "strerror", ""), getattr(error, "errno", -1)
        fix = "give another --web-port; 0 takes any free one"
        if number < 0 or number == errno.EADDRNOTAVAIL:  # below 0: the name has no address
            fix = "give --host an address of this machine: 127.0.0.1, or 0.0.0.0 for all of them"
        cause = f"cannot listen on {host} port {port}: {(said or 'no address').partition(' (')[0]}"
        raise ProbeError(cause, fix=fix) from error


def _address(host: str, port: int, token: str) -> str:
    shown = _reachable(host)
    shown = f"[{shown}]" if ":" in shown else shown
    return f"open-bench: http://{shown}:{port}/" + (f"?token={token}" if token else "")


def _reachable(host: str) -> str:
    """Return an address that others can open, where a server listens on all of them."""
    try:
        if not ipaddress.ip_address(host).is_unspecified:
            return host
    except ValueError:  # a name
        return host
    six = ":" in host
    family, anywhere = (socket.AF_INET6, "2001:db8::1") if six else (socket.AF_INET, "192.0.2.1")
    with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as line:
        line.connect((anywhere, 9))  # chooses the way out; nothing is sent
        return str(line.getsockname()[0])
    return socket.gethostname()
