"""Sequences, folds and products: sizes, random access, errors with their way out, costs."""

import sys
import tracemalloc

import numpy as np
import pytest
from reference.polynomials import windows_are_unique

from generator.array import (
    FoldedArray,
    Sequence,
    array_from,
    next_larger,
    profile,
)
from generator.array.field import field_of_order
from generator.array.fold import folds, usual_fold
from generator.array.polynomial import is_primitive, primitive_polynomial
from generator.array.window import (
    least_weight_by_dual,
    minimum_distance,
)
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


def test_two_to_the_64_sequence_has_indices_beyond_int64():
    array = array_from({"family": "prbs", "degree": 64})
    n = array.columns
    assert (array.rows, n, array.window, array.family) == (1, 2**64 - 1, (1, 64), "prbs")
    last = array.symbols(0, np.array([n - 1, 2**64 - 3], dtype=object))
    assert last.tolist() == array.symbols(5, [-1, -2]).tolist()
    assert array.symbols(0, [0, -1, 2**64 - 2]).tolist()[1:] == [last[0], last[0]]
    assert array.symbols(0, np.array([2**64 - 2], dtype=np.uint64)).tolist() == [last[0]]


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


def test_a_fold_has_sides_without_a_common_factor_that_may_be_given_by_one():
    sequence = Sequence(field_of_order(2), primitive_polynomial(2, 12))
    with pytest.raises(ArrayError, match="take 63x65, 45x91"):
        FoldedArray(sequence, 105, 39)  # 3 divides both
    binary = {"family": "prba", "degree": 12}
    for given, size in (
        ({"rows": 65, "columns": 63}, (65, 63)),
        ({"rows": 45}, (45, 91)),
        ({"columns": 91}, (45, 91)),
    ):
        array = array_from(binary | given)
        assert (array.rows, array.columns) == size


@pytest.mark.parametrize(
    ("definition", "message"),
    [
        *[
            ({"family": family, "order": order, "degree": degree}, f"{cause}.*take degree {fix}")
            for order, degree, cause, fix in (
                (2, 61, r"prime factor 2305843009213693951.*2\^40", r"60 \(\d+x\d+\) or degree 62"),
                (2, 59, "prime factor 3203431780337", "58 .* or degree 60"),
                (2, 49, "prime factor 4432676798593", "48 .* or degree 50"),
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
        ({"family": "anoto"}, "family 'anoto'"),
        ({"family": "prba", "order": 4, "degree": 6}, "binary.*take family prmva"),
        ({"family": "prmva", "degree": 6}, "needs the order"),
        ({"family": "prmva", "order": 4}, "no size.*give degree"),
        ({"family": "prmva", "order": 6, "degree": 2}, "prime power"),
        ({"family": "prba", "degree": 12, "taps": [1]}, "knows no taps; use family, order"),
        ({"family": "prba", "degree": "12"}, "degree: '12' is no positive integer"),
        ({"family": "prba", "degree": True}, "degree: True is no positive integer"),
        ({"family": "prba", "degree": 0}, "degree: 0"),
        ({"family": "prba", "degree": 65}, "take a degree from 1 to 64"),
        ({"family": "prba", "degree": 11, "polynomial": "0x1099"}, "set degree: 12"),
        ({"family": "prba", "polynomial": "0x1fff"}, "0x1fff is not primitive"),
        ({"family": "prba", "polynomial": 1.5}, "is not understood"),
        ({"family": "prba", "polynomial": [1, 2, 0, 0, 1]}, "labels 0 to 1"),
        ({"family": "prba", "degree": 12, "initial": [0] * 12}, "not all 0"),
        ({"family": "prba", "degree": 12, "initial": [1]}, "give 12 labels"),
        ({"family": "prba", "degree": 12, "initial": "1"}, "no list of labels"),
        ({"family": "prba", "degree": 12, "window": 3}, "window: 3"),
        ({"family": "prba", "degree": 12, "window": [3]}, r"window: \[3\]"),
        ({"family": "prbs", "degree": 12, "rows": 63}, "prbs has one row, not 63; take prba"),
        ({"family": "prmva", "order": 4, "degree": 6, "field": [1, 0, 1]}, "not a primitive"),
        ({"family": "prmva", "order": 4, "degree": 6, "field": "x"}, "no minimal polynomial"),
        ({"family": "prmva", "order": 32, "degree": 11}, "is on file"),
        ({"family": "prpa"}, "factors: does not give them"),
        (product("prpa", {}, 3), "rows: has no degree"),
        (product("prpa", {"degree": 4}, 3), "is no sequence"),
        (product("prpa", {"degree": 4, "window": 2}, {}), "factors: rows knows no window"),
        (product("prpa", {"degree": 4, "order": 4}, {}), "binary"),
        ({"family": "prpa", "degree": 4}, "prpa knows no degree"),
    ],
)  # fmt: skip
def test_definitions_that_make_no_array(definition, message):
    with pytest.raises(ArrayError, match=message) as caught:
        array_from(definition)
    assert caught.value.fix


def test_product_law_and_sizes():
    given = product("prpa", {"degree": 4}, {"degree": 6})
    array = array_from(given | {"law": [[0, 2], [1, 3]]})
    assert (array.rows, array.columns, array.order, array.window) == (15, 63, 4, (4, 6))
    rows, columns = array.row_sequence, array.column_sequence
    assert np.array_equal(
        array.symbols(*block(15, 63)),
        rows.symbols(block(15, 1)[0]) + 2 * columns.symbols(range(63)),
    )
    assert windows_are_unique(array, (4, 6))
    for law in ([[0, 1], [1, 2]], [[0, 1, 2, 3]], [0, 1, 2, 3]):
        with pytest.raises(ArrayError, match="injective"):
            array_from(given | {"law": law})
    with pytest.raises(ArrayError, match="rows: 16 is not the period of its sequence, 15"):
        array_from(given | {"rows": 16})
    assert array.rank([], []) == 0
    assert array.minimum_distance([0], [0]) == 0


def test_definition_keeps_start_and_field():
    given = {"family": "prmva", "order": 16, "degree": 2, "field": [1, 0, 0, 1, 1]}
    field = field_of_order(16, (1, 0, 0, 1, 1))
    every = ((c, b, 1) for b in range(1, 16) for c in range(2, 16))
    polynomial = next(h for h in every if is_primitive(field, h))
    array = array_from(given | {"polynomial": list(polynomial), "initial": [7, 3]})
    again = array_from(array.definition())
    assert again.definition()["field"] == [1, 0, 0, 1, 1]
    assert array.sequence.symbols([0, 1]).tolist() == [7, 3]
    assert np.array_equal(again.symbols(*block(15, 17)), array.symbols(*block(15, 17)))
    assert windows_are_unique(array, array.window)


def test_large_and_up():
    large = next_larger(profile("large"))
    assert (large.name, large.pitch_mm, large.alphabet) == ("large", 7.0, "dense-4")
    array = large.array()
    assert (array.rows, array.columns) == (511, 513)
    assert array.window == large.window
    assert array.identifies(*block(*large.window))
    degree = 9
    while degree < 32:
        large = next_larger(large)
        assert large.array().full_rank > degree
        degree = large.array().full_rank
    with pytest.raises(ArrayError, match=r"no array over GF\(4\) is larger"):
        next_larger(large)
    with pytest.raises(ArrayError, match="not a folded array"):
        next_larger(profile("product"))


def test_distance_by_dual_equals_distance_by_listing():
    for q, n, cells in ((2, 8, 17), (3, 4, 9), (4, 4, 8), (5, 3, 7), (9, 2, 4)):
        sequence = Sequence(field_of_order(q), primitive_polynomial(q, n))
        offsets = [(7 * k * k + k) % sequence.period for k in range(cells)]
        offsets = list(dict.fromkeys(offsets))
        listed = minimum_distance(sequence, offsets, [1] * len(offsets))
        if sequence.rank(offsets) == n:
            assert least_weight_by_dual(sequence.field, sequence.coefficients(offsets)) == listed
            assert listed >= 1


def test_distance_on_large_arrays():
    array = array_from({"family": "prba", "degree": 24})  # 4095x4097, window 12x2
    assert array.minimum_distance(*block(12, 2)) == 1
    assert array.minimum_distance(*block(3, 3)) == 0
    d = array.minimum_distance(*block(6, 6))
    assert d >= 1
    with pytest.raises(ArrayError, match=r"out of reach: exact up to 1048576 places"):
        array.minimum_distance(*block(9, 9))


def test_a_face_costs_what_it_shows():
    """Work is counted, not timed: calls, and bytes held at once for a cell that is shown."""

    def cost(work):
        work()  # fields and polynomials are found once
        calls = 0

        def count(_frame, event, _argument):
            nonlocal calls
            calls += event in ("call", "c_call")

        tracemalloc.start()
        sys.setprofile(count)
        try:
            work()
        finally:
            sys.setprofile(None)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        return calls, peak

    rows = 10 * np.arange(6)[:, None, None] + np.arange(8)[:, None]
    columns = 9 * np.arange(6)[:, None, None] + np.arange(8)
    small = cost(lambda: profile().array().symbols(rows, columns))
    assert small[0] < 5_000
    assert small[1] < 300_000  # bytes; 384 cells of 4,095
    huge = {"family": "prba", "degree": 64}
    face = 2**31 + np.arange(64)[:, None], 2**30 + np.arange(64)
    large = cost(lambda: array_from(huge).symbols(*face))
    assert large[0] < 30_000
    assert large[1] < 8_000_000  # bytes; 4,096 cells of 2^64
