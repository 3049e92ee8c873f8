"""Sequences, folds and products: sizes, random access, errors with their way out, costs."""

import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from reference.polynomials import windows_are_unique

from generator.array import (
    PROFILES,
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


def test_rank_depends_on_differences_only():
    array = profile("thesis").array()
    assert array.rank([], []) == 0
    assert array.rank(0, 0) == 1
    assert array.rank([0, 0, 63], [0, 65, 0]) == 1  # one cell, three times
    r, c = block(4, 4)
    assert array.rank(r, c) == array.rank(r + 60, c - 3) == 10
    assert not array.identifies(r, c)
    assert array.identifies(*block(6, 2))
    assert not array.identifies(*block(2, 6))  # of 0x1099: 6x2 means six rows


def test_fold_that_is_none():
    with pytest.raises(ArrayError, match=r"63x64 is no size.*take 63x65 or 23x89"):
        array_from({"family": "prba", "rows": 63, "columns": 64})
    sequence = Sequence(field_of_order(2), primitive_polynomial(2, 12))
    with pytest.raises(ArrayError, match="take 63x65, 45x91"):
        FoldedArray(sequence, 105, 39)  # 3 divides both
    with pytest.raises(ArrayError, match=r"do not fold.*degree 12 \(63x65\) or degree 14.*prbs"):
        array_from({"family": "prba", "degree": 13})
    assert array_from({"family": "prba", "degree": 12, "rows": 65, "columns": 63}).rows == 65
    assert array_from({"family": "prba", "degree": 12, "rows": 45}).columns == 91
    assert array_from({"family": "prba", "degree": 12, "columns": 91}).rows == 45


@pytest.mark.parametrize(
    ("order", "degree", "cause", "fix"),
    [
        (2, 61, r"prime factor 2305843009213693951.*2\^40", r"degree 60 \(\d+x\d+\) or degree 62"),
        (2, 59, "prime factor 3203431780337", r"degree 58 .* or degree 60"),
        (2, 49, "prime factor 4432676798593", "degree 48 .* or degree 50"),
        (7, 19, "prime factor", "degree 18 .* or degree 20"),
    ],
)
def test_sizes_that_cannot_be_decoded_are_refused(order, degree, cause, fix):
    for family in ("prmva", "prmvs"):
        with pytest.raises(ArrayError) as caught:
            array_from({"family": family, "order": order, "degree": degree})
        caught.match(cause)
        caught.match("take degree")
        if family == "prmva":
            caught.match(fix)
    factors = {"rows": {"order": order, "degree": degree}, "columns": {"degree": 3}}
    with pytest.raises(ArrayError, match="prime factor"):
        array_from({"family": "prmvpa", "factors": factors})


def test_window_that_is_not_unique():
    with pytest.raises(ArrayError) as caught:
        array_from({"family": "prba", "polynomial": "0x1099", "window": [4, 4]})
    assert str(caught.value) == (
        "a 4x4 window of 0x1099 on 63x65 has rank 10 of 12, so it occurs more than once; "
        "take 6x2 or 5x4"
    )
    array_from({"family": "prba", "polynomial": "0x1099", "window": [5, 4]})
    for window in ([0, 3], [64, 2], [3, 66]):
        with pytest.raises(ArrayError, match="does not lie in an array of 63x65"):
            array_from({"family": "prba", "degree": 12, "window": window})
    with pytest.raises(ArrayError, match="take 4x2 or larger"):
        array_from(dict(profile("product").encoding) | {"window": [3, 2]})


@pytest.mark.parametrize(
    ("definition", "message"),
    [
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
        ({"family": "prmva", "order": 32, "degree": 9}, "is on file"),
        ({"family": "prpa"}, "factors: does not give them"),
        ({"family": "prpa", "factors": {"rows": {}, "columns": 3}}, "rows: has no degree"),
        ({"family": "prpa", "factors": {"rows": {"degree": 4}, "columns": 3}}, "is no sequence"),
        ({"family": "prpa", "factors": {"rows": {"degree": 4, "window": 2}, "columns": {}}},
         "factors: rows knows no window"),
        ({"family": "prpa", "factors": {"rows": {"degree": 4, "order": 4}, "columns": {}}},
         "binary"),
        ({"family": "prpa", "degree": 4}, "prpa knows no degree"),
    ],
)  # fmt: skip
def test_definitions_that_make_no_array(definition, message):
    with pytest.raises(ArrayError, match=message) as caught:
        array_from(definition)
    assert caught.value.fix


def test_product_law_and_sizes():
    factors = {"rows": {"degree": 4}, "columns": {"degree": 6}}
    array = array_from({"family": "prpa", "factors": factors, "law": [[0, 2], [1, 3]]})
    assert (array.rows, array.columns, array.order, array.window) == (15, 63, 4, (4, 6))
    rows, columns = array.row_sequence, array.column_sequence
    assert np.array_equal(
        array.symbols(*block(15, 63)),
        rows.symbols(block(15, 1)[0]) + 2 * columns.symbols(range(63)),
    )
    assert windows_are_unique(array, (4, 6))
    for law in ([[0, 1], [1, 2]], [[0, 1, 2, 3]], [0, 1, 2, 3]):
        with pytest.raises(ArrayError, match="injective"):
            array_from({"family": "prpa", "factors": factors, "law": law})
    with pytest.raises(ArrayError, match="rows: 16 is not the period of its sequence, 15"):
        array_from({"family": "prpa", "factors": factors, "rows": 16})
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


def test_profiles_by_name():
    assert profile() is PROFILES["one-touch"]
    with pytest.raises(ArrayError, match="unknown profile 'huge'; choose one of one-touch, thesis"):
        profile("huge")
    with pytest.raises(TypeError):
        profile().encoding["order"] = 2


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


def test_import_is_light():
    script = (
        "import sys, generator.array; "
        "heavy = {'scipy','shapely','trimesh','pydantic','sqlalchemy','yaml','typer','rich',"
        "'manifold3d','PIL','matplotlib','OCP','importlib.resources'} & set(sys.modules); "
        "print(sorted(heavy))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
