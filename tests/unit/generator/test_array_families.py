"""GF(q) tables, factors and polynomials; sequences and folds, their errors, what they cost."""

import itertools
import math

import numpy as np
import pytest
from reference.polynomials import windows_are_unique

from generator.array import Sequence, array_from, factor, next_larger, polynomial, profile
from generator.array.field import (
    MINIMAL_POLYNOMIALS,
    field_of_order,
    format_polynomial,
    parse_polynomial,
)
from generator.array.fold import FoldedArray, folds, usual_fold
from generator.array.polynomial import is_primitive, primitive_polynomial
from generator.array.residue import Residues
from generator.array.window import least_weight_by_dual, minimum_distance
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


def block(a, b):
    return np.arange(a)[:, None], np.arange(b)


def product(family, rows, columns):
    return {"family": family, "factors": {"rows": rows, "columns": columns}}


def test_most_square_folds():
    binary = {8: (15, 17), 10: (31, 33), 12: (63, 65), 14: (127, 129), 16: (255, 257),
              18: (511, 513), 20: (1023, 1025), 24: (4095, 4097)}  # fmt: skip
    quaternary = {4: (15, 17), 6: (63, 65), 8: (255, 257), 10: (1023, 1025), 12: (4095, 4097)}
    octal = {2: (7, 9), 4: (63, 65), 6: (511, 513), 8: (4095, 4097)}
    ternary, of_nine = {6: (8, 91), 9: (26, 757), 12: (80, 6643)}, {3: (8, 91), 6: (80, 6643)}
    known = {2: binary, 3: ternary, 4: quaternary, 8: octal, 9: of_nine}
    assert {q: {n: usual_fold(q, n) for n in sizes} for q, sizes in known.items()} == known
    assert usual_fold(2, 13) is None
    assert folds(2, 6) == [(7, 9)]


def test_shapes_and_kinds_of_indices():
    array = profile().array()
    assert array.symbols(3, 4).shape == ()
    assert array.symbols([], []).shape == (0,)
    assert array.symbols(np.zeros((5, 1), int), np.zeros((1, 0), int)).shape == (5, 0)
    assert array.symbols([[1], [2]], [1, 2, 3]).shape == (2, 3)
    assert array.symbols(-1, -1) == array.symbols(62, 64) == array.symbols(62 + 63, 64 - 650)
    assert array.symbols(np.int8(-1), np.uint8(64)) == array.symbols(62, 64)
    for wrong in (1.0, [0.5], True, "a", [None], np.array([1.0]), [2**64, 0.5]):
        with pytest.raises(ArrayError, match="pair of integers"):
            array.symbols(wrong, 0)
    assert array.symbols([1, 2], 3).dtype == np.int64
    assert array.rank([], []) == 0
    assert array.rank([0, 0, 63], [0, 65, 0]) == 1  # one cell, three times


def test_sides_of_a_fold_have_no_common_factor_and_one_gives_the_other():
    with pytest.raises(ArrayError, match="take 63x65, 45x91"):
        FoldedArray(Sequence(field_of_order(2), primitive_polynomial(2, 12)), 105, 39)
    for given, size in (({"rows": 45}, (45, 91)), ({"columns": 91}, (45, 91))):
        array = array_from({"family": "prba", "degree": 12} | given)
        assert (array.rows, array.columns) == size


@pytest.mark.parametrize(
    ("definition", "message"),
    [
        *[
            ({"family": family, "order": order, "degree": degree}, f"{cause}.*take degree {fix}")
            for order, degree, cause, fix in (
                (2, 61, r"prime factor 2305843009213693951.*2\^40", r"60 \(\d+x\d+\) or degree 62"),
                (2, 59, "prime factor 3203431780337", "58 .* or degree 60"),
                (7, 19, "prime factor", "18 .* or degree 20"),
            )
            for family, fix in (("prmva", fix), ("prmvs", ""))
        ],
        (product("prmvpa", {"order": 2, "degree": 61}, {"degree": 3}), "prime factor"),
        ({"family": "prba", "degree": 13},
         r"do not fold.*degree 12 \(63x65\) or degree 14.*prbs"),
        ({"family": "prba", "polynomial": "0x1099", "window": [4, 4]},
         ".*has rank 10 of 12, so it occurs more than once; take 6x2 or 5x4"),
        *[({"family": "prba", "degree": 12, "window": window}, "does not lie in an array of 63x65")
          for window in ([0, 3], [64, 2], [3, 66])],
        (dict(profile("product").encoding) | {"window": [3, 2]}, "take 4x2 or larger"),
        ({"family": "prmva", "order": 121, "degree": 2}, "none is for this field"),
        ({}, "family None is none.*prbs, prba"),
        ({"family": "prba", "order": 4, "degree": 6}, "binary.*take family prmva"),
        ({"family": "prmva", "order": 4}, "no size.*give degree"),
        ({"family": "prba", "degree": 12, "taps": [1]}, "knows no taps; use family, order"),
        ({"family": "prba", "degree": "12"}, "degree: '12' is no positive integer"),
        ({"family": "prba", "degree": 65}, "take a degree from 1 to 64"),
        ({"family": "prba", "degree": 11, "polynomial": "0x1099"}, "set degree: 12"),
        ({"family": "prba", "polynomial": "0x1fff"}, "0x1fff is not primitive"),
        ({"family": "prba", "polynomial": [1, 2, 0, 0, 1]}, "labels 0 to 1"),
        ({"family": "prba", "degree": 12, "initial": [0] * 12}, "not all 0"),
        ({"family": "prba", "degree": 12, "initial": [1]}, "give 12 labels"),
        ({"family": "prbs", "degree": 12, "rows": 63}, "prbs has one row, not 63; take prba"),
        ({"family": "prmva", "order": 4, "degree": 6, "field": [1, 0, 1]}, "not a primitive"),
        ({"family": "prmva", "order": 32, "degree": 11}, "is on file"),
        ({"family": "prpa"}, "factors: does not give them"),
        (product("prpa", {}, 3), "rows: has no degree"),
        (product("prpa", {"degree": 4, "window": 2}, {}), "factors: rows knows no window"),
        ({"family": "prpa", "degree": 4}, "prpa knows no degree"),
        *[(product("prpa", {"degree": 4}, {"degree": 6}) | {"law": law}, "injective")
          for law in ([[0, 1], [1, 2]], [[0, 1, 2, 3]], [0, 1, 2, 3])],
        (product("prpa", {"degree": 4}, {"degree": 6}) | {"rows": 16},
         "rows: 16 is not the period of its sequence, 15"),
    ],
)  # fmt: skip
def test_definitions_that_make_no_array(definition, message):
    with pytest.raises(ArrayError, match=message) as caught:
        array_from(definition)
    assert caught.value.fix


def test_a_definition_keeps_its_field():
    field = [1, 0, 0, 1, 1]
    given = {"family": "prmva", "order": 16, "degree": 2, "field": field, "initial": [7, 3]}
    every = ((2, b, 1) for b in range(16))
    h = next(h for h in every if is_primitive(field_of_order(16, field), h))
    array = array_from(given | {"polynomial": list(h)})
    again = array_from(array.definition())
    assert again.definition()["field"] == field
    assert np.array_equal(again.symbols(*block(15, 17)), array.symbols(*block(15, 17)))
    assert windows_are_unique(array, array.window)


def test_the_next_larger_arrays_end():
    large, size = profile("large"), 0
    while size < 32:
        large = next_larger(large)
        array = large.array()
        assert (large.pitch_mm, large.alphabet, large.window) == (7.0, "dense-4", array.window)
        assert array.full_rank > size
        size = array.full_rank
    with pytest.raises(ArrayError, match=r"no array over GF\(4\) is larger"):
        next_larger(large)
    with pytest.raises(ArrayError, match="not a folded array"):
        next_larger(profile("product"))


def test_distance_by_dual_equals_distance_by_listing():
    for q, n, cells in ((2, 8, 17), (3, 4, 9), (4, 4, 8), (5, 3, 7), (9, 2, 4)):
        sequence = Sequence(field_of_order(q), primitive_polynomial(q, n))
        offsets = list(dict.fromkeys((7 * k * k + k) % sequence.period for k in range(cells)))
        listed = minimum_distance(sequence, offsets, [1] * len(offsets))
        if sequence.rank(offsets) == n:
            assert least_weight_by_dual(sequence.field, sequence.coefficients(offsets)) == listed
            assert listed >= 1


def test_distance_on_large_arrays():
    array = array_from({"family": "prba", "degree": 24})  # 4095x4097, window 12x2
    assert array.minimum_distance(*block(12, 2)) == 1
    assert array.minimum_distance(*block(3, 3)) == 0
    assert array.minimum_distance(*block(6, 6)) >= 1
    with pytest.raises(ArrayError, match=r"out of reach: exact up to 1048576 places"):
        array.minimum_distance(*block(9, 9))
