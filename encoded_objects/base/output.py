"""Results to stdout; messages and progress to stderr; as text or as JSON."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID
    from rich.table import Table

    from encoded_objects.base.errors import EncodedObjectsError

WIDTH = 120  #: characters of a table that is written to a file


def write(text: str) -> None:
    """Write text to stdout."""
    sys.stdout.write(text if text.endswith("\n") else text + "\n")


def write_json(value: Any, *, line: bool = False) -> None:
    """Write one JSON value to stdout, on a line of its own if asked; null for no number."""
    write(json.dumps(json_value(value), indent=None if line else 2, allow_nan=False))


def three_digits(value: float) -> str:
    """Return a number to three digits, never by a power of ten: 12.3, 1230."""
    return f"{float(f'{value:.3g}'):g}"


def version(name: str, *, as_json: bool, **parts: str) -> None:
    """Say which version this is, and of parts which one is in use."""
    from encoded_objects import __version__

    if as_json:
        write_json({"version": __version__, **parts})
    else:
        write(f"{name} {__version__}")
        for part, used in parts.items():
            write(f"{part}: {used}")


def error(problem: EncodedObjectsError, *, as_json: bool) -> None:
    """Say what is wrong: to stderr, or as JSON to stdout."""
    if as_json:
        write_json({"error": problem.as_json()}, line=True)  # where results are lines, too
    else:
        message(problem.as_text(), "error:", "red")


def warning(text: str) -> None:
    """Warn on stderr."""
    message(f"warning: {text}", "warning:", "yellow")


def message(text: str, word: str = "", colour: str = "yellow") -> None:
    """Write a message to stderr; `word` in colour on a terminal."""
    if word and sys.stderr.isatty() and not os.environ.get("NO_COLOR"):
        from typer import style

        text = text.replace(word, style(word, fg=colour, bold=True))
    sys.stderr.write(text + "\n")


def table(*titles: str, broken: tuple[str, ...] | None = None) -> Table:
    """Return an empty table; only columns `broken` may be broken into lines, all by default."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    made = Table(box=SIMPLE_HEAD, pad_edge=False)
    for title in titles:
        whole = broken is not None and title not in broken
        made.add_column(title, no_wrap=whole, overflow="ellipsis" if broken is None else "fold")
    return made


def show(made: Table) -> None:
    """Write a table to stdout."""
    from rich.console import Console

    Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH).print(made)


def pairs(values: dict[str, str]) -> None:
    """Write names and values, one pair a line."""
    wide = max(map(len, values), default=0)
    for name, value in values.items():
        write(f"{name:<{wide}}  {value}")


def count_of(count: int, thing: str) -> str:
    """Return a count in words: 1 frame, 2,000 frames."""
    plural = f"{thing}es" if thing.endswith("ch") else f"{thing}s"
    return f"{count:,} {thing if count == 1 else plural}"


def some_of(names: Sequence[str], most: int = 6) -> str:
    """Return names with commas between; of many the first few, and how many more."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more"


def json_value(value: Any) -> Any:
    """Return a value as JSON has it: numbers of numpy as such, null for inf and nan."""
    if isinstance(value, dict):
        return {name: json_value(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_value(item) for item in value]
    if hasattr(value, "tolist"):
        return json_value(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (str, int, float, bool)):
        return value
    return str(value)


class ProgressBar:
    """A bar of progress on a terminal, nothing elsewhere."""

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

    `total` None: nobody knows; a total of 1 is shown as a share.
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
