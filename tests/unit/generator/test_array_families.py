"""Sequences and folds: sizes, indices, errors with their way out, costs."""

import numpy as np
import pytest
from reference.polynomials import windows_are_unique

from generator.array import FoldedArray, Sequence, array_from, next_larger, profile
from generator.array.field import field_of_order
from generator.array.fold import folds, usual_fold
from generator.array.polynomial import is_primitive, primitive_polynomial
from generator.array.window import least_weight_by_dual, minimum_distance
from generator.errors import ArrayError


def block(a, b):
    return np.arange(a)[:, None], np.arange(b)


def product(family, rows, columns):
    return {"family": family, "factors": {"rows": rows, "columns": columns}}


def test_most_square_folds():
    binary = {8: (15, 17), 10: (31, 33), 12: (63, 65), 14: (127, 129), 16: (255, 257),
              18: (511, 513), 20: (1023, 1025), 24: (4095, 4097)}  # fmt: skip
    assert {n: usual_fold(2, n) for n in binary} == binary
    quaternary = {4: (15, 17), 6: (63, 65), 8: (255, 257), 10: (1023, 1025), 12: (4095, 4097)}
    assert {n: usual_fold(4, n) for n in quaternary} == quaternary
    octal = {2: (7, 9), 4: (63, 65), 6: (511, 513), 8: (4095, 4097)}
    assert {n: usual_fold(8, n) for n in octal} == octal
    assert [usual_fold(3, n) for n in (6, 9, 12)] == [(8, 91), (26, 757), (80, 6643)]
    assert [usual_fold(9, n) for n in (3, 6)] == [(8, 91), (80, 6643)]
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
