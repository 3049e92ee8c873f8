"""Laws that hold for every array: unique windows, the rank test, the torus, random access."""

import json
from itertools import islice

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from reference.polynomials import powmod, windows_are_unique

from generator.array import FoldedArray, ProductArray, Sequence, array_from
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
