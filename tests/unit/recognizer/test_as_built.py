"""How a part came out of the printer: known strains, what poses make of it, stretched touches."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.database.as_built import AsBuilt
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.simulate.registered import registered_surface
from recognizer.as_built.estimate import (
    ALWAYS,
    BETWEEN,
    MeasuredPrint,
    estimate_print,
    estimate_printer,
)
from recognizer.as_built.touches import measure_prints
from recognizer.as_built.verdict import AS_DESIGNED, CORRECTED, PRINT_AGAIN, judge_print
from recognizer.errors import AsBuiltError
from recognizer.touch.as_built import (
    PrintedFace,
    TouchScale,
    print_matrix,
    print_of,
    scales_and_skew,
)
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchImage

NEAR = st.floats(0.94, 1.06)
TOP = np.eye(3)
WALL_X = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # face x along x, face y along z
WALL_Y = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # face x along y
SLOPE = np.array([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])


def print_with(scale_x=1.0, scale_y=1.0, skew_rad=0.0, stroke_mm=1.4, covariance=None, **named):
    known = {"object_id": 1, "part": "Cube-F1", "printer": "mk4", "material": "PLA", "touches": 30}
    covariance = np.zeros((4, 4)) if covariance is None else covariance
    return AsBuilt(scale_x=scale_x, scale_y=scale_y, skew_rad=skew_rad, stroke_mm=stroke_mm,
                   covariance=covariance, **(known | named))  # fmt: skip


def turned(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def felt_on(as_built, R_part_face, error=(0, 0, 0, 0), covariance=None):
    """What an exact touch of a face tells: the metric of its plane as it is printed."""
    S, B = print_matrix(scales_and_skew(as_built)), R_part_face[:, :2]
    E = (B.T @ S.T @ S @ B - np.eye(2)) / 2
    return MeasuredPrint(
        0, "Cube", "F1", "Cube-F1", R_part_face[:2, :2],
        np.array([E[0, 0], E[1, 1], E[0, 1]]) + error[:3], as_built.stroke_mm + error[3],
        np.eye(4) * 1e-6 if covariance is None else covariance,
    )  # fmt: skip


@settings(max_examples=30, deadline=None)
@given(NEAR, NEAR, st.floats(-0.03, 0.03), st.floats(-math.pi, math.pi))
def test_exact_touches_of_turned_faces_give_the_print_back(scale_x, scale_y, skew, angle):
    truth = print_with(scale_x, scale_y, skew, 1.55)
    faces = [turned(angle), turned(angle + 2) @ WALL_X, turned(angle) @ WALL_Y, SLOPE]
    felt = [felt_on(truth, faces[k % 4]) for k in range(12)]
    found = estimate_print(felt)
    for name in ("scale_x", "scale_y", "skew_rad", "stroke_mm"):
        assert getattr(found, name) == pytest.approx(getattr(truth, name), abs=1e-9)
    assert found.touches == 12


def test_one_bad_touch_in_twenty_five_moves_little():
    truth, rng = print_with(0.98, 0.99, 0.004), np.random.default_rng(3)
    felt = [felt_on(truth, TOP, rng.normal(0, 1e-3, 4)) for _ in range(24)]
    bad = felt_on(truth, TOP, (0.06, -0.05, 0.03, 0.3))
    without, found = estimate_print(felt), estimate_print([*felt, bad])
    assert abs(found.scale_x - without.scale_x) < 2e-4
    assert abs(found.skew_rad - without.skew_rad) < 2e-4


@pytest.mark.parametrize("said", [1e-7, 1e-6, 1e-5])
def test_how_sure_it_is_comes_from_the_spread_of_the_touches(said):
    truth, rng = print_with(0.98, 0.99, 0.004), np.random.default_rng(4)
    chi2 = []
    for _ in range(60):
        felt = [felt_on(truth, TOP, rng.normal(0, 2e-3, 4), np.eye(4) * said) for _ in range(30)]
        found = estimate_print(felt)
        away = np.array([found.scale_x - 0.98, found.scale_y - 0.99, found.skew_rad - 0.004])
        spread = found.covariance[:3, :3] - np.diag(np.square(ALWAYS[:3]))
        chi2.append(away @ np.linalg.solve(spread, away))
    assert 2.4 < np.mean(chi2) < 4.2  # three degrees of freedom


def test_a_wall_alone_does_not_tell_the_print():
    along_x, along_y = (felt_on(print_with(0.98), wall) for wall in (WALL_X, WALL_Y))
    for first, unknown in ((along_x, "y and skew"), (along_y, "skew")):
        with pytest.raises(AsBuiltError, match=f"do not tell {unknown}"):
            estimate_print([first, *[along_x] * 29])


def test_a_printer_is_what_its_parts_are_and_how_far_they_differ():
    spread = np.diag([1e-8, 1e-8, 1e-8, 1e-4])
    one = estimate_printer([print_with(0.99, 0.995, 0.001, covariance=spread)])
    assert (one.object_id, one.part, one.printer, one.material) == (None, None, "mk4", "PLA")
    between = np.square(BETWEEN)
    np.testing.assert_allclose(np.diag(one.covariance), np.diag(spread) + 2 * between)
    apart = [print_with(0.98, covariance=spread), print_with(1.0, covariance=spread)]
    both = estimate_printer(apart)
    assert (both.scale_x, both.touches) == (0.99, 60)
    assert both.covariance[0, 0] == pytest.approx(0.5e-8 + 2e-4 * 1.5)
    assert both.covariance[1, 1] == pytest.approx(0.5e-8 + between[1] * 1.5)


def test_what_is_known_of_a_part_comes_before_its_printer():
    own, other = print_with(0.98), print_with(0.97, part="Cube-F2")
    made = print_with(0.99, object_id=None, part=None)
    assert print_of([other, own, made], "Cube-F1", "mk4") is own
    assert print_of([other, made], "Cube-F1", "mk4") is made
    assert print_of([other, made], "Cube-F1", "another") is None
    petg = print_with(0.995, object_id=None, part=None, material="PETG")
    assert print_of([other, made, petg], "Cube-F1", "mk4") is None


def read_pose(S, T_part_face, T_part_probe):
    """What a reader that fits a turned and scaled lattice says of a pose on a printed face."""
    R, at = T_part_face[:3, :3], T_part_face[:3, 3]
    middle = R.T @ (np.linalg.solve(S, T_part_probe[:3, 3]) - at)
    steps = np.array([(x, y) for x in (-8, 0, 8) for y in (-8, 0, 8)], float)
    design = middle + np.c_[steps, np.zeros(9)]  # symbols about the probe, face frame
    seen = (S @ (design @ R.T + at).T - T_part_probe[:3, 3:]).T @ T_part_probe[:3, :3]
    z = (seen[:, 0] + 1j * seen[:, 1]).conj() @ (steps[:, 0] + 1j * steps[:, 1])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turned(float(np.angle(z))), middle
    return pose


@settings(max_examples=30, deadline=None)
@given(NEAR, NEAR, st.floats(-0.03, 0.03), st.floats(-3, 3), st.sampled_from((TOP, WALL_X, SLOPE)))
def test_a_pose_that_is_read_becomes_the_pose_on_the_print(scale_x, scale_y, skew, turn, R):
    T_part_face = np.eye(4)
    T_part_face[:3, :3], T_part_face[:3, 3] = R, (-30, -20, 12)
    as_built = print_with(scale_x, scale_y, skew)
    S = print_matrix(scales_and_skew(as_built))
    Q, _ = np.linalg.qr(S @ R[:, :2])  # a frame of the printed face, the same way round
    Q *= np.sign((Q * R[:, :2]).sum(axis=0))
    T_part_probe = np.eye(4)
    T_part_probe[:3, :3] = np.column_stack([Q, np.cross(*Q.T)]) @ turned(turn)
    T_part_probe[:3, 3] = S @ (R @ (41.0, 33.0, 1.0) + T_part_face[:3, 3])
    read = read_pose(S, T_part_face, T_part_probe)
    found, _ = PrintedFace(as_built, T_part_face).pose(read, np.eye(3))
    np.testing.assert_allclose(T_part_face @ found, T_part_probe, atol=1e-9)


def test_on_a_wall_the_height_is_as_designed_and_the_scale_felt_is_half():
    T_part_face, pose = np.eye(4), np.eye(4)
    T_part_face[:3, :3], pose[:2, 3] = WALL_X, (20.0, 10.0)
    spread = np.diag([4e-6, 4e-6, 1e-12, 1])
    felt = TouchScale(0.002, np.array([0.0, 0.0, 0.0, 1e-6]), 1e9)
    face = PrintedFace(print_with(covariance=spread), T_part_face)
    found, _ = face.pose(pose, np.zeros((3, 3)), felt)
    at = T_part_face[:3, :3] @ found[:3, 3]
    before = T_part_face[:3, :3] @ (20.0, 10.0, 0.0)
    assert at[2] == pytest.approx(before[2], abs=1e-9)
    along = int(np.argmax(np.abs(before[:2])))
    # one axis of two counts: half its scale is felt, 1e-6 of 2e-6 in variance
    assert at[along] == pytest.approx(before[along] * (1 - 2 * 0.002 * 1 / 2), rel=2e-4)


UNSURE = np.diag([0.004**2, 0.004**2, 0.004**2, 0.2**2])


@pytest.mark.parametrize(
    ("print_", "kind", "words"),
    [
        ((1.0003, 0.9996, 0.0004), AS_DESIGNED, "as designed"),
        ((0.992, 0.9925, 0.0), CORRECTED, "0.8 % small, within what the reader corrects"),
        ((1.01, 1.01, 0.0), CORRECTED, "1.0 % large, within what the reader corrects"),
        ((0.99, 1.0, 0.0), CORRECTED, "X is 1.0 % short, within what the reader corrects"),
        ((0.97, 1.0, 0.0), PRINT_AGAIN, "print again, X is 3.0 % short: belts?"),
        ((1.0, 1.03, 0.01), PRINT_AGAIN,
         "print again, Y is 3.0 % long, 0.6 degrees askew: belts? a frame out of square?"),
        ((1.0, 1.0, -0.03), PRINT_AGAIN,
         "print again, 1.7 degrees askew: a frame out of square?"),
        ((0.96, 0.96, 0.0), PRINT_AGAIN,
         "print again, 4.0 % small: scale in the slicer, shrinkage?"),
        ((1.0, 1.0, 0.0, 1.2), AS_DESIGNED,
         "as designed; strokes 0.2 mm too narrow: flow, first layer?"),
        ((0.996, 1.0, 0.003, 1.6, UNSURE), AS_DESIGNED, "as designed"),
    ],
)  # fmt: skip
def test_what_is_said_of_a_print(print_, kind, words):
    verdict = judge_print(print_with(*print_), 1.4)
    assert (verdict.kind, verdict.words) == (kind, words)


MIDDLE = np.array([20.0, 20.0])


@dataclass(frozen=True)
class Stretched:
    """A surface that is stretched about the middle of a 40 mm face."""

    surface: object
    matrix: np.ndarray

    @property
    def top_mm(self):
        return self.surface.top_mm

    def heights_mm(self, points):
        back = (points - MIDDLE) @ np.linalg.inv(self.matrix).T
        return self.surface.heights_mm(back + MIDDLE)


@pytest.fixture(scope="module")
def reader(make_lab):
    specs = (f"{{name: {name}, shape: {{cube: 40 mm}}}}" for name in ("Cube", "Other"))
    return Reader(open_lab(make_lab(*specs, formats=("stl",)) / "lab.db"))


def image_felt(reader, matrix, touch, name="Cube"):
    scene = registered_surface(reader.lab.url, name, "F1")
    forces = press(Stretched(scene.surface, matrix), reader.sensor, touch).forces_n
    return TouchImage(0, 0, 1, 100 * forces, np.zeros(4), None)


@pytest.mark.parametrize("matrix", [np.diag([0.98, 1.0]), np.array([[1.0, 0.015], [0.0, 0.99]])])
def test_a_touch_tells_scales_and_skew_of_the_print(reader, matrix):
    at = [Touch(18.0, 21.5, turn, 80.0) for turn in (0.3, 1.9, -2.2, -0.8)]
    touches = [image_felt(reader, matrix, touch) for touch in at]
    found = np.mean([one.strain for one in measure_prints(reader, touches)], axis=0)
    E = (matrix.T @ matrix - np.eye(2)) / 2
    np.testing.assert_allclose(found, (E[0, 0], E[1, 1], E[0, 1]), atol=0.0015)


def test_touches_that_tell_no_print_are_named(reader):
    blank = TouchImage(0, 0, 1, np.zeros((16, 16)), np.zeros(4), None)
    with pytest.raises(AsBuiltError, match=r"none of 2 touches tells of a print: 2 no contact"):
        measure_prints(reader, [blank, blank])
    with pytest.raises(AsBuiltError, match="no touch"):
        measure_prints(reader, [])
    at = Touch(18.0, 21.5, math.radians(20), 80.0)
    both = [image_felt(reader, np.eye(2), at, name) for name in ("Cube", "Other", "Cube")]
    with pytest.raises(AsBuiltError, match=r"touches of 2 objects: Cube \(2\), Other \(1\)"):
        measure_prints(reader, both, place="touch.h5")
