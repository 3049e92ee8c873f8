"""What a decoder answers: one value for a window, columns of values for a batch.

A window that is not decoded is a value too: `reason` says why, and `candidates` lists the
places between which the cells seen cannot decide. Rows and columns are zero-based, at the
window's upper left cell.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Reason(IntEnum):
    """Why a window is not decoded."""

    NONE = 0
    TOO_FEW = 1
    AMBIGUOUS = 2
    NOT_ENCODED = 3

    @property
    def text(self) -> str:
        """The words that people read; empty if the window is decoded."""
        return ("", "too few symbols", "ambiguous", "not an encoded surface")[self]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A place that the cells seen allow."""

    row: int
    column: int
    rotation: int = 0  #: quarter turns, counter-clockwise, that bring the window upright
    score: float | None = None  #: log-likelihood, nats, relative to the best candidate


@dataclass(frozen=True, slots=True)
class Decoded:
    """The answer for one window."""

    row: int | None  #: None if not decoded
    column: int | None
    t: int | None  #: index in the folded sequence; row * columns + column of a product array
    margin: float | None  #: log-likelihood ratio to the runner-up, nats; None: nothing weighed
    runner_up: Candidate | None  #: the second-best place
    candidates: tuple[Candidate, ...]  #: best first; empty if nothing competes
    reason: str  #: "" if decoded, otherwise "too few symbols", "ambiguous", ...
    rotation: int = 0  #: quarter turns, counter-clockwise, that bring the window upright
    doubt: float | None = None  #: probability that the best candidate is wrong
    object: str | None = None  #: that holds the place; None: nobody asked, or none is registered
    face: str | None = None  #: of that object

    def __bool__(self) -> bool:
        return self.row is not None

    def __str__(self) -> str:
        if self.row is None:
            return f"not decoded: {self.reason}"
        turned = f", turned by {90 * self.rotation} degrees" if self.rotation else ""
        return f"row {self.row}, column {self.column} (t = {self.t}){turned}"


@dataclass(frozen=True, slots=True)
class Decodings:
    """The answers for N windows, as columns; `decodings[i]` is a `Decoded`."""

    columns_of_array: int
    rows: NDArray[np.uint64]  #: (N,) best place; has no meaning where a reason is given
    columns: NDArray[np.uint64]  #: (N,)
    indices: NDArray[np.uint64] | None  #: (N,) t of a folded array
    reasons: NDArray[np.uint8]  #: (N,) values of `Reason`
    margins: NDArray[np.float64] | None = None  #: (N,)
    doubts: NDArray[np.float64] | None = None  #: (N,)
    rotations: NDArray[np.uint8] | None = None  #: (N,)
    runners_up: tuple[NDArray[np.uint64], NDArray[np.uint64], NDArray[np.uint8]] | None = None
    candidates: Mapping[int, tuple[Candidate, ...]] = field(default_factory=dict)

    def __len__(self) -> int:
        return int(self.rows.size)

    def __iter__(self) -> Iterator[Decoded]:
        return (self[i] for i in range(len(self)))

    @property
    def answered(self) -> NDArray[np.bool_]:
        """(N,) which windows are decoded."""
        return np.asarray(self.reasons == Reason.NONE)

    def __getitem__(self, i: int) -> Decoded:
        if not -len(self) <= i < len(self):
            raise IndexError(i)
        i %= len(self)
        reason = Reason(int(self.reasons[i]))
        place = reason is Reason.NONE
        row, column = int(self.rows[i]), int(self.columns[i])
        index = row * self.columns_of_array + column
        if self.indices is not None:
            index = int(self.indices[i])
        runner_up = None
        if self.runners_up is not None and self.margins is not None:
            rows, columns, rotations = self.runners_up
            gap = float(self.margins[i])
            if np.isfinite(gap):
                runner_up = Candidate(
                    int(rows[i]), int(columns[i]), int(rotations[i]), round(-gap, 6)
                )
        return Decoded(
            row if place else None,
            column if place else None,
            index if place else None,
            None if self.margins is None else _finite(self.margins[i]),
            runner_up,
            self.candidates.get(i, ()),
            reason.text,
            int(self.rotations[i]) if place and self.rotations is not None else 0,
            None if self.doubts is None else _finite(self.doubts[i]),
        )


def _finite(value: np.float64) -> float | None:
    return float(value) if np.isfinite(value) else None
