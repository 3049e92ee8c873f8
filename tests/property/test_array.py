"""Laws of every array and of its decoding: unique windows, the torus, there and back."""

import json
from itertools import islice

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference.polynomials import mulmod, powmod, windows_are_unique

from decoder import Likelihood, decode_exact, strength
from decoder.element import Keys, elements_of
from decoder.register import eliminate
from generator.array import PROFILES, FoldedArray, ProductArray, Sequence, array_from
from generator.array.factor import is_decodable
from generator.array.field import field_of_order, format_polynomial, parse_polynomial
from generator.array.fold import folds
from generator.array.polynomial import is_primitive, known_polynomials, norm

ON_FILE = known_polynomials()
SMALL = [p for p in ON_FILE if p.degree > 1 and p.order**p.degree <= 7000 and p.order <= 27]
FOLDING = [p for p in SMALL if folds(p.order, p.degree)]
MEDIUM = [p for p in ON_FILE if p.order**p.degree <= 2**64]

small, folding, medium = map(st.sampled_from, (SMALL, FOLDING, MEDIUM))
quick = settings(max_examples=60, deadline=None)


def sequence_of(entry):
    return Sequence(field_of_order(entry.order), entry.labels)


def decodable(entry):
    return is_decodable(entry.order, entry.degree)


def drawn_cells(data, most):
    cell = st.tuples(st.integers(0, 7), st.integers(0, 7))
    return np.array(data.draw(st.lists(cell, min_size=1, max_size=most, unique=True)))


def seen_at_all_places(array, rows, columns):
    places = np.arange(array.rows)[:, None, None], np.arange(array.columns)[:, None]
    return array.symbols(places[0] + rows, places[1] + columns).reshape(-1, len(rows))


@quick
@given(folding, st.data())
def test_rank_test_says_exactly_which_cells_identify(entry, data):
    """Any set of visible cells: full rank if and only if no two places look alike."""
    fold = data.draw(st.sampled_from(folds(entry.order, entry.degree)))
    array = FoldedArray(sequence_of(entry), *data.draw(st.permutations(fold)))
    cells = drawn_cells(data, entry.degree + 3)
    rows, columns = np.unique(cells % (array.rows, array.columns), axis=0).T
    seen = seen_at_all_places(array, rows, columns)
    unique = len(np.unique(seen, axis=0)) == len(seen)
    distance = array.minimum_distance(rows, columns)
    assert array.identifies(rows, columns) == (distance > 0) == unique
    if unique:  # linear: the same from every place, but for the zero word that no place shows
        some = data.draw(st.integers(0, len(seen) - 2))
        others = [np.sort(np.count_nonzero(seen != seen[k], axis=1))[1] for k in (some, some + 1)]
        assert min(others) == distance
    assert windows_are_unique(array, array.window)


@quick
@given(small, small, st.data())
def test_product_identifies_when_both_factors_are_determined(a, b, data):
    array = ProductArray(sequence_of(a), sequence_of(b))
    if array.rows * array.columns > 40_000:
        return
    rows, columns = drawn_cells(data, max(a.degree, b.degree) + 2).T
    seen = seen_at_all_places(array, rows, columns)
    unique = len(np.unique(seen, axis=0)) == len(seen)
    distance = array.minimum_distance(rows, columns)
    assert array.identifies(rows, columns) == (distance > 0) == unique
    if unique:
        assert min(np.count_nonzero(seen[1:] != seen[0], axis=1)) >= distance


@quick
@given(medium.filter(decodable), st.integers(-(2**70), 2**70))
def test_random_access_obeys_the_recurrence_in_both_directions(entry, t):
    sequence = sequence_of(entry)
    n = entry.degree
    around = sequence.symbols([t + k for k in range(-n, 2 * n)]).tolist()
    going_on = Sequence(sequence.field, entry.labels, around[:n]).forward()
    assert list(islice(going_on, 3 * n)) == around
    assert sequence.symbols(t) == sequence.symbols(t + sequence.period)


@quick
@given(folding, st.integers(-(2**66), 2**66), st.integers(-(2**66), 2**66))
def test_fold_is_the_sequence_on_a_torus(entry, row, column):
    array = FoldedArray(sequence_of(entry), *folds(entry.order, entry.degree)[0])
    t = array.index(row, column)
    assert array.cell(t) == (row % array.rows, column % array.columns)
    assert int(array.symbols(row, column)) == int(array.sequence.symbols(t))


@quick
@given(st.sampled_from([2, 3, 4, 5, 8, 9, 16]), st.data())
def test_arithmetic_modulo_h_over_gf_q_and_over_its_prime_field_agree(q, data):
    field = field_of_order(q)
    n = data.draw(st.integers(1, 5))
    label = st.integers(0, q - 1)
    middle = data.draw(st.lists(label, min_size=n - 1, max_size=n - 1))
    h = (data.draw(st.integers(1, q - 1)), *middle, 1)
    conjugates = norm(field, h)
    assert len(conjugates) == n * field.degree + 1
    prime_field = field_of_order(field.characteristic)
    if is_primitive(field, h):
        assert is_primitive(prime_field, conjugates)
        assert powmod(field, (0, 1), q**n - 1, h) == powmod(field, (0, 1), 0, h)
    assert parse_polynomial(field, format_polynomial(field, h)) == h


@quick
@given(folding, st.data())
def test_definition_round_trip(entry, data):
    fold = data.draw(st.sampled_from(folds(entry.order, entry.degree)))
    n, label = entry.degree, st.integers(0, entry.order - 1)
    initial = data.draw(st.lists(label, min_size=n, max_size=n))
    if not any(initial):
        initial[0] = 1
    given = {"order": entry.order, "polynomial": list(entry.labels), "initial": initial}
    array = array_from({"family": "prmva", "rows": fold[0], "columns": fold[1]} | given)
    again = array_from(json.loads(json.dumps(array.definition())))
    assert again.definition() == array.definition()
    cells = np.arange(12)[:, None], np.arange(12)
    assert np.array_equal(again.symbols(*cells), array.symbols(*cells))


FOLDS = [
    array_from({"family": "prba" if q == 2 else "prmva", "order": q, "degree": n})
    for q, n in ((2, 8), (2, 12), (2, 48), (2, 64), (3, 8), (4, 6), (4, 32), (8, 4), (9, 4), (5, 6))
]
SHORT = [a for a in FOLDS if a.rows * a.columns < 10_000] + [PROFILES["product"].array()]


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
    array = data.draw(st.sampled_from(SHORT))
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
    array = data.draw(st.sampled_from(SHORT))
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
