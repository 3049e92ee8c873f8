"""How polynomials and elements of GF(q) are written.

As in the thesis's table 5.3 ("x^10+x^3+A(x^2+x+1)", "2x^3+1"), and "0x1099" over GF(2):
bit k for x^k. Numbers are integers of the prime field, A the element of label 2.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from generator.array.field import Field
from generator.errors import ArrayError

_TERM = re.compile(r"(?P<number>\d+)?(?P<a>A(?:\^(?P<power>\d+))?)?(?P<x>x(?:\^(?P<degree>\d+))?)?")
_GROUP = re.compile(r"([^()+]*)\(([^()]*)\)")


def parse_polynomial(field: Field, text: str) -> tuple[int, ...]:
    """Return the polynomial written as `text`, e.g. "x^6+x^2+x+A" or "0x1099".

    Raises `ArrayError` that shows the term which is not understood.
    """
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
            scale = element_text(field, label)
            terms.append(unknown if scale == "1" and unknown else scale + unknown)
    return "+".join(terms) or "0"


def element_text(field: Field, label: int) -> str:
    """Return an element as the thesis writes it: 0, 1, A, A^2, ... or an integer."""
    if field.degree == 1 or label < 2:
        return str(label)
    return "A" if label == 2 else f"A^{label - 1}"
