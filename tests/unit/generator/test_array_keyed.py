"""Arrays and keys of labs, and rivals of what a sensor sees."""

import re
import secrets
from itertools import combinations
from math import gcd
from pathlib import Path

import numpy as np
import pytest
from reference.polynomials import windows_are_unique
from reference.visible import visible_sets
from reference.windows import windows_at

from decoder import decode_exact
from generator.array import FoldedArray, Sequence, next_larger, profile
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


ORDER_32 = Profile(
    "order-32", {"family": "prmva", "order": 32, "degree": 3, "rows": 151, "columns": 217}, (3, 1),
    "own", 5.0, keyed=True,
)  # fmt: skip
SMALLEST = (profile("large"), profile("tactel-8"), profile("tactel-16"), ORDER_32)
by_order = pytest.mark.parametrize("smallest", SMALLEST, ids=lambda one: one.name)


@pytest.mark.parametrize("smallest", [profile("one-touch"), *SMALLEST], ids=lambda one: one.name)
def test_keys_give_arrays_of_their_own(smallest):
    published, order = smallest.array(), smallest.array().order
    arrays = [keyed_array(published, key) for key in KEYS]
    assert len({array_key(array) for array in (published, *arrays)}) == len(KEYS) + 1
    assert len({array.first for array in arrays}) == len(KEYS)
    shown = {tuple(array.permutation.tolist()) for array in arrays}
    assert shown <= {translation(field_of_order(order), label) for label in range(order)}
    assert len(shown) >= 4
    assert {array.window for array in arrays} == {published.window}
    assert all(windows_are_unique(array, array.window) for array in arrays[:4])
    sets = visible_sets(6.0, (12.7, 12.7), 2.16, places=6, turns=15)
    unnamed = [
        sum(share for cells, share in sets if not array.identifies(*cells.T))
        for array in (published, *arrays[:6])
    ]
    assert max(unnamed) <= unnamed[0] + 0.06


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


def small(**options):
    return FoldedArray(Sequence(field_of_order(4), (2, 1, 1)), 3, 5, **options)


def test_a_permutation_changes_symbols_and_no_rank():
    plain, changed = small(), small(permutation=(2, 0, 1, 3), first=(1, 4))
    rows, columns = np.indices((3, 5))
    terms, shown = plain.symbols(rows, columns), changed.symbols(rows, columns)
    assert shown.tolist() == np.array([2, 0, 1, 3])[terms].tolist()
    assert changed.terms_of(shown).tolist() == terms.tolist()
    assert changed.terms_of([-1, 2]).tolist() == [-1, 0]
    assert changed.rank([0, 0], [0, 1]) == plain.rank([0, 0], [0, 1])
    assert (plain.first, changed.first) == ((0, 0), (1, 4))
    assert "permutation" not in plain.definition()
    assert "first" not in plain.definition()
    assert array_key(changed) == array_key(small(permutation=(2, 0, 1, 3)))  # not by `first`
    assert array_key(changed) != array_key(plain)
    for wrong in ((0, 1, 2, 2), (1, 2, 3, 4)):
        with pytest.raises(ArrayError, match="each of the 4 labels"):
            small(permutation=wrong)
    for nowhere in ((3, 0), (0, 5), (-1, 0)):
        with pytest.raises(ArrayError, match="no cell"):
            small(first=nowhere)


def test_a_key_is_drawn_from_the_whole_range(monkeypatch):
    monkeypatch.setattr("generator.array.lab_key.token_bytes", secrets.token_bytes)
    keys = {draw_lab_key() for _ in range(64)}
    assert len(keys) == 64
    assert all(read_lab_key(key) == key for key in keys)
    assert set("".join(keys)) == {*CHARACTERS, "-"}


def test_what_people_type_is_understood_or_refused_with_the_reason():
    for typed in (KEY.lower(), "0123456789abcder", " 0123 4567\t89AB-CDER\n", "oI23-4567-89ABCDER"):
        assert read_lab_key(typed) == KEY
    for typed, said in (
        (KEY + "0", "17 characters"),
        ("0123-4567-89AB-CDEU", "it holds U"),
        ("0123-4567-89AB-C*ER", "it holds \\*"),
    ):
        with pytest.raises(LabKeyError, match=said) as caught:
            read_lab_key(typed)
        assert caught.value.exit_code == 2
        assert "encode-object lab" in caught.value.fix


def test_every_wrong_character_and_every_exchange_is_found():
    plain = lab_key_of(np.random.default_rng(1).bytes(LENGTH)).replace("-", "")
    wrong = {plain[:k] + one + plain[k + 1 :] for k in range(LENGTH) for one in CHARACTERS}
    for a, b in combinations(range(LENGTH), 2):
        wrong.add(plain[:a] + plain[b] + plain[a + 1 : b] + plain[a] + plain[b + 1 :])
    for typed in wrong - {plain}:
        with pytest.raises(LabKeyError):
            read_lab_key(typed)


def test_the_guide_says_how_many_rivals_the_profiles_have():
    text = (Path(__file__).parents[3] / "docs" / "folds.md").read_text()
    sets, shares = zip(*visible_sets(7.0, (12.7, 12.7), 2.52), strict=True)
    for name in ("one-touch", "large"):
        array = profile(name).array()
        (row,) = re.findall(rf"\| {array.rows}x{array.columns} `{name}`.*? \| (.*?) \|", text)
        poses, rivals = row.rstrip(")").split(" (")
        least = np.array([array.minimum_distance(*cells.T) for cells in sets])
        found = [100 * np.dot(shares, least <= most) for most in range(3)]
        assert [float(share) for share in poses.split(" / ")] == pytest.approx(found, abs=0.51)
        alike = [array.order ** (array.full_rank - array.rank(*cells.T)) - 1 for cells in sets]
        assert float(rivals) == pytest.approx(np.dot(shares, alike), abs=0.01)
