"""The thesis's arrays and windows against golden.json, read from printed figures and appendices.

Not here: figure 5.8 (its content is not in the text, nothing to compare with).
"""

import hashlib
import json
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from reference.polynomials import on_file, powmod, windows_are_unique

from decoder import decode_exact, decode_likelihood
from decoder.milestones import optimal_distance
from generator.array import array_from, profile
from generator.array.factor import prime_factors
from generator.array.field import field_of_order
from generator.array.polynomial import is_primitive, known_polynomials, primitive_polynomial
from generator.array.product import ProductArray
from generator.array.sequence import Sequence

FIXTURES = Path(__file__).parents[2] / "fixtures"
GOLDEN = json.loads((FIXTURES / "golden.json").read_text())
MEASURED = json.loads((FIXTURES / "array_profiles.json").read_text())
THESIS = GOLDEN["prba_63x65"]
METHODS = ("table", "serial", "milestones", "logarithm")


def whole(array):
    return array.symbols(np.arange(array.rows)[:, None], np.arange(array.columns))


def distance(array, a, b):
    return array.minimum_distance(np.arange(a)[:, None], np.arange(b))


@pytest.mark.parametrize("entry", GOLDEN["table_5_1"], ids=lambda e: f"n={e['n']}")
def test_table_5_1(entry):
    n, direct, reverse = entry["n"], entry["direct_taps"], entry["reverse_taps"]
    sequence = Sequence(field_of_order(2), on_file(2, n, "table 5.1"))
    assert list(sequence.polynomial) == entry["poly"]
    s = list(islice(sequence.forward(), sequence.period + 2 * n))
    for t in range(n + 1, len(s)):  # R(k) holds s[t - k], R(0) = s[t]
        assert s[t] == sum(s[t - k] for k in direct) % 2
        assert s[t - n - 1] == sum(s[t - k] for k in reverse) % 2


@pytest.mark.parametrize("entry", GOLDEN["table_5_3"], ids=lambda e: f"q={e['q']},n={e['n']}")
def test_table_5_3(entry):
    q, n = entry["q"], entry["n"]
    field = field_of_order(q)
    h = on_file(q, n, "table 5.3")
    assert list(h) == entry["poly"]
    assert is_primitive(field, h) == entry["primitive"]
    period, one = entry["period"], powmod(field, (1,), 0, h)
    assert powmod(field, (0, 1), period, h) == one
    assert all(powmod(field, (0, 1), period // p, h) != one for p in prime_factors(period))


def test_table_5_3_is_complete_and_its_fields_hold():
    printed = {(p.order, p.degree) for p in known_polynomials() if p.source == "table 5.3"}
    assert printed == {(e["q"], e["n"]) for e in GOLDEN["table_5_3"]}
    # A^k = digits, highest power of A first, as printed under the table
    relations = {
        4: {2: "11", 3: "01"},
        8: {3: "011", 4: "110", 5: "111", 6: "101", 7: "001"},
        9: {2: "11", 3: "21", 4: "02", 5: "20", 6: "22", 7: "12", 8: "01"},
    }
    for q, powers in relations.items():
        field = field_of_order(q)
        for power, digits in powers.items():
            label = 1 + power % (q - 1)
            assert "".join(map(str, field.digits[label][::-1])) == digits


APPENDIX_4 = [
    *((2, entry, dict.fromkeys(entry["lags"], 1)) for entry in GOLDEN["appendix4_q2"]),
    *((3, entry, entry["lag_coef"]) for entry in GOLDEN["appendix4_q3"]),
    *((4, entry, entry["lags_coef_labels"]) for entry in GOLDEN["appendix4_q4"]),
]


@pytest.mark.parametrize(("order", "entry", "lags"), APPENDIX_4)
def test_appendix_4(order, entry, lags):
    field, n = field_of_order(order), entry["n"]
    h = on_file(2, n, "appendix 4") if order == 2 else primitive_polynomial(order, n)
    sequence = Sequence(field, h)
    assert list(sequence.polynomial) == entry.get("poly", list(sequence.polynomial))
    assert list(sequence.initial) == entry.get("init", list(sequence.initial))
    s = sequence.symbols(range(200))
    for t in range(n, 200):
        total = 0
        for lag, label in lags.items():
            total = field.addition[total, field.multiplication[label, s[t - int(lag)]]]
        assert s[t] == total


def test_appendix_4_lengths_that_are_misprinted():
    # printed: 16393 for GF(2) n = 14, 13682 for GF(3) n = 9
    assert Sequence(field_of_order(2), primitive_polynomial(2, 14)).period == 16383
    assert Sequence(field_of_order(3), primitive_polynomial(3, 9)).period == 19682
    # printed: (2 prma) % 4 for GF(4) n = 1, which gives 1, 2, 0
    assert Sequence(field_of_order(4), (2, 1)).symbols(range(3)).tolist() == [1, 2, 3]


def test_fifteen_terms_over_gf4():
    entry = GOLDEN["prmvs15_gf4"]
    array = array_from(
        {"family": "prmvs", "order": 4, "polynomial": entry["poly"], "initial": entry["init"]}
    )
    assert whole(array).tolist() == [entry["sequence"]]
    assert (array.rows, array.columns, array.window) == (1, 15, (1, 2))
    assert windows_are_unique(array, (1, 2))


def test_figure_5_10():
    entry = GOLDEN["fig_5_10"]
    sequence = Sequence(field_of_order(4), entry["poly"], entry["init"])
    assert sequence.period == entry["true_length"] == 1023
    terms = sequence.symbols(range(1023))
    digits = "".join(map(str, terms))
    assert digits == entry["sequence"]
    assert hashlib.sha256(digits.encode()).hexdigest() == entry["sha256_digits"]
    array = array_from({"family": "prmvs", "order": 4, "degree": 5, "polynomial": "x^5+x+A"})
    ring = np.append(terms, terms[:4])
    windows = np.lib.stride_tricks.sliding_window_view(ring, 5)[:, None, :]
    for method in METHODS:
        assert decode_exact(array, windows, method).indices.tolist() == list(range(1023))
    assert array.rows == 1


def test_figure_5_7():
    field = field_of_order(2)
    array = ProductArray(Sequence(field, (1, 1, 1)), Sequence(field, (1, 1, 1)))
    for pair, symbol in GOLDEN["fig_5_7_law"]["table"].items():
        sx, sy = (int(part[-1]) for part in pair.split(","))
        assert array.law[sy, sx] == symbol  # Y down the rows, X along the columns
        assert array.factors[symbol].tolist() == [sy, sx]


def test_figure_5_11():
    entry = GOLDEN["fig_5_11"]
    array = profile("product").array()
    assert array.row_sequence.symbols(range(15)).tolist() == entry["rows_sequence"]["s"]
    assert array.column_sequence.symbols(range(15)).tolist() == entry["cols_sequence"]["s"]
    grid = whole(array)
    assert grid.tolist() == entry["array"]
    shown = np.array(entry["window"])
    torus = np.pad(grid, ((0, 3), (0, 1)), mode="wrap")
    found = [
        [i, j] for i in range(15) for j in range(15) if (torus[i : i + 4, j : j + 2] == shown).all()
    ]
    assert found == entry["window_decodes_to"] == [[5, 7]]
    decoded = [decode_exact(array, shown, method)[0] for method in METHODS]
    decoded.append(decode_likelihood(array, shown, error=1e-3)[0])
    assert {(one.row, one.column) for one in decoded} == {(5, 7)}
    few = np.where(np.eye(2, dtype=bool)[[0, 1, 0, 0]], shown, -1)  # four, not p + q - 1 = 5
    assert np.count_nonzero(few >= 0) == 4
    assert decode_exact(array, few)[0].t == 5 * 15 + 7


def test_figure_6_9():
    entry = GOLDEN["fig_6_9"]
    array = array_from(
        {"family": "prpa", "factors": {"rows": {"degree": 4}, "columns": {"degree": 4}}}
    )
    assert array.row_sequence.symbols(range(15)).tolist() == entry["row_sequence_SY"]
    assert array.column_sequence.symbols(range(15)).tolist() == entry["col_sequence_SX"]
    assert whole(array).tolist() == entry["array"]
    assert windows_are_unique(array, (4, 4))
    assert array.rows * array.columns == entry["unique_4x4_windows"]
    assert not windows_are_unique(array, (4, 3))


def test_product_window_needs_one_symbol_in_every_row_and_column():
    """GOLDEN["min_symbols_note"]: max(k1, k2) symbols, not k1 + k2 - 1."""
    array = profile("product").array()
    assert array.identifies([0, 1, 2, 3], [0, 1, 0, 1])
    assert not array.identifies([0, 1, 2], [0, 1, 0])
    assert not array.identifies([0, 1, 2, 3], [0, 0, 0, 0])


def test_recognition_figures_6_17_to_6_19():
    array = profile("thesis").array()
    assert array.window == (6, 2)
    entries = THESIS["golden_windows"]
    windows = [[list(map(int, line)) for line in entry["window"]] for entry in entries]
    for entry, window in zip(entries, windows, strict=True):
        row, column = entry["row"], entry["col"]
        assert (entry["Y_PRBA"], entry["X_PRBA"]) == (row, column)
        seen = array.symbols(row + np.arange(6)[:, None], column + np.arange(2))
        assert seen.tolist() == window
        for method in METHODS:
            found = decode_exact(array, window, method)[0]
            assert (found.row, found.column, found.t, found.reason) == (row, column, entry["t"], "")
        assert array.index(row, column) == entry["t"]
        assert array.cell(entry["t"]) == (row, column)
    likely = decode_likelihood(array, windows, error=1e-6, blank=0)
    assert [(one.column, one.row) for one in likely] == [(61, 1), (9, 25), (25, 5)]
    assert max(one.doubt for one in likely) < 2e-5


def test_the_whole_63x65_array():
    array = profile("thesis").array()
    grid = whole(array)
    assert list(array.sequence.polynomial) == THESIS["poly"]
    assert list(array.sequence.initial) == THESIS["init"]
    assert "".join(map(str, grid[0])) == THESIS["row0"]
    digest = hashlib.sha256("".join(map(str, grid.ravel())).encode()).hexdigest()
    assert digest == THESIS["sha256_rowmajor"]
    s = array.sequence.symbols(range(4095))
    assert all(s[t] == s[t - 5] ^ s[t - 8] ^ s[t - 9] ^ s[t - 12] for t in range(12, 4095))


def test_appendix_5_remainder_is_no_window():
    """The thesis takes (1, 0, 1) for t^2 + 1 and finds 6; the index of the window is 2."""
    entry = GOLDEN["appendix5_example"]
    field, h = field_of_order(2), tuple(entry["h"])
    sequence = Sequence(field, h, entry["sequence"][:3])
    assert sequence.symbols(range(7)).tolist() == entry["sequence"]
    r = entry["r_low_to_high"]
    assert list(powmod(field, (0, 1), entry["exponent_of_r"], h)) == r
    assert sequence.symbols(entry["thesis_i"] + np.arange(3)).tolist() == r
    # the linear map between the two: element -> window
    element = sequence.element(2)
    window = sequence.functionals(sequence.element([0, 1, 2]))[:, 0] @ element % 2
    assert window.tolist() == r
    definition = {"family": "prbs", "polynomial": [1, 1, 0, 1], "initial": [0, 0, 1], "degree": 3}
    assert decode_exact(array_from(definition), [[1, 0, 1]])[0].t == entry["thesis_i"] == 2
    assert entry["exponent_of_r"] == 6


@pytest.mark.parametrize(
    ("definition", "measured"),
    [
        ({"family": "prba", "polynomial": 0x1099}, MEASURED["prba_63x65"]["dmin_thesis"]),
        ({"family": "prba", "polynomial": 0x1655}, MEASURED["prba_63x65"]["dmin_0x1655"]),
        ({"family": "prmva", "order": 4, "degree": 6}, MEASURED["prmva_gf4_63x65"]["dmin"]),
        (
            {"family": "prmva", "order": 4, "degree": 6, "rows": 45, "columns": 91},
            MEASURED["prmva_gf4_45x91"]["dmin"],
        ),
    ],
    ids=["0x1099", "0x1655", "gf4-63x65", "gf4-45x91"],
)
def test_minimum_distances(definition, measured):
    array = array_from(definition)
    for shape, expected in measured.items():
        a, b = map(int, shape.split("x"))
        if isinstance(expected, str):  # "rank 8, not unique"
            rank = array.rank(np.arange(a)[:, None], np.arange(b))
            assert rank == int(expected.split()[1].rstrip(","))
            assert distance(array, a, b) == 0
            assert not windows_are_unique(array, (a, b))
        else:
            assert distance(array, a, b) == expected
            assert windows_are_unique(array, (a, b))


def test_product_distances():
    array = array_from(
        {"family": "prpa", "factors": {"rows": {"degree": 4}, "columns": {"degree": 4}}}
    )
    assert (distance(array, 4, 4), distance(array, 5, 5)) == (4, 5)
    gf4 = {"order": 4, "degree": 2}
    array = array_from({"family": "prmvpa", "factors": {"rows": gf4, "columns": gf4}})
    assert array.order == 16
    assert distance(array, 4, 4) == 12


@pytest.mark.parametrize(
    ("q", "n", "rows", "columns", "windows"),
    [
        (2, 12, 63, 65, ["6x2", "2x6", "3x4"]),  # 0x1f11
        (4, 6, 45, 91, ["1x6", "2x3", "3x2", "6x1"]),
        (3, 8, 41, 160, ["2x4", "4x2"]),
        (9, 4, 41, 160, ["2x2"]),
        (9, 6, 560, 949, ["3x2"]),
        (8, 4, 63, 65, ["2x2"]),
        (8, 6, 511, 513, ["3x2"]),
    ],
)
def test_general_folds_have_tight_windows(q, n, rows, columns, windows):
    polynomial = on_file(q, n, "three windows") if q == 2 else primitive_polynomial(q, n)
    definition = {"family": "prmva", "order": q, "polynomial": list(polynomial)}
    array = array_from(definition | {"rows": rows, "columns": columns})
    for name in windows:
        a, b = map(int, name.split("x"))
        assert a * b == n == array.full_rank
        assert array.identifies(np.arange(a)[:, None], np.arange(b))
        if rows * columns < 10_000:
            assert windows_are_unique(array, (a, b))


@pytest.mark.parametrize(
    ("name", "size", "window", "alphabet", "pitch_mm", "distance_of_window"),
    [
        ("thesis", (63, 65, 2), (6, 2), "thesis-2", 12.0, 1),
        ("product", (15, 15, 8), (4, 2), "dense-8", 12.0, 2),
        ("one-touch", (63, 65, 4), (3, 2), "dense-4", 7.0, 1),
        ("large", (51, 1285, 4), (4, 2), "dense-4", 7.0, 1),
        ("fine", (51, 1285, 4), (4, 2), "dense-4", 4.5, 1),
    ],
)
def test_profiles(name, size, window, alphabet, pitch_mm, distance_of_window):
    chosen = profile(name)
    array = chosen.array()
    assert (array.rows, array.columns, array.order) == size
    assert chosen.window == array.window == window
    assert (chosen.alphabet, chosen.pitch_mm) == (alphabet, pitch_mm)
    assert windows_are_unique(array, window)
    assert distance(array, *window) == distance_of_window


def test_optimal_distance_costs_least_and_the_printed_formula_does_not():
    """Figure 5.4, table 5.2."""
    for k1, k4 in ((1, 4), (4, 1), (1, 1)):
        costs = [k1 * (2**16 - 1) / t + k4 * t for t in range(1, 2**16 - 1)]
        assert optimal_distance(2**16 - 1, k1, k4) == 1 + int(np.argmin(costs))
        periods = [2**n - 1 for n in (8, 16, 24, 32)]
        milestones = [round(N / optimal_distance(N, k1, k4)) for N in periods]
        assert GOLDEN["table_5_2"]["rows"].get(f"{k1}/{k4}", milestones) == milestones
    assert 1 / 512 * 2**8 - 1 < 0  # as printed: no distance at all where milestones are cheap
    assert optimal_distance(2**8 - 1, 1, 512) == 1
