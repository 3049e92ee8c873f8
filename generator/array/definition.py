"""Arrays from plain values: an `encoding:` block of a spec, or a row of the database.

    {family: prba, degree: 12, polynomial: 0x1099, rows: 63, columns: 65, window: [6, 2]}
    {family: prmva, order: 4, rows: 255, columns: 257}
    {family: prmvs, order: 9, degree: 3}
    {family: prmvpa, factors: {rows: {degree: 4}, columns: {order: 4, degree: 2}}}

Left out: `polynomial`, the default one on file; `initial`, 0 ... 0 1; `rows` and `columns`,
the most square fold; `window`, the smallest unique one; `law`, figure 5.11's; `field`, the
usual minimal polynomial of A; `permutation`, none; `first`, cell (0, 0). Polynomials are
labels from x^0 upwards, or texts as "x^6+x^2+x+A", or 0x1099 over GF(2).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from generator.array.field import Field, field_of_order, parse_polynomial
from generator.array.fold import FoldedArray, nearest_sizes, require_foldable
from generator.array.polynomial import primitive_polynomial
from generator.array.product import ProductArray
from generator.array.sequence import Sequence
from generator.errors import ArrayError

FAMILIES = ("prbs", "prba", "prpa", "prmvs", "prmva", "prmvpa")
_SEQUENCE_KEYS = ("order", "degree", "field", "polynomial", "initial")
_FOLD_KEYS = ("family", *_SEQUENCE_KEYS, "rows", "columns", "window", "permutation", "first")
_PRODUCT_KEYS = ("family", "factors", "law", "rows", "columns", "window")


def array_from(definition: Mapping[str, Any]) -> FoldedArray | ProductArray:
    """Return the array that plain values describe; `array.definition()` returns the complete form.

    Raises `ArrayError` if a key is unknown, missing or of the wrong kind, or the array cannot be
    built, decoded, or its window is not unique.

    >>> array_from({"family": "prba", "degree": 12, "polynomial": "0x1099"})
    FoldedArray(Sequence(GF(2), 0x1099), 63x65)
    """
    family = definition.get("family")
    if family not in FAMILIES:
        raise ArrayError(
            f"family {family!r} is none of the arrays of the thesis",
            fix=f"take one of {', '.join(FAMILIES)}",
        )
    window = _window(definition)
    if family in ("prpa", "prmvpa"):
        _refuse_unknown(definition, _PRODUCT_KEYS, family)
        return _product(definition, family, window)
    _refuse_unknown(definition, _FOLD_KEYS, family)
    order = _order(definition, family)
    rows, columns = _integer(definition, "rows"), _integer(definition, "columns")
    one_row = family in ("prbs", "prmvs")
    if one_row and rows not in (None, 1):
        raise ArrayError(
            f"{family} has one row, not {rows}", fix=f"take {family[:-1]}a, or rows: 1"
        )
    degree = _degree(definition, order, rows, columns)
    if degree is None:
        raise ArrayError(
            f"{family} over GF({order}) has no size", fix="give degree, or rows and columns"
        )
    usual = (1, order**degree - 1) if one_row else require_foldable(order, degree)
    sequence = _sequence(definition, order, degree)
    if rows is None and columns is None:
        rows, columns = usual
    elif rows is None and columns:
        rows = sequence.period // columns
    elif columns is None and rows:
        columns = sequence.period // rows
    first = _integers(definition, "first", 2)
    return FoldedArray(
        sequence,
        rows or 0,
        columns or 0,
        window,
        permutation=_integers(definition, "permutation", order),
        first=(first[0], first[1]) if first else (0, 0),
    )


def _product(
    definition: Mapping[str, Any], family: str, window: tuple[int, int] | None
) -> ProductArray:
    factors = definition.get("factors")
    if not isinstance(factors, Mapping) or set(factors) != {"rows", "columns"}:
        raise ArrayError(
            f"{family} is made of two sequences, and factors: does not give them",
            fix="give factors: {rows: {order, degree}, columns: {order, degree}}",
        )
    sequences = []
    for axis in ("rows", "columns"):
        factor = factors[axis]
        if not isinstance(factor, Mapping):
            raise ArrayError(f"factors: {axis}: is no sequence", fix="give {order: 4, degree: 2}")
        _refuse_unknown(factor, _SEQUENCE_KEYS, f"factors: {axis}")
        order = _order(factor, "prbs" if family == "prpa" else "factor")
        degree = _degree(factor, order, None, None)
        if degree is None:
            raise ArrayError(f"factors: {axis}: has no degree", fix="give degree: 4, or another")
        sequences.append(_sequence(factor, order, degree))
    array = ProductArray(sequences[0], sequences[1], window, definition.get("law"))
    for axis, steps in (("rows", array.rows), ("columns", array.columns)):
        if _integer(definition, axis) not in (None, steps):
            raise ArrayError(
                f"{axis}: {definition[axis]} is not the period of its sequence, {steps}",
                fix=f"leave {axis}: out, or change the degree of that factor",
            )
    return array


def _refuse_unknown(given: Mapping[str, Any], known: tuple[str, ...], name: str) -> None:
    unknown = [str(key) for key in given if key not in known]
    if unknown:
        raise ArrayError(f"{name} knows no {', '.join(unknown)}", fix=f"use {', '.join(known)}")


def _order(given: Mapping[str, Any], family: str) -> int:
    binary = family in ("prbs", "prba")
    order = _integer(given, "order")
    if order is None and family in ("prmvs", "prmva"):
        raise ArrayError(
            f"{family} needs the order of its field",
            fix="give order: 4, or another prime power",
        )
    if binary and order not in (None, 2):
        raise ArrayError(
            f"{family} is binary, its order is 2 and not {order}",
            fix=f"take family {family.replace('prb', 'prmv')}, or order: 2",
        )
    return 2 if order is None else order


def _degree(
    given: Mapping[str, Any], order: int, rows: int | None, columns: int | None
) -> int | None:
    field_of_order(order)  # a prime power, or the error that says so
    degree = _integer(given, "degree")
    if degree is None and given.get("polynomial") is not None:
        return len(_polynomial(given, order)) - 1
    if degree is None and rows and columns:
        return _degree_of_size(order, rows, columns)
    return degree


def _degree_of_size(order: int, rows: int, columns: int) -> int:
    cells, degree = rows * columns + 1, 0
    while order ** (degree + 1) <= cells:
        degree += 1
    if order**degree == cells:
        return degree
    near = nearest_sizes(order, degree) + nearest_sizes(order, degree + 1)
    near.sort(key=lambda size: abs(order ** size[0] - cells))
    sizes = " or ".join(list(dict.fromkeys(f"{a}x{b}" for _, (a, b) in near))[:2])
    raise ArrayError(
        f"{rows}x{columns} is no size of an array over GF({order}): rows times columns must be "
        f"{order}^n - 1",
        fix=f"take {sizes}",
    )


def _sequence(given: Mapping[str, Any], order: int, degree: int) -> Sequence:
    field = _field(given, order)
    if given.get("polynomial") is None:
        polynomial = primitive_polynomial(order, degree)
    else:
        polynomial = _polynomial(given, order)
    if len(polynomial) != degree + 1:
        raise ArrayError(
            f"the polynomial has degree {len(polynomial) - 1}, but degree: is {degree}",
            fix=f"set degree: {len(polynomial) - 1}, or leave it out",
        )
    initial = given.get("initial")
    if initial is not None and not _are_integers(initial):
        raise ArrayError(
            f"initial: {initial!r} is no list of labels", fix=f"give {degree} labels, or none"
        )
    return Sequence(field, polynomial, initial)


def _field(given: Mapping[str, Any], order: int) -> Field:
    minimal = given.get("field")
    if minimal is not None and not _are_integers(minimal):
        raise ArrayError(
            f"field: {minimal!r} is no minimal polynomial of A",
            fix="give its coefficients from A^0 upwards, [1, 1, 1] for GF(4), or leave it out",
        )
    return field_of_order(order, minimal)


def _polynomial(given: Mapping[str, Any], order: int) -> tuple[int, ...]:
    polynomial = given["polynomial"]
    if isinstance(polynomial, int) and not isinstance(polynomial, bool) and polynomial > 0:
        polynomial = hex(polynomial)
    if isinstance(polynomial, str):
        return parse_polynomial(_field(given, order), polynomial)
    if _are_integers(polynomial):
        return tuple(polynomial)
    raise ArrayError(
        f"polynomial: {polynomial!r} is not understood",
        fix="write 'x^6+x^2+x+A', 0x1099 over GF(2), or the labels from x^0 upwards",
    )


def _window(given: Mapping[str, Any]) -> tuple[int, int] | None:
    window = given.get("window")
    if window is None:
        return None
    if _are_integers(window) and len(window) == 2:
        return int(window[0]), int(window[1])
    raise ArrayError(f"window: {window!r} is no size", fix="give [rows, columns], as [3, 2]")


def _integers(given: Mapping[str, Any], key: str, number: int) -> tuple[int, ...] | None:
    values = given.get(key)
    if values is None:
        return None
    if _are_integers(values) and len(values) == number:
        return tuple(values)
    raise ArrayError(f"{key}: {values!r} is no list of {number}", fix=f"give {number} integers")


def _are_integers(values: Any) -> bool:
    return isinstance(values, list | tuple) and all(
        isinstance(value, int) and not isinstance(value, bool) for value in values
    )


def _integer(given: Mapping[str, Any], key: str) -> int | None:
    value = given.get(key)
    if value is None or (isinstance(value, int) and not isinstance(value, bool) and value > 0):
        return value
    raise ArrayError(f"{key}: {value!r} is no positive integer", fix=f"give {key} as an integer")
