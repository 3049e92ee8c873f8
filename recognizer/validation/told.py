"""What `validate-set` says: results to stdout, progress and messages to stderr."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from recognizer.validation.complete import Summary
    from recognizer.validation.rows import Row
    from recognizer.validation.run import Told


def error(kind: str, cause: str, fix: str, place: str, exit_code: int, *, as_json: bool) -> None:
    """Say what is wrong: to stderr, or as JSON to stdout."""
    if as_json:
        values = {"kind": kind, "exit_code": exit_code, "place": place, "cause": cause, "fix": fix}
        write_json({"error": values})
        return
    sys.stderr.write(f"{place}: error: {cause}\n" if place else f"error: {cause}\n")
    if fix:
        sys.stderr.write(f"  fix: {fix}\n")


def write_json(values: Any) -> None:
    """Write one JSON object to stdout."""
    sys.stdout.write(json.dumps(values, indent=2, allow_nan=False) + "\n")


def version(*, as_json: bool) -> None:
    """Say which version this is."""
    from importlib.metadata import version as installed

    number = installed("encoded-objects")
    if as_json:
        write_json({"version": number})
    else:
        sys.stdout.write(f"validate-set {number}\n")


def summary(found: Summary, folder: Path, *, as_json: bool) -> None:
    """Say how a run ended."""
    if as_json:
        write_json(found.as_json() | {"folder": str(folder), "holds": found.holds})
        return
    head = (
        f"{found.touches:,} touches: {found.right:,} right, {found.wrong:,} wrong, "
        f"{found.rejected:,} rejected; pose {_size(found.rms_mm, 'mm')}, "
        f"{_size(found.rms_deg, 'degrees')} rms ({found.seconds:.1f} s)"
    )
    lines = [head]
    for check in found.checks:
        mark = "holds" if check["holds"] else "FAILS"
        lines.append(f"  {mark}  {check_text(check)}")
    lines.append(f"next: open {folder / 'report.html'}")
    sys.stdout.write("\n".join(lines) + "\n")


def check_text(check: dict[str, Any]) -> str:
    """Return a bound and what was found, in a line."""
    if "share" in check:
        if check["share"] is None:
            return f"{check['name']}: none was drawn"
        return (
            f"{check['name']}: {check['count']:,} of {check['of']:,}, {check['share']:.3%} "
            f"({check['low']:.3%} ... {check['high']:.3%}), bound {check['sign']} "
            f"{check['bound']:.1%}"
        )
    found = _size(check["value"], check["unit"])
    return f"{check['name']}: {found}, bound {check['sign']} {check['bound']:g} {check['unit']}"


def comparison(found: dict[str, Any], output: Path | None, *, as_json: bool) -> None:
    """Say what became of what."""
    if as_json:
        write_json(found)
        return
    wide = max(len(line["name"]) for line in found["lines"])
    head = f"{'':{wide}}  {'A':>12}  {'B':>12}\n"
    sys.stdout.write(head)
    for line in found["lines"]:
        a, b = (("-" if v is None else f"{v:.6g}") for v in (line["a"], line["b"]))
        sys.stdout.write(f"{line['name']:{wide}}  {a:>12}  {b:>12}  {line['word']}\n")
    if output:
        sys.stdout.write(f"next: open {output}\n")


def repetition(found: dict[str, Any], plot: Path | None, *, as_json: bool) -> None:
    """Say what became of one touch."""
    if as_json:
        write_json(found)
        return
    wide = max(map(len, found))
    for name, value in found.items():
        sys.stdout.write(f"{name:{wide}}  {'-' if value is None else value}\n")
    if plot:
        sys.stdout.write(f"next: open {plot}\n")


@contextmanager
def progress_bar() -> Iterator[Told]:
    """Yield a bar on a terminal, and silence elsewhere."""
    if not sys.stderr.isatty():
        yield _Silent()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn("{task.fields[text]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield _Shown(bar, bar.add_task("making the set", total=None, text=""))


class _Silent:
    def stage(self, text: str, touches: int, done: int) -> None:
        """Say nothing: nobody watches."""

    def touched(self, rows: tuple[Row, ...]) -> None:
        """Say nothing: nobody watches."""


class _Shown:
    def __init__(self, bar: Progress, task: TaskID) -> None:
        self._bar, self._task = bar, task
        self._total = self._done = self._new = 0
        self._start = time.monotonic()
        self._counts = {"right": 0, "wrong": 0, "rejected": 0}

    def stage(self, text: str, touches: int, done: int) -> None:
        """Begin a bar; what was done before counts for the bar, not for the rate."""
        self._total, self._done, self._new = touches, done, 0
        self._start = time.monotonic()
        self._counts = dict.fromkeys(self._counts, 0)
        self._bar.reset(self._task, total=touches, completed=done, description=text, text="")

    def touched(self, rows: tuple[Row, ...]) -> None:
        """Move the bar, and say rate and time left."""
        for row in rows:
            self._counts[row["verdict"]] += 1
        self._new += len(rows)
        rate = self._new / max(time.monotonic() - self._start, 1e-3)
        left = timedelta(seconds=round((self._total - self._done - self._new) / rate))
        counts = ", ".join(f"{number:,} {name}" for name, number in self._counts.items())
        text = f"{rate:.1f} touches/s, {left} left; {counts}"
        self._bar.update(self._task, advance=len(rows), text=text)


def _size(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.3f} {unit}"
