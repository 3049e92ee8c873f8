"""The last fit: its covariance against drawn errors, and how far readings scatter."""

import math
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
from recognizer.touch.signal import Signal
from recognizer.touch.symbols import posterior
from recognizer.touch.symbols.image import image_of_signal
from recognizer.touch.symbols.kernels import FORM_SD
from recognizer.touch.symbols.linearize import force_jacobian, project_symbols
from recognizer.touch.symbols.posterior import (
    TactelScatter,
    explained_share,
    fit_posterior,
    fit_scatter,
    second_differences,
)
from recognizer.touch.symbols.template import CROSS_TALK, template_of

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


@pytest.mark.parametrize(("value", "presses"), [(0.0, False), (9e-7, False), (1.1e-6, True)])
def test_what_rounding_leaves_of_no_symbol_presses_nothing(touch, value, presses):
    image, deep = touch(), GAIN + np.array([0.0, 0.9, 0.0, 0.0])  # so that the bare face is felt
    felt, _, values = project_symbols(image, TRUE[None], deep[None], shown)
    values = np.zeros_like(values)
    values[0, 100, 0] = value
    force = force_jacobian(image, TRUE[None], deep[None], values, felt)[1][0]
    assert bool(force[100] > 1.0) is presses
    assert force[100] < 1e-3 or presses
    assert not np.delete(force, 100).any()


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


def test_tips_that_stand_aside_widen_it_and_even_gains_do_not_hide_them(touch):
    widths = []
    for aside_mm in (0.02, 0.1, 0.25):
        found = [fit(touch(seed, aside_mm), seed).covariance for seed in range(4)]
        widths.append(math.sqrt(np.mean([one[0, 0] for one in found])))
    assert widths[1] > 1.5 * widths[0]
    assert widths[2] > 1.5 * widths[1]


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


def test_much_blur_widens_it_beyond_least_squares(touch, monkeypatch):
    image = touch(3, 0.05, blur=(0.1, 0.1))
    found = fit(image)
    monkeypatch.setattr(posterior, "BLURRED_SIZE", 0.0)
    monkeypatch.setattr(posterior, "SIZE", 1.0)
    usual = fit(image)
    monkeypatch.setattr(posterior, "SIZE", 2.0)
    np.testing.assert_allclose(fit(image).covariance, 2 * usual.covariance)
    heard = CROSS_TALK * (1 + found.pose[4]) + 2 * sum(found.blur)
    assert heard > 0.12
    factor = 1.1 + 2.5 * (heard - 0.12)
    np.testing.assert_allclose(found.covariance, factor * usual.covariance, rtol=1e-9)
    even = fit(touch(3, 0.05))
    assert CROSS_TALK * (1 + even.pose[4]) + 2 * sum(even.blur) < 0.12


def test_a_form_far_from_what_was_known_widens_it(touch, monkeypatch):
    far = np.array([*TRUE[:3], -1.2, 0.7, 0.4, 0.0])
    for pose, wider in ((TRUE, False), (far, True)):
        image = touch(3, 0.05, pose=pose)
        found = fit_posterior(image, pose, GAIN, shown)
        with monkeypatch.context() as changed:
            changed.setattr(posterior, "FORM_SIZE", 0.0)
            plain = fit_posterior(image, pose, GAIN, shown)
        strange = ((found.pose[3:6] / np.array(FORM_SD)) ** 2).sum()
        assert (strange > 5.0) == wider
        factor = 1 + 0.25 * max(0.0, strange - 5.0)
        np.testing.assert_allclose(found.covariance, factor * plain.covariance, rtol=1e-9)


def test_tips_that_were_learned_scatter_less(touch):
    image = touch(3, 0.08)
    learned = np.where(np.arange(256) % 2 == 0, 0.01, 1.0)
    forces = np.where(np.arange(256) % 2 == 0, touch(3, 0.0).forces, image.forces)
    image = replace(image, forces=forces)  # every other tip stands where it is believed to
    blind, told = fit(image), fit(replace(image, aside=learned))
    assert told.covariance[0, 0] < 0.7 * blind.covariance[0, 0]
    assert told.scatter.aside_mm > blind.scatter.aside_mm


def test_a_scale_is_told_with_its_covariance(touch):
    errors, scaled = [], TRUE + np.array([0, 0, 0, 0, 0, 0, 0.004])
    for seed in range(30):
        found = fit(touch(seed, 0.08, 0.1, pose=scaled), seed)
        errors.append((found.pose[6] - 0.004) / math.sqrt(found.covariance[3, 3]))
    assert abs(np.mean(errors)) < 0.5
    assert 0.6 < np.std(errors) < 1.25


def test_dead_tactels_and_masked_ones_do_not_move_it(touch):
    image = touch(6, 0.05)
    forces, trust = image.forces.copy(), image.trust.copy()
    forces[[40, 100, 170]] = 0.0
    dead = fit(replace(image, forces=forces))
    trust[[40, 100, 170]] = 0.0
    masked = fit(replace(image, forces=forces, trust=trust))
    whole = fit(image)
    assert masked.pose[:3] == pytest.approx(whole.pose[:3], abs=0.02)
    assert dead.pose[:3] == pytest.approx(masked.pose[:3], abs=0.02)
    # to leave tactels out costs information
    assert np.linalg.det(masked.covariance) > np.linalg.det(whole.covariance)


def test_where_nothing_tells_a_place_it_is_wide(touch):
    found = fit(replace(touch(7, 0.05), trust=np.zeros(256)))
    assert np.isfinite(found.covariance).all()
    assert found.covariance[0, 0] > 1.0


def test_what_noise_of_readings_leaves_is_not_left_unexplained(touch):
    image = touch(8, 0.03)
    rng = np.random.default_rng(8)
    clean = explained_share(image, TRUE, GAIN, shown)
    assert clean > 0.9
    loud = np.maximum(image.forces + 40 * rng.standard_normal(256), 0.0)  # of 200 on a plateau
    told = replace(image, forces=loud, noise=40.0)
    plain = explained_share(replace(told, noise=0.0), TRUE, GAIN, shown)
    assert plain < 0.7
    assert explained_share(told, TRUE, GAIN, shown) > plain + 0.15
    # symbols that are not there explain no more for it
    other = explained_share(told, TRUE, GAIN, lambda cells: (shown(cells) + 1) % 4)
    assert other < 0.3


USUAL = TactelScatter(0.08, 0.08)


def test_variances_are_those_of_both_parts():
    parts = np.array([[1.0, 4.0, 0.0], [0.0, 2.0, 9.0]])
    assert TactelScatter(0.5, 0.1).variances(parts) == pytest.approx([0.25, 1.02, 0.09])


def test_what_lies_far_out_weighs_little():
    left, parts, trust = np.array([0.0, 2.0, 20.0, 2.0]), np.ones((2, 4)), np.array([1.0, 1, 1, 0])
    weights = TactelScatter(math.sqrt(3), 1.0).weights(left, parts, trust)  # variance 4
    assert weights == pytest.approx([9 / 32, 9 / 36, 9 / 432, 0.0])


def test_the_log_likelihood_is_students():
    left, parts, trust = np.array([0.5, -3.0, 1.0]), np.ones((2, 3)), np.array([1.0, 1.0, 0.0])
    spread = TactelScatter(0.6, 0.8)  # variance 1
    expected = sum(-4.5 * math.log(1 + x * x / 8) for x in (0.5, -3.0))
    assert spread.log_likelihood(left, parts, trust) == pytest.approx(expected)
    wider = TactelScatter(1.2, 1.6).log_likelihood(left, parts, trust)
    expected = sum(-4.5 * math.log(1 + x * x / 32) - math.log(2) for x in (0.5, -3.0))
    assert wider == pytest.approx(expected)


def touched(felt, aside, seed, count=256):
    """Residuals of a touch whose tactels differ in slope, and of which nothing was fitted."""
    rng = np.random.default_rng(seed)
    parts = np.stack([0.7 + rng.random(count), 3 * rng.random(count) ** 2])
    left = np.sqrt(TactelScatter(felt, aside).variances(parts)) * rng.standard_normal(count)
    return left, parts


def told(left, parts, jacobian=None, trust=None, rounds=60):
    unknowns = np.zeros((len(left), 1)) if jacobian is None else jacobian
    known = np.eye(unknowns.shape[1]) * 1e-9
    spread = USUAL
    for _ in range(rounds):
        trusted = np.ones(len(left)) if trust is None else trust
        spread = fit_scatter(spread, left, parts, unknowns, known, trusted)
    return spread


@pytest.mark.parametrize(("felt", "aside"), [(0.05, 0.2), (0.03, 0.1), (0.08, 0.08)])
def test_a_touch_tells_even_sensors_from_straight_ones(felt, aside, monkeypatch):
    monkeypatch.setattr(posterior, "USUAL_WEIGHT", 0.5)
    found = [told(*touched(felt, aside, seed)) for seed in range(20)]
    # Student's scale of normal errors is a little less than their deviation
    assert np.mean([one.psi for one in found]) == pytest.approx(0.93 * felt, rel=0.12)
    assert np.mean([one.aside_mm for one in found]) == pytest.approx(0.93 * aside, rel=0.25)


def test_few_tactels_leave_it_as_usual_and_many_do_not():
    few = told(*touched(0.3, 0.3, 1, count=2))
    many = told(*touched(0.3, 0.3, 1, count=2000))
    assert many.psi > 0.25
    assert few.psi < 0.2
    nothing = told(np.zeros(3), np.ones((2, 3)), trust=np.zeros(3))
    assert (nothing.psi, nothing.aside_mm) == pytest.approx((0.08, 0.08))


def test_a_dead_tactel_does_not_widen_it():
    left, parts = touched(0.1, 0.1, 3)
    sound = told(left, parts)
    left[7] = 40.0
    dead = told(left, parts)
    assert dead.psi == pytest.approx(sound.psi, rel=0.1)


def test_what_was_fitted_away_is_counted():
    """Half of all unknowns free: residuals are half as large, the spread is not."""
    rng = np.random.default_rng(4)
    left, parts = touched(0.1, 0.0, 4)
    jacobian = rng.standard_normal((256, 128))
    taken = left - jacobian @ np.linalg.lstsq(jacobian, left, rcond=None)[0]
    assert np.std(taken) < 0.75 * np.std(left)
    assert told(taken, parts, jacobian).psi == pytest.approx(told(left, parts).psi, rel=0.25)
    assert told(taken, parts).psi < 0.8 * told(left, parts).psi


def test_second_differences_by_hand():
    image = np.array([[1.0, 2.0, 4.0], [0.0, 5.0, 1.0]])
    rows, columns = second_differences(image.reshape(-1, 1), (2, 3))
    assert rows.reshape(2, 3).tolist() == [[-2.0, 1.0, -7.0], [1.0, -8.0, 2.0]]
    assert columns.reshape(2, 3).tolist() == [[0.0, 1.0, -6.0], [5.0, -9.0, 3.0]]
    both = second_differences(np.column_stack([image.ravel(), 2 * image.ravel()]), (2, 3))
    np.testing.assert_array_equal(both[0][:, 1], 2 * rows[:, 0])
    np.testing.assert_array_equal(both[1][:, 0], columns[:, 0])
