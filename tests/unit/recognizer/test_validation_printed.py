"""Prints of registered parts as surfaces: which faces, where they are kept, how they are found.

The slicer is left out: what stands for a print is the written part's own height map, moved.
The real one runs in tests/loop/test_validate_printed.py.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.errors import PrintError
from generator.printed import prints
from generator.printed.prints import surface_keys, surface_path
from generator.printed.surface import PrintedSurface, write_surface
from probe.errors import SurfaceError
from probe.simulate import printed
from probe.simulate.printed import (
    PrintOptions,
    listing_of,
    printed_scene,
    read_listing,
)
from probe.simulate.target import part_surface
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.draw import draw_touch
from recognizer.validation.errors import ValidationError
from recognizer.validation.printing import find_parts
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import RIGHT, trial

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
    spec = "{name: Cube, shape: {cube: 36 mm}, print: {parts: whole}}"
    return str(make_lab(spec, formats=("stl",)) / "lab.db")


def print_as_designed(part, database, folder, faces):
    """Write what the STL says, .1 mm aside, as the print of some of a part's faces."""
    keys = surface_keys(part.job, OPTIONS.plan())
    for face in part.job.faces[:faces]:
        scene = part_surface(part.job.file, database=database, object_name=part.object_name,
                             face=face.name)  # fmt: skip
        line = np.arange(-1.0, 37.0, 0.1)
        points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        heights = scene.surface.heights_mm(points - np.array((0.1, 0.0)))
        heights[heights < -2.5] = -np.inf
        side = (len(line), len(line))
        laid = heights.reshape(side).astype(np.float32)
        surface = PrintedSurface(laid, (-1.0, -1.0), 0.1, np.eye(4))
        write_surface(surface, surface_path(folder, keys[face.name]), moved_mm=(0.1, 0.0))


@pytest.fixture(scope="module")
def listing(panels, tmp_path_factory):
    """One panel of six, printed."""
    folder = tmp_path_factory.mktemp("run")
    part = find_parts(panels)[2]
    print_as_designed(part, panels, folder / "kept", 1)
    (folder / "printed.json").write_text(listing_of([part], OPTIONS, folder / "kept", folder))
    return str(folder / "printed.json")


def test_each_panel_is_printed_for_its_own_face(panels):
    parts = find_parts(panels)
    assert [[face.name for face in part.job.faces] for part in parts] == [
        [f"F{k}"] for k in range(1, 7)
    ]
    for part in parts:
        assert part.unseen == ()
        assert not part.job.supports
        assert part.job.faces[0].embossing.T_part_facet[:3, 2] == pytest.approx((0, 0, 1))
        assert len(part.job.faces[0].embossing.labels) >= 9


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


def test_a_print_is_touched_in_the_frame_of_its_face(panels, listing):
    scene = printed_scene(listing, panels, "Cube", "F3")
    part = find_parts(panels)[2]
    designed = part_surface(part.job.file, database=panels, face="F3")
    assert (scene.object_name, scene.face) == ("Cube", "F3")
    assert scene.T_object_surface == pytest.approx(designed.T_object_surface)
    points = np.random.default_rng(1).uniform(4.0, 32.0, (3000, 2))
    asked, found = designed.surface.heights_mm(points), scene.surface.heights_mm(points)
    # Walls of 10 degrees: a grid of .1 mm cuts their edges.
    assert np.mean(np.abs(asked - found) < 0.02) > 0.85
    assert scene.surface.top_mm == pytest.approx(1.0, abs=0.01)
    with pytest.raises(SurfaceError, match="F1 of 'Cube' was not printed"):
        printed_scene(listing, panels, "Cube", "F1")


def test_a_listing_tells_whether_all_is_there(panels, listing, tmp_path):
    found = read_listing(listing)
    assert found.complete()
    assert found.moved_mm() == [(0.1, 0.0)]
    (tmp_path / "printed.json").write_text(Path(listing).read_text())
    assert not read_listing(str(tmp_path / "printed.json")).complete()
    with pytest.raises(PrintError, match="not there or cannot be read"):
        printed_scene(str(tmp_path / "printed.json"), panels, "Cube", "F3")
    for text in ("{", "[]", "{}"):
        (tmp_path / "bad.json").write_text(text)
        read_listing.cache_clear()
        with pytest.raises(SurfaceError, match="listing of the prints"):
            read_listing(str(tmp_path / "bad.json"))


def test_a_part_is_left_until_all_its_faces_are_there(whole, tmp_path):
    (part,) = find_parts(whole)
    assert part.left(OPTIONS, tmp_path)
    print_as_designed(part, whole, tmp_path, 1)
    assert part.left(OPTIONS, tmp_path)
    print_as_designed(part, whole, tmp_path, 5)
    assert not part.left(OPTIONS, tmp_path)
    assert part.left(replace(OPTIONS, seed=6), tmp_path)


def test_touches_of_prints_are_of_printed_faces_and_right(panels, listing):
    reader = Reader(open_lab(panels))
    plan = TouchPlan(panels, 3, "typical", files=True, prints=listing)
    found = [trial(plan, number, reader) for number in range(4)]
    assert [(t.object, t.face, t.verdict) for t in found] == [("Cube", "F3", RIGHT)] * 4
    assert math.sqrt(np.mean([t.error_mm**2 for t in found])) < 0.06
    edge = draw_touch(replace(plan, kind="edge"), 1, reader)
    assert (
        edge.contact.scene.region.distance_mm(np.array([[edge.touch.x_mm, edge.touch.y_mm]]))[0] < 9
    )


def test_a_print_brings_its_own_faults(panels, listing):
    plan = TouchPlan(panels, level="mismatch")
    assert plan.noise.scale != 0
    level = replace(plan, prints=listing).noise
    assert (level.scale, level.wider_mm) == (0.0, 0.0)
    assert level.shift_mm == plan.noise.shift_mm > 0


def test_other_faces_than_those_of_the_lab_are_refused(panels, listing, tmp_path):
    values = json.loads(Path(listing).read_text())
    (tmp_path / "other.json").write_text(json.dumps(values | {"faces": {"Ball": {"F1": "a"}}}))
    reader = Reader(open_lab(panels))
    with pytest.raises(ValidationError, match="no face for touches of kind face was printed"):
        draw_touch(TouchPlan(panels, prints=str(tmp_path / "other.json")), 0, reader)
