"""Touches that are drawn: those that follow one without an answer, of prints, and of decoys.

The slicer is left out: what stands for a print is the written part's own height map, moved.
The real one runs in tests/loop/test_validate_printed.py.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from generator.errors import PrintError
from generator.printed import prints
from generator.printed.prints import surface_keys, surface_path
from generator.printed.surface import PrintedSurface, write_surface
from probe.errors import SurfaceError
from probe.simulate import printed
from probe.simulate.printed import PrintOptions, listing_of, printed_scene, read_listing
from probe.simulate.registered import registered_surface
from probe.simulate.target import part_surface
from probe.simulate.world.surfaces import exchange_symbols, seat_panel, seats_of
from probe.surface.polygon import polygon
from recognizer.scan.session import Scan
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import AMBIGUOUS, NextTouch, refusal
from recognizer.validation.draw import draw_again, draw_touch
from recognizer.validation.errors import ValidationError
from recognizer.validation.pipeline import validate
from recognizer.validation.printing import find_parts
from recognizer.validation.repeat import repeat_touch
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import NEXT, judge, touch_until_answered, trial

PLAN = TouchPlan("", 5, "typical", "corner", policy=NEXT)


@pytest.fixture(scope="module")
def url(make_lab):
    return f"sqlite:///{make_lab('{name: Cube, shape: {cube: 60 mm}}') / 'lab.db'}"


@pytest.fixture(scope="module")
def reader(url):
    return Reader(open_lab(url))


@pytest.mark.parametrize("number", range(4))
def test_the_first_touch_is_the_one_that_is_made_alone(url, reader, number):
    plan = replace(PLAN, database=url)
    one, alone = (trial(replace(plan, policy=how), number, reader) for how in (NEXT, "one"))
    assert (one.x_mm, one.y_mm, one.force_n) == (alone.x_mm, alone.y_mm, alone.force_n)
    assert (one.touches == 1) == (alone.verdict == "right")


def test_steps_are_made_from_the_sensor_s_frame_by_the_same_sensor(url, reader, monkeypatch):
    plan = replace(PLAN, database=url, kind="face", level="dead-40")
    step = NextTouch(4.0, 2.0, 30.0, 60.0, "told")
    refused = replace(refusal(3, AMBIGUOUS), next=step)
    monkeypatch.setattr(Scan, "add", lambda *_arguments, **_named: refused)
    made = list(touch_until_answered(plan, 3, reader, 2))
    first, second = (one.found.touch for one in made)
    c, s = math.cos(first.theta_rad), math.sin(first.theta_rad)
    at = first.x_mm + 4 * c - 2 * s, first.y_mm + 4 * s + 2 * c
    assert math.dist(at, (second.x_mm, second.y_mm)) < 1.5  # the arm errs by .3 mm each way
    assert second.theta_rad - first.theta_rad == pytest.approx(math.radians(30), abs=0.02)
    assert second.force_n == pytest.approx(60, rel=0.4)
    dead = [one.found.counts < 40 for one in made]
    assert np.logical_and(*dead).sum() >= 90  # a third of them would be by chance
    assert len(made) == 2


def test_a_run_of_touches_that_follow_each_other_repeats(url, tmp_path, monkeypatch):
    monkeypatch.setattr("recognizer.validation.report.page_of", lambda *_: "")  # pictures are slow
    options = {"policy": NEXT, "kinds": "corner", "surfaces": "database", "study": 0, "seed": 6}
    validate((), database=url, folder=tmp_path / "run", touches=6, **options)
    rows = pq.read_table(tmp_path / "run" / "trials.parquet").to_pylist()
    row = next(row for row in rows if row["touches"] > 1)
    again = repeat_touch(tmp_path / "run", row["number"], None)
    for name, value in again.items():
        assert value == (None if value is None else row[name]), name


L = """
name: Bracket
shape:
  polyhedron:
    vertices: [[0, 0, 0], [70, 0, 0], [70, 20, 0], [20, 20, 0], [20, 70, 0], [0, 70, 0],
      [0, 0, 50], [70, 0, 50], [70, 20, 50], [20, 20, 50], [20, 70, 50], [0, 70, 50]]
    faces: [[0, 5, 4, 3, 2, 1], [6, 7, 8, 9, 10, 11], [0, 1, 7, 6], [1, 2, 8, 7], [2, 3, 9, 8],
      [3, 4, 10, 9], [4, 5, 11, 10], [5, 0, 6, 11]]
print: {parts: whole}
"""


def test_a_touch_that_meets_another_face_is_drawn_again(make_lab):
    url = f"sqlite:///{make_lab(L) / 'lab.db'}"
    reader = Reader(open_lab(url))
    plan = replace(PLAN, database=url, kind="anywhere", level="low", only="Bracket/F5")
    made = [draw_touch(plan, number, reader) for number in range(8)]
    assert any("met another face" in one.resampled for one in made)
    reach = reader.sensor.half_mm[0]
    for one in made:  # the wall is where x of the object is 20
        at = one.contact.scene.T_object_surface @ (one.touch.x_mm, one.touch.y_mm, 0, 1)
        assert at[0] - 20 > 0.7 * reach


@pytest.mark.parametrize("shape", ["cylinder: {diameter: 44 mm, height: 30 mm}",
                                   "cone: {diameter: 64 mm, height: 34 mm}"])  # fmt: skip
def test_answers_across_the_seam_of_a_round_face_are_right(make_lab, shape):
    made = make_lab(f"{{name: Round, shape: {{{shape}}}}}", formats=("stl",))
    url = f"sqlite:///{made / 'lab.db'}"
    reader = Reader(open_lab(url))
    plan = replace(PLAN, database=url, level="low", kind="anywhere")
    numbers = range(len(reader.lab.arrays[0].faces))
    face = next(f for f in map(reader.lab.arrays[0].face, numbers) if f.round)
    d = face.round.development
    start, end = (d.low[0] + d.high[0]) / 2, (d.low[-1] + d.high[-1]) / 2  # one place
    up, over = d.high[0] - d.low[0], d.high[-1] - d.low[-1]
    turn = math.atan2(over[1], over[0]) - math.atan2(up[1], up[0])
    drawn = draw_touch(replace(plan, only=f"Round/{face.face}"), 0, reader)
    found = replace(drawn, touch=replace(drawn.touch, x_mm=start[0], y_mm=start[1], theta_rad=0.3))
    T = np.eye(4)
    for off, verdict in ((0.3, "right"), (3.0, "wrong")):
        c, s = math.cos(0.3 + turn), math.sin(0.3 + turn)
        T[:2, :2], T[:2, 3] = [[c, -s], [s, c]], end + off * over / np.hypot(*over)
        answer = replace(
            refusal(0, ""), object="Round", face=face.face, T_face_probe=T, covariance=np.eye(3)
        )
        judged = judge(plan, 0, found, answer, reader)
        assert judged.verdict == verdict
        assert judged.error_mm == pytest.approx(off, abs=0.01)
        assert judged.error_deg == pytest.approx(0, abs=0.01)


def test_a_worn_face_has_lost_the_same_symbols_elsewhere(url, reader):
    plan = replace(PLAN, database=url, kind="worn", level="low")
    first = draw_touch(plan, 1, reader)
    again = draw_again(plan, first, first.touch, reader, np.random.default_rng(0))
    points = np.random.default_rng(1).uniform(0, 60, (400, 2))
    heights = [one.contact.scene.surface.heights_mm(points) for one in (again, first)]
    assert np.array_equal(*heights)
    assert (np.abs(again.counts.astype(int) - first.counts) < 40).all()  # the noise is another


OPTIONS = PrintOptions(faults="usual", seed=5)


@pytest.fixture(autouse=True, scope="module")
def no_slicer():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(printed, "find_slicer", lambda: "none")
        for module in (printed, prints):
            patch.setattr(module, "slicer_version", lambda: "test")
        yield


@pytest.fixture(scope="module")
def panels(make_lab):
    return str(make_lab("{name: Cube, shape: {cube: 36 mm}}", formats=("stl",)) / "lab.db")


@pytest.fixture(scope="module")
def whole(make_lab):
    spec = "{name: Cube, shape: {cube: 36 mm}, print: {parts: whole, down: none}}"
    return str(make_lab(spec, formats=("stl",)) / "lab.db")


@pytest.fixture(scope="module")
def listing(panels, tmp_path_factory):
    """One panel of six, printed: what the STL says, .1 mm aside."""
    folder = tmp_path_factory.mktemp("run")
    part = find_parts(panels)[2]
    (key,) = surface_keys(part.job, OPTIONS.plan()).values()
    designed = part_surface(part.job.file, database=panels, face="F3").surface
    line = np.arange(-1.0, 37.0, 0.1)
    points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    heights = designed.heights_mm(points - np.array((0.1, 0.0)))
    heights[heights < -2.5] = -np.inf
    laid = heights.reshape(len(line), len(line)).astype(np.float32)
    surface = PrintedSurface(laid, (-1.0, -1.0), 0.1, np.eye(4))
    assert part.left(OPTIONS, folder / "kept")
    write_surface(surface, surface_path(folder / "kept", key), moved_mm=(0.1, 0.0))
    assert not part.left(OPTIONS, folder / "kept")
    assert part.left(replace(OPTIONS, seed=6), folder / "kept")
    (folder / "printed.json").write_text(listing_of([part], OPTIONS, folder / "kept", folder))
    return str(folder / "printed.json")


def test_of_a_whole_body_what_looks_down_is_not_simulated(whole):
    (part,) = find_parts(whole)
    assert part.job.supports
    assert len(part.job.faces) == 5
    assert len(part.unseen) == 1
    values = json.loads(listing_of([part], OPTIONS, Path("/a/kept"), Path("/a/run")))
    assert values["not simulated"] == [f"{part.unseen[0]} of Cube"]
    assert values["folder"] == "../kept"
    assert list(values["faces"]["Cube"]) == [face.name for face in part.job.faces]


def test_a_body_of_which_nothing_is_seen_is_refused(whole, monkeypatch):
    monkeypatch.setattr(prints, "is_seen", lambda _T: False)
    with pytest.raises(ValidationError, match="no face of this set") as caught:
        find_parts(whole)
    assert "panels" in caught.value.fix


def test_a_listing_tells_whether_all_is_there(panels, listing, tmp_path):
    found, copy = read_listing(listing), tmp_path / "printed.json"
    assert (found.complete(), found.moved_mm()) == (True, [(0.1, 0.0)])
    assert printed_scene(listing, panels, "Cube", "F3").surface.top_mm == pytest.approx(1, abs=0.01)
    with pytest.raises(SurfaceError, match="F1 of 'Cube' was not printed"):
        printed_scene(listing, panels, "Cube", "F1")
    copy.write_text(Path(listing).read_text())
    assert not read_listing(str(copy)).complete()
    with pytest.raises(PrintError, match="not there or cannot be read"):
        printed_scene(str(copy), panels, "Cube", "F3")
    for text in ("{", "[]", "{}"):
        copy.write_text(text)
        read_listing.cache_clear()
        with pytest.raises(SurfaceError, match="listing of the prints"):
            read_listing(str(copy))


def test_touches_are_of_what_was_printed_with_its_own_faults(panels, listing, tmp_path):
    reader = Reader(open_lab(panels))
    edge = draw_touch(TouchPlan(panels, 3, kind="edge", files=True, prints=listing), 1, reader)
    at = np.array([[edge.touch.x_mm, edge.touch.y_mm]])
    assert edge.contact.scene.region.distance_mm(at)[0] < 9
    plan = TouchPlan(panels, level="mismatch")
    level = replace(plan, prints=listing).noise
    assert (level.scale, level.wider_mm) == (0.0, 0.0) != (plan.noise.scale, plan.noise.wider_mm)
    assert level.shift_mm == plan.noise.shift_mm > 0
    values = json.loads(Path(listing).read_text())
    (tmp_path / "other.json").write_text(json.dumps(values | {"faces": {"Ball": {"F1": "a"}}}))
    with pytest.raises(ValidationError, match="no face for touches of kind face was printed"):
        draw_touch(TouchPlan(panels, prints=str(tmp_path / "other.json")), 0, reader)


SQUARE = polygon([np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])])
OBLONG = polygon([np.array([[0.0, 0], [60, 0], [60, 40], [0, 40]])])


@pytest.mark.parametrize(
    ("seat", "panel", "ways"), [(SQUARE, SQUARE, 4), (OBLONG, OBLONG, 2), (SQUARE, OBLONG, 0)]
)
def test_a_panel_fills_a_seat_in_as_many_ways_as_it_looks_alike(seat, panel, ways):
    found = seats_of(seat, panel)
    assert len(found) == ways
    for place in found:
        inside = place.into(seat.starts)
        assert panel.contains(0.99 * (inside - panel.starts.mean(0)) + panel.starts.mean(0)).all()


def test_a_panel_in_another_seat_has_its_own_symbols(url):
    seat, panel = (registered_surface(url, "Cube", face) for face in ("F1", "F2"))
    points = np.random.default_rng(0).uniform(5, 55, (400, 2))
    for place in seats_of(seat.region, panel.region):
        there = seat_panel(seat.surface, panel.surface, place).heights_mm(points)
        assert there == pytest.approx(panel.surface.heights_mm(place.into(points)), abs=1e-9)
        assert not np.allclose(there, seat.surface.heights_mm(points))


def test_exchanged_symbols_are_others_and_no_more(url):
    scene = registered_surface(url, "Cube", "F1")
    held = scene.surface.lattice
    at = np.array([[30.0, 30.0], [12.0, 40.0]])
    rows, columns = held.cells_at(at)
    labels = (held.label_at(rows, columns) + 1) % 4
    found = exchange_symbols(scene.surface, at, labels).lattice
    assert found.label_at(rows, columns).tolist() == labels.tolist()
    everywhere = [grid.ravel() for grid in np.indices((16, 16))]
    differ = found.label_at(*everywhere) != held.label_at(*everywhere)
    assert differ.sum() <= 2
