"""Beads and printed surfaces, in files too; symbols as designed, moved, worn, swapped, gone.

What faults do to touches of a print is in the corpus `counts`, and on a whole panel in
`tests/loop/test_printed_panel.py`.
"""

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
from generator.printed.deposit import Beads, Deposit, beads_of, dot_size, section_size
from generator.printed.faults import NAMED, PrintFaults, print_faults
from generator.printed.gcode import toolpath_of
from generator.printed.prints import FaceOnPart, PrintJob, print_plan, surface_keys, symbols_shift
from generator.printed.surface import (
    UNIT_MM,
    PrintedSurface,
    is_written,
    read_surface,
    write_surface,
)
from generator.printed.survey import DOUBTFUL, LOST, SURVIVES, rings_at, survey_face
from generator.printed.view import DEPTH_MM, face_surface, heights_from_above, heights_sideways
from generator.solid.part import Embossing, turn

FILAMENT = math.pi * 1.75**2 / 4
W, H = 0.5, 0.2
SECTION = H * (W - H) + math.pi * H**2 / 4


def one_line(length=10.0, section=SECTION):
    e = length * section / FILAMENT
    return toolpath_of(f"M83\nG1 X0 Y0 Z.2\nG1 X{length} E{e:.8f}")


def volume(beads, step=0.01):
    """Volume of one straight bead from its heights: its lower half mirrors its upper half."""
    low = np.minimum(beads.start_mm, beads.end_mm).min(axis=0) - 1
    high = np.maximum(beads.start_mm, beads.end_mm).max(axis=0) + 1
    shape = tuple((np.ceil((high - low)[::-1] / step)).astype(int))
    heights = heights_from_above(beads, low, shape, step)
    middle = beads.top_mm[0] - beads.height_mm[0] / 2
    over = heights[np.isfinite(heights)].astype(np.float64) - middle
    return float(2 * over.sum() * step**2)


@pytest.mark.parametrize("length", [10.0, 1.0, 0.5, 0.3, 0.05])
def test_a_stroke_is_as_wide_as_its_volume_says_and_holds_it_ends_included(length):
    bead = beads_of(one_line(length))
    if length > W:
        assert (*bead.width_mm, *bead.height_mm) == pytest.approx((W, H))
    assert volume(bead) == pytest.approx(length * SECTION, rel=0.02)


def test_too_little_for_its_layer_is_a_string_on_the_layer_below():
    thin = beads_of(one_line(section=math.pi * 0.05**2))
    assert (*thin.width_mm, *thin.height_mm, *thin.top_mm) == pytest.approx([0.1] * 3, rel=1e-3)
    sizes = section_size(np.array([math.pi / 100]), np.array([0.2]))
    assert np.concatenate(sizes) == pytest.approx([0.2, 0.2])
    sizes = dot_size(np.array([math.pi * 0.1**3 / 6]), np.array([0.2]))
    assert np.concatenate(sizes) == pytest.approx([0.1, 0.1])


def some_beads(count):
    """Random beads; some are dots, some lie along the axes."""
    rng = np.random.default_rng(17)
    height = np.where(rng.random(count) < 0.5, 0.2, 0.3)
    start = rng.uniform(0, 4, (count, 2))
    end = start + rng.normal(0, 1.0, (count, 2))
    end[:3] = start[:3]
    end[3:6, 0], end[6:9, 1] = start[3:6, 0], start[6:9, 1]
    top, width = 0.2 * rng.integers(1, 6, count), height + rng.uniform(0, 0.4, count)
    return Beads(start, end, top, width, height)


def off_the_flat(points, k, beads):
    """Return how far points (..., 2) lie outside the flat middle of a bead."""
    a = beads.start_mm[k]
    way = beads.end_mm[k] - a
    t = np.clip((points - a) @ way / max(way @ way, 1e-12), 0, 1)
    off = np.linalg.norm(points - a - t[..., None] * way, axis=-1)
    return np.maximum(off - (beads.width_mm[k] - beads.height_mm[k]) / 2, 0.0)


def test_from_above_the_highest_of_all_beads_counts():
    beads = some_beads(40)
    low, step, shape = np.array([-0.53, -0.51]), 0.13, (45, 40)
    points = np.stack(np.meshgrid(np.arange(40), np.arange(45)), axis=-1) * step + low
    expected = np.full(shape, -np.inf)
    for k in range(len(beads)):
        off, r = off_the_flat(points, k, beads), beads.height_mm[k] / 2
        z = beads.top_mm[k] - r + np.sqrt((r * r - off * off).clip(0))
        expected = np.maximum(expected, np.where(off <= r, z, -np.inf))
    assert np.isfinite(expected).mean() > 0.2
    assert heights_from_above(beads, low, shape, step) == pytest.approx(expected, abs=1e-5)


def test_sideways_the_outermost_of_all_beads_counts():
    beads = some_beads(25)
    low, step, shape = np.array([-0.53, 0.013]), 0.1, (11, 50)
    heights = heights_sideways(beads, low, shape, step)
    n = np.arange(-3.0, 8.0, 0.004)
    for i, j in np.ndindex(shape[0], 17):
        z, t = low[1] + step * i, low[0] + step * 3 * j
        points = np.stack([np.full(len(n), t), n], axis=1)
        reach = -np.inf
        for k in range(len(beads)):
            r = beads.height_mm[k] / 2
            up = z - (beads.top_mm[k] - r)
            if abs(up) <= r:
                inside = np.hypot(off_the_flat(points, k, beads), up) <= r
                reach = max(reach, n[inside].max(initial=-np.inf))
        assert heights[i, 3 * j] == pytest.approx(reach, abs=0.012)


def block(T, *, bow_mm=0.0, **options):
    """A block of 4 x 2 x 0.6 mm of three layers along x, seen on one of its faces."""
    y, top = (each.ravel() for each in np.meshgrid([0.25, 0.65, 1.05, 1.45, 1.75], [0.2, 0.4, 0.6]))
    start, end = (np.stack([np.full(15, x), y], axis=1) for x in (0.25, 3.75))
    beads = Beads(start, end, top, np.full(15, W), np.full(15, H))
    return face_surface(
        Deposit(beads, np.zeros(3), np.array([4.0, 2.0, 0.6]), bow_mm), T, **options
    )


def test_deeper_plastic_and_leaning_faces_are_left_out():
    T = np.eye(4)
    for above in (2.45, 2.55):  # the block
        T[2, 3] = 0.6 + above
        region = block(T, outline_mm=np.array([[0.0, 0], [1, 0], [1, 1]]))
        assert region.heights.shape == (61, 61)
        assert region.top_mm == (pytest.approx(-above, abs=1e-6) if above < DEPTH_MM else -np.inf)
    for z, y in ((-1.0, 0.0), (0.6, 0.8)):
        lean = np.eye(4)
        lean[:3, 1:3] = [[0, 0], [z, y], [-y, z]]
        with pytest.raises(PrintError, match="leans"):
            block(lean)


def test_names_and_numbers():
    assert print_faults("none") == PrintFaults() == print_faults("")
    assert print_faults("usual,flow=1.3") == replace(NAMED["usual"], flow=1.3)
    own = print_faults("scale_x=.995, backlash_mm=0.1")
    assert own == PrintFaults(scale_x=0.995, backlash_mm=0.1)
    for text, says in (
        ("flow=1,bad", "unknown fault 'bad'"), ("backlash=0.1", "did you mean backlash_mm"),
        ("flow=much", "flow 'much'"), ("flow=3", "from 0.3 to 2"),
        ("scale_x=nan", "scale_x 'nan'"), ("seam_mm=-1", "from 0 to 1"),
    ):  # fmt: skip
        with pytest.raises(PrintError, match=says):
            print_faults(text)


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
