"""The key of a lab, 75 random bits as 15 characters and one that checks them; a lab's own array.

Characters are Crockford's 32, without I, L, O and U: a key is read aloud, typed and copied by
hand. They stand for the elements of GF(32); the check character makes sum A^k c_k = 0, which
finds every single wrong character and every two that were exchanged.

A lab's array is the published one with another polynomial, permutation of symbols and first cell,
drawn from a hash of key and array. Every j-th term of an m-sequence, j coprime to its period N,
is an m-sequence of the same period, and all are found this way (phi(N) / n: 288 of degree 6, 4,096
of degree 8 over GF(4)); j is drawn until the array identifies every small view that the published
one identifies. That takes ranks of the published sequence alone: cells at offsets d of the new
array have the rank that offsets j d have there. Two labs agree on a touch by chance only.

MacWilliams, Sloane, The Theory of Error-Correcting Codes, chapters 4 and 14. Thesis 5.1, 5.2.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from functools import reduce
from itertools import count
from math import gcd
from secrets import token_bytes

import numpy as np
from numpy.typing import NDArray

from generator.array.field import field_of_order
from generator.array.fold import FoldedArray, translation
from generator.array.sequence import Sequence
from generator.array.window import echelon
from generator.errors import LabKeyError

CHARACTERS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
LENGTH = 16  #: characters, the last of which checks the others
GROUP = 4

_MEANT = str.maketrans("ILO", "110")  # what people write for 1 and 0


def draw_lab_key() -> str:
    """Return a key that no other lab has."""
    return lab_key_of(token_bytes(LENGTH))


def lab_key_of(drawn: bytes) -> str:
    """Return the key of 15 random bytes or more."""
    labels = [byte % len(CHARACTERS) for byte in drawn[: LENGTH - 1]]
    return _text([*labels, _check_label(labels)])


def read_lab_key(text: str) -> str:
    """Return a key as it is written, from how a person typed it.

    Raises `LabKeyError` for another length, a character that no key has, or a wrong last one.

    >>> read_lab_key("o123 4567 89ab cder")
    '0123-4567-89AB-CDER'
    """
    typed = re.sub(r"[\s-]", "", text).upper().translate(_MEANT)
    strange = sorted(set(typed) - set(CHARACTERS))
    if len(typed) != LENGTH or strange:
        has = f"it holds {' '.join(strange)}" if strange else f"it has {len(typed)} characters"
        raise LabKeyError(
            f"'{text}' is no lab key: {has}",
            fix=f"give {LENGTH} letters and digits, as `encode-object lab` prints them",
        )
    labels = [CHARACTERS.index(character) for character in typed]
    if _check_label(labels[:-1]) != labels[-1]:
        raise LabKeyError(
            f"'{text}' is no lab key: its last character does not fit the others, so one of them "
            "is wrong",
            fix="copy it once more from `encode-object lab`",
        )
    return _text(labels)


def _check_label(labels: list[int]) -> int:
    """Return c with A c_1 + ... + A^15 c_15 + c = 0 over GF(32); -x = x there."""
    field = field_of_order(len(CHARACTERS))
    terms = [int(field.multiplication[k + 2, label]) for k, label in enumerate(labels)]  # A^(k + 1)
    return reduce(lambda total, term: int(field.addition[total, term]), terms, 0)


def _text(labels: list[int]) -> str:
    typed = "".join(CHARACTERS[label] for label in labels)
    return "-".join(typed[k : k + GROUP] for k in range(0, LENGTH, GROUP))


Cells = NDArray[np.int64]

VIEW_SIDE = 4  #: cells: views are all blocks up to this side, and those without one corner


def keyed_array(published: FoldedArray, lab_key: str) -> FoldedArray:
    """Return a lab's own array of the size, the field and the window of a published one.

    >>> from generator.array.profiles import profile
    >>> one = keyed_array(profile("one-touch").array(), "0123-4567-89AB-CDER")
    >>> one.rows, one.columns, one.window, one.first
    (63, 65, (3, 2), (4, 17))
    """
    numbers = _hash_numbers(published, lab_key)
    sequence = published.sequence
    step = _step(published, numbers)
    return FoldedArray(
        Sequence(sequence.field, decimated_polynomial(sequence, step)),
        published.rows,
        published.columns,
        published.window,
        permutation=translation(sequence.field, next(numbers) % sequence.field.order),
        first=(next(numbers) % published.rows, next(numbers) % published.columns),
    )


def decimated_polynomial(sequence: Sequence, step: int) -> tuple[int, ...]:
    """Return the polynomial of every `step`-th term, labels from x^0; `step` coprime to N.

    2 n of these terms are 2 n - n equations for the n coefficients of their recurrence.
    """
    field, degree = sequence.field, sequence.degree
    terms = sequence.symbols([step * k % sequence.period for k in range(2 * degree)])
    states = np.lib.stride_tricks.sliding_window_view(terms, degree)[:degree]
    solved, _ = echelon(field, np.column_stack([states, terms[degree:]]))
    return (*field.negative[solved[:, -1]].tolist(), 1)


def _step(published: FoldedArray, numbers: Iterator[int]) -> int:
    """Return the first step whose array identifies what the published one does."""
    sequence = published.sequence
    offsets = [published.offsets(view[:, 0], view[:, 1]) for view in _views(published)]
    ranks = [sequence.rank(view) for view in offsets]
    for number in numbers:
        step = number % sequence.period
        if gcd(step, sequence.period) == 1 and all(
            sequence.rank(step * offset for offset in view) >= rank
            for view, rank in zip(offsets, ranks, strict=True)
        ):
            return step
    raise AssertionError("the hash never ends")


def _views(array: FoldedArray) -> Iterator[Cells]:
    """Yield the window, and small blocks with and without a corner, as (k, 2) cells."""
    sizes = {array.window}
    sides = range(1, VIEW_SIDE + 1)
    sizes |= {(a, b) for a in sides for b in sides if a <= array.rows and b <= array.columns}
    for a, b in sorted(sizes):
        block = np.argwhere(np.ones((a, b), dtype=bool))
        yield block
        if min(a, b) > 2:
            for corner in ((0, 0), (0, b - 1), (a - 1, 0), (a - 1, b - 1)):
                yield block[(block != corner).any(axis=1)]


def _hash_numbers(published: FoldedArray, lab_key: str) -> Iterator[int]:
    """Yield numbers below 2^256: SHA-256 of the key, the array and a counter, as one text."""
    definition = {k: v for k, v in published.definition().items() if k != "window"}
    array = json.dumps(definition, sort_keys=True, separators=(",", ":"))
    for number in count():
        text = f"{lab_key} {array} {number}"
        yield int.from_bytes(hashlib.sha256(text.encode()).digest(), "big")
