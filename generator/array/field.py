"""GF(q) for every prime power q, labels and exact tables; and how its polynomials are written.

Labels 0 ... q - 1 name the elements. Prime q: the integers modulo q. Extension q = p^m:
0 is 0 and k >= 1 is A^(k - 1), A a root of a primitive polynomial over GF(p). For 4, 8, 9
it is the thesis's (the relations under table 5.3); it is Conway's for these and all others
up to 256, and beyond that the first primitive one by the value of its coefficients.

Polynomials are written as in table 5.3 ("x^10+x^3+A(x^2+x+1)", "2x^3+1"), or "0x1099" over
GF(2): bit k for x^k. Numbers are integers of the prime field, A the element of label 2.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import gcd

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.array.factor import period_factors, prime_power
from generator.array.residue import Residues
from generator.errors import ArrayError

Labels = NDArray[np.int64]

LARGEST_FIELD = 1024  #: elements: tables of q^2 labels

#: A's minimal polynomial over GF(p), coefficients from A^0 upwards.
MINIMAL_POLYNOMIALS: dict[int, tuple[int, ...]] = {
    4: (1, 1, 1),
    8: (1, 1, 0, 1),
    9: (2, 2, 1),
    16: (1, 1, 0, 0, 1),
    25: (2, 4, 1),
    27: (1, 2, 0, 1),
    32: (1, 0, 1, 0, 0, 1),
    49: (3, 6, 1),
    64: (1, 1, 0, 1, 1, 0, 1),
    81: (2, 0, 0, 2, 1),
    121: (2, 7, 1),
    125: (3, 3, 0, 1),
    128: (1, 1, 0, 0, 0, 0, 0, 1),
    169: (2, 12, 1),
    243: (1, 2, 0, 0, 0, 1),
    256: (1, 0, 1, 1, 1, 0, 0, 0, 1),
}


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """GF(q) as tables over labels; all arrays are read-only."""

    order: int  #: q
    characteristic: int  #: p
    degree: int  #: m, with q = p^m
    minimal: tuple[int, ...]  #: A's minimal polynomial, from A^0; () for prime q
    digits: Labels  #: (q, m) coefficients of each element in 1, A, ..., A^(m-1)
    addition: Labels  #: (q, q)
    multiplication: Labels  #: (q, q)
    negative: Labels  #: (q,)
    inverse: Labels  #: (q,); entry 0 is 0 and has no meaning
    label_of_code: Labels  #: (q,) label of the element whose digits have the value sum d_i p^i

    def labels(self, digits: ArrayLike) -> Labels:
        """Return the labels of elements given by their digits, (..., m)."""
        weights = self.characteristic ** np.arange(self.degree)
        return np.asarray(self.label_of_code[np.asarray(digits, dtype=np.int64) @ weights])

    @property
    def primitive_labels(self) -> tuple[int, ...]:
        """Labels of the elements that generate the multiplicative group."""
        size = self.order - 1
        if self.degree > 1:  # label k is A^(k - 1)
            return tuple(k for k in range(1, self.order) if gcd(k - 1, size) == 1)
        steps = [size // prime for prime in period_factors(self.order, 1)]
        return tuple(
            a for a in range(1, self.order) if all(pow(a, step, self.order) != 1 for step in steps)
        )


def field_of_order(order: int, minimal: Sequence[int] | None = None) -> Field:
    """Return GF(order), order a prime power from 2 to 1024, the same object for the same arguments.

    `minimal` (m + 1,): A's minimal polynomial over GF(p), coefficients from A^0 to A^m = 1; that of
    `MINIMAL_POLYNOMIALS` by default, not used for prime orders. Raises `ArrayError` if the order is
    no prime power or too large, or `minimal` is not primitive.

    >>> int(field_of_order(4).addition[2, 3])  # A + A^2 = 1
    1
    """
    return _field(order, None if minimal is None else tuple(int(c) for c in minimal))


@lru_cache(maxsize=64)
def _field(order: int, minimal: tuple[int, ...] | None) -> Field:
    prime, exponent = prime_power(order)
    if order > LARGEST_FIELD:
        raise ArrayError(
            f"GF({order}) is too large: an alphabet has at most {LARGEST_FIELD} symbols",
            fix=f"take a prime power up to {LARGEST_FIELD}",
        )
    if exponent == 1:
        digits = np.arange(order)[:, None]
        minimal = ()
    else:
        minimal = minimal or MINIMAL_POLYNOMIALS.get(order) or _first_primitive(prime, exponent)
        digits = _powers_of_a(prime, exponent, minimal)
    weights = prime ** np.arange(exponent)
    label_of_code = np.empty(order, dtype=np.int64)
    label_of_code[digits @ weights] = np.arange(order)
    addition = np.zeros((order, order), dtype=np.int64)
    for digit, weight in zip(digits.T, weights, strict=True):
        addition += (digit[:, None] + digit) % prime * weight
    addition = label_of_code[addition]
    negative = label_of_code[-digits % prime @ weights]
    if exponent == 1:
        labels = np.arange(order)
        multiplication = labels[:, None] * labels % order
        inverse = np.array([pow(a, -1, order) if a else 0 for a in range(order)], dtype=np.int64)
    else:
        logarithms = np.arange(order - 1)
        multiplication = np.zeros((order, order), dtype=np.int64)
        multiplication[1:, 1:] = (logarithms[:, None] + logarithms) % (order - 1) + 1
        inverse = np.zeros(order, dtype=np.int64)
        inverse[1:] = -logarithms % (order - 1) + 1
    tables = (digits, addition, multiplication, negative, inverse, label_of_code)
    for table in tables:
        table.setflags(write=False)
    return Field(order, prime, exponent, minimal, *tables)


def _powers_of_a(prime: int, exponent: int, minimal: tuple[int, ...]) -> Labels:
    """Return (q, m) digits of 0, 1, A, A^2, ...; checks that A is primitive."""
    if (
        len(minimal) != exponent + 1
        or minimal[-1] != 1
        or not all(0 <= c < prime for c in minimal)
        or not Residues(prime, minimal).is_primitive(period_factors(prime, exponent))
    ):
        order = prime**exponent
        usual = MINIMAL_POLYNOMIALS.get(order)
        raise ArrayError(
            f"{list(minimal)} is not a primitive polynomial of degree {exponent} over "
            f"GF({prime}), so it does not make GF({order})",
            fix=f"take {list(usual)}" if usual else "leave the minimal polynomial out",
        )
    ring = Residues(prime, minimal)
    digits = np.zeros((prime**exponent, exponent), dtype=np.int64)
    power = ring.powers_of_x[0]
    for label in range(1, prime**exponent):
        digits[label] = power
        power = ring.product(power, ring.powers_of_x[1])
    return digits


def _first_primitive(prime: int, exponent: int) -> tuple[int, ...]:
    factors = period_factors(prime, exponent)
    for high in product(range(prime), repeat=exponent):
        candidate = (*reversed(high), 1)
        if candidate[0] and Residues(prime, candidate).is_primitive(factors):
            return candidate
    raise AssertionError("every field has a primitive polynomial of every degree")


_TERM = re.compile(r"(?P<number>\d+)?(?P<a>A(?:\^(?P<power>\d+))?)?(?P<x>x(?:\^(?P<degree>\d+))?)?")
_GROUP = re.compile(r"([^()+]*)\(([^()]*)\)")


def parse_polynomial(field: Field, text: str) -> tuple[int, ...]:
    """Return the polynomial of a text; `ArrayError` shows the term which is not understood."""
    plain = re.sub(r"[\s*]", "", text)
    if re.fullmatch(r"0[xX][0-9a-fA-F]+", plain):
        if field.order != 2:
            raise ArrayError(
                f"'{text}': a hexadecimal polynomial is binary, the field is GF({field.order})",
                fix="write it as 'x^6+x^2+x+A'",
            )
        return tuple(int(bit) for bit in reversed(bin(int(plain, 16))[2:]))
    coefficients: dict[int, int] = {}
    for group in _GROUP.finditer(plain):
        for term in group[2].split("+"):
            _collect(field, text, coefficients, term, factor=_term(field, text, group[1])[0])
    rest = _GROUP.sub("", plain)
    for term in filter(None, rest.split("+")):
        _collect(field, text, coefficients, term, factor=1)
    if not coefficients:
        raise ArrayError(f"'{text}' is no polynomial", fix="write it as 'x^6+x^2+x+A'")
    return tuple(coefficients.get(k, 0) for k in range(max(coefficients) + 1))


def _collect(field: Field, text: str, into: dict[int, int], term: str, factor: int) -> None:
    label, degree = _term(field, text, term)
    value = int(field.multiplication[label, factor])
    into[degree] = int(field.addition[into.get(degree, 0), value])


def _term(field: Field, text: str, term: str) -> tuple[int, int]:
    match = _TERM.fullmatch(term)
    if not term or match is None or (match["a"] and field.degree == 1):
        raise ArrayError(
            f"'{text}': term '{term}' is not understood over GF({field.order})",
            fix="write terms as x^3, 2x or, over an extension field, A^2x",
        )
    number = int(match["number"] or 1)
    if number >= field.characteristic:
        raise ArrayError(
            f"'{text}': {number} is no element of GF({field.characteristic})",
            fix=f"use the numbers 0 to {field.characteristic - 1}",
        )
    label = int(field.labels([number] + [0] * (field.degree - 1)))
    if match["a"]:
        power = int(match["power"] or 1) % (field.order - 1)
        label = int(field.multiplication[label, power + 1])
    degree = int(match["degree"] or 1) if match["x"] else 0
    if degree > 64:
        raise ArrayError(f"'{text}': degree {degree} is too large", fix="take a degree up to 64")
    return label, degree


def format_polynomial(field: Field, h: Sequence[int]) -> str:
    """Return the polynomial as text: "x^6+x^2+x+A", or "0x1099" over GF(2)."""
    if field.order == 2:
        return hex(sum(bit << k for k, bit in enumerate(h)))
    terms = []
    for degree in range(len(h) - 1, -1, -1):
        label = h[degree]
        if label:
            unknown = "" if degree == 0 else "x" if degree == 1 else f"x^{degree}"
            integer = field.degree == 1 or label == 1
            scale = str(label) if integer else "A" if label == 2 else f"A^{label - 1}"
            terms.append(unknown if scale == "1" and unknown else scale + unknown)
    return "+".join(terms) or "0"
