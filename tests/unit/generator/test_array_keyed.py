"""Arrays and keys of labs, rivals of what a sensor sees, and how many touches are needed."""

import re
import secrets
from functools import partial
from itertools import combinations
from math import gcd
from pathlib import Path

import numpy as np
import pytest
from reference.polynomials import windows_are_unique
from reference.rivals import rival_shares
from reference.visible import PoseGrid, VisibleSet, visible_sets
from reference.windows import windows_at

from decoder import decode_exact
from generator.array import FoldedArray, Sequence, array_from, next_larger, profile
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
    sets = visible_sets(6.0, (12.7, 12.7), 2.16, PoseGrid(places=6, turns=15))
    worst = max(rival_shares(array, sets).poses[0] for array in arrays[:6])
    assert worst <= rival_shares(published, sets).poses[0] + 0.06


@pytest.mark.parametrize("size", SMALLEST, ids=lambda one: one.name)
def test_larger_sizes_have_keys_too(size):
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


def test_a_permutation_changes_symbols_and_no_rank():
    small = partial(FoldedArray, Sequence(field_of_order(4), (2, 1, 1)), 3, 5)
    plain, changed = small(), small(permutation=(2, 0, 1, 3), first=(1, 4))
    rows, columns = np.indices((3, 5))
    terms, shown = plain.symbols(rows, columns), changed.symbols(rows, columns)
    assert shown.tolist() == np.array([2, 0, 1, 3])[terms].tolist()
    assert changed.terms_of(shown).tolist() == terms.tolist()
    assert changed.terms_of([-1, 2]).tolist() == [-1, 0]
    assert changed.rank([0, 0], [0, 1]) == plain.rank([0, 0], [0, 1])
    assert (plain.first, changed.first) == ((0, 0), (1, 4))
    assert not {"permutation", "first"} & set(plain.definition())
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


SMALL = [(2, 15, 17), (3, 5, 16), (4, 7, 9), (5, 4, 31), (8, 7, 9), (16, 15, 17), (32, 31, 33)]


@pytest.mark.parametrize(("order", "height", "width"), SMALL)
def test_rivals_are_those_found_by_comparing_all_places(order, height, width):
    """Of sets of 0 to 12 cells in a 5x4 patch."""
    array = array_from({"family": "prmva", "order": order, "rows": height, "columns": width})
    r, c = (g.ravel() for g in np.indices((height, width)))
    rng, places = np.random.default_rng(order), height * width
    for size in rng.integers(0, 13, 12):
        cells = np.argwhere(np.ones((5, 4)))[np.sort(rng.permutation(20)[:size])]
        cells -= cells.min(axis=0, initial=5)
        shown = array.symbols(r[:, None] + cells[:, 0], c[:, None] + cells[:, 1])
        apart = (shown[:, None] != shown).sum(axis=2)
        np.fill_diagonal(apart, 99)
        shares = rival_shares(array, [VisibleSet(cells, 1.0)])
        for most in range(3):
            # of all differences of states one leads from a place to the state 0
            assert (apart <= most).sum() == round(shares.rivals[most] * (places - 1))
            assert shares.poses[most] == float(shares.rivals[most] > 0)
        rank = array.rank(cells[:, 0], cells[:, 1]) if len(cells) else 0
        assert shares.short == float(rank < min(len(cells), array.full_rank))
        assert shares.cells == len(cells)


def test_the_guide_says_how_many_rivals_the_profiles_have():
    text = (Path(__file__).parents[3] / "docs" / "folds.md").read_text()
    sets = visible_sets(7.0, (12.7, 12.7), 2.52)
    for name in ("one-touch", "large"):
        array = profile(name).array()
        (row,) = re.findall(rf"\| {array.rows}x{array.columns} `{name}`.*? \| (.*?) \|", text)
        poses, rivals = row.rstrip(")").split(" (")
        shares = rival_shares(array, sets)
        wanted = pytest.approx([100 * share for share in shares.poses], abs=0.51)
        assert [float(share) for share in poses.split(" / ")] == wanted
        assert float(rivals) == pytest.approx(shares.rivals[0], abs=0.01)
