"""Exact conversion: windows without wrong symbols -> places, by every method of the thesis.

Windows are read as linear equations (`register`), so any set of visible cells of full rank
serves, in any array: folded ones by one index, t -> (t mod rows, t mod columns); product
arrays by two (`product`). Cells beyond the needed ones are checked. A window that fails its
checks is no window of the array; one that shows too few cells gets its candidates listed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from decoder.decoded import Reason
from decoder.element import Element
from decoder.errors import MethodError
from decoder.logarithm import Logarithm
from decoder.milestones import Milestones
from decoder.register import LISTED, Register
from decoder.scattered import read_scattered
from decoder.serial import serial
from decoder.table import Table
from generator.array.contract import Labels
from generator.array.sequence import Sequence

_FEW_MASKS = 4  # sets of visible cells for which a linear map each is prepared


class Conversion(Protocol):
    """A method: field elements -> indices."""

    @property
    def nbytes(self) -> int:
        """Memory of its tables, bytes."""
        ...

    def convert(self, states: Element) -> NDArray[np.uint64]:
        """Return the index of each element (none of them 0); (N,)."""
        ...


METHODS: dict[str, Callable[[Sequence], Conversion]] = {
    "table": Table,
    "serial": serial,
    "milestones": Milestones,
    "logarithm": Logarithm,
}


@lru_cache(maxsize=32)
def conversion(sequence: Sequence, method: str) -> Conversion:
    """Return the prepared method for a sequence, the same object for the same arguments."""
    if method not in METHODS:
        raise MethodError(
            f"unknown method '{method}'", fix=f"choose one of {', '.join(METHODS)}, likelihood"
        )
    return METHODS[method](sequence)


@lru_cache(maxsize=4096)
def _register(sequence: Sequence, offsets: tuple[int, ...]) -> Register:
    return Register(sequence, list(offsets))


@dataclass(frozen=True, slots=True)
class Terms:
    """Indices found on one sequence."""

    indices: NDArray[np.uint64]  #: (N,) has no meaning where a reason is given
    reasons: NDArray[np.uint8]  #: (N,) values of `Reason`
    candidates: dict[int, list[int]]  #: indices that an undetermined window allows


def convert_terms(sequence: Sequence, offsets: list[int], labels: Labels, method: str) -> Terms:
    """Find the indices of symbols seen at given offsets of one sequence.

    Parameters
    ----------
    sequence
        The m-sequence.
    offsets
        (k,) relative indices.
    labels
        (N, k) symbols, -1 where none is seen.
    method
        A key of `METHODS`.
    """
    number = len(labels)
    found = Terms(np.zeros(number, np.uint64), np.zeros(number, np.uint8), {})
    prepared = conversion(sequence, method)
    masks = _masks(labels >= 0)
    if len(masks) > _FEW_MASKS:
        states, determined, right = read_scattered(sequence, offsets, labels)
        found.indices[determined & right] = prepared.convert(states[determined & right])
        found.reasons[determined & ~right] = Reason.NOT_ENCODED
        masks = [
            (mask, left) for mask, members in masks if (left := members[~determined[members]]).size
        ]
    for mask, members in masks:
        seen = np.flatnonzero(mask)
        if seen.size == 0:
            found.reasons[members] = Reason.TOO_FEW
            continue
        register = _register(sequence, tuple(offsets[cell] for cell in seen.tolist()))
        whole = members.size == number and seen.size == labels.shape[1]
        states, right = register.read(labels if whole else labels[np.ix_(members, seen)])
        if not register.determined:
            _list_candidates(found, register, prepared, members, states, right)
            continue
        right &= register.nonzero(states)
        if right.all():
            found.indices[members] = prepared.convert(states)
        else:
            found.indices[members[right]] = prepared.convert(states[right])
            found.reasons[members[~right]] = Reason.NOT_ENCODED
    return found


def _masks(seen: NDArray[np.bool_]) -> list[tuple[NDArray[np.bool_], NDArray[np.intp]]]:
    """Group windows by the cells that they show."""
    if seen.all():
        return [(seen[0], np.arange(len(seen)))] if len(seen) else []
    whole, place = np.unique(seen, axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    bounds = np.searchsorted(place.ravel()[order], np.arange(len(whole) + 1))
    return [(mask, order[bounds[i] : bounds[i + 1]]) for i, mask in enumerate(whole)]


def _list_candidates(
    found: Terms,
    register: Register,
    prepared: Conversion,
    members: NDArray[np.intp],
    states: Element,
    right: NDArray[np.bool_],
) -> None:
    """Give the reason, and the places that stay open if they are few."""
    found.reasons[members] = np.where(right, Reason.TOO_FEW, Reason.NOT_ENCODED)
    others = register.open_elements()
    if len(others) > LISTED:
        return
    ring = register.sequence.ring
    for i in np.flatnonzero(right):
        allowed = others ^ states[i] if ring.prime == 2 else ring.reduced(others + states[i])
        allowed = allowed[register.nonzero(allowed)]
        found.candidates[int(members[i])] = sorted(prepared.convert(allowed).tolist())
