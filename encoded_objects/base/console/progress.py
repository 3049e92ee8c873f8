"""A progress bar on stderr when a person watches, and notices that do not disturb it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class ProgressBar:
    """How far the work is; a bar on a terminal, nothing elsewhere."""

    def __init__(self, bar: Progress | None, task: TaskID | None) -> None:
        self._bar, self._task = bar, task

    def show(self, done: float, text: str = "", *, label: str | None = None) -> None:
        """Say how much of the total is done, a few words, and what is being done now."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=done, text=text, description=label)

    def begin(self, label: str, total: float | None, done: float = 0) -> None:
        """Begin another stage of the work, of which some may be done already."""
        if self._bar is not None and self._task is not None:
            self._bar.reset(
                self._task, total=total, completed=int(done), description=label, text=""
            )

    def say(self, notice: str) -> None:
        """Write a notice that stays, above the bar."""
        if self._bar is not None:
            self._bar.console.print(notice, markup=False)
        else:
            sys.stderr.write(f"{notice}\n")


@contextmanager
def progress_bar(label: str, total: float | None = None) -> Iterator[ProgressBar]:
    """Yield a bar on a terminal; elsewhere notices are written and progress is not.

    Parameters
    ----------
    label
        What is being done.
    total
        How much there is to do; None: nobody knows. A total of 1 is shown as a share.
    """
    if not sys.stderr.isatty():
        yield ProgressBar(None, None)
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
    )

    columns: list[ProgressColumn] = [TextColumn("{task.description}"), BarColumn(bar_width=20)]
    if total is not None:
        columns.append(TaskProgressColumn() if total == 1 else MofNCompleteColumn())
    columns += [TextColumn("{task.fields[text]}"), TimeElapsedColumn()]
    console = Console(stderr=True, highlight=False)
    with Progress(*columns, console=console, transient=True) as bar:
        yield ProgressBar(bar, bar.add_task(label, total=total, text=""))
