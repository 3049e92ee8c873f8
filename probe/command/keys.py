"""Keys of a terminal, one at a time and unechoed; none where stdin is no terminal."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager

KeyReader = Callable[[float], str]
"""Returns what was typed within so many seconds, as soon as something was; else nothing."""


@contextmanager
def keys() -> Iterator[KeyReader]:
    """Yield a function that returns what is typed; the terminal is put back at the end."""
    if not sys.stdin.isatty():
        yield _no_keys
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)

    def pressed(timeout_s: float) -> str:
        ready, _, _ = select.select([descriptor], [], [], max(timeout_s, 0.0))
        return os.read(descriptor, 64).decode(errors="ignore") if ready else ""

    tty.setcbreak(descriptor)  # Ctrl-C still interrupts
    try:
        yield pressed
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _no_keys(timeout_s: float) -> str:
    select.select([], [], [], max(timeout_s, 0.0))
    return ""
