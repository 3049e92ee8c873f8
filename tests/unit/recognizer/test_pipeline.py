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
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch, recognise
from recognizer.touch.signal import signal_of
from recognizer.touch.symbols.template import psi, template_of
from recognizer.touch.verdict import is_encoded
from recognizer.touch.verify import TouchImages, verify_hypotheses
from recognizer.validation.draw import FOREIGN, draw_touch
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


@pytest.mark.parametrize(("level", "rms_mm"), [("typical", 0.1), ("hard", 0.1), ("mismatch", 0.3)])
def test_touches_of_a_level(url, reader, level, rms_mm):
    """A print that is 1 % off costs what it is off from its datum: up to .3 mm on these faces."""
    found = [trial(TouchPlan(url, 3, level), number, reader) for number in range(8)]
    right = [t for t in found if t.verdict == "right"]
    assert len(right) >= 7
    assert math.sqrt(np.mean([t.error_mm**2 for t in right])) < rms_mm
    assert math.sqrt(np.mean([t.error_deg**2 for t in right])) < 0.4


@pytest.mark.parametrize(
    ("plan", "verdicts"),
    [
        *(((3, level), {"rejected"}) for level in ("mirrored", "dead-40", "floating")),
        *(((5, "typical", kind), {"rejected"}) for kind in FOREIGN),
        *(((7, "typical", kind), {"right", "rejected"}) for kind in ("edge", "corner", "worn")),
    ],
)
def test_no_touch_is_wrong(url, reader, plan, verdicts):
    assert {trial(TouchPlan(url, *plan), number, reader).verdict for number in range(4)} <= verdicts


def test_one_sensor_for_a_run_keeps_its_errors(url, reader):
    plan = TouchPlan(url, 3, "dead-40", sensor_per="run")
    dead = [draw_touch(plan, n, reader).counts < 40 for n in range(24)]
    assert np.logical_and.reduce(dead).sum() >= 102  # the same tactels feel nothing, touch by touch
    every = [
        draw_touch(replace(plan, sensor_per="touch"), n, reader).counts < 16 for n in range(24)
    ]
    assert np.logical_and.reduce(every).sum() < 26


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
