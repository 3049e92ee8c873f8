"""Connections that ask for nothing are let go: who opens many and stays silent locks nobody out.

uvicorn bounds the pauses between requests, but not the wait for the first one.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from recognizer.bench.settings import PAGE


class PatientProtocol(H11Protocol):  # type: ignore[misc]  # uvicorn tells no types
    """HTTP on a connection that has to ask for something within `PAGE.silent_s`."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._deadline = self.loop.call_later(PAGE.silent_s, self._give_up)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection on; it is no longer waited for."""
        self._settle()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._settle()
        super().connection_lost(exc)

    def _settle(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _give_up(self) -> None:
        if self.cycle is None and not self.transport.is_closing():
            self.transport.close()
