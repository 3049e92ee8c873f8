"""Text with fields of fixed width, stamped many times at the speed of an array copy.

A template is written once with marked fields (entity numbers, decimals, names); every instance is
a row of bytes in which only the fields are overwritten. All numbers of one kind have the same
width, so that a block of a thousand instances is one (m, length) array of bytes.

By hand because neither numpy nor Python formats many numbers at once: a million coordinates
take 0.06 s of CPU here and 0.17 s as one `%` over a tuple, before names and numbers are set in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

NUMBER, DECIMAL = "\x01", "\x02"  #: marks of the bytes of number and decimal fields
NAMES = "\x03\x04\x05"  #: marks of up to three kinds of names
REFERENCE = "\x06"  #: before the digits that say which of a file's own entities is meant
_SPACE, _ZERO, _POINT, _MINUS = 32, 48, 46, 45

_FOUR_DIGITS = np.stack(
    [np.arange(10_000) // 10**place % 10 + _ZERO for place in (3, 2, 1, 0)],
    1,
    dtype=np.uint8,
    casting="unsafe",
).view(np.uint32)[:, 0]  #: (10000,) the text of each, as one item


@dataclass(frozen=True, slots=True)
class TextTemplate:
    """A text and where its fields stand."""

    text: Bytes  #: (length,) ASCII with marked fields
    numbers: NDArray[np.int64]  #: (n,) value of each number field, relative to the instance
    number_columns: NDArray[np.intp]  #: (n,) first byte of each number field
    decimal_columns: NDArray[np.intp]  #: (d * width,) bytes of the decimal fields
    name_columns: tuple[NDArray[np.intp], ...]  #: per kind of name: (k * width,) bytes


def template_of(text: str, numbers: list[int], width: int) -> TextTemplate:
    """Return the template of `text`, whose number fields, `width` long, hold `numbers` in turn."""
    array = np.frombuffer(text.encode("ascii"), np.uint8)
    return TextTemplate(
        array,
        np.array(numbers, np.int64),
        np.flatnonzero(array == ord(NUMBER))[::width],
        np.flatnonzero(array == ord(DECIMAL)),
        tuple(np.flatnonzero(array == ord(mark)) for mark in NAMES),
    )


def reference_field(number: int, width: int) -> str:
    """Return the field of the entity `number` of a list, as long as `#` and `width` digits."""
    return f"{REFERENCE}{number:0{width}}"


def with_references(text: Bytes, references: list[str], width: int) -> Bytes:
    """Return a text whose reference fields hold the references, each `#` and `width` digits."""
    at = np.flatnonzero(text == ord(REFERENCE))[:, None] + np.arange(width + 1)
    given = np.frombuffer("".join(references).encode("ascii"), np.uint8).reshape(-1, width + 1)
    digits = text[at[:, 1:]].astype(np.int64) - _ZERO
    filled = text.copy()
    filled[at] = given[digits @ 10 ** np.arange(width - 1, -1, -1)]
    return filled


def stamp(
    template: TextTemplate,
    first: NDArray[np.int64],
    width: int,
    decimals: Bytes,
    names: tuple[Bytes, ...],
) -> memoryview:
    """Return the text of m instances.

    Parameters
    ----------
    first
        (m,) added to the relative numbers of each instance.
    width
        Digits of every number.
    decimals
        (m, d, decimal width) text of the decimal fields of each instance.
    names
        Per kind of name: (m, width) text that fills every field of that kind.
    """
    m, length = len(first), len(template.text)
    block = np.empty((m, length), np.uint8)
    block[:] = template.text
    span = int(template.numbers.max(initial=0)) + 1
    table = whole_numbers(first[:, None] + np.arange(span), width).view(f"V{width}")[..., 0]
    # All bytes from which a field can begin, so that a number is copied as one item.
    fields = np.ndarray((m, length - width + 1), f"V{width}", block, 0, (length, 1))
    fields[:, template.number_columns] = table[:, template.numbers]
    block[:, template.decimal_columns] = decimals.reshape(m, -1)
    for columns, rows in zip(template.name_columns, names, strict=True):
        if len(columns):
            block[:, columns] = np.tile(rows, (1, len(columns) // rows.shape[1]))
    return block.reshape(-1).data


def whole_numbers(values: NDArray[np.int64], width: int) -> Bytes:
    """Return the decimal digits of non-negative integers, shape (..., width), zero-padded."""
    out = np.empty((*values.shape, width), np.uint8)
    rest = values
    for end in range(width, 0, -4):  # four digits at a time
        rest, low = np.divmod(rest, 10_000)
        four, start = _FOUR_DIGITS[low], max(end - 4, 0)
        if end >= 4:
            np.ndarray(values.shape, np.uint32, out, start, out.strides[:-1])[...] = four
        else:
            digits = four.view(np.uint8).reshape(*values.shape, 4)
            for column in range(end):
                out[..., column] = digits[..., column - end]
    return out


def decimal_width(largest: float, places: int) -> int:
    """Return the width that holds every number up to `largest` with sign and `places` decimals."""
    return len(str(int(abs(largest)) + 1)) + places + 2


def decimal_numbers(values: NDArray[np.float64], width: int, places: int) -> Bytes:
    """Return `values` rounded to `places` decimals as text, shape (..., width), spaces in front.

    Zero has no sign. `width` is at least `decimal_width` of the largest value.
    """
    scaled = np.rint(values * 10.0**places).astype(np.int64)
    digits = whole_numbers(np.abs(scaled), width - 1)
    point = width - 1 - places
    out = np.empty((*values.shape, width), np.uint8)
    out[..., :point], out[..., point], out[..., point + 1 :] = (
        digits[..., :point], _POINT, digits[..., point:]
    )  # fmt: skip
    assert np.abs(scaled).max(initial=0) < 10 ** (width - 2), "a number is wider than its field"
    unsigned = scaled >= 0
    for column in range(point - 2, -1, -1):  # the digit before the point is always written
        ended = np.abs(scaled) < 10 ** (width - 2 - column)
        sign = np.where(unsigned, _SPACE, _MINUS).astype(np.uint8)
        out[..., column] = np.where(ended, sign, out[..., column])
        unsigned |= ended
    return out


def number_lines(
    words: tuple[str, ...], rows: NDArray[np.float64] | NDArray[np.int64], places: int
) -> bytes:
    """Return one line for each row of numbers (n, k), without needless zeros.

    `words`: (k + 1) ASCII texts around the numbers of a row; `places`: decimals to round to, 0 for
    integers. Some thousand rows at once stay in the cache.
    """
    scaled = np.rint(rows.T * 10.0**places).astype(np.int64) if places else rows.T
    sizes = np.abs(scaled)
    largest = int(sizes.max(initial=0))
    if largest < 1 << 32:  # divided twice as fast
        sizes = sizes.astype(np.uint32)
    whole = max(len(str(largest)) - places, 1)
    field = 1 + whole + (1 + places if places else 0)
    line = ("\0" * field).join(words).encode("ascii")
    block = np.empty((len(rows), len(line)), np.uint8)
    block[:] = np.frombuffer(line, np.uint8)
    text = np.empty((field, len(rows)), np.uint8)
    at = 0
    for word, numbers, size in zip(words[:-1], scaled, sizes, strict=True):
        at += len(word)
        _put_digits(text[1:], size, places)
        text[0] = _MINUS * (numbers < 0)
        block[:, at : at + field] = text.T
        at += field
    return block.tobytes().translate(None, b"\0")


def _put_digits(field: Bytes, rest: NDArray[np.unsignedinteger | np.int64], places: int) -> None:
    """Write numbers of 10^-places into the rows of a field; needless zeros as bytes of zero."""
    last = len(field) - 1
    if places:
        needless = np.ones(len(rest), np.bool_)
        for row in range(last, last - places, -1):
            rest, digit = _last_digit(rest)
            needless &= digit == _ZERO
            field[row] = digit * ~needless
        last -= places + 1
        field[last + 1] = _POINT * ~needless
    rest, field[last] = _last_digit(rest)  # always written
    for row in range(last - 1, -1, -1):
        needed = rest > 0
        rest, digit = _last_digit(rest)
        field[row] = digit * needed


def _last_digit(
    values: NDArray[np.unsignedinteger | np.int64],
) -> tuple[NDArray[np.unsignedinteger | np.int64], Bytes]:
    """Return a tenth of the values, rounded down, and the text of their last digits."""
    quotient = values // 10
    return quotient, (values - 10 * quotient + _ZERO).astype(np.uint8)


def pad(names: list[str]) -> Bytes:
    """Return ASCII texts as rows of equal width, spaces behind, shape (m, width)."""
    width = max(map(len, names), default=0)
    text = "".join(name.ljust(width) for name in names)
    return np.frombuffer(text.encode("ascii"), np.uint8).reshape(len(names), width)
