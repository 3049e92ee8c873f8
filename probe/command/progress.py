"""A progress bar on stderr when a person watches, and notices that do not disturb it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID


class Told(Protocol):
    """What the work tells about itself."""

    def show(self, done: float, text: str) -> None:
        """Say how much is done, of the total, and a few words."""
        ...

    def say(self, notice: str) -> None:
        """Write a notice that stays."""
        ...


@contextmanager
def progress_bar(label: str, total: float | None = None) -> Iterator[Told]:
    """Yield a bar on a terminal; elsewhere notices are written and progress is not.

    Parameters
    ----------
    label
        What is being done.
    total
        How much there is to do; None: nobody knows.
    """
    if not sys.stderr.isatty():
        yield _Silent()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True, highlight=False)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        TextColumn("{task.fields[text]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        yield _Shown(bar, bar.add_task(label, total=total, text=""))


class _Silent:
    def show(self, done: float, text: str) -> None:
        """Say nothing: nobody watches."""

    def say(self, notice: str) -> None:
        """Write a line to stderr."""
        sys.stderr.write(f"{notice}\n")


class _Shown:
    def __init__(self, bar: Bar, task: TaskID) -> None:
        self._bar, self._task = bar, task

    def show(self, done: float, text: str) -> None:
        """Move the bar."""
        self._bar.update(self._task, completed=done, text=text)

    def say(self, notice: str) -> None:
        """Write a line above the bar."""
        self._bar.console.print(notice, markup=False)
