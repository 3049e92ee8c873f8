"""Printed surfaces in files, and symbols on them: as designed, moved, worn, swapped, gone."""

from __future__ import annotations

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
from generator.printed.gcode import toolpath_of
from generator.printed.prints import (
    FaceOnPart,
    PrintJob,
    left_to_print,
    print_part,
    print_plan,
    surface_keys,
    surface_path,
    symbols_shift,
)
from generator.printed.slicer import SlicedPart
from generator.printed.surface import (
    UNIT_MM,
    PrintedSurface,
    is_written,
    read_surface,
    write_surface,
)
from generator.printed.survey import DOUBTFUL, LOST, SURVIVES, SymbolTile, rings_at, survey_face
from generator.solid.part import Embossing, turn

SIZE = np.array([9.0, 6.0, 0.6])


def rough_surface(rng: np.random.Generator) -> PrintedSurface:
    heights = rng.uniform(-2.5, 1.4, (40, 60)).astype(np.float32)
    heights[:5] = -np.inf
    T = np.eye(4)
    T[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    T[:2, 3] = (3.0, -1.0)
    return PrintedSurface(heights, (-0.5, 0.25), 0.05, T)


def test_a_surface_reads_as_it_was_to_half_a_unit(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    surface = rough_surface(rng)
    write_surface(surface, tmp_path / "a")
    held = read_surface(tmp_path / "a")
    points = rng.uniform(-5.0, 6.0, (4000, 2))
    asked, found = surface.heights_mm(points), held.heights_mm(points)
    laid = np.isfinite(asked)
    assert 100 < laid.sum() < 4000
    assert (laid == np.isfinite(found)).all()
    assert np.abs(asked[laid] - found[laid]).max() <= UNIT_MM / 2 + 1e-9
    assert surface.top_mm <= held.top_mm <= surface.top_mm + UNIT_MM
    assert found.max() <= held.top_mm
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "a.npy"]


def test_a_print_that_stands_aside_is_moved_back(tmp_path: Path) -> None:
    surface = rough_surface(np.random.default_rng(2))
    write_surface(surface, tmp_path / "a", moved_mm=(0.3, -0.2))
    held = read_surface(tmp_path / "a")
    points = np.random.default_rng(3).uniform(0.0, 3.0, (500, 2))
    asked = surface.heights_mm(points + np.array((0.3, -0.2)))
    assert np.isfinite(asked).any()
    assert held.heights_mm(points) == pytest.approx(asked, abs=UNIT_MM)
    assert held.moved_mm == (0.3, -0.2)


def test_what_is_damaged_or_of_another_format_is_no_surface(tmp_path: Path) -> None:
    path = tmp_path / "a"
    assert not is_written(path)
    with pytest.raises(PrintError, match="not there or cannot be read") as caught:
        read_surface(path)
    assert "--resume" in caught.value.fix
    write_surface(rough_surface(np.random.default_rng(1)), path)
    assert is_written(path)
    values = json.loads((tmp_path / "a.json").read_text())
    (tmp_path / "a.json").write_text(json.dumps(values | {"format": 0}))
    assert not is_written(path)
    (tmp_path / "a.json").write_text("{")
    assert not is_written(path)
    with pytest.raises(PrintError):
        read_surface(path)
    (tmp_path / "a.json").write_text(json.dumps(values))
    (tmp_path / "a.npy").unlink()
    assert not is_written(path)


def wall_gcode() -> str:
    """A block of SIZE in three layers, lines along x, its middle at (50, 50)."""
    lines = ["M83"]
    for k in (1, 2, 3):
        lines.append(f"G1 Z{0.2 * k:.1f}")
        for n in range(15):
            y = 50 - SIZE[1] / 2 + 0.2 + 0.4 * n
            lines += [f"G1 X{50 - SIZE[0] / 2 + 0.2} Y{y:.3f}", f"G1 X{50 + SIZE[0] / 2 - 0.2} E.3"]
    return "\n".join(lines)


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> PrintJob:
    """A block with a face on top; the slicer is left out."""
    T_part_gcode = np.eye(4)
    T_part_gcode[:2, 3] = -50.0
    low = np.array([-SIZE[0] / 2, -SIZE[1] / 2, 0.0])
    sliced = SlicedPart(toolpath_of(wall_gcode()), T_part_gcode, low, low + SIZE)
    monkeypatch.setattr(prints, "slicer_version", lambda: "test")
    monkeypatch.setattr(prints, "slice_part", lambda *_args, **_options: sliced)
    T = np.eye(4)
    T[:3, 3] = (*low[:2], SIZE[2])
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle())
    symbols = Embossing(0, 0, T, 0.0, np.zeros((0, 2)), np.zeros(0, np.int64), (), tiers, 7.0)
    corners = np.array([(0.0, 0.0), (SIZE[0], 0.0), (SIZE[0], SIZE[1]), (0.0, SIZE[1])])
    face = FaceOnPart("F1", corners, symbols)
    return PrintJob("Block-F1", tmp_path / "b.stl", "ab" * 32, False, (face,))


def test_a_part_is_printed_once_and_the_same_again(job: PrintJob, tmp_path: Path) -> None:
    plan = print_plan("fdm-0.4-0.2", "usual", 3)
    assert left_to_print(job, plan, tmp_path / "one")
    for folder in ("one", "two"):
        print_part(job, plan, tmp_path / folder)
        assert not left_to_print(job, plan, tmp_path / folder)
    (key,) = surface_keys(job, plan).values()
    first, second = (surface_path(tmp_path / folder, key) for folder in ("one", "two"))
    for suffix in (".npy", ".json"):
        assert first.with_suffix(suffix).read_bytes() == second.with_suffix(suffix).read_bytes()
    middle = np.array([[SIZE[0] / 2, SIZE[1] / 2]])
    assert read_surface(first).heights_mm(middle) == pytest.approx([0.0], abs=0.12)
    assert np.isneginf(read_surface(first).heights_mm(middle + SIZE[0])).all()


def test_a_key_follows_from_what_decides_the_surface_alone(job: PrintJob) -> None:
    plan = print_plan("fdm-0.4-0.2", "usual", 3)
    known = surface_keys(job, plan)
    assert surface_keys(replace(job, file=Path("elsewhere.stl"), name="Other"), plan) == known
    moved = replace(job.faces[0].embossing, T_part_facet=np.eye(4))
    others = [
        surface_keys(job, print_plan("fdm-0.4-0.3", "usual", 3)),
        surface_keys(job, print_plan("fdm-0.4-0.2", "bad", 3)),
        surface_keys(job, print_plan("fdm-0.4-0.2", "usual,flow=1.03", 3)),
        surface_keys(job, print_plan("fdm-0.4-0.2", "usual", 4)),
        surface_keys(replace(job, sha256="cd" * 32), plan),
        surface_keys(replace(job, supports=True), plan),
        surface_keys(replace(job, faces=(replace(job.faces[0], embossing=moved),)), plan),
    ]
    assert len({keys["F1"] for keys in [known, *others]}) == 1 + len(others)


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
