"""Progress callbacks."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]  #: what is being done, and the share of the run done


def no_progress(_what: str, _share: float) -> None:
    """Report nothing."""


def part_of_progress(progress: Progress, start: float, end: float) -> Progress:
    """Return the progress of a step that fills the run from share `start` to `end`."""
    return lambda what, share: progress(what, start + share * (end - start))
