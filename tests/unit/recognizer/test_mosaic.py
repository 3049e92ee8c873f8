"""Touches on a mosaic: poses, correlation, registration, the pose graph, the canvas, all of it."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import alphabet_named
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.scan import surface_to_sensor
from probe.surface.face import endless_face
from recognizer.errors import MosaicError
from recognizer.scan.mosaic.canvas import CanvasEntry, add_to_canvas, empty_canvas, image_of
from recognizer.scan.mosaic.mosaic import ALONE, AMBIGUOUS, add_touch, no_touches
from recognizer.scan.mosaic.patch import (
    interpolate_patch,
    patch_of,
    restrict_information,
    seen_motions,
)
from recognizer.scan.mosaic.planar import (
    PlacedTouch,
    compose_poses,
    decoded_place,
    inverse,
    planar_belief,
    planar_covariance,
    planar_pose,
    relative_pose,
    transform_points,
    wrap_angle,
)
from recognizer.scan.mosaic.pose_graph import PLANE, Constraint, covariances, solve_pose_graph
from recognizer.scan.mosaic.register import APART, CONSTANT, NOISE, register_patches
from recognizer.scan.mosaic.search import KnownRaster, cross_correlate, peaks
from recognizer.touch.recognition import Recognition, refusal
from recognizer.touch.signal import Signal, signal_of

SENSOR = SensorType()
P = SENSOR.pitch_mm
DEG = math.pi / 180
GLYPHS = [glyph.strokes for glyph in alphabet_named("dense-4").glyphs]
TACTELS = SENSOR.centres_mm().reshape(-1, 2)
SURE = np.diag([1e-4, 1e-4, 1e-7])


def newtons(forces):
    return Signal(forces, np.ones((16, 16)), True, newtons=True)


def symbols(seed=0):
    labels = np.random.default_rng(seed).integers(0, 4, (23, 25))
    return endless_face(labels, GLYPHS, pitch_mm=7.0, unit_mm=0.26 * 7)


def felt(surface, pose, rng):
    """Forces of one sensor, whose gains spread by a tenth."""
    gains = np.exp(np.random.default_rng(9).normal(0, 0.1, (16, 16)))
    forces = tabs(surface, SENSOR, Touch(*pose, 80.0)).forces_n * gains
    return np.maximum(forces + rng.normal(0, 0.02, (16, 16)), 0)


def patch(readings):
    return patch_of(SENSOR, newtons(np.asarray(readings, float)))


def waves(points):
    x, y = np.moveaxis(points, -1, 0)
    return 4 + np.sin(x / 3.1) + np.cos(y / 3.6 + 0.4) + 0.5 * np.sin((x + y) / 4.3)


WAVES = waves(TACTELS).reshape(16, 16)


def test_a_quarter_turn_by_hand():
    T_a_b = np.array([10.0, 5.0, math.pi / 2])
    assert transform_points(T_a_b, np.array([1.0, 0.0])) == pytest.approx([10, 6])
    assert compose_poses(T_a_b, np.array([1.0, 2.0, 0.0])) == pytest.approx([8, 6, math.pi / 2])
    assert inverse(T_a_b) == pytest.approx([-5, 10, -math.pi / 2])


def test_poses_in_space_and_what_is_no_place():
    T = surface_to_sensor(12.0, 30.0, -0.4, 9)
    assert planar_pose(T) == pytest.approx([12, 30, -0.4])
    assert planar_belief(T, (1, 1, 0.1)).pose == pytest.approx([12, 30, -0.4])
    turned = surface_to_sensor(0, 0, math.pi / 2)[:3, :3]
    spread = planar_covariance(np.diag([1.0, 4, 9, 16, 25, 36]), turned)
    assert spread == pytest.approx(np.diag([4.0, 1, 36]))
    with pytest.raises(MosaicError, match=r"\(6, 6\)"):
        planar_covariance(np.eye(5))
    for pose in (np.eye(3), np.diag([1.0, -1, -1, 1]), np.full((4, 4), math.nan)):
        with pytest.raises(MosaicError):
            planar_pose(pose)
    for pose, spread in (
        ((1, 2), (1, 1, 1)), ((1, 2, math.nan), (1, 1, 1)), ((0, 0, 0), (1, 1, 0)),
        ((0, 0, 0), np.ones((3, 3))), ((0, 0, 0), [[1, 2, 0], [0, 1, 0], [0, 0, 1]]),
    ):  # fmt: skip
        with pytest.raises(MosaicError):
            planar_belief(pose, spread)
    with pytest.raises(MosaicError, match="touch 7 has no place"):
        PlacedTouch(newtons(np.zeros((16, 16))), seq=7)
    spread = np.diag([1e-3, 1e-3, 1e-6])
    place = decoded_place(Recognition(1, "Cube", "A", (0, 0), T, T, spread, 20.0, None, ""))
    assert place.pose == pytest.approx([12, 30, -0.4])
    assert (place.covariance == spread).all()
    assert decoded_place(refusal(1, "ambiguous")) is None


def test_correlation_in_parts_is_that_of_every_overlap():
    rng = np.random.default_rng(4)
    wide = KnownRaster(rng.normal(5, 1, (20, 23)), rng.random((20, 23)) > 0.2, 0, 0, 1)
    image = KnownRaster(rng.normal(9, 3, (12, 11)), rng.random((12, 11)) > 0.2, 0, 0, 1)
    rho, overlap = cross_correlate(wide, image)
    assert rho.shape == (9, 13)
    for i, j in np.ndindex(9, 13):
        window = np.s_[i : i + 12, j : j + 11]
        both = wide.known[window] & image.known
        a, b = wide.values[window][both], image.values[both]
        assert overlap[i, j] == both.sum()
        assert rho[i, j] == pytest.approx(np.corrcoef(a, b)[0, 1], abs=1e-9)


def test_peaks_lie_between_cells_and_none_where_nothing_varies():
    y, x = np.mgrid[:9, :11]
    hill = -((y - 3.3) ** 2) - 2 * (x - 6.2) ** 2
    hill[0, 0] = math.nan
    ((row, column, _),) = peaks(hill, 3)
    assert (row, column) == pytest.approx((3.3, 6.2))
    assert peaks(-hill, 3) == []  # highest on the rim
    known = np.ones((12, 12), bool)
    varied = KnownRaster(np.random.default_rng(1).normal(size=(8, 8)), known[:8, :8], 0, 0, 1)
    for seen in (known, ~known):
        even = KnownRaster(np.full((12, 12), 3.0), seen, 0, 0, 1)
        rho, overlap = cross_correlate(even, varied)
        assert np.isnan(rho).all()
        assert (overlap > 0).all() == (overlap > 0).any() == seen.all()
        assert peaks(rho, 4) == []


def test_a_patch_between_the_tactels():
    points = np.random.default_rng(2).uniform(-9, 9, (200, 2))
    found = patch(WAVES)
    value, by_x, by_y = interpolate_patch(found, points)
    assert np.abs(value * found.scale - waves(points)).max() < 0.12
    for slope, step in ((by_x, (1e-4, 0)), (by_y, (0, 1e-4))):
        ahead, behind = (
            interpolate_patch(found, points + sign * np.array(step))[0] for sign in (1, -1)
        )
        assert slope == pytest.approx((ahead - behind) / 2e-4, abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.2])
def test_a_ridge_moved_along_itself_and_a_dome_that_is_turned_are_invisible(angle):
    everywhere, middle = np.ones(256, bool), np.array([2.0, 1.0, 0.0])
    across = TACTELS @ [math.cos(angle), math.sin(angle)]
    ridge = patch(np.exp(-((across - 1.0) ** 2) / 4).reshape(16, 16))
    dome = patch(np.exp(-((TACTELS - middle[:2]) ** 2).sum(axis=1) / 18).reshape(16, 16))
    even = patch(np.ones((16, 16)))
    for shown, seen in ((ridge, 2), (dome, 2), (patch(WAVES), 3), (even, 0)):
        assert seen_motions(shown, everywhere, middle).shape == (3, seen)
    motions = seen_motions(ridge, everywhere, np.zeros(3))
    along = np.array([-math.sin(angle), math.cos(angle), 0.0])
    assert np.abs(along @ motions).max() < 0.05
    belief = np.diag([2.0, 2.0, 1e-4])
    information = restrict_information(np.diag([300.0, 200.0, 4e4]), motions, SENSOR, belief)
    assert along @ information @ along < 0.1
    assert np.linalg.eigvalsh(information).min() > -1e-6
    assert (restrict_information(np.eye(3), np.zeros((3, 0)), SENSOR, np.eye(3)) == 0).all()


A = np.array([41.3, 52.9, 0.35])
BELIEF = np.diag([P**2, P**2, (0.5 * DEG) ** 2])


class Ridges:
    """Ridges across one direction, unevenly spaced."""

    top_mm = 0.0

    def __init__(self, angle):
        self.across = np.array([math.cos(angle), math.sin(angle)])
        self.shifts = np.random.default_rng(5).uniform(-0.3, 0.3, 99)

    def heights_mm(self, points):
        u = points @ self.across / 7
        k = np.floor(u).astype(int)
        return np.where(np.abs(u - k - 0.5 - self.shifts[k % 99]) < 0.16, 0.0, -1.0)


def two(surface, true):
    poses = A, compose_poses(A, true)
    return [patch(felt(surface, pose, np.random.default_rng(n))) for n, pose in enumerate(poses)]


@pytest.mark.parametrize("angle", [0.0, 0.6, 1.9])
def test_ridges_define_the_motion_across_them(angle):
    true = np.array([3.0, 2.0, 0.01])
    off = np.array([0.8, -0.6, 0.003])
    found = register_patches(*two(Ridges(angle), true), true + off, BELIEF, true + off)
    assert found
    covariance = np.linalg.inv(found.information + np.linalg.inv(BELIEF))
    local = angle - A[2]
    across = np.array([math.cos(local), math.sin(local), 0.0])
    along = np.array([-math.sin(local), math.cos(local), 0.0])
    assert abs(across @ (found.pose - true)) < 0.2 * P
    assert along @ (found.pose - true - off) == pytest.approx(0, abs=0.15)  # as believed
    assert 0.5 * P**2 < along @ covariance @ along < 1.01 * P**2
    assert across @ covariance @ across < (0.2 * P) ** 2


def test_reasons_for_no_answer():
    rng = np.random.default_rng(0)
    here, far = np.zeros(3), np.array([30.0, 0.0, 0.0])
    flat = [patch(70 + rng.normal(0, 2, (16, 16))) for _ in "ab"]
    rough = [patch(rng.exponential(9, (16, 16))) for _ in "ab"]
    nothing = patch(np.zeros((16, 16)))
    for pair, at, reason in (
        (flat, here, CONSTANT),
        ((nothing, flat[0]), here, CONSTANT),
        (two(symbols(1), np.array([3.0, 0.0, 0.0])), far, APART),
        (rough, here, NOISE),
    ):
        refused = register_patches(*pair, at, BELIEF, at)
        assert refused.reason == reason
        assert not refused
        assert (refused.pose == at).all()
        assert (refused.information == 0).all()
        assert math.isnan(refused.gain)


BELIEVED, PAIR = np.diag([0.4, 0.4, 4e3]), np.diag([90.0, 60.0, 6e4])


def scene(rng, n=12):
    poses = np.column_stack([rng.uniform(0, 60, (n, 2)), rng.normal(0, 0.02, n)])
    near = [(a, b) for b in range(n) for a in range(b) if np.hypot(*(poses[b] - poses[a])[:2]) < 30]
    return poses, near


def measured(true, near, rng):
    """What the arm believes of each pose and what pairs of them say, with errors."""
    seen = [(PLANE, n, pose, BELIEVED) for n, pose in enumerate(true)]
    seen += [(a, b, relative_pose(true[a], true[b]), PAIR) for a, b in near]
    return [
        Constraint(a, b, rng.multivariate_normal(pose, np.linalg.inv(sure)), sure)
        for a, b, pose, sure in seen
    ]


def test_wrong_pairs_are_switched_off():
    rng = np.random.default_rng(2)
    true, near = scene(rng, 16)
    constraints = measured(true, near, rng)
    wrong = set(range(3, len(near), 7))
    for k in wrong:
        constraints[16 + k].pose[0] += 7.0
    found = solve_pose_graph(constraints, np.array([t.pose for t in constraints[:16]]))
    assert set((np.flatnonzero(found.weights < 0.5) - 16).tolist()) == wrong
    shape = (found.poses - true)[:, :2]
    assert np.hypot(*(shape - shape.mean(axis=0)).T).max() < 1.0


def test_covariances_are_true():
    rng = np.random.default_rng(3)
    true, near = scene(rng)
    inside = []
    for _ in range(60):
        constraints = measured(true, near, rng)
        found = solve_pose_graph(constraints, true)
        spread = covariances(found.normal, range(len(true)))
        dense = np.linalg.inv(found.normal.toarray())
        assert spread[5] == pytest.approx(dense[15:18, 15:18], rel=1e-6, abs=1e-12)
        away = found.poses - true
        away[:, 2] = wrap_angle(away[:, 2])
        inside.append(np.einsum("ni,nij,nj->n", away, np.linalg.inv(spread), away) < 7.815)
    assert 0.9 < np.mean(inside) < 0.99


def test_the_image_is_the_weighted_mean():
    canvas = empty_canvas(P)
    how = CanvasEntry(np.zeros(3), SURE, 1.0)
    for k, level in enumerate((1.0, 1.0, 1.3)):
        canvas = add_to_canvas(canvas, patch(np.full((16, 16), level)), how)
        image = image_of(canvas)
        assert image.values.shape == (64, 64)
        assert (image.count == k + 1).all()
        assert image.corner_mm == pytest.approx((-31.5 * P / 4, 31.5 * P / 4))
    # variances go with the level: weights 1, 1, 1 / 1.69
    assert image.values == pytest.approx((1 + 1 + 1.3 / 1.69) / (2 + 1 / 1.69), abs=1e-6)


SPREAD = (1.0 * P, 1.0 * P, 0.3 * DEG)
DECODED = (0.03, 0.03, 0.1 * DEG)
T_FACE_ARM = np.array([60.0, 35.0, 0.4])
RASTER = np.array([(k % 4, -(k // 4), 0.0) for k in range(16)]) * 4.25 * P


@lru_cache
def scanned():
    """Places on the face, and the signals there."""
    rng, face = np.random.default_rng(8), symbols(8)
    poses, signals = [], []
    for believed in RASTER:
        poses.append(compose_poses(T_FACE_ARM, believed) + rng.normal(0, SPREAD))
        signals.append(newtons(felt(face, poses[-1], rng)))
    return np.array(poses), tuple(signals)


def touches(decoded=False):
    """The arm believes the raster; or all touches were decoded."""
    rng, found = np.random.default_rng(5), []
    for seq, (true, signal) in enumerate(zip(*scanned(), strict=True)):
        believed = planar_belief(RASTER[seq], SPREAD)
        read = planar_belief(true + rng.normal(0, DECODED), DECODED)
        place = {"decoded": read} if decoded else {"believed": believed}
        found.append(PlacedTouch(signal, **place, seq=seq))
    return found


def mosaic_of(some):
    mosaic = no_touches(SENSOR)
    for touch in some:
        mosaic = add_touch(mosaic, touch)
    return mosaic


def test_by_images_alone_the_shape_is_right():
    mosaic = mosaic_of(touches())
    assert set(mosaic.reasons) == {""}
    a, b = mosaic.poses[:, :2], scanned()[0][:, :2]
    z, w = (p[:, 0] + 1j * p[:, 1] - complex(*p.mean(axis=0)) for p in (a, b))
    turn = np.vdot(z, w)
    assert np.sqrt(np.mean(np.abs(w - z * turn / abs(turn)) ** 2)) / P < 0.07
    assert (np.linalg.eigvalsh(mosaic.covariances) > 0).all()
    assert mosaic.image.count.max() >= 9


def test_decoded_touches_lie_on_the_face():
    before = []
    mosaic = no_touches(SENSOR)
    for touch in touches(decoded=True):
        before.append((mosaic, mosaic.poses.copy(), len(mosaic.canvas.tiles)))
        mosaic = add_touch(mosaic, touch)
    for old, poses, tiles in before:  # a mosaic is a value
        assert (old.poses == poses).all()
        assert len(old.canvas.tiles) == tiles
    away = mosaic.poses - scanned()[0]
    tactels = np.hypot(*away[:, :2].T) / P
    assert tactels.max() < 0.25
    assert np.sqrt(np.mean(tactels**2)) < 0.12
    chi2 = np.einsum("ni,nij,nj->n", away, np.linalg.inv(mosaic.covariances), away)
    assert (chi2 < 16.3).mean() > 0.9


def test_blank_touches_stay_where_they_are_believed():
    rng = np.random.default_rng(1)
    flat = [newtons(0.3 + rng.normal(0, 0.01, (16, 16))) for _ in range(3)]
    places = [planar_belief((k * 4.25 * P, 0.0, 0.0), SPREAD) for k in range(3)]
    mosaic = mosaic_of(PlacedTouch(f, p) for f, p in zip(flat, places, strict=True))
    assert mosaic.reasons == (CONSTANT,) * 3
    assert mosaic.poses == pytest.approx(np.array([p.pose for p in places]), abs=1e-6)
    assert mosaic.covariances[1] == pytest.approx(np.diag(np.square(SPREAD)), rel=1e-6)
    assert mosaic.image.count.max() == 3


def test_a_surface_that_repeats_is_ambiguous():
    face = endless_face(np.zeros((9, 9), int), GLYPHS, pitch_mm=7.0, unit_mm=0.26 * 7)
    wide = (2.5 * P, 2.5 * P, 0.3 * DEG)
    some = []
    for k in range(2):
        forces = tabs(face, SENSOR, Touch(30 + 6.0 * k, 40, 0.2, 80.0)).forces_n
        pose = planar_belief((6.0 * k * math.cos(0.2), -6.0 * k * math.sin(0.2), 0.0), wide)
        some.append(PlacedTouch(newtons(forces), pose, seq=k))
    mosaic = mosaic_of(some)
    assert mosaic.reasons == (ALONE, AMBIGUOUS)
    assert mosaic.poses[1] == pytest.approx(some[1].believed.pose, abs=1e-6)


def test_touches_that_cannot_be_placed():
    nothing = no_touches(SENSOR)
    assert nothing.image.values.shape == (0, 0)
    small = PlacedTouch(signal_of(np.ones((8, 8))), planar_belief(np.zeros(3), SPREAD))
    believed, decoded = touches()[0], touches(decoded=True)[1]
    stepped = PlacedTouch(decoded.signal, stepped=believed.believed)
    for mosaic, touch, words in (
        (nothing, small, "8 x 8"),
        (nothing, stepped, "no touch before it"),
        (add_touch(nothing, decoded), believed, "two frames"),
        (add_touch(nothing, believed), decoded, "two frames"),
    ):
        with pytest.raises(MosaicError, match=words):
            add_touch(mosaic, touch)
