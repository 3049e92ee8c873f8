"""Decode after encode is the identity; up to t errors are corrected; nothing is guessed."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference.polynomials import mulmod

from decoder import Likelihood, decode_exact, strength
from decoder.element import Keys, elements_of
from decoder.register import eliminate
from generator.array import PROFILES, array_from
from generator.array.field import field_of_order

FOLDS = [
    array_from({"family": "prba" if q == 2 else "prmva", "order": q, "degree": n})
    for q, n in ((2, 8), (2, 12), (2, 48), (2, 64), (3, 8), (4, 6), (4, 32), (8, 4), (9, 4), (5, 6))
]
SMALL = [a for a in FOLDS if a.rows * a.columns < 10_000] + [PROFILES["product"].array()]


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_any_cells_of_full_rank_decode_to_their_place(data):
    array = data.draw(st.sampled_from(FOLDS))
    t = data.draw(st.integers(0, array.sequence.period - 1))
    row, column = array.cell(t)
    side = data.draw(st.integers(3, 9))
    mask = np.random.default_rng(data.draw(st.integers(0, 2**32))).random((side, side)) < 0.8
    cells = np.nonzero(mask)
    assume(cells[0].size and array.identifies(*cells))
    window = np.full((side, side), -1)
    rows = np.array([(row + int(r)) % array.rows for r in cells[0]], dtype=np.uint64)
    columns = np.array([(column + int(c)) % array.columns for c in cells[1]], dtype=np.uint64)
    window[cells] = array.symbols(rows, columns)
    found = decode_exact(array, window)[0]
    assert (found.t, found.row, found.column) == (t, row, column)


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_errors_and_erasures_within_the_distance_are_corrected(data):
    array = data.draw(st.sampled_from(SMALL))
    shape = data.draw(st.tuples(st.integers(3, 6), st.integers(3, 6)))
    able = strength(array, *np.indices(shape))
    assume(able.distance >= 2)
    erasures = data.draw(st.integers(0, able.erasures))
    errors = (able.distance - 1 - erasures) // 2
    row = data.draw(st.integers(0, array.rows - 1))
    column = data.draw(st.integers(0, array.columns - 1))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    a, b = np.indices(shape)
    window = array.symbols(row + a, column + b).ravel()
    hurt = rng.permutation(window.size)
    window[hurt[:erasures]] = -1
    for cell in hurt[erasures : erasures + errors]:
        window[cell] = (window[cell] + rng.integers(1, array.order)) % array.order
    found = Likelihood(array, doubt=1.0).decode(window.reshape(shape))[0]
    assert (found.row, found.column) == (row, column)
    assert found.margin > 0


@settings(deadline=None, max_examples=40)
@given(st.data())
def test_likelihood_answers_or_names_the_place_among_its_candidates(data):
    array = data.draw(st.sampled_from(SMALL))
    row = data.draw(st.integers(0, array.rows - 1))
    column = data.draw(st.integers(0, array.columns - 1))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    a, b = np.indices((5, 5))
    window = np.where(rng.random((5, 5)) < 0.4, -1, array.symbols(row + a, column + b))
    found = Likelihood(array).decode(window)[0]
    if found:
        assert (found.row, found.column) == (row, column)
    elif 0 < len(found.candidates) < 16:
        assert (row, column) in {(c.row, c.column) for c in found.candidates}


@settings(deadline=None, max_examples=80)
@given(st.sampled_from(FOLDS), st.integers(0, 2**64), st.integers(0, 2**64))
def test_products_of_elements_are_sums_of_indices(array, s, t):
    elements = elements_of(array.sequence.ring)
    period = array.sequence.period
    a, b = (elements.of_digits(array.sequence.element([i % period])) for i in (s, t))
    both = elements.of_digits(array.sequence.element([(s + t) % period]))
    np.testing.assert_array_equal(elements.product(a, b), both)
    np.testing.assert_array_equal(elements.of_keys(elements.keys(a)), a)


@given(st.integers(2, 12).flatmap(lambda n: st.tuples(st.just(n), *[st.integers(0, 2**n - 1)] * 2)))
def test_products_agree_with_polynomials(case):
    n, a, b = case
    array = array_from({"family": "prbs", "order": 2, "degree": n})
    found = elements_of(array.sequence.ring).product(np.array([a], "u8"), np.array([b], "u8"))[0]
    digits = [[x >> k & 1 for k in range(n)] for x in (a, b)]
    truth = mulmod(field_of_order(2), *digits, array.sequence.polynomial)
    assert int(found) == sum(bit << k for k, bit in enumerate(truth))


@given(st.sampled_from([2, 3, 5, 7]), st.integers(1, 8), st.integers(1, 6), st.integers(0, 99))
def test_elimination_says_which_combination_it_took(prime, rows, columns, seed):
    matrix = np.random.default_rng(seed).integers(0, prime, (rows, columns)).astype(float)
    combinations, reduced, pivots = eliminate(matrix, prime)
    np.testing.assert_array_equal(combinations @ matrix % prime, reduced)
    np.testing.assert_array_equal(reduced[: len(pivots), pivots], np.eye(len(pivots)))
    assert not reduced[len(pivots) :].any()


@given(st.lists(st.integers(0, 2**64 - 1), min_size=1, max_size=40, unique=True), st.data())
def test_keys_are_found(known, data):
    keys = Keys(np.array(known, dtype=np.uint64))
    asked = known + data.draw(st.lists(st.integers(0, 2**64 - 1), max_size=20))
    found = keys.find(np.array(asked, dtype=np.uint64))
    assert found.tolist() == [known.index(k) if k in known else -1 for k in asked]
