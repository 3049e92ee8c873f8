"""The running list of entities of one STEP file: numbers, shared directions, literal text.

ISO 10303-21: an entity is `#17=KIND(...);`. Text is ASCII. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from generator.export.fixed_text import whole_numbers

PLACES = 10  #: decimals of a coordinate in mm
_UNIT_PLACES = 13  #: decimals of a component of a unit vector
_PER_LINE = 12  #: references in one line of a long list


class Entities:
    """Entities that are written once, in order; the text waits until it is taken.

    Parameters
    ----------
    at_most
        No more entities will be written than this; it sets the width of the numbers:
        all have the same, as in #100000, #100001, ...
    """

    def __init__(self, at_most: int) -> None:
        self.width = max(5, len(str(at_most // 9)) + 1)
        self.next: int = 10 ** (self.width - 1)
        self._text: list[str] = []
        self._shared: dict[str, str] = {}

    def add(self, text: str) -> str:
        """Write one entity; return its reference."""
        reference = f"#{self.next}"
        self.next += 1
        self._text.append(f"{reference}={text};\n")
        return reference

    def direction(self, unit: NDArray[np.float64]) -> str:
        """Return the direction `unit`, (3,), written once however often it is used."""
        return self.direction_along(unit_text(unit))

    def direction_along(self, components: str) -> str:
        """Return the direction with these components, as `unit_text` writes them."""
        return self._once(f"DIRECTION('',{components})")

    def vector(self, unit: NDArray[np.float64]) -> str:
        """Return the vector of length 1 along `unit`."""
        return self.vector_along(unit_text(unit))

    def vector_along(self, components: str) -> str:
        """Return the vector of length 1 with these components, as `unit_text` writes them."""
        return self._once(f"VECTOR('',{self.direction_along(components)},1.)")

    def reserve(self, count: int) -> int:
        """Return the first of `count` numbers that the caller writes himself."""
        first = self.next
        self.next += count
        return first

    def taken(self) -> bytes:
        """Return the text written since the last call."""
        text = "".join(self._text).encode("ascii")
        self._text.clear()
        return text

    def _once(self, text: str) -> str:
        found = self._shared.get(text)
        if found is None:
            found = self._shared[text] = self.add(text)
        return found


def unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `vector` (..., 3) scaled to length 1."""
    length: NDArray[np.float64] = np.linalg.norm(vector, axis=-1, keepdims=True)
    return vector / length


def unit_text(unit: NDArray[np.float64]) -> str:
    """Return the components of a unit vector (3,) as STEP writes them."""
    return triple(unit, _UNIT_PLACES)


def triple(values: NDArray[np.float64], places: int) -> str:
    """Return three reals as STEP writes them: `(0.,-12.5,3.)`."""
    return "(" + ",".join(_real(value, places) for value in values.tolist()) + ")"


def reference_list(references: Iterable[str]) -> str:
    """Return references with commas, in lines that an editor can show."""
    items = list(references)
    lines = (",".join(items[i : i + _PER_LINE]) for i in range(0, len(items), _PER_LINE))
    return ",\n".join(lines)


def numbers_listed(numbers: NDArray[np.int64], width: int, block: int = 240_000) -> Iterator[bytes]:
    """Yield the references to `numbers`, all of `width` digits, as `reference_list` would."""
    for start in range(0, len(numbers), block):
        some = numbers[start : start + block]
        text = np.full((len(some), width + 3), ord("\n"), np.uint8)
        text[:, 0] = ord("#")
        text[:, 1:-2] = whole_numbers(some, width)
        text[:, -2] = ord(",")
        kept = np.ones(text.shape, bool)
        kept[:, -1] = np.arange(1, len(some) + 1) % _PER_LINE == 0
        if start + len(some) == len(numbers):
            kept[-1, -2:] = False
        yield text[kept].tobytes()


def step_string(text: str) -> str:
    r"""Return `text` as the inside of a STEP string: quotes doubled, beyond ASCII as \X2\ or \X4\.

    >>> step_string("O'Neil")
    "O''Neil"
    >>> print(step_string("Würfel"))
    W\X2\00FC\X0\rfel
    """
    if text.isascii() and text.isprintable() and "'" not in text and "\\" not in text:
        return text
    return "".join(_step_character(character) for character in text)


def _step_character(character: str) -> str:
    code = ord(character)
    if character in "'\\":
        return 2 * character
    if 32 <= code < 127:
        return character
    return f"\\X2\\{code:04X}\\X0\\" if code < 0x10000 else f"\\X4\\{code:08X}\\X0\\"


def _real(value: float, places: int) -> str:
    text = f"{value:.{places}f}".rstrip("0")
    return "0." if text == "-0." else text
