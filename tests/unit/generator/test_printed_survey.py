"""Symbols on surfaces whose truth is known: as designed, moved, worn, swapped, gone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.plane.polygon import points_inside
from generator.printed.prints import symbols_shift
from generator.printed.surface import PrintedSurface
from generator.printed.survey import DOUBTFUL, LOST, SURVIVES, SymbolTile, rings_at, survey_face
from generator.solid.part import Embossing, turn

TIERS = outlines(alphabet_named("dense-4"), SymbolStyle())
CENTRES = np.array([[5.0, 5.0], [12.0, 5.0], [5.0, 12.0], [12.0, 12.0]])


def embossing(rotation: float = 0.0) -> Embossing:
    T = np.eye(4)
    T[2, 3] = 3.0
    names = tuple(f"r{k}c0" for k in range(4))
    return Embossing(0, 0, T, rotation, CENTRES, np.arange(4), names, TIERS, 7.0)


def surface(
    labels: list[int], *, moved: tuple[float, float] = (0.0, 0.0), high: float = 1.0,
    base: float = 0.0, rotation: float = 0.0,
) -> PrintedSurface:  # fmt: skip
    """The exact CAD surface of some symbols, 17 x 17 mm, every .05 mm; -1 for none."""
    line = np.arange(0, 341) * 0.05
    x, y = np.meshgrid(line, line)
    heights = np.zeros(x.shape)
    for centre, label in zip(CENTRES, labels, strict=True):
        if label < 0:
            continue
        at = np.stack([x, y], axis=-1) - centre - moved
        near = (np.abs(at) < 3.6).all(axis=-1)
        for z in (0.0, 0.25, 0.4, 0.475, 0.49, 0.5, 0.502, 0.51, 0.525, 0.6, 0.8, 1.0):
            within = points_inside(at[near] @ turn(rotation), rings_at(TIERS[label], z))
            heights[near] = np.where(within, high * z, heights[near])
    return PrintedSurface((heights + base).astype(np.float32), (0.0, 0.0), 0.05, np.eye(4))


def survey(of: PrintedSurface, rotation: float = 0.0) -> list[SymbolTile]:
    return survey_face(of, embossing(rotation), part="P", face="F1")


@pytest.mark.parametrize("rotation", [0.0, math.radians(90), 0.3])
def test_symbols_as_designed_survive(rotation: float) -> None:
    for tile in survey(surface([0, 1, 2, 3], rotation=rotation), rotation):
        check = tile.check
        assert check.verdict == SURVIVES
        assert check.overlap > (0.95 if rotation == 0.3 else 0.98)  # steps of a turned grid
        assert check.rival_overlap < 0.8
        assert check.height_mm == pytest.approx(1.0, abs=1e-3)
        assert check.moved_mm == pytest.approx((0.0, 0.0), abs=0.02)
        assert (check.part, check.face) == ("P", "F1")
        assert tile.deposited == pytest.approx(tile.designed, abs=1.0)


def test_areas_are_those_of_the_outline_at_half_height() -> None:
    check = survey(surface([0, 1, 2, 3]))[0].check
    rings = rings_at(TIERS[0], 0.5)
    x, y = rings[0].T
    area = abs(float(x @ np.roll(y, -1) - np.roll(x, -1) @ y)) / 2
    assert check.area_mm2 == pytest.approx(area, rel=0.03)
    assert check.lost_mm2 + check.widened_mm2 < 0.02 * area


def test_a_symbol_aside_of_its_place_survives_and_says_how_far() -> None:
    for tile in survey(surface([0, 1, 2, 3], moved=(0.15, -0.1), base=-0.1)):
        assert tile.check.verdict == SURVIVES
        assert tile.check.overlap > 0.97
        assert tile.check.moved_mm == pytest.approx((0.15, -0.1), abs=0.012)


def test_low_symbols_are_doubtful_and_lower_ones_lost() -> None:
    for high, verdict in ((0.8, SURVIVES), (0.62, DOUBTFUL), (0.3, LOST)):
        checks = [tile.check for tile in survey(surface([0, 1, 2, 3], high=high))]
        assert {check.verdict for check in checks} == {verdict}
        assert checks[0].height_mm == pytest.approx(high, abs=0.01)


def test_another_symbol_in_its_place_is_lost() -> None:
    swapped = [tile.check for tile in survey(surface([3, 1, 2, 0]))]
    assert [check.verdict for check in swapped] == [LOST, SURVIVES, SURVIVES, LOST]
    assert swapped[0].rival_overlap > 0.93
    assert swapped[3].lost_mm2 > 4
    assert swapped[0].widened_mm2 > 4


def test_no_symbol_is_lost() -> None:
    checks = [tile.check for tile in survey(surface([0, -1, -1, 3]))]
    assert [check.verdict for check in checks] == [SURVIVES, LOST, LOST, SURVIVES]
    assert checks[1].overlap == 0
    assert checks[1].height_mm == 0


def test_a_string_across_the_cell_moves_nothing() -> None:
    strung = surface([0, 1, 2, 3])
    line = np.arange(341) * 0.05
    strung.heights[np.abs(line - 8.2) < 0.08] = 0.9  # from side to side, above symbols 0 and 1
    check = survey(strung)[0].check
    assert check.moved_mm == pytest.approx((0.0, 0.0), abs=0.02)
    assert check.verdict == SURVIVES
    assert check.widened_mm2 > 0.9


@pytest.mark.parametrize("rotation", [0.0, math.radians(90), 0.3])
def test_the_middle_of_the_symbols_is_found_in_the_faces_frame(rotation: float) -> None:
    moved = surface([0, 1, 2, 3], moved=(0.15, -0.1), base=0.2, rotation=rotation)
    found = symbols_shift(moved, embossing(rotation))
    assert found == pytest.approx((0.15, -0.1), abs=0.012)


def test_symbols_that_are_gone_do_not_move_the_middle() -> None:
    some = symbols_shift(surface([0, -1, -1, 3], moved=(0.2, 0.1)), embossing())
    assert some == pytest.approx((0.2, 0.1), abs=0.012)
    assert (symbols_shift(surface([-1, -1, -1, -1]), embossing()) == 0).all()
    assert (symbols_shift(surface([0, 1, 2, 3], base=-np.inf), embossing()) == 0).all()
