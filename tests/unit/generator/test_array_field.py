"""GF(q) tables, factors, polynomials and the ones on file."""

import itertools
import math

import numpy as np
import pytest

from generator.array import factor, polynomial
from generator.array.field import (
    MINIMAL_POLYNOMIALS,
    field_of_order,
    format_polynomial,
    parse_polynomial,
)
from generator.array.residue import Residues
from generator.errors import ArrayError

ORDERS = [2, 3, 4, 5, 7, 8, 9, 11, 13, 16, 25, 27, 32, 49, 64, 81, 121, 125, 128, 169, 243, 256]


@pytest.mark.parametrize("q", [2, 3, 4, 5, 7, 8, 9, 11, 16, 25, 27, 49])
def test_field_axioms_exhaustively(q):
    field = field_of_order(q)
    add, mul = field.addition, field.multiplication
    a = np.arange(q)
    assert np.array_equal(add[0], a)
    assert np.array_equal(mul[1], a)
    assert not mul[0].any()
    assert np.array_equal(add, add.T)
    assert np.array_equal(mul, mul.T)
    x, y, z = a[:, None, None], a[:, None], a
    assert np.array_equal(add[add[x, y], z], add[x, add[y, z]])
    assert np.array_equal(mul[mul[x, y], z], mul[x, mul[y, z]])
    assert np.array_equal(mul[x, add[y, z]], add[mul[x, y], mul[x, z]])
    assert not add[a, field.negative].any()
    assert (mul[a[1:], field.inverse[1:]] == 1).all()


@pytest.mark.parametrize("q", sorted(MINIMAL_POLYNOMIALS))
def test_minimal_polynomials_are_conways(q):
    """The definition: first in Conway's order, primitive, and compatible with each subfield."""
    p, m = factor.prime_power(q)

    def compatible(candidate):
        ring = Residues(p, candidate)
        if not ring.is_primitive(factor.period_factors(p, m)):
            return False
        for d in range(1, m):
            if m % d == 0:
                root = ring.power_of_x((q - 1) // (p**d - 1))
                value, power = np.zeros(m), ring.powers_of_x[0]
                for coefficient in smaller(d):
                    value = (value + coefficient * power) % p
                    power = ring.product(power, root)
                if value.any():
                    return False
        return True

    def smaller(d):
        if d > 1:
            return MINIMAL_POLYNOMIALS[p**d]
        generator = next(g for g in range(1, p) if p == 2 or multiplicative_order(g, p) == p - 1)
        return (-generator % p, 1)

    for signed in itertools.product(range(p), repeat=m):  # c_k = (-1)^(m-k) signed_k
        candidate = (*((-1) ** (m - k) * signed[m - 1 - k] % p for k in range(m)), 1)
        if candidate[0] and compatible(candidate):
            assert candidate == MINIMAL_POLYNOMIALS[q]
            return
    pytest.fail("no candidate")


def multiplicative_order(a, p):
    return next(k for k in range(1, p) if pow(a, k, p) == 1)


def test_other_minimal_polynomial_and_large_fields():
    field = field_of_order(16, (1, 0, 0, 1, 1))
    assert field.addition[1, field.multiplication[2, field.multiplication[2, 2]]] == 5
    assert field_of_order(343).order == 343
    with pytest.raises(ArrayError, match=r"not a primitive polynomial of degree 4.*take \[1, 1, 0"):
        field_of_order(16, (1, 1, 1, 1, 1))
    with pytest.raises(ArrayError, match="prime power; take one of 4, 5, 7, 8"):
        field_of_order(6)
    with pytest.raises(ArrayError, match="up to 1024"):
        field_of_order(2048)
    for wrong in (1, 0, -3):
        with pytest.raises(ArrayError, match="no field has"):
            field_of_order(wrong)


def test_prime_factors():
    assert factor.prime_factors(1) == {}
    for number in range(1, 3000):
        found = factor.prime_factors(number)
        assert math.prod(p**e for p, e in found.items()) == number
        assert all(all(p % d for d in range(2, math.isqrt(p) + 1)) for p in found)
    for a, b in ((1009, 1013), (1000003, 1000003), (4294967291, 4294967279)):
        assert factor.prime_factors(a * b) == {a: 1, b: 1} | ({a: 2} if a == b else {})
    assert factor.prime_factors(1000003**3) == {1000003: 3}
    assert not factor.is_prime(3215031751)  # passes for the bases 2, 3, 5, 7


@pytest.mark.parametrize("q", [2, 3, 4, 5, 7, 8, 9, 16, 25, 27])
def test_period_factors_multiply_to_the_period(q):
    n = 1
    while q**n <= 2**64:
        found = factor.period_factors(q, n)
        assert math.prod(p**e for p, e in found.items()) == q**n - 1
        assert all(map(factor.is_prime, found))
        n += 1
    with pytest.raises(ArrayError, match=rf"take a degree from 1 to {n - 1}"):
        factor.period_factors(q, n)


def test_every_polynomial_on_file_is_primitive():
    entries = polynomial.known_polynomials()
    degrees = {q: {p.degree for p in entries if p.order == q} for q in ORDERS}
    assert degrees[2] == set(range(2, 65))
    assert degrees[4] == set(range(1, 33))
    assert degrees[8] == set(range(1, 22))
    for q in (3, 5, 7, 9, 11, 13, 16, 25, 27):
        assert degrees[q] == {n for n in range(1, 65) if q**n <= 2**64}
    for entry in entries:
        field = field_of_order(entry.order)
        assert len(entry.labels) == entry.degree + 1, entry
        assert polynomial.is_primitive(field, entry.labels), entry
    sources = {"appendix 4", "table 5.1", "table 5.3", "robust", "three windows", "search"}
    assert {entry.source for entry in entries} == sources


@pytest.mark.parametrize(("q", "n"), [(2, 17), (2, 40), (3, 11), (4, 12), (5, 6), (9, 1), (16, 2)])
def test_search_repeats_what_is_on_file(q, n):
    assert polynomial.search_primitive(q, n) == polynomial.primitive_polynomial(q, n)


def test_polynomials_that_drive_no_register():
    binary = field_of_order(2)
    assert not polynomial.is_primitive(binary, (0, 1, 1))
    for wrong in ((0, 1, 1), (1,), (1, 1, 2), (1, 1.5, 1), (1, 1, 0)):
        with pytest.raises(ArrayError):
            polynomial.monic(binary, wrong)
    with pytest.raises(ArrayError, match="at most 2\\^64 - 1"):
        polynomial.monic(binary, [1] * 66)


@pytest.mark.parametrize(
    ("q", "text", "labels"),
    [
        (2, "0x1099", (1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 0, 1)),
        (2, "x^4 + x + 1", (1, 1, 0, 0, 1)),
        (3, "x^3+2x+1", (1, 2, 0, 1)),
        (4, "x^10+x^3+A(x^2+x+1)", (2, 2, 2, 1, 0, 0, 0, 0, 0, 0, 1)),
        (4, "x^4+x^2+A*x+A^2", (3, 2, 1, 0, 1)),
        (9, "x^2+2x+A^9", (2, 5, 1)),  # 2 = A^4, A^9 = A
        (4, "x+x+x^2+A", (2, 0, 1)),
    ],
)
def test_written_polynomials(q, text, labels):
    field = field_of_order(q)
    assert parse_polynomial(field, text) == labels
    assert parse_polynomial(field, format_polynomial(field, labels)) == labels


@pytest.mark.parametrize(
    ("q", "text"),
    [(2, ""), (2, "x^2+y"), (2, "x^2+A"), (3, "x^2+3"), (4, "0x13"), (4, "A(x+(1))"), (2, "x^99"),
     (2, "x^^2"), (4, "x^2-A")],
)  # fmt: skip
def test_polynomials_that_are_not_understood(q, text):
    with pytest.raises(ArrayError):
        parse_polynomial(field_of_order(q), text)
