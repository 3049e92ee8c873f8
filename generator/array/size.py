"""Sizes of folded arrays: which rows and columns a degree allows, and which decode.

n1 n2 = q^n - 1, coprime (thesis 5.2; the general fold). The most square ones with
n1 = q^k - 1 over GF(2): 15x17, 31x33, 63x65, 127x129, 255x257, ...; over GF(4): 15x17,
63x65, 255x257, 1023x1025, 4095x4097.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import prod

from generator.array.factor import (
    LARGEST_PERIOD,
    LARGEST_PRIME_FACTOR,
    is_decodable,
    period_factors,
)
from generator.errors import ArrayError


def folds(order: int, degree: int) -> list[tuple[int, int]]:
    """Return every coprime (rows, columns), 1 < rows < columns, the most square first."""
    parts = [prime**exponent for prime, exponent in period_factors(order, degree).items()]
    period = prod(parts)
    divisors = {prod(chosen) for chosen in _subsets(parts)}
    pairs = [(rows, period // rows) for rows in divisors if 1 < rows < period // rows]
    return sorted(pairs, key=lambda pair: pair[1])


def _subsets(parts: list[int]) -> Iterator[Iterable[int]]:
    for chosen in range(1 << len(parts)):
        yield [part for place, part in enumerate(parts) if chosen >> place & 1]


def usual_fold(order: int, degree: int) -> tuple[int, int] | None:
    """Return the most square fold with rows = q^k - 1 (thesis 5.2), or the most square of all."""
    every = folds(order, degree)
    powers = {order**k - 1 for k in range(1, degree)}
    return next((pair for pair in every if pair[0] in powers), every[0] if every else None)


def no_fold(order: int, degree: int, rows: int, columns: int) -> ArrayError:
    """Return the error for rows and columns that do not fold; it names some that do."""
    period = order**degree - 1
    allowed = folds(order, degree)
    if allowed:
        names = ", ".join(f"{a}x{b}" for a, b in allowed[:3])
        way_out = f"take {names}, or rows and columns exchanged"
    else:
        way_out = f"{period} has no coprime factors: take family prbs or prmvs, or another degree"
    return ArrayError(
        f"{rows}x{columns} does not fold the {period} terms of degree {degree} over GF({order}): "
        "rows and columns must be coprime with that product",
        fix=way_out,
    )


def nearest_sizes(order: int, degree: int) -> list[tuple[int, tuple[int, int]]]:
    """Return (degree, usual fold) of the nearest arrays, below and above, that fold and decode."""
    found = []
    for step in (-1, 1):
        n = degree + step
        while n > 1 and order**n - 1 <= LARGEST_PERIOD:
            fold = usual_fold(order, n) if is_decodable(order, n) else None
            if fold is not None:
                found.append((n, fold))
                break
            n += step
    return found


def require_foldable(order: int, degree: int) -> tuple[int, int]:
    """Return the usual fold of a degree that folds and decodes.

    Raises
    ------
    ArrayError
        Naming the nearest sizes, if q^n - 1 has no coprime factors or a prime factor beyond
        2^40, which is too large for the discrete logarithm.
    """
    largest = max(period_factors(order, degree), default=1)
    fold = usual_fold(order, degree)
    near = nearest_sizes(order, degree)
    way_out = "take " + " or ".join(f"degree {n} ({a}x{b})" for n, (a, b) in near)
    terms = order**degree - 1
    if largest > LARGEST_PRIME_FACTOR:
        raise ArrayError(
            f"an array of {terms} cells (degree {degree} over GF({order})) cannot be decoded: "
            f"{terms} has the prime factor {largest}, and the logarithm is limited to 2^40",
            fix=way_out,
        )
    if fold is None:
        raise ArrayError(
            f"the {terms} terms of degree {degree} over GF({order}) do not fold: {terms} has no "
            "two coprime factors",
            fix=f"{way_out}, or family {'prbs' if order == 2 else 'prmvs'}",
        )
    return fold
