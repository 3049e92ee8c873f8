"""The newest of every topic, for any number of pages.

Threads publish, pages wait. A page that is slow misses what was replaced meanwhile, and costs
nobody else anything: nothing is queued. Topics are texts (JSON) or pictures that are made for
the page that asks.
"""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

Picture = bytes | Callable[[str], bytes]  #: a message, or what makes it by the name of a filter


@dataclass(slots=True, eq=False)
class Subscriber:
    """One page: what it has seen, and the filter that it wants."""

    filter_name: str = "bias-free"
    seen: dict[str, int] = field(default_factory=dict)
    news: asyncio.Event = field(default_factory=asyncio.Event)


class Broker:
    """The board; `publish` from any thread, the rest on the server's loop."""

    def __init__(self) -> None:
        self._topics: dict[str, tuple[int, str | Picture]] = {}
        self._turn = threading.Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waking = False
        self.subscribers: set[Subscriber] = set()
        self._number = 0

    def attach(self, loop: asyncio.AbstractEventLoop | None) -> None:
        """Wake pages on this loop from now on; None: it has ended."""
        with self._turn:
            self._loop = loop

    def publish(self, topic: str, content: dict[str, Any] | Picture) -> None:
        """Replace a topic."""
        if isinstance(content, dict):
            message: str | Picture = json.dumps({"topic": topic, **content}, allow_nan=False)
        else:
            message = content
        with self._turn:
            self._number += 1
            self._topics[topic] = (self._number, message)
            if self._loop is not None and not self._waking:
                self._waking = True
                self._loop.call_soon_threadsafe(self._wake)

    def news(self, subscriber: Subscriber) -> list[str | bytes]:
        """Return what a page has not seen yet, oldest first."""
        with self._turn:
            fresh = sorted(
                (number, topic, content)
                for topic, (number, content) in self._topics.items()
                if number > subscriber.seen.get(topic, 0)
            )
        subscriber.seen.update({topic: number for number, topic, _ in fresh})
        return [
            content(subscriber.filter_name) if callable(content) else content
            for _, _, content in fresh
        ]

    def _wake(self) -> None:
        with self._turn:
            self._waking = False
        for subscriber in self.subscribers:
            subscriber.news.set()
