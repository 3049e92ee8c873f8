"""Poses in a plane, correlation in parts, textures, the canvas: each by itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.scan.places import surface_to_sensor
from recognizer.errors import MosaicError
from recognizer.scan.mosaic.canvas import (
    CanvasEntry,
    add_to_canvas,
    empty_canvas,
    image_of,
    reference,
)
from recognizer.scan.mosaic.patch import (
    interpolate_patch,
    patch_of,
    restrict_information,
    seen_motions,
)
from recognizer.scan.mosaic.planar import (
    PlacedTouch,
    compose_poses,
    composed_covariance,
    decoded_place,
    inverse,
    planar_belief,
    planar_covariance,
    planar_pose,
    relative_covariance,
    relative_pose,
    transform_points,
)
from recognizer.scan.mosaic.search import (
    KnownRaster,
    cross_correlate,
    magnify_patch,
    peaks,
    points_mm,
    resample,
)
from recognizer.thesis.merge import product_shift
from recognizer.touch.recognition import Recognition, refusal
from recognizer.touch.signal import Signal, signal_of

SENSOR = SensorType()
P = SENSOR.pitch_mm
LEVEL = (0.0, 0.0, 0.0)


def patch(readings, trust=None):
    return patch_of(SENSOR, signal_of(np.asarray(readings, float), trust=trust, floor=0.0))


def waves(points, shift=(0.0, 0.0)):
    x, y = np.moveaxis(points - np.asarray(shift), -1, 0)
    return 4 + np.sin(x / 3.1) + np.cos(y / 3.6 + 0.4) + 0.5 * np.sin((x + y) / 4.3)


def sampled(shift=(0.0, 0.0)):
    return waves(SENSOR.centres_mm().reshape(-1, 2), shift).reshape(16, 16)


# --- poses ------------------------------------------------------------------------------


def test_a_quarter_turn_by_hand():
    T_a_b = np.array([10.0, 5.0, math.pi / 2])
    assert transform_points(T_a_b, np.array([1.0, 0.0])) == pytest.approx([10, 6])
    assert compose_poses(T_a_b, np.array([1.0, 2.0, 0.0])) == pytest.approx([8, 6, math.pi / 2])
    assert inverse(T_a_b) == pytest.approx([-5, 10, -math.pi / 2])


@pytest.mark.parametrize("rule", ["between", "composed"])
def test_covariances_are_those_of_a_sample(rule):
    rng = np.random.default_rng(3)
    a, b = np.array([20.0, -7.0, 0.8]), np.array([31.0, 4.0, -0.3])
    of_a, of_b = np.diag([0.04, 0.01, 1e-5]), np.diag([0.02, 0.03, 4e-5])
    if rule == "between":
        stated, function = relative_covariance(a, b, of_a, of_b), relative_pose
    else:
        stated, function = composed_covariance(a, b, of_a, of_b), compose_poses
    some_a = a + rng.multivariate_normal(np.zeros(3), of_a, 40_000)
    some_b = b + rng.multivariate_normal(np.zeros(3), of_b, 40_000)
    scale = np.sqrt(np.diag(stated))
    seen = np.cov(function(some_a, some_b).T)
    assert np.abs((seen - stated) / np.outer(scale, scale)).max() < 0.03


def test_spatial_poses_and_covariances_in_the_plane():
    assert planar_pose(surface_to_sensor(3, -2, 0.7, 9)) == pytest.approx([3, -2, 0.7])
    turned = surface_to_sensor(0, 0, math.pi / 2)[:3, :3]
    spread = planar_covariance(np.diag([1.0, 4, 9, 16, 25, 36]), turned)
    assert spread == pytest.approx(np.diag([4.0, 1, 36]))
    upside = np.diag([1.0, -1, -1, 1])
    for bad in (np.eye(3), upside, np.full((4, 4), math.nan)):
        with pytest.raises(MosaicError):
            planar_pose(bad)
    with pytest.raises(MosaicError, match=r"\(6, 6\)"):
        planar_covariance(np.eye(5))


def test_places_are_checked():
    assert planar_belief(surface_to_sensor(1, 2, 0.3), (1, 1, 0.1)).pose == pytest.approx(
        [1, 2, 0.3]
    )
    for pose, spread in (
        ((1, 2), (1, 1, 1)),
        ((1, 2, math.nan), (1, 1, 1)),
        (LEVEL, (1, 1, 0)),
        (LEVEL, np.ones((3, 3))),
        (LEVEL, [[1, 2, 0], [0, 1, 0], [0, 0, 1]]),
    ):
        with pytest.raises(MosaicError):
            planar_belief(pose, spread)
    with pytest.raises(MosaicError, match="touch 7 has no place"):
        PlacedTouch(Signal(np.zeros((16, 16)), np.ones((16, 16)), False, True), seq=7)


def test_the_reader_s_answer_is_a_place():
    T = surface_to_sensor(12.0, 30.0, -0.4)
    spread = np.diag([1e-3, 1e-3, 1e-6])
    answer = Recognition(1, "Cube", "A", (0, 0), T, T, spread, 20.0, None, "")
    place = decoded_place(answer)
    assert place is not None
    assert place.pose == pytest.approx([12, 30, -0.4])
    assert (place.covariance == spread).all()
    assert decoded_place(refusal(1, "ambiguous")) is None


# --- correlation ------------------------------------------------------------------------


def brute(reference, image, i, j):
    rows, columns = image.values.shape
    window = np.s_[i : i + rows, j : j + columns]
    both = reference.known[window] & image.known
    a, b = reference.values[window][both], image.values[both]
    return np.corrcoef(a, b)[0, 1] if both.sum() > 1 else math.nan, both.sum()


def test_correlation_in_parts_is_that_of_every_overlap():
    rng = np.random.default_rng(4)
    wide = KnownRaster(rng.normal(5, 1, (20, 23)), rng.random((20, 23)) > 0.2, 0, 0, 1)
    image = KnownRaster(rng.normal(9, 3, (12, 11)), rng.random((12, 11)) > 0.2, 0, 0, 1)
    found = cross_correlate(wide, image)
    assert found.rho.shape == (9, 13)
    for i in range(9):
        for j in range(13):
            rho, cells = brute(wide, image, i, j)
            assert found.overlap[i, j] == cells
            assert found.rho[i, j] == pytest.approx(rho, abs=1e-9)


def test_where_nothing_varies_there_is_no_correlation():
    known = np.ones((12, 12), bool)
    varied = np.random.default_rng(1).normal(size=(8, 8))
    flat = cross_correlate(KnownRaster(np.full((12, 12), 3.0), known, 0, 0, 1),
                      KnownRaster(varied, known[:8, :8], 0, 0, 1))  # fmt: skip
    assert np.isnan(flat.rho).all()
    nothing = cross_correlate(KnownRaster(np.zeros((12, 12)), ~known, 0, 0, 1),
                         KnownRaster(varied, known[:8, :8], 0, 0, 1))  # fmt: skip
    assert np.isnan(nothing.rho).all()
    assert (nothing.overlap == 0).all()
    assert peaks(nothing.rho, 4) == []


def test_peaks_lie_between_cells():
    y, x = np.mgrid[:9, :11]
    hill = -((y - 3.3) ** 2) - 2 * (x - 6.2) ** 2
    hill[0, 0] = math.nan
    ((row, column, _),) = peaks(hill, 3)
    assert (row, column) == pytest.approx((3.3, 6.2))
    assert peaks(-hill, 3) == []  # highest on the rim


def test_the_thesis_s_product_finds_whole_tactels():
    image = np.zeros((24, 24))
    rows, columns = np.random.default_rng(0).integers(0, 24, (2, 40))
    image[rows, columns] = 5.0
    shift = product_shift(image[4:20, 2:18], image[7:23, 4:20], (1.5, -2.5), 1.0)
    assert shift.tolist() == [2.0, -3.0]  # right, and down the rows


# --- patch, raster, texture ----------------------------------------------------------------


def test_a_patch_between_the_tactels():
    points = np.random.default_rng(2).uniform(-9, 9, (200, 2))
    found = patch(sampled())
    value, by_x, by_y = interpolate_patch(found, points)
    assert np.abs(value * found.scale - waves(points)).max() < 0.12
    for slope, step in ((by_x, (1e-4, 0)), (by_y, (0, 1e-4))):
        ahead, behind = (
            interpolate_patch(found, points + sign * np.array(step))[0] for sign in (1, -1)
        )
        assert slope == pytest.approx((ahead - behind) / 2e-4, abs=1e-6)


def test_bad_tactels_are_filled_from_around():
    readings = sampled()
    trust = np.ones((16, 16))
    trust[7, :] = trust[3, 12] = 0
    broken = np.where(trust > 0, readings, 1e6)
    assert np.abs(patch(broken, trust).values - patch(readings).values).max() < 0.35
    assert patch(broken, np.zeros((16, 16))).scale == 0


def test_a_raster_is_resampled_on_another():
    found = magnify_patch(patch(sampled()))
    assert found.values.shape == (64, 64)
    pose = np.array([2.0, -1.0, 0.3])
    under = resample(found, found, pose)
    at = transform_points(pose, points_mm(found)[under.known])
    inside = (np.abs(at) < 10).all(axis=1)
    scale = patch(sampled()).scale
    assert np.abs(under.values[under.known] * scale - waves(at))[inside].max() < 0.15
    assert 0.7 < under.known.mean() < 0.95


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.2])
def test_a_ridge_moved_along_itself_is_invisible(angle):
    points = SENSOR.centres_mm().reshape(-1, 2)
    across = points @ [math.cos(angle), math.sin(angle)]
    ridge = patch(np.exp(-((across - 1.0) ** 2) / 4).reshape(16, 16))
    motions = seen_motions(ridge, np.ones(256, bool), np.zeros(3))
    assert motions.shape == (3, 2)
    along = np.array([-math.sin(angle), math.cos(angle), 0.0])
    assert np.abs(along @ motions).max() < 0.05
    belief = np.diag([2.0, 2.0, 1e-4])
    information = restrict_information(np.diag([300.0, 200.0, 4e4]), motions, SENSOR, belief)
    assert along @ information @ along < 0.1
    assert np.linalg.eigvalsh(information).min() > -1e-6


def test_a_dome_turned_about_its_middle_is_invisible():
    points = SENSOR.centres_mm().reshape(-1, 2)
    dome = patch(np.exp(-((points - [2, 1]) ** 2).sum(axis=1) / 18).reshape(16, 16))
    everywhere = np.ones(256, bool)
    assert seen_motions(dome, everywhere, np.array([2.0, 1.0, 0.0])).shape == (3, 2)
    assert seen_motions(patch(sampled()), everywhere, np.zeros(3)).shape == (3, 3)
    assert seen_motions(patch(np.ones((16, 16))), everywhere, np.zeros(3)).shape == (3, 0)
    assert (restrict_information(np.eye(3), np.zeros((3, 0)), SENSOR, np.eye(3)) == 0).all()


# --- canvas and image ----------------------------------------------------------------------


def test_a_removed_touch_leaves_nothing():
    canvas = empty_canvas(P)
    sure = np.diag([1e-4, 1e-4, 1e-7])
    first = CanvasEntry(np.array([5.0, 40.0, 0.2]), sure, 1.0)
    second = CanvasEntry(np.array([-9.0, 33.0, -0.7]), sure, 1.3)
    one = add_to_canvas(canvas, patch(sampled()), first)
    both = add_to_canvas(one, patch(sampled((1, 0))), second)
    back = add_to_canvas(both, patch(sampled((1, 0))), second, -1)
    assert not canvas.tiles
    assert back.tiles.keys() == one.tiles.keys()
    for key, tile in one.tiles.items():
        assert back.tiles[key] == pytest.approx(tile, rel=1e-9, abs=1e-6)
    assert not add_to_canvas(back, patch(sampled()), first, -1).tiles
    assert image_of(canvas).values.shape == (0, 0)


def test_the_image_is_the_mean_with_its_errors():
    canvas = empty_canvas(P)
    sure = np.diag([1e-4, 1e-4, 1e-7])
    for k, level in enumerate((1.0, 1.0, 1.3)):
        how = CanvasEntry(np.array([0.0, 0.0, 0.0]), sure, 1.0)
        canvas = add_to_canvas(canvas, patch(np.full((16, 16), level)), how)
        image = image_of(canvas)
        assert image.values.shape == (64, 64)
        assert (image.count == k + 1).all()
        assert image.corner_mm == pytest.approx((-31.5 * P / 4, 31.5 * P / 4))
    # variances go with the level: weights 1, 1, 1 / 1.69
    mean = (1 + 1 + 1.3 / 1.69) / (2 + 1 / 1.69)
    assert image.values == pytest.approx(mean, abs=1e-6)
    spread = math.sqrt((2 * (1 - mean) ** 2 + (1.3 - mean) ** 2 / 1.69) / (2 + 1 / 1.69))
    assert image.deviation == pytest.approx(spread, abs=1e-6)
    assert (image.error > 0.03 / math.sqrt(3)).all()  # they scatter more than readings do


def test_the_canvas_shows_a_touch_where_it_lies():
    how = CanvasEntry(np.array([30.0, -20.0, 0.4]), np.diag([1e-4, 1e-4, 1e-7]), 1.0)
    canvas = add_to_canvas(empty_canvas(P), patch(sampled()), how)
    shown = reference(canvas, 30.0, -20.0, 12.0)
    at = transform_points(inverse(how.pose), points_mm(shown)[shown.known])
    inside = (np.abs(at) < 9).all(axis=1)
    assert inside.sum() > 1000
    assert np.abs(shown.values[shown.known] - waves(at))[inside].max() < 0.15


def test_a_doubtful_place_counts_little_at_edges_only():
    points = SENSOR.centres_mm().reshape(-1, 2)
    step = patch(1 + (points[:, 0] > 0).reshape(16, 16).astype(float))
    canvas = add_to_canvas(
        empty_canvas(P), step, CanvasEntry(np.zeros(3), np.diag([1.0, 1.0, 1e-4]), 1.0)
    )
    error = image_of(canvas).error
    assert error[32, 32] > 5 * error[32, 4]
