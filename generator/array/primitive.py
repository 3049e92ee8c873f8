"""Primitive polynomials on file, and how to find one more.

`primitive_polynomials.json` holds, for each order and degree, texts with their source: the
thesis's tables 5.1 and 5.3 and appendix 4 as printed, the recommended ones for folds, and
for the rest the first one that `search_primitive` finds. The first entry is the default.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product
from pathlib import Path

from generator.array.factor import period_factors
from generator.array.field import Field, field_of_order
from generator.array.notation import parse_polynomial
from generator.array.polynomial import is_primitive
from generator.errors import ArrayError


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


def primitive_polynomial(order: int, degree: int, source: str | None = None) -> tuple[int, ...]:
    """Return a primitive polynomial of `degree` over GF(order) that is on file.

    Parameters
    ----------
    order, degree
        q and n.
    source
        The one of this source ("table 5.1", "robust"); the default one otherwise.

    Raises
    ------
    ArrayError
        If none is on file.

    Examples
    --------
    >>> primitive_polynomial(4, 2)
    (2, 1, 1)
    """
    entries = [p for p in known_polynomials() if p.order == order]
    for entry in entries:
        if entry.degree == degree and source in (None, entry.source):
            return entry.labels
    period_factors(order, degree)  # first say if there can be none
    degrees = sorted({p.degree for p in entries if source in (None, p.source)})
    wanted = f" from {source}" if source else ""
    raise ArrayError(
        f"no primitive polynomial of degree {degree} over GF({order}){wanted} is on file; "
        + (f"on file: degrees {_ranges(degrees)}" if degrees else "none is for this field"),
        fix="give one as polynomial: 'x^2+x+A', found by "
        f"generator.array.primitive.search_primitive({order}, {degree})",
    )


def _ranges(numbers: list[int]) -> str:
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs)


def search_primitive(order: int, degree: int) -> tuple[int, ...]:
    """Return the primitive polynomial with the fewest terms, then the lowest exponents.

    Takes milliseconds to seconds; the result is the same every time.

    Examples
    --------
    >>> search_primitive(2, 7)
    (1, 1, 0, 0, 0, 0, 0, 1)
    """
    field = field_of_order(order)
    period_factors(order, degree)  # raises if too long
    return next(h for h in _candidates(field, degree) if is_primitive(field, h))


def _candidates(field: Field, degree: int) -> Iterator[tuple[int, ...]]:
    """Monic polynomials that may be primitive, few terms first.

    (-1)^n h(0), the product of the roots, must generate GF(q)'s group; and h(1) is not 0
    unless n = 1.
    """
    negative = field.negative if degree % 2 else range(field.order)
    constants = sorted(int(negative[label]) for label in field.primitive_labels)
    for middle in range(degree):
        places = sorted(combinations(range(1, degree), middle), key=lambda c: c[::-1])
        for exponents in places:
            for scales in product(range(1, field.order), repeat=middle):
                for constant in constants:
                    h = [constant] + [0] * (degree - 1) + [1]
                    for exponent, scale in zip(exponents, scales, strict=True):
                        h[exponent] = scale
                    value = 0
                    for label in h:
                        value = int(field.addition[value, label])
                    if value or degree == 1:
                        yield tuple(h)
