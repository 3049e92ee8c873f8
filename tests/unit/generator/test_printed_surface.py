"""Printed surfaces in files, and symbols on them: as designed, moved, worn, swapped, gone."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.errors import PrintError
from generator.plane.polygon import points_inside
from generator.printed import prints
from generator.printed.prints import FaceOnPart, PrintJob, print_plan, surface_keys, symbols_shift
from generator.printed.surface import (
    UNIT_MM,
    PrintedSurface,
    is_written,
    read_surface,
    write_surface,
)
from generator.printed.survey import DOUBTFUL, LOST, SURVIVES, rings_at, survey_face
from generator.solid.part import Embossing, turn

TIERS = outlines(alphabet_named("dense-4"), SymbolStyle())
CENTRES = np.array([[5.0, 5.0], [12.0, 5.0], [5.0, 12.0], [12.0, 12.0]])
ASIDE = (0.15, -0.1)


def embossing(rotation=0.0):
    T = np.eye(4)
    T[2, 3] = 3.0
    names = tuple(f"r{k}c0" for k in range(4))
    return Embossing(0, 0, T, rotation, CENTRES, np.arange(4), names, TIERS, 7.0)


def rough_surface():
    heights = np.random.default_rng(1).uniform(-2.5, 1.4, (40, 60)).astype(np.float32)
    heights[:5] = -np.inf
    T = np.eye(4)
    T[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    T[:2, 3] = (3.0, -1.0)
    return PrintedSurface(heights, (-0.5, 0.25), 0.05, T)


@pytest.mark.parametrize("moved", [(0.0, 0.0), (0.3, -0.2)])
def test_a_surface_reads_as_it_was_and_is_moved_back(tmp_path, moved):
    surface = rough_surface()
    write_surface(surface, tmp_path / "a", moved_mm=moved)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "a.npy"]
    held = read_surface(tmp_path / "a")
    assert held.moved_mm == moved
    points = np.random.default_rng(3).uniform(-5.0, 6.0, (4000, 2))
    asked, found = surface.heights_mm(points + moved), held.heights_mm(points)
    laid = np.isfinite(asked)
    assert 100 < laid.sum() < 4000
    assert (laid == np.isfinite(found)).all()
    assert np.abs(asked[laid] - found[laid]).max() <= UNIT_MM / 2 + 1e-9
    assert surface.top_mm <= held.top_mm <= surface.top_mm + UNIT_MM
    assert found.max() <= held.top_mm


def test_what_is_damaged_or_of_another_format_is_no_surface(tmp_path):
    path = tmp_path / "a"
    with pytest.raises(PrintError, match="not there or cannot be read") as caught:
        read_surface(path)
    assert "--resume" in caught.value.fix
    write_surface(rough_surface(), path)
    assert is_written(path)
    values = json.loads((tmp_path / "a.json").read_text())
    for text in (json.dumps(values | {"format": 0}), "{"):
        (tmp_path / "a.json").write_text(text)
        assert not is_written(path)
    with pytest.raises(PrintError):
        read_surface(path)
    (tmp_path / "a.json").write_text(json.dumps(values))
    (tmp_path / "a.npy").unlink()
    assert not is_written(path)


def test_a_key_follows_from_what_decides_the_surface_alone(monkeypatch):
    monkeypatch.setattr(prints, "slicer_version", lambda: "test")
    face = FaceOnPart("F1", np.array([(0.0, 0.0), (9.0, 0.0), (9.0, 6.0)]), embossing())
    job = PrintJob("Block-F1", Path("b.stl"), "ab" * 32, False, (face,))
    plan = print_plan("fdm-0.4-0.2", "usual", 3)
    known = surface_keys(job, plan)
    assert surface_keys(replace(job, file=Path("elsewhere.stl"), name="Other"), plan) == known
    moved = replace(face.embossing, T_part_facet=np.eye(4))
    fine, plans = "fdm-0.4-0.2", [("fdm-0.4-0.3", "usual", 3)]
    plans += [(fine, "bad", 3), (fine, "usual,flow=1.03", 3), (fine, "usual", 4)]
    others = [
        *(surface_keys(job, print_plan(*one)) for one in plans),
        surface_keys(replace(job, sha256="cd" * 32), plan),
        surface_keys(replace(job, supports=True), plan),
        surface_keys(replace(job, faces=(replace(face, embossing=moved),)), plan),
    ]
    assert len({keys["F1"] for keys in [known, *others]}) == 1 + len(others)


def surface(labels=range(4), *, moved=(0.0, 0.0), high=1.0, base=0.0, rotation=0.0):
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


def checks_of(of, rotation=0.0):
    tiles = survey_face(of, embossing(rotation), part="P", face="F1")
    return [tile.check for tile in tiles]


@pytest.mark.parametrize("rotation", [0.0, math.radians(90), 0.3])
def test_symbols_as_designed_survive(rotation):
    for check in checks_of(surface(rotation=rotation), rotation):
        assert check.verdict == SURVIVES
        assert check.overlap > (0.95 if rotation == 0.3 else 0.98)  # steps of a turned grid
        assert check.rival_overlap < 0.8
        assert check.height_mm == pytest.approx(1.0, abs=1e-3)
        assert check.moved_mm == pytest.approx((0.0, 0.0), abs=0.02)
        assert (check.part, check.face) == ("P", "F1")
        if not rotation:
            rings = rings_at(TIERS[check.label], 0.5)
            crosses = (x @ np.roll(y, -1) - np.roll(x, -1) @ y for x, y in (r.T for r in rings))
            area = abs(float(sum(crosses))) / 2
            assert check.area_mm2 == pytest.approx(area, rel=0.03)
            assert check.lost_mm2 + check.widened_mm2 < 0.02 * area


@pytest.mark.parametrize("rotation", [0.0, math.radians(90), 0.3])
def test_symbols_aside_of_their_place_survive_and_say_how_far(rotation):
    aside = surface(moved=ASIDE, base=-0.1, rotation=rotation)
    assert symbols_shift(aside, embossing(rotation)) == pytest.approx(ASIDE, abs=0.012)
    for check in checks_of(aside) if not rotation else ():
        assert check.verdict == SURVIVES
        assert check.overlap > 0.97
        assert check.moved_mm == pytest.approx(ASIDE, abs=0.012)


def test_symbols_that_are_gone_do_not_move_the_middle():
    some = symbols_shift(surface([0, -1, -1, 3], moved=(0.2, 0.1)), embossing())
    assert some == pytest.approx((0.2, 0.1), abs=0.012)
    assert (symbols_shift(surface([-1] * 4), embossing()) == 0).all()
    assert (symbols_shift(surface(base=-np.inf), embossing()) == 0).all()


@pytest.mark.parametrize(("high", "verdict"), [(0.8, SURVIVES), (0.62, DOUBTFUL), (0.3, LOST)])
def test_low_symbols_are_doubtful_and_lower_ones_lost(high, verdict):
    checks = checks_of(surface(high=high))
    assert {check.verdict for check in checks} == {verdict}
    assert checks[0].height_mm == pytest.approx(high, abs=0.01)


def test_another_symbol_or_none_in_its_place_is_lost():
    checks = checks_of(surface([3, 1, -1, 0]))
    assert [check.verdict for check in checks] == [LOST, SURVIVES, LOST, LOST]
    assert checks[0].rival_overlap > 0.93
    assert checks[3].lost_mm2 > 4
    assert checks[0].widened_mm2 > 4
    assert (checks[2].overlap, checks[2].height_mm) == (0, 0)


def test_a_string_across_the_cell_moves_nothing():
    strung = surface()
    line = np.arange(341) * 0.05
    strung.heights[np.abs(line - 8.2) < 0.08] = 0.9  # from side to side, above symbols 0 and 1
    check = checks_of(strung)[0]
    assert check.moved_mm == pytest.approx((0.0, 0.0), abs=0.02)
    assert check.verdict == SURVIVES
    assert check.widened_mm2 > 0.9
