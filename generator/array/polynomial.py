"""Polynomials over GF(q): arithmetic modulo h, order, primitivity; those on file. Thesis 5.4.1.

A polynomial is a sequence of labels, coefficient of x^0 first. `primitive_polynomials.json` holds
texts with their source for each order and degree, the default first: the thesis's tables 5.1 and
5.3 and appendix 4 as printed, the recommended ones for folds, and for the rest the first one that
`search_primitive` finds.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from itertools import product as tuples_of
from pathlib import Path

import numpy as np

from generator.array.factor import LARGEST_PERIOD, period_factors
from generator.array.field import Field, Labels, field_of_order, parse_polynomial
from generator.array.residue import Residues
from generator.errors import ArrayError


def product(field: Field, a: Sequence[int], b: Sequence[int]) -> tuple[int, ...]:
    """Return the product of two polynomials."""
    result = np.zeros(len(a) + len(b) - 1, dtype=np.int64)
    left = np.asarray(a, dtype=np.int64)
    for shift, coefficient in enumerate(b):
        if coefficient:
            part = result[shift : shift + len(a)]
            part[:] = field.addition[part, field.multiplication[left, coefficient]]
    return tuple(result.tolist())


def norm(field: Field, h: Sequence[int]) -> tuple[int, ...]:
    """Return the product of h and its conjugates: the polynomial over GF(p) of h's roots.

    For a primitive h of degree n it is their minimal polynomial, degree n m: GF(q)[x]/h and
    GF(p)[x]/norm are the same field with the same x.
    """
    result: tuple[int, ...] = (1,)
    conjugate = tuple(h)
    for _ in range(field.degree):
        result = product(field, result, conjugate)
        conjugate = tuple(_frobenius(field, label) for label in conjugate)
    return tuple(int(digit) for digit in field.digits[list(result), 0])


def _frobenius(field: Field, label: int) -> int:
    if label == 0 or field.degree == 1:
        return label
    return (label - 1) * field.characteristic % (field.order - 1) + 1


def is_primitive(field: Field, h: Sequence[int]) -> bool:
    """Whether the monic h has the period q^n - 1: then its norm is primitive over GF(p)."""
    if len(h) < 2 or h[-1] != 1 or h[0] == 0:
        return False
    factors = period_factors(field.order, len(h) - 1)
    return Residues(field.characteristic, norm(field, h)).is_primitive(factors)


def monic(field: Field, h: Iterable[int]) -> tuple[int, ...]:
    """Return h as a tuple, checked: labels of the field, monic, degree >= 1, h(0) not 0."""
    labels = tuple(h)
    if not all(
        isinstance(c, int | np.integer) and not isinstance(c, bool) and 0 <= c < field.order
        for c in labels
    ):
        raise ArrayError(
            f"polynomial {list(labels)}: coefficients over GF({field.order}) are the labels "
            f"0 to {field.order - 1}",
            fix="give the labels from x^0 upwards, or a text as 'x^2+x+A'",
        )
    if len(labels) < 2 or labels[-1] != 1 or labels[0] == 0:
        raise ArrayError(
            f"polynomial {list(labels)} cannot drive a shift register: it must have degree 1 or "
            "more, the highest coefficient 1 and a constant term",
            fix="list the coefficients from x^0 upwards, the last one being 1",
        )
    if field.order ** (len(labels) - 1) - 1 > LARGEST_PERIOD:
        period_factors(field.order, len(labels) - 1)  # raises with the longest degree
    return tuple(int(c) for c in labels)


def companion_powers(field: Field, h: Sequence[int], number: int) -> Labels:
    """Return x^0 ... x^(number-1) modulo h as (number, n) labels."""
    degree = len(h) - 1
    low = field.negative[np.asarray(h[:-1], dtype=np.int64)]
    rows = np.zeros((number, degree), dtype=np.int64)
    rows[0, 0] = 1
    for k in range(1, number):
        rows[k, 1:] = rows[k - 1, :-1]
        rows[k] = field.addition[rows[k], field.multiplication[rows[k - 1, -1], low]]
    return rows


@dataclass(frozen=True, slots=True)
class PrimitivePolynomial:
    """One entry of the file."""

    order: int  #: q
    degree: int  #: n
    text: str  #: as printed in its source
    source: str  #: "table 5.1", "table 5.3", "appendix 4", "robust", "search", ...

    @property
    def labels(self) -> tuple[int, ...]:
        """Coefficients over GF(order), from x^0 to x^degree = 1."""
        return parse_polynomial(field_of_order(self.order), self.text)


@cache
def known_polynomials() -> tuple[PrimitivePolynomial, ...]:
    """Return every primitive polynomial on file, by order and degree, the default first."""
    path = Path(__file__).with_name("primitive_polynomials.json")
    orders = json.loads(path.read_text(encoding="utf-8"))["polynomials"]
    return tuple(
        PrimitivePolynomial(int(order), int(degree), text, source)
        for order, degrees in orders.items()
        for degree, entries in degrees.items()
        for text, source in entries
    )


def primitive_polynomial(order: int, degree: int) -> tuple[int, ...]:
    """Return the primitive polynomial of `degree` over GF(order) that is on file.

    Raises `ArrayError` if none is.

    >>> primitive_polynomial(4, 2)
    (2, 1, 1)
    """
    entries = [p for p in known_polynomials() if p.order == order]
    for entry in entries:
        if entry.degree == degree:
            return entry.labels
    period_factors(order, degree)  # first say if there can be none
    degrees = [p.degree for p in entries]
    known = f"on file: degrees {min(degrees)} to {max(degrees)}" if degrees else ""
    raise ArrayError(
        f"no primitive polynomial of degree {degree} over GF({order}) is on file; "
        + (known or "none is for this field"),
        fix="give one as polynomial: 'x^2+x+A', found by "
        f"generator.array.polynomial.search_primitive({order}, {degree})",
    )


def search_primitive(order: int, degree: int) -> tuple[int, ...]:
    """Return the primitive polynomial with the fewest terms, then the lowest exponents.

    Takes milliseconds to seconds.

    >>> search_primitive(2, 7)
    (1, 1, 0, 0, 0, 0, 0, 1)
    """
    field = field_of_order(order)
    period_factors(order, degree)  # raises if too long
    return next(h for h in _candidates(field, degree) if is_primitive(field, h))


def _candidates(field: Field, degree: int) -> Iterator[tuple[int, ...]]:
    """Yield monic polynomials that may be primitive, few terms first.

    (-1)^n h(0), the product of the roots, must generate GF(q)'s group; h(1) is not 0 unless n = 1.
    """
    negative = field.negative if degree % 2 else range(field.order)
    constants = sorted(int(negative[label]) for label in field.primitive_labels)
    for middle in range(degree):
        places = sorted(combinations(range(1, degree), middle), key=lambda c: c[::-1])
        for exponents in places:
            for scales in tuples_of(range(1, field.order), repeat=middle):
                for constant in constants:
                    h = [constant] + [0] * (degree - 1) + [1]
                    for exponent, scale in zip(exponents, scales, strict=True):
                        h[exponent] = scale
                    value = 0
                    for label in h:
                        value = int(field.addition[value, label])
                    if value or degree == 1:
                        yield tuple(h)
