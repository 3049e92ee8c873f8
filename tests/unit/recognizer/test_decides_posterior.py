"""The last fit: its covariance against drawn errors, and how far readings scatter."""

import math
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.image import image_of_signal
from recognizer.touch.symbols.linearize import force_jacobian, project_symbols
from recognizer.touch.symbols.posterior import (
    fit_posterior,
    second_differences,
)
from recognizer.touch.symbols.template import template_of

SENSOR = SensorType()
STYLE = SymbolStyle(pitch_mm=7.0, height_mm=1.0, stroke_mm=1.4)
TRUE = np.array([17.3, 9.1, 0.6, 0.2, -0.3, -0.1, 0.0])
GAIN = np.array([4.6, 0.35, 0.03, -0.02])
LABELS = np.random.default_rng(5).integers(0, 4, (24, 24))


def shown(cells):
    return LABELS[cells[..., 0] % 24, cells[..., 1] % 24]


@pytest.fixture(scope="module")
def touch():
    """Return a function that makes an image: a sensor with these errors at the true pose."""
    signal = Signal(np.ones((16, 16)), np.ones((16, 16)), contact=True, newtons=False)
    template = template_of(alphabet_named("dense-4"), STYLE, SENSOR)
    plain = image_of_signal(SENSOR, signal, template, STYLE.height_mm)

    def made(seed=0, aside_mm=0.0, gain=0.0, offset=0.0, blur=(0.0, 0.0), pose=TRUE):
        rng = np.random.default_rng(seed)
        at = replace(plain, points_mm=plain.points_mm + aside_mm * rng.standard_normal((256, 2)))
        felt, _, values = project_symbols(at, pose[None], GAIN[None], shown)
        force = force_jacobian(at, pose[None], GAIN[None], values, felt)[1][0]
        force = force * np.exp(gain * rng.standard_normal(256)) + 1.5 * rng.standard_normal(256)
        rows, columns = (one[:, 0] for one in second_differences(force[:, None], (16, 16)))
        return replace(plain, forces=force + blur[0] * rows + blur[1] * columns + offset)

    return made


def near(rng):
    """A pose as the search leaves it, and a gain."""
    spread = (0.05, 0.05, 0.004, 0.1, 0.1, 0.1, 0.0)
    pose = TRUE + rng.normal(0, 1, 7) * spread
    return pose, GAIN * (1 + rng.normal(0, 0.03, 4))


def fit(image, seed=0):
    return fit_posterior(image, *near(np.random.default_rng(100 + seed)), shown)


def away(found):
    pose = found.pose[:3] - TRUE[:3]
    return np.append(pose, found.pose[6])


@pytest.mark.parametrize(("aside_mm", "gain"), [(0.03, 0.05), (0.08, 0.12), (0.2, 0.05)])
def test_errors_are_as_large_as_the_covariance_says(touch, aside_mm, gain):
    squares, felt = [], []
    for seed in range(40):
        found = fit(touch(seed, aside_mm, gain), seed)
        error = away(found)[:3]
        squares.append(error @ np.linalg.solve(found.covariance[:3, :3], error))
        felt.append(found.scatter.aside_mm)
    assert 1.6 < np.mean(squares) < 4.5  # of three numbers: 3, nearly
    assert np.mean(np.array(squares) < 7.815) >= 0.85
    assert np.mean(felt) == pytest.approx(aside_mm, abs=0.02 + 0.2 * aside_mm)


def test_what_all_readings_have_too_much_is_told(touch):
    plain, lifted = (fit(touch(2, 0.03, offset=offset)) for offset in (0.0, 12.0))
    assert lifted.pose[:3] == pytest.approx(plain.pose[:3], abs=0.01)
    assert lifted.scatter.psi == pytest.approx(plain.scatter.psi, rel=0.1)  # else 2.4 times


def test_blur_of_rows_and_of_columns_is_told_and_flattens_slopes(touch):
    plain = fit(touch(3, 0.05))
    assert plain.blur == pytest.approx((0.0, 0.0), abs=0.02)
    for blur in ((0.08, 0.0), (0.0, 0.08)):
        found = fit(touch(3, 0.05, blur=blur))
        assert found.blur == pytest.approx(blur, abs=0.03)
        assert found.pose[:2] == pytest.approx(plain.pose[:2], abs=0.03)
        assert found.covariance[0, 0] > 0.9 * plain.covariance[0, 0]


def test_a_scale_is_told_with_its_covariance(touch):
    errors, scaled = [], TRUE + np.array([0, 0, 0, 0, 0, 0, 0.004])
    for seed in range(30):
        found = fit(touch(seed, 0.08, 0.1, pose=scaled), seed)
        errors.append((found.pose[6] - 0.004) / math.sqrt(found.covariance[3, 3]))
    assert abs(np.mean(errors)) < 0.5
    assert 0.6 < np.std(errors) < 1.25


def test_where_nothing_tells_a_place_it_is_wide(touch):
    found = fit(replace(touch(7, 0.05), trust=np.zeros(256)))
    assert np.isfinite(found.covariance).all()
    assert found.covariance[0, 0] > 1.0
