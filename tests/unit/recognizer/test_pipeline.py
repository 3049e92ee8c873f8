"""One touch: object, face and pose, or the reason why not; the stages of it."""

import math
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.pipeline import encode
from generator.spec import read_specs
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.simulate.registered import registered_surface
from recognizer.touch import verdict
from recognizer.touch.chance import expected_matches
from recognizer.touch.evidence import weigh_cells
from recognizer.touch.hypothesis import (
    CAP,
    Hypothesis,
    find_hypotheses,
    find_rivals,
    labels_of,
    log_likelihood,
)
from recognizer.touch.lab import open_lab
from recognizer.touch.options import DEFAULTS, ReaderOptions
from recognizer.touch.pose import inside_mm
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch, recognise
from recognizer.touch.recognition import AMBIGUOUS, NO_CONTACT, NOT_ENCODED, OUTSIDE, TOO_FEW
from recognizer.touch.signal import signal_of
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.template import psi, template_of
from recognizer.touch.verdict import MANY_INLIERS, NAMED, is_encoded
from recognizer.touch.verify import TouchImages, verify_hypotheses
from recognizer.validation.draw import FOREIGN, INSIDE_MM, draw_touch
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import trial


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    for name, shape in (("Cube", "cube: 60 mm"), ("Tetra", "tetrahedron: 80 mm")):
        (folder / f"{name}.yaml").write_text(f"name: {name}\nshape: {{{shape}}}\n")
    specs = read_specs([folder / "Cube.yaml", folder / "Tetra.yaml"])
    database = f"sqlite:///{folder / 'lab.db'}"
    encode(specs, folder=folder / "out", database=database, formats=())
    return database


@pytest.fixture(scope="module")
def reader(url):
    return Reader(open_lab(url), SensorType())


@pytest.fixture(scope="module")
def coarse_url(tmp_path_factory):
    """Symbols that a sensor under a pad can tell."""
    folder = tmp_path_factory.mktemp("coarse")
    (folder / "Cube.yaml").write_text("name: Cube\nshape: {cube: 60 mm}\nprofile: large\n")
    database = f"sqlite:///{folder / 'lab.db'}"
    encode(read_specs([folder / "Cube.yaml"]), folder=folder / "out", database=database, formats=())
    return database


@pytest.fixture(scope="module")
def pad_reader(coarse_url):
    return Reader(open_lab(coarse_url), SensorType().with_overlay("pad"))


def felt(url, name, face, touch):
    return tabs(registered_surface(url, name, face).surface, SensorType(), touch).forces_n


@pytest.mark.parametrize(("name", "face"), [("Cube", "F1"), ("Cube", "F6"), ("Tetra", "F2")])
def test_a_clean_touch_is_placed(url, reader, name, face):
    touch = Touch(32.0, 24.0, 0.7, 80.0)
    forces = felt(url, name, face, touch)
    for newtons in (True, False):
        image = forces if newtons else 100 * forces
        found = recognise(reader, signal_of(image, floor=0.0, newtons=newtons), 5)
        assert (found.object, found.face, found.seq) == (name, face, 5)
        T = found.T_face_probe
        assert T[:2, 3] == pytest.approx([32.0, 24.0], abs=0.05)
        assert math.atan2(T[1, 0], T[0, 0]) == pytest.approx(0.7, abs=0.003)
        assert found.margin > 20
        scene = registered_surface(url, name, face)
        assert found.T_object_probe == pytest.approx(scene.T_object_surface @ T)


@pytest.mark.parametrize(
    ("level", "rms_mm"),
    [("sound", 0.1), ("low", 0.1), ("typical", 0.1), ("hard", 0.1), ("mismatch", 0.3)],
)
def test_touches_of_a_level(url, reader, level, rms_mm):
    """A print that is 1 % off costs what it is off from its datum: up to .3 mm on these faces."""
    found = [trial(TouchPlan(url, 3, level), number, reader) for number in range(12)]
    assert all(t.verdict != "wrong" for t in found)
    right = [t for t in found if t.verdict == "right"]
    assert len(right) >= 11
    assert math.sqrt(np.mean([t.error_mm**2 for t in right])) < rms_mm
    assert math.sqrt(np.mean([t.error_deg**2 for t in right])) < 0.4


def test_a_sensor_a_quarter_turn_off_is_answered_and_counted_as_wrong(url, reader):
    found = [trial(TouchPlan(url, 3, "quarter-turn"), number, reader) for number in range(4)]
    assert [t.verdict for t in found] == ["wrong"] * 4
    assert all(abs(abs(t.error_deg) - 90) < 1 for t in found)


def test_columns_that_are_rolled_by_one_shift_the_answer_by_a_tactel(url, reader):
    found = [trial(TouchPlan(url, 3, "rolled"), number, reader) for number in range(4)]
    errors = [t.error_mm for t in found if t.answer]
    assert errors
    assert errors == pytest.approx([1.5875] * len(errors), abs=0.15)


@pytest.mark.parametrize("level", ["mirrored", "dead-40", "floating"])
def test_sensors_that_cannot_be_read_are_never_wrong(url, reader, level):
    found = [trial(TouchPlan(url, 3, level), number, reader) for number in range(4)]
    assert [t.verdict for t in found] == ["rejected"] * 4


def test_levels_have_forces_and_tilts_of_their_own(url, reader):
    light = [draw_touch(TouchPlan(url, 3, "light"), n, reader).touch for n in range(12)]
    assert all(3 <= touch.force_n <= 20 for touch in light)
    tilted = [draw_touch(TouchPlan(url, 3, "tilt-5"), n, reader).touch for n in range(12)]
    tilts = [math.degrees(math.hypot(touch.tilt_x_rad, touch.tilt_y_rad)) for touch in tilted]
    assert 3 < max(tilts) <= 5


def test_one_sensor_for_a_run_keeps_its_errors(url, reader):
    plan = TouchPlan(url, 3, "dead-40", sensor_per="run")
    dead = [draw_touch(plan, n, reader).counts < 40 for n in range(24)]
    assert np.logical_and.reduce(dead).sum() >= 102  # the same tactels feel nothing, touch by touch
    every = [
        draw_touch(replace(plan, sensor_per="touch"), n, reader).counts < 16 for n in range(24)
    ]
    assert np.logical_and.reduce(every).sum() < 26


def test_touches_through_a_pad(coarse_url, pad_reader):
    found = [trial(TouchPlan(coarse_url, 3, "typical"), number, pad_reader) for number in range(8)]
    assert all(t.verdict != "wrong" for t in found)
    assert sum(t.verdict == "right" for t in found) >= 6


@pytest.mark.parametrize("kind", list(FOREIGN))
def test_other_surfaces_are_refused(url, reader, kind):
    found = [trial(TouchPlan(url, 5, "typical", kind), number, reader) for number in range(6)]
    assert [t.verdict for t in found] == ["rejected"] * 6
    assert {t.reason for t in found} <= {NOT_ENCODED, TOO_FEW, AMBIGUOUS, NO_CONTACT, OUTSIDE}


@pytest.mark.parametrize("kind", ["edge", "corner", "worn"])
def test_hard_touches_are_never_wrong(url, reader, kind):
    plan = TouchPlan(url, 7, "typical", kind)
    found = [trial(plan, number, reader) for number in range(10)]
    assert all(t.verdict != "wrong" for t in found)
    if kind == "edge":
        assert all(t.edge_mm < INSIDE_MM for t in found)
        assert any(t.verdict == "right" for t in found)


def test_a_trial_is_known_by_its_number(url, reader):
    plan = TouchPlan(url, 11, "hard")
    again = [draw_touch(plan, number, reader) for number in (4, 4, 5)]
    assert again[0].touch == again[1].touch != again[2].touch
    assert (again[0].counts == again[1].counts).all()
    first, second = trial(plan, 4, reader), trial(plan, 4, reader)
    assert replace(first, seconds=0.0) == replace(second, seconds=0.0)


def test_nothing_pressed_is_no_contact(reader):
    found = recognise(reader, signal_of(np.full((16, 16), 9.0)), 2)
    assert not found
    assert found.reason == NO_CONTACT
    assert read_touch(reader, signal_of(np.full((16, 16), 9.0))).best is None


def test_dead_rows_are_told_from_the_image(url, reader):
    image = 100 * felt(url, "Cube", "F2", Touch(30.0, 30.0, -2.0, 90.0))
    image[6] = 0.0
    signal = signal_of(image, floor=0.0)
    assert (signal.trust[6] == 0).all()
    assert signal.trust.sum() == 15 * 16
    found = recognise(reader, signal)
    assert (found.object, found.face) == ("Cube", "F2")


def test_contact_is_judged_in_its_own_unit():
    image = np.zeros((16, 16))
    image[4:8, 4:8] = 2 * DEFAULTS.contact_n
    assert signal_of(image, floor=0.0, newtons=True).contact
    assert not signal_of(image, floor=0.0).contact


def test_the_reading_behind_an_answer(url, reader):
    signal = signal_of(felt(url, "Cube", "F3", Touch(28.0, 33.0, 2.0, 70.0)), newtons=True)
    reading = read_touch(reader, signal)
    answer, hypothesis = reading.answer, reading.best
    assert hypothesis.embossed.face(hypothesis.hypothesis.face).face == answer.face == "F3"
    speaks = hypothesis.evidence
    assert is_encoded(speaks)
    assert speaks.explained > 0.85
    assert speaks.inliers >= 9
    assert speaks.contradictions == speaks.strong_contradictions == 0
    scores = [r.score for r in verify_hypotheses(TouchImages(reader, signal), reader.options.first)]
    assert scores == sorted(scores, reverse=True)


def test_the_index_of_windows_lists_every_window(reader):
    encoding = reader.lab.arrays[0]
    order = encoding.array.order
    for windows in encoding.windows:
        down, right = windows.shape
        assert (np.diff(windows.codes) >= 0).all()
        for code, cell in list(zip(windows.codes, windows.cells, strict=True))[::97]:
            row, column = divmod(int(encoding.keys[cell]), encoding.array.columns)
            rows, columns = np.mgrid[row : row + down, column : column + right]
            held, labels = encoding.at(rows % encoding.array.rows, columns % encoding.array.columns)
            assert (held == encoding.owners[cell]).all()
            digits = labels.ravel().astype(int).tolist()
            assert int("".join(map(str, digits)), order) == code
            assert cell in windows.at(int(code))


def test_a_large_array_is_looked_up_like_a_small_one(reader):
    encoding = reader.lab.arrays[0]
    sparse = replace(encoding, dense=None, known={})
    rng = np.random.default_rng(2)
    rows = rng.integers(encoding.array.rows, size=500)
    columns = rng.integers(encoding.array.columns, size=500)
    for one, other in zip(encoding.at(rows, columns), sparse.at(rows, columns), strict=True):
        assert (one == other).all()


def place_of(encoding, at=40):
    """A lattice that shows the cells about a registered one without doubt."""
    row, column = divmod(int(encoding.keys[at]), encoding.array.columns)
    place = Hypothesis(0, row, column, int(encoding.owners[at]), 0.0)
    cells = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3)), axis=-1).reshape(-1, 2)
    shown = labels_of(encoding, place, cells)
    scores = np.full((len(cells), encoding.array.order + 1), -30.0)
    scores[np.arange(len(cells)), shown] = 0.0
    fit = Fit(3.5, 3.5, 0.0, np.zeros(4), np.zeros(4), cells, scores, np.full(len(cells), 20.0),
              0.1, -5.0, np.eye(3))  # fmt: skip
    return place, fit


def test_a_sure_lattice_is_placed_and_a_wrong_cell_costs_its_cap(reader):
    encoding = reader.lab.arrays[0]
    place, fit = place_of(encoding)
    best = find_hypotheses(encoding, (fit,))[0]
    assert (best.row, best.column, best.face) == (place.row, place.column, place.face)
    assert best.score == pytest.approx(-5.0)
    assert log_likelihood(encoding, fit, place) == pytest.approx(-5.0)
    scores = fit.scores.copy()
    middle = int(np.flatnonzero((fit.cells == 0).all(axis=1))[0])
    scores[middle] = [*np.roll(scores[middle][:-1], 1).tolist(), -30.0]
    spoiled = replace(fit, scores=scores)
    assert log_likelihood(encoding, spoiled, place) == pytest.approx(-5.0 - CAP)
    best = find_hypotheses(encoding, (spoiled,))[0]
    assert (best.row, best.column, best.face) == (place.row, place.column, place.face)


@pytest.mark.parametrize("other", [90, 150, 333])
def test_a_place_that_fits_nearly_as_well_is_found_wherever_it_is(reader, other):
    encoding = reader.lab.arrays[0]
    place, fit = place_of(encoding)
    row, column = divmod(int(encoding.keys[other]), encoding.array.columns)
    second = Hypothesis(0, row, column, int(encoding.owners[other]), 0.0)
    shown = labels_of(encoding, second, fit.cells)
    rows = np.arange(len(shown))
    scores = fit.scores.copy()
    scores[rows, shown] = np.maximum(scores[rows, shown], -0.25)
    alike = replace(fit, scores=scores)
    found = find_rivals(encoding, alike, place, 3)
    best = found[0]
    assert (best.row, best.column, best.face, best.fit) == (row, column, second.face, 3)
    assert best.score == pytest.approx(log_likelihood(encoding, alike, second))
    assert all((p.row, p.column) != (place.row, place.column) for p in found)


def test_a_print_keeps_the_middle_of_its_symbols(reader):
    """On a triangle that is 4 mm and more from the middle of its box, whatever its part's frame."""
    for number in range(len(reader.lab.arrays[0].faces)):
        face = reader.lab.arrays[0].face(number)
        about, middle = face.printed.T_part_face, face.centres_mm.mean(axis=0)
        np.testing.assert_allclose(about @ [*middle, 0.0, 1.0], [0, 0, 0, 1], atol=1e-9)
        if face.T_part_face is not None:
            np.testing.assert_array_equal(about[:3, :3], face.T_part_face[:3, :3])
        outline = face.polygon_mm[0]
        box = (outline.min(axis=0) + outline.max(axis=0)) / 2
        assert (np.linalg.norm(box - middle) > 4.0) == (face.object == "Tetra")
        pose = np.eye(4)
        pose[:2, 3] = middle
        tenth = replace(face.printed.as_built, scale_x=0.9, scale_y=0.9)
        at, _ = replace(face.printed, as_built=tenth).pose(pose, np.eye(3))
        assert at[:2, 3] == pytest.approx(middle)
        pose[0, 3] += 10.0
        at, _ = replace(face.printed, as_built=tenth).pose(pose, np.eye(3))
        assert at[:2, 3] == pytest.approx(middle + np.array([9.0, 0.0]))


def touches_at_the_rim(url, reader):
    """Clean touches ever nearer to an edge and a corner: recognition and what was judged."""
    for x, y in [(6.0, 30.0), (3.0, 30.0), (0.5, 30.0), (6.0, 6.0), (3.0, 5.0), (2.0, 1.0)]:
        forces = felt(url, "Cube", "F1", Touch(x, y, 0.5, 80.0))
        reading = read_touch(reader, signal_of(forces, newtons=True))
        yield reading.answer, reading.best


def test_few_symbols_answer_only_if_they_can_name_a_place(coarse_url):
    reader = Reader(open_lab(coarse_url), SensorType())
    seen = []
    for found, best in touches_at_the_rim(coarse_url, reader):
        cells, at = best.evidence.inliers, (best.embossed, best.fit, best.hypothesis)
        seen.append((bool(found), cells))
        if found and cells < MANY_INLIERS:
            assert expected_matches(reader.lab.arrays, *at, borders=False) <= NAMED
    assert any(told and cells < MANY_INLIERS for told, cells in seen)
    assert not all(told for told, _ in seen)


def test_a_cell_that_says_hardly_anything_does_not_speak_for_a_place(url, reader):
    forces = felt(url, "Cube", "F1", Touch(32.0, 24.0, 0.7, 80.0))
    read = read_touch(reader, signal_of(forces, newtons=True)).best
    encoding, fit, place = read.embossed, read.fit, read.hypothesis
    told = weigh_cells(encoding, fit, place).agree
    held = labels_of(encoding, place, fit.cells)
    assert told.sum() >= MANY_INLIERS
    assert (held[told] < encoding.array.order).all()
    scores = fit.scores.copy()
    mute, torn = np.flatnonzero(told)[:2]
    scores[mute] = [0.0, -0.2, -0.2, -0.7, -0.5]  # looked at, and nearly as likely anything
    scores[torn] = -9.0
    scores[torn, [held[torn], (held[torn] + 1) % encoding.array.order]] = 0.0, -0.1
    again = weigh_cells(encoding, replace(fit, scores=scores), place)
    assert again.seen[mute]
    assert np.flatnonzero(told ^ again.agree).tolist() == [mute]
    scores[torn, (held[torn] + 1) % encoding.array.order] = 0.1
    again = weigh_cells(encoding, replace(fit, scores=scores), place)
    assert np.flatnonzero(told ^ again.agree).tolist() == sorted([mute, torn])


def test_few_symbols_must_leave_other_places_far_behind(url, reader):
    strict = replace(reader, options=ReaderOptions(margin_by_few=1e6))
    for found, best in touches_at_the_rim(url, strict):
        assert not found or best.evidence.inliers >= MANY_INLIERS
        assert found or found.reason in (AMBIGUOUS, NOT_ENCODED, TOO_FEW)


def test_few_symbols_are_refused_by_what_they_name_first(url, reader, monkeypatch):
    signal = signal_of(felt(url, "Cube", "F1", Touch(32.0, 24.0, 0.7, 80.0)), newtons=True)
    usual = read_touch(reader, signal)
    best = usual.best
    at = (best.embossed, best.fit, best.hypothesis)
    by_symbols = expected_matches(reader.lab.arrays, *at, borders=False)
    # its cells are few then
    monkeypatch.setattr(verdict, "MANY_INLIERS", best.evidence.inliers + 1)
    near = replace(reader, options=ReaderOptions(margin_by_few=1e6))
    monkeypatch.setattr(verdict, "NAMED", by_symbols)
    assert (usual.answer.face, read_touch(reader, signal).answer.face) == ("F1", "F1")
    assert read_touch(near, signal).answer.reason == AMBIGUOUS
    monkeypatch.setattr(verdict, "NAMED", 0.99 * by_symbols)
    assert read_touch(reader, signal).answer.reason == TOO_FEW
    assert read_touch(near, signal).answer.reason == TOO_FEW


def test_a_point_in_a_face(reader):
    face = next(
        reader.lab.arrays[0].face(n)
        for n in range(10)
        if reader.lab.arrays[0].face(n).object == "Cube"
    )
    assert inside_mm(face, 30.0, 30.0) == pytest.approx(30.0)
    assert inside_mm(face, 30.0, -2.0) == pytest.approx(-2.0)
    assert inside_mm(face, 63.0, 64.0) == pytest.approx(-5.0)


@pytest.mark.parametrize("overlay", ["tab", "pad"])
def test_a_template_is_the_derivative_of_itself(reader, overlay):
    encoding = reader.lab.arrays[0]
    template = template_of(encoding.alphabet, encoding.style, SensorType().with_overlay(overlay))
    at = np.array([[-1.2, 0.4], [0.3, -1.7], [1.6, 1.1]])
    by = 0.1
    aside = np.array([by, 0.0])
    there = template.at(at)
    ahead, behind = template.at(at + aside), template.at(at - aside)
    assert (ahead - behind)[..., 0] / (2 * by) == pytest.approx(there[..., 1], abs=0.06)
    assert template.at(np.array([[90.0, 0.0]])) == pytest.approx(0.0)
    assert 0.1 < template.ink < 0.7
    assert float(psi(np.array(1.0))) == pytest.approx(1.0)


def test_reading_loads_no_cad_and_no_pictures():
    heavy = ("matplotlib", "build123d", "cadquery", "OCP", "pymeshlab", "dask", "fastapi", "skfem")
    asked = f"[name for name in {heavy!r} if name in sys.modules]"
    program = f"import recognizer, recognizer.touch.recognise, sys; print({asked})"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=os.environ
    )
    assert done.stdout.strip() == "[]", done.stderr
