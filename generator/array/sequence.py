"""PRBS and PRMVS: the m-sequence of a primitive polynomial, at any index.

s[t+n] = -(h_0 s[t] + ... + h_(n-1) s[t+n-1]) over GF(q), period N = q^n - 1. Because
s[t] = L(x^t) for a linear functional L on GF(q)[x]/h, any term costs O(log t), none is
stored, and s[t + d] is a fixed linear combination of the state (s[t], ..., s[t+n-1]): the
coefficients of x^d modulo h. Thesis 5.1 and 5.4.2, table 5.1, table 5.3.

As printed, figure 5.10 says length 1024 and holds one digit too many in line 11: the
sequence of x^5+x+A has 4^5 - 1 = 1023 terms.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generator.array.contract import on_torus
from generator.array.factor import (
    LARGEST_PRIME_FACTOR,
    degrees_that_decode,
    period_factors,
)
from generator.array.field import Field, Labels, format_polynomial
from generator.array.polynomial import companion_powers, monic, norm
from generator.array.residue import Digits, Powers, Residues, binary_rank, pack_words, rank_modulo
from generator.errors import ArrayError

_REMEMBERED = 1 << 16  # offsets whose functionals are kept


class Sequence:
    """A pseudo-random multi-valued sequence (PRMVS; PRBS over GF(2)).

    `polynomial` (n + 1,): labels of the primitive polynomial h, from x^0 to x^n = 1. `initial`
    (n,): labels s[0] ... s[n-1], not all zero; 0 ... 0 1 by default (appendix 4).

    Raises `ArrayError` if the polynomial is not primitive, the start is zero, the sequence is
    longer than 2^64 - 1, or its length has a prime factor beyond 2^40: no index could be recovered
    from a window then (the error names the nearest degrees).

    >>> from generator.array.field import field_of_order
    >>> Sequence(field_of_order(4), (2, 1, 1)).symbols(range(6))
    array([0, 1, 1, 3, 1, 0])
    """

    def __init__(
        self, field: Field, polynomial: Iterable[int], initial: Iterable[int] | None = None
    ) -> None:
        self.field = field
        self.polynomial = monic(field, polynomial)
        self.degree = len(self.polynomial) - 1  #: n
        self.period: int = field.order**self.degree - 1  #: N
        self.factors = period_factors(field.order, self.degree)  #: {prime: exponent} of N
        largest = max(self.factors, default=1)
        if largest > LARGEST_PRIME_FACTOR:
            near = degrees_that_decode(field.order, self.degree)
            sizes = " or ".join(f"{n} ({field.order**n - 1} terms)" for n in near)
            raise ArrayError(
                f"degree {self.degree} over GF({field.order}) cannot be decoded: {self.period} has "
                f"the prime factor {largest}, and the discrete logarithm is limited to 2^40",
                fix=f"take degree {sizes}, the nearest that decode",
            )
        self.ring = Residues(field.characteristic, norm(field, self.polynomial))
        if not self.ring.is_primitive(self.factors):
            given = format_polynomial(field, self.polynomial)
            raise ArrayError(
                f"{given} is not primitive over GF({field.order}): its sequence repeats before "
                f"{self.period} terms",
                fix="take one on file (generator.array.polynomial.primitive_polynomial("
                f"{field.order}, {self.degree})) or leave polynomial: out",
            )
        start = (*[0] * (self.degree - 1), 1) if initial is None else tuple(initial)
        self.initial = tuple(int(label) for label in start)
        if (
            len(self.initial) != self.degree
            or not any(self.initial)
            or not all(0 <= label < field.order for label in self.initial)
        ):
            raise ArrayError(
                f"state {list(self.initial)} does not start a sequence of degree {self.degree} "
                f"over GF({field.order})",
                fix=f"give {self.degree} labels from 0 to {field.order - 1}, not all 0",
            )
        self.powers = Powers(self.ring, self.ring.powers_of_x[1], self.period)
        terms = list(islice(self.forward(), 2 * self.ring.degree))
        windows = np.lib.stride_tricks.sliding_window_view(
            field.digits[terms], self.ring.degree, axis=0
        )[: self.ring.degree]
        self._hankel = windows.reshape(self.ring.degree, -1).astype(np.float64)
        self._remembered: dict[int, list[int]] = {}

    def __repr__(self) -> str:
        return f"Sequence(GF({self.field.order}), {format_polynomial(self.field, self.polynomial)})"

    # --- terms -----------------------------------------------------------------------------

    def symbols(self, indices: ArrayLike) -> Labels:
        """Return s[t] for indices of any shape and size, taken modulo the period."""
        t = on_torus(indices, self.period)
        distinct, place = np.unique(t.ravel(), return_inverse=True)
        digits = self.ring.reduced(self.powers.at(distinct) @ self._first_digits)
        return np.asarray(self.field.labels(digits)[place.reshape(t.shape)])

    def forward(self) -> Iterator[int]:
        """Yield the terms from s[0] on, by the direct feedback."""
        field = self.field
        scale = field.multiplication[field.negative[list(self.polynomial[:-1])]].tolist()
        taps = [(k, scale[k]) for k, label in enumerate(self.polynomial[:-1]) if label]
        register, sums = list(self.initial), field.addition.tolist()
        while True:
            yield register[0]
            label = 0
            for place, scaled in taps:
                label = sums[label][scaled[register[place]]]
            register = [*register[1:], label]

    # --- linear functionals, for the rank test and for the decoder -----------------------------

    @cached_property
    def _first_digits(self) -> Digits:
        return self._hankel.reshape(self.ring.degree, self.field.degree, -1)[:, :, 0]

    @cached_property
    def _to_labels(self) -> Digits:
        """(D, n m): digits in x^j modulo norm(h) to digits over GF(q)[x]/h."""
        rows = companion_powers(self.field, self.polynomial, self.ring.degree)
        return self.field.digits[rows].reshape(self.ring.degree, -1).astype(np.float64)

    def element(self, indices: ArrayLike) -> Digits:
        """Return x^t in GF(p)[x]/norm(h), (..., D) digits: the field element of a place."""
        t = on_torus(indices, self.period)
        return self.powers.at(t.ravel()).reshape(*t.shape, self.ring.degree)

    def coefficients(self, offsets: ArrayLike) -> Labels:
        """Return c, (..., n) labels, with s[t + offset] = sum_j c_j s[t + j]: x^offset modulo h."""
        elements = self.element(offsets)
        digits = self.ring.reduced(elements @ self._to_labels)
        return self.field.labels(
            digits.reshape(*elements.shape[:-1], self.degree, self.field.degree)
        )

    def functionals(self, elements: Digits) -> Digits:
        """Return F (..., m, D), modulo p: digits(s[t + d]) = F @ element(t), for elements x^d."""
        flat = self.ring.reduced(elements @ self._hankel)
        return flat.reshape(*elements.shape[:-1], self.field.degree, self.ring.degree)

    def rank(self, offsets: Iterable[int]) -> int:
        """Return the rank over GF(q) of the terms s[t + offset]; n names the index t.

        The functionals span a GF(q) space, so their rank over GF(p) is m times it.
        """
        distinct = list(dict.fromkeys(int(offset) % self.period for offset in offsets))
        if not distinct:
            return 0
        if self.field.characteristic == 2:
            return binary_rank(self._words(distinct), self.ring.degree) // self.field.degree
        rows = self.functionals(self.element(distinct)).reshape(-1, self.ring.degree)
        return rank_modulo(rows, self.field.characteristic) // self.field.degree

    def _words(self, offsets: list[int]) -> list[int]:
        """Rows of the functionals as integers; layout asks for the same offsets many times."""
        known = self._remembered
        missing = [offset for offset in offsets if offset not in known]
        if len(known) + len(missing) > _REMEMBERED:
            self._remembered = known = {}
            missing = offsets
        if missing:
            maps = pack_words(self.functionals(self.element(missing))).tolist()
            known.update(zip(missing, maps, strict=True))
        return [word for offset in offsets for word in known[offset]]


def sequence_definition(sequence: Sequence) -> dict[str, Any]:
    """Return the plain values that make the sequence again."""
    field = sequence.field
    found: dict[str, Any] = {"order": field.order, "degree": sequence.degree}
    if field.degree > 1:
        found["field"] = list(field.minimal)
    return found | {
        "polynomial": list(sequence.polynomial),
        "initial": list(sequence.initial),
    }
