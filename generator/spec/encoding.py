"""An array named explicitly, in place of a profile (Thesis 5.1 to 5.5).

A sequence alone (prbs, prmvs), folded on the torus (prba, prmva), or the product of two
sequences (prpa, prmvpa). What only the mathematics can tell (primitive,
coprime, unique windows) is checked where the array is made; the keys are those of
`generator.array.definition`.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from encoded_objects.base.settings import Block, refuse, whole_number

Family = Literal["prbs", "prmvs", "prba", "prmva", "prpa", "prmvpa"]
CELLS_MAX = 2**64
ORDER_MAX = 64  # larger fields have no alphabet in sight
POLYNOMIAL_LENGTH_MAX = 1000


def polynomial(value: Any) -> str | tuple[int, ...]:
    """Return labels, x^0 first, from a list; text and `0x1099` as text."""
    if type(value) is int and 1 < value < 2**65:
        return hex(value)
    if isinstance(value, str) and 0 < len(value) <= POLYNOMIAL_LENGTH_MAX:
        return value
    listed = isinstance(value, list) and 2 <= len(value) <= 65
    if listed and all(type(label) is int and 0 <= label < ORDER_MAX for label in value):
        return tuple(value)
    raise refuse(
        "a polynomial is text, a list of coefficients (x^0 first), or a hexadecimal number",
        "write, for example, x^6+x^2+x+A, [2, 1, 1] or 0x1099",
    )


def window(value: Any) -> Any:
    """Return `[3, 2]` for `3x2`; lists stay as they are."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})\s*", value)
        if match:
            return [int(match[1]), int(match[2])]
    if not isinstance(value, list) or len(value) != 2:
        raise refuse("a window is rows and columns", "write, for example, [3, 2]")
    return value


Order = Annotated[int, Field(ge=2, le=ORDER_MAX), whole_number(2, ORDER_MAX, "order")]
Degree = Annotated[int, Field(ge=1, le=64), whole_number(1, 64, "degree")]
Extent = Annotated[int, Field(ge=1), whole_number(1, CELLS_MAX, "a size")]
Label = Annotated[int, Field(ge=0, le=ORDER_MAX), whole_number(0, ORDER_MAX, "a label")]
Side = Annotated[int, Field(ge=1, le=64), whole_number(1, 64, "a side of the window")]
Polynomial = Annotated[
    str | tuple[int, ...],
    BeforeValidator(polynomial),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": ["integer", "string"]},
                {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 2},
            ]
        }
    ),
]
Window = Annotated[
    tuple[Side, Side],
    BeforeValidator(window, json_schema_input_type=tuple[Side, Side] | str),
]


class SequenceBlock(Block):
    """One sequence over GF(q)."""

    order: Order | None = None
    """Number of different terms: a prime power q; 2 if left out."""
    degree: Degree | None = None
    """Degree n of the primitive polynomial; the sequence has q^n - 1 terms."""
    polynomial: Polynomial | None = None
    """x^2+x+A, its coefficients from x^0 upwards [2, 1, 1], or 0x13; one on file if left out."""
    field: list[Label] | None = None
    """Minimal polynomial of A, from A^0 upwards; the usual one if left out."""
    initial: list[Label] | None = None
    """The first n terms; 0 ... 0 1 if left out."""


class Factors(Block):
    """The two sequences of a product array."""

    rows: SequenceBlock
    """The sequence that runs down the rows."""
    columns: SequenceBlock
    """The sequence that runs along the columns."""


class Encoding(SequenceBlock):
    """An array, named explicitly."""

    family: Family
    """prbs, prmvs: a sequence; prba, prmva: a folded one; prpa, prmvpa: the product of two."""
    rows: Extent | None = None
    """Rows of the array; the squarest fold if left out."""
    columns: Extent | None = None
    """Columns of the array; rows x columns = q^n - 1, without a common factor."""
    window: Window | None = None
    """Rows and columns of the window that is unique: [6, 2] or 6x2; the smallest if left out."""
    factors: Factors | None = None
    """The two sequences of a product array."""
    law: list[list[Label]] | None = None
    """Product law: the symbol for each pair of terms [row][column]; q row + column if left out."""
