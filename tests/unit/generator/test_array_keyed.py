"""Arrays and keys of labs, rivals of what a sensor sees, and how many touches are needed."""

import re
import secrets
from math import gcd
from pathlib import Path

import numpy as np
import pytest
from reference.polynomials import windows_are_unique
from reference.rivals import rival_shares, serves
from reference.visible import PoseGrid, VisibleSet, visible_sets
from reference.windows import windows_at

from decoder import decode_exact
from generator.array import FoldedArray, Sequence, array_from, next_larger, profile
from generator.array.contract import touches_needed
from generator.array.field import field_of_order
from generator.array.fold import translation
from generator.array.lab_key import (
    CHARACTERS,
    LENGTH,
    decimated_polynomial,
    draw_lab_key,
    keyed_array,
    lab_key_of,
    read_lab_key,
)
from generator.array.polynomial import is_primitive, primitive_polynomial
from generator.array.profiles import PROFILES, Profile
from generator.database.cells import array_key
from generator.errors import ArrayError, LabKeyError

KEY = "0123-4567-89AB-CDER"
KEYS = [lab_key_of(np.random.default_rng(seed).bytes(16)) for seed in range(20)]


def test_the_array_of_a_key_stays_what_it_is():
    """Golden: another array would be another lab's, and databases could not go on."""
    assert keyed_array(profile("one-touch").array(), KEY).definition() == {
        "family": "prmva", "order": 4, "degree": 6, "field": [1, 1, 1],
        "polynomial": [3, 2, 2, 2, 0, 2, 1], "initial": [0, 0, 0, 0, 0, 1],
        "rows": 63, "columns": 65, "window": [3, 2],
        "permutation": [2, 3, 0, 1], "first": [4, 17],
    }  # fmt: skip


ORDER_32 = Profile(
    "order-32", {"family": "prmva", "order": 32, "degree": 3, "rows": 151, "columns": 217}, (3, 1),
    "own", 5.0, keyed=True,
)  # fmt: skip
SMALLEST = (profile("large"), profile("tactel-8"), profile("tactel-16"), ORDER_32)
by_order = pytest.mark.parametrize("smallest", SMALLEST, ids=lambda one: one.name)


@by_order
def test_keys_give_arrays_of_their_own(smallest):
    published = smallest.array()
    arrays = [keyed_array(published, key) for key in KEYS]
    assert len({array_key(array) for array in (published, *arrays)}) == len(KEYS) + 1
    assert len({array.first for array in arrays}) == len(KEYS)
    order = published.order
    shown = {tuple(array.permutation.tolist()) for array in arrays}
    every = {translation(field_of_order(order), label) for label in range(order)}
    assert shown <= every
    assert len(shown) >= 4
    assert {array.window for array in arrays} == {published.window}


@pytest.mark.parametrize("one", [profile("one-touch"), *SMALLEST], ids=lambda one: one.name)
def test_windows_are_unique_on_every_one(one):
    for key in KEYS[:4]:
        array = one.array_of_lab(key)
        assert windows_are_unique(array, array.window)


@by_order
def test_a_touch_has_as_few_rivals_as_on_the_published_array(smallest):
    sets = visible_sets(6.0, (12.7, 12.7), 2.16, PoseGrid(places=6, turns=15))
    published = smallest.array()
    worst = max(rival_shares(keyed_array(published, key), sets).poses[0] for key in KEYS[:6])
    assert worst <= rival_shares(published, sets).poses[0] + 0.06


@by_order
def test_larger_sizes_have_keys_too(smallest):
    size = smallest
    for _ in range(3):
        size = next_larger(size)
        array = size.array_of_lab(KEYS[0])
        places = [[0, 5, array.rows - 1], [1, 0, array.columns - 1]]
        found = decode_exact(array, windows_at(array, *places, array.window))
        assert [[one.row for one in found], [one.column for one in found]] == places
        assert (array.rows, array.columns) == (size.encoding["rows"], size.encoding["columns"])
        assert array.window == size.window
        assert array.definition() != size.array().definition()
    assert array.rows * array.columns > 1e6 * 12**2 or array.order == 4  # faces of 60 mm


def test_published_profiles_have_none():
    published = {name for name, one in PROFILES.items() if not one.keyed}
    assert published == {"thesis", "product"}
    for name in PROFILES:
        assert profile(name).array_of_lab("").definition() == profile(name).array().definition()
    for name in published:
        assert profile(name).array_of_lab(KEY).definition() == profile(name).array().definition()


@pytest.mark.parametrize(
    ("order", "degree", "number"),
    [(2, 6, 6), (3, 3, 4), (4, 3, 12), (5, 2, 4), (8, 2, 18), (16, 2, 64), (32, 2, 300)],
)
def test_decimation_gives_every_primitive_polynomial(order, degree, number):
    """phi(N) / n of them (MacWilliams and Sloane, chapter 4)."""
    field = field_of_order(order)
    sequence = Sequence(field, primitive_polynomial(order, degree))
    steps = [step for step in range(1, sequence.period) if gcd(step, sequence.period) == 1]
    found = {decimated_polynomial(sequence, step) for step in steps}
    assert len(found) == len(steps) / degree == number
    assert all(is_primitive(field, h) for h in found)
    step = steps[len(steps) // 2]
    terms = sequence.symbols(step * np.arange(3 * degree) % sequence.period).tolist()
    going_on = Sequence(field, decimated_polynomial(sequence, step), terms[:degree])
    assert going_on.symbols(range(len(terms))).tolist() == terms


def test_translations_are_what_shifts_and_other_polynomials_do_not_give():
    """All 24 permutations of 4 symbols are 4 translations times 6 that give known arrays."""
    field = field_of_order(4)
    scaled = [[int(field.multiplication[a, x]) for x in range(4)] for a in (1, 2, 3)]
    conjugated = [[row[x] for x in (0, 1, 3, 2)] for row in scaled]
    every = {
        tuple(translation(field, k)[x] for x in row)
        for k in range(4)
        for row in (*scaled, *conjugated)
    }
    assert len(every) == 24
    sequence = profile("one-touch").array().sequence
    terms = sequence.symbols(np.arange(200))
    ring = sequence.symbols(np.arange(sequence.period + 5))
    states = set(map(tuple, np.lib.stride_tricks.sliding_window_view(ring, 6).tolist()))
    for row in scaled[1:]:
        assert tuple(np.array(row)[terms][:6].tolist()) in states  # a shift of the same one
    swapped = np.array([0, 1, 3, 2])
    conjugate = Sequence(field, swapped[list(sequence.polynomial)].tolist(), swapped[terms[:6]])
    np.testing.assert_array_equal(conjugate.symbols(np.arange(200)), swapped[terms])


def small(**options):
    return FoldedArray(Sequence(field_of_order(4), (2, 1, 1)), 3, 5, **options)


def test_a_permutation_changes_symbols_and_no_rank():
    plain, changed = small(), small(permutation=(2, 3, 0, 1), first=(1, 4))
    rows, columns = np.indices((3, 5))
    np.testing.assert_array_equal(
        changed.symbols(rows, columns), np.array([2, 3, 0, 1])[plain.symbols(rows, columns)]
    )
    np.testing.assert_array_equal(
        changed.terms_of(changed.symbols(rows, columns)), plain.symbols(rows, columns)
    )
    assert changed.terms_of([-1, 2]).tolist() == [-1, 0]
    assert changed.rank([0, 0], [0, 1]) == plain.rank([0, 0], [0, 1])
    assert (plain.first, changed.first) == ((0, 0), (1, 4))
    assert "permutation" not in plain.definition()
    assert "first" not in plain.definition()
    assert array_key(changed) == array_key(small(permutation=(2, 3, 0, 1)))  # not by `first`
    assert array_key(changed) != array_key(plain)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"permutation": (0, 1, 2, 2)}, "each of the 4 labels"),
        ({"permutation": (1, 2, 3, 4)}, "each of the 4 labels"),
        ({"first": (3, 0)}, "no cell"),
        ({"first": (0, 5)}, "no cell"),
        ({"first": (-1, 0)}, "no cell"),
    ],
)
def test_what_is_no_permutation_or_cell_is_refused(options, said):
    with pytest.raises(ArrayError, match=said):
        small(**options)


def test_a_key_is_drawn_from_the_whole_range(monkeypatch):
    monkeypatch.setattr("generator.array.lab_key.token_bytes", secrets.token_bytes)
    keys = {draw_lab_key() for _ in range(64)}
    assert len(keys) == 64
    assert all(read_lab_key(key) == key for key in keys)
    assert set("".join(keys)) == {*CHARACTERS, "-"}


@pytest.mark.parametrize(
    "typed",
    [KEY, KEY.lower(), "0123456789abcder", " 0123 4567\t89AB-CDER\n", "oI23-4567-89ABCDER"],
)
def test_what_people_type_is_understood(typed):
    assert read_lab_key(typed) == KEY


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        (KEY + "0", "17 characters"),
        ("0123-4567-89AB-CDEU", "it holds U"),
        ("0123-4567-89AB-C*ER", "it holds \\*"),
    ],
)
def test_what_is_no_key_is_refused_with_the_reason(typed, said):
    with pytest.raises(LabKeyError, match=said) as caught:
        read_lab_key(typed)
    assert caught.value.exit_code == 2
    assert "encode-object lab" in caught.value.fix


def test_every_wrong_character_and_every_exchange_is_found():
    rng = np.random.default_rng(1)
    plain = lab_key_of(rng.bytes(LENGTH)).replace("-", "")
    wrong = {
        plain[:k] + character + plain[k + 1 :]
        for k in range(LENGTH)
        for character in CHARACTERS
        if character != plain[k]
    }
    for a in range(LENGTH):
        for b in range(a):
            if plain[a] != plain[b]:
                swapped = list(plain)
                swapped[a], swapped[b] = swapped[b], swapped[a]
                wrong.add("".join(swapped))
    assert len(wrong) > LENGTH * 31
    for typed in wrong:
        with pytest.raises(LabKeyError):
            read_lab_key(typed)


def test_profiles_are_read_by_as_many_touches_as_was_measured():
    assert touches_needed(2, 63 * 65, 12.0) == 8  # thesis
    assert touches_needed(8, 15 * 15, 15.0) == 5  # product, of the 80 mm cube
    assert touches_needed(4, 63 * 65, 7.0) == 1  # one-touch
    assert touches_needed(4, 1 << 62, 7.0) == touches_needed(4, 1 << 20, 7.0)


def test_larger_sensors_and_closer_symbols_need_fewer():
    by_pitch = [touches_needed(2, 4095, pitch) for pitch in (5.0, 8.0, 12.0, 16.0)]
    assert by_pitch == sorted(by_pitch)
    assert touches_needed(2, 4095, 12.0, sensor_mm=50.0) == 1


SENSOR = (12.7, 12.7)
SMALL = [
    {"family": "prba", "rows": 15, "columns": 17},
    {"family": "prmva", "order": 3, "rows": 5, "columns": 16},
    {"family": "prmva", "order": 4, "rows": 7, "columns": 9},
    {"family": "prmva", "order": 4, "rows": 15, "columns": 17},
    {"family": "prmva", "order": 5, "rows": 4, "columns": 31},
    {"family": "prmva", "order": 8, "rows": 7, "columns": 9},
    {"family": "prmva", "order": 16, "rows": 15, "columns": 17},
    {"family": "prmva", "order": 32, "rows": 31, "columns": 33},
]


def patches(seed, number=12):
    """Sets of 0 to 12 cells in a 5x4 patch, cell (0, 0) of the patch among the smallest."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(range(5), range(4), indexing="ij"), -1).reshape(-1, 2)
    for size in rng.integers(0, 13, number):
        cells = grid[np.sort(rng.permutation(len(grid))[:size])]
        yield cells - (cells.min(axis=0) if size else 0)


@pytest.mark.parametrize("definition", SMALL, ids=str)
def test_rivals_are_those_found_by_comparing_all_places(definition):
    array = array_from(definition)
    r, c = (g.ravel() for g in np.indices((array.rows, array.columns)))
    for cells in patches(array.order):
        shown = array.symbols(r[:, None] + cells[:, 0], c[:, None] + cells[:, 1])
        apart = (shown[:, None] != shown).sum(axis=2)
        np.fill_diagonal(apart, 99)
        shares = rival_shares(array, [VisibleSet(cells, 1.0)])
        places = len(r)
        for most in range(3):
            found = (apart <= most).sum()
            # of all differences of states one leads from a place to the state 0
            assert found == round(shares.rivals[most] * (places - 1)), (cells, most)
            assert shares.poses[most] == float(shares.rivals[most] > 0)
        full = min(len(cells), array.full_rank)
        rank = array.rank(cells[:, 0], cells[:, 1]) if len(cells) else 0
        assert shares.short == float(rank < full)
        assert shares.cells == len(cells)


@pytest.mark.parametrize(("pitch_mm", "cells"), [(7, 8.5), (4, 31.7)])
def test_symbols_seen_whole_by_pitch(pitch_mm, cells):
    """Mid-face, as measured by another program: 8.4 and 30.7 on a 60 mm face."""
    sets = visible_sets(pitch_mm, SENSOR, 0.36 * pitch_mm)
    assert sum(one.share for one in sets) == pytest.approx(1)
    assert sum(one.share * len(one.cells) for one in sets) == pytest.approx(cells, abs=0.05)
    assert [one.share for one in sets] == sorted((one.share for one in sets), reverse=True)


def test_profiles_serve_a_sensor_at_their_pitch():
    for name in ("one-touch", "large", "fine", "tactel-8", "tactel-16"):
        one = profile(name)
        assert serves(one.array(), one.pitch_mm, SENSOR, 0.36 * one.pitch_mm), name
    for smallest, sizes, reach in zip(SMALLEST, (4, 3, 3, 3), (0.36, 0.4, 0.4, 0.4), strict=True):
        larger = smallest
        for _ in range(sizes):
            larger = next_larger(larger)
            assert serves(larger.array(), 5.5, SENSOR, reach * 5.5), larger.encoding


def test_the_guide_says_how_many_rivals_the_profiles_have():
    text = (Path(__file__).parents[3] / "docs" / "folds.md").read_text()
    sets = visible_sets(7.0, SENSOR, 2.52)
    for name in ("one-touch", "large"):
        array = profile(name).array()
        (row,) = re.findall(rf"\| {array.rows}x{array.columns} `{name}`.*? \| (.*?) \|", text)
        poses, rivals = row.rstrip(")").split(" (")
        shares = rival_shares(array, sets)
        assert [float(share) for share in poses.split(" / ")] == pytest.approx(
            [100 * share for share in shares.poses], abs=0.51
        )
        assert float(rivals) == pytest.approx(shares.rivals[0], abs=0.01)
