"""The thesis's image: filters, skeletons, symbols, and the grid that they stand on."""

import math

import numpy as np
import pytest
from scipy import ndimage

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
from recognizer.thesis.filters import magnify_image, median, sobel
from recognizer.thesis.grid import grid
from recognizer.thesis.merge import magnify_samples
from recognizer.thesis.skeleton import points_of_glyph, points_of_skeleton
from recognizer.thesis.symbols import COUNTS, CUT, Symbol, symbols
from recognizer.touch.tactile_image import ImageError, tactile_image, touch_image

STEP = 0.4
PITCH = 12.0
LABELS = np.array([[0, 1, 1, 0], [1, 1, 0, 0], [0, 1, 0, 1]])


# --- filters


def noise(seed=0, shape=(16, 16)):
    return np.random.default_rng(seed).uniform(0, 1, shape)


def test_frame_has_x_along_columns_and_y_against_rows():
    sensor = SensorType()
    image = touch_image(sensor, noise())
    assert image.xy_mm(*np.indices((16, 16))) == pytest.approx(sensor.centres_mm(), abs=1e-12)
    fine = magnify_image(image)
    assert fine.xy_mm(0, 0) == pytest.approx(image.xy_mm(0, 0))
    assert fine.xy_mm(60, 60) == pytest.approx(image.xy_mm(15, 15))


@pytest.mark.parametrize(
    ("values", "kwargs", "match"),
    [
        (np.zeros(5), {"step_mm": 1}, "shape"),
        (np.zeros((4, 4)), {"step_mm": 0}, "step"),
        (np.zeros((4, 4)), {"step_mm": 1, "defined": np.ones((3, 4))}, "mask"),
        (np.full((4, 4), np.nan), {"step_mm": 1}, r"16 readings.*\(0, 0\)"),
    ],
)
def test_no_image_is_refused(values, kwargs, match):
    with pytest.raises(ImageError, match=match):
        tactile_image(values, **kwargs)


def test_median_takes_spikes_and_keeps_edges_but_erases_thin_lines():
    spiked = np.where(np.arange(16) >= 8, 1.0, np.zeros((16, 16)))
    step = tactile_image(spiked.copy(), step_mm=1.0)
    spiked[4, 3] = 9
    assert np.array_equal(median(tactile_image(spiked, step_mm=1.0)).values, step.values)
    line = tactile_image(np.where(np.arange(16) == 8, 1.0, np.zeros((16, 16))), step_mm=1.0)
    assert not median(line).values.any()
    with pytest.raises(ImageError, match="erases lines"):
        median(line, thinnest_mm=1.5)


def test_sobel_is_scipys_with_y_against_rows():
    values = noise(5)
    x, y = sobel(tactile_image(values, step_mm=0.5))
    assert x == pytest.approx(ndimage.sobel(values, axis=1, mode="nearest") / 4)
    assert y == pytest.approx(-ndimage.sobel(values, axis=0, mode="nearest") / 4)


def test_magnification_is_the_thesis_convolution():
    """Zeros between the tactels and H, twice; the last three rows and columns are beyond."""
    values, h = noise(4), np.outer([0.5, 1.0, 0.5], [0.5, 1.0, 0.5])
    wanted = values
    for _ in range(2):
        wide = np.zeros((2 * len(wanted), 2 * len(wanted)))
        wide[::2, ::2] = wanted
        wanted = ndimage.convolve(wide, h, mode="constant")
    assert magnify_samples(values) == pytest.approx(wanted, abs=1e-12)
    fine = magnify_image(tactile_image(values, step_mm=1.0))
    assert fine.values.shape == (61, 61)
    assert fine.step_mm == 0.25
    assert fine.values == pytest.approx(wanted[:61, :61], abs=1e-12)


def style(alphabet):
    return SymbolStyle(PITCH, 1.0, stroke_mm=alphabet.stroke_ratio * PITCH, draft_rad=0.17)


def drawn(alphabet, placed, size_mm=50.0, pitch=12.0, half_mm=None):
    """An image of (label, x, y, theta), strokes with soft sides."""
    n = round(size_mm / STEP)
    at = (np.arange(n) - (n - 1) / 2) * STEP
    z = at[None, :] - 1j * at[:, None]
    half = alphabet.stroke_ratio * pitch / 2 if half_mm is None else half_mm
    image = np.zeros((n, n))
    unit = alphabet.reach * pitch
    for label, x, y, theta in placed:
        own = (z - complex(x, y)) * np.exp(-1j * theta)
        for a, b in alphabet.glyphs[label].strokes:
            p, u = complex(*a) * unit, (complex(*b) - complex(*a)) * unit
            t = np.clip(((own - p) * u.conjugate()).real / abs(u) ** 2, 0, 1)
            image = np.maximum(image, np.clip((half + 0.4 - abs(own - p - t * u)) / 0.8, 0, 1))
    return tactile_image(image, step_mm=STEP)


# --- counts -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("thesis-2", [(2, 1, 0), (3, 2, 0)]),  # thesis, figure 6.4
        ("dense-4", [(2, 1, 0), (3, 3, 0), (3, 2, 0), (2, 2, 0)]),  # figure 6.12
        ("letters-4", [(2, 1, 0), (3, 3, 0), (3, 2, 0), (2, 2, 0)]),
    ],
)
def test_glyphs_have_the_end_points_and_vertices_of_the_thesis(name, expected):
    assert [points_of_glyph(glyph).counts for glyph in alphabet_named(name).glyphs] == expected


def test_a_ring_is_one_loop_without_ends():
    ring = np.zeros((5, 5), bool)
    ring[[1, 2, 2, 3], [2, 1, 3, 2]] = True
    assert points_of_skeleton(ring, 100.0).counts == (0, 0, 1)


# --- symbols ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["thesis-2", "letters-4"])
@pytest.mark.parametrize("degrees", [0, 17, 45, 133, 290])
def test_symbols_are_named_placed_and_turned(name, degrees):
    alphabet = alphabet_named(name)
    theta = math.radians(degrees)
    for label in range(alphabet.order):
        image = drawn(alphabet, [(label, 1.3, -2.2, theta)], size_mm=24)
        (found,) = symbols(image, alphabet, style(alphabet))
        assert found.label == label
        assert math.hypot(found.x_mm - 1.3, found.y_mm + 2.2) < 0.5
        assert abs(math.remainder(found.theta_rad - theta, math.tau)) < math.radians(8)


def test_what_is_no_symbol_is_rejected_with_a_reason():
    two, four = alphabet_named("thesis-2"), alphabet_named("letters-4")
    assert symbols(tactile_image(np.zeros((40, 40)), step_mm=STEP), two, style(two)) == []
    bar = np.zeros((60, 60))
    bar[28:32, 10:40] = 1
    wide = drawn(four, [(0, 0, 0, 0.0)], size_mm=40, pitch=22.0, half_mm=0.9)
    for image, alphabet, reason in (
        (tactile_image(bar, step_mm=STEP), two, COUNTS),
        (drawn(two, [(0, 10.5, 0, 0.0)], size_mm=24), two, CUT),
        (wide, four, "shape"),
    ):
        (found,) = symbols(image, alphabet, style(alphabet))
        assert (found.label, found.rejected) == (-1, reason)


# --- grid


def symbol(x, y, theta, label=0, off=0.1):
    rejected = "" if label >= 0 else "counts"
    return Symbol(label, x, y, theta, (x, y), off, rejected)


def laid(labels, theta=0.0, at=(0.0, 0.0), rng=None, place=0.0, turn=0.0):
    """Symbols of labels (rows, columns), -1 where none is felt, turned by theta."""
    found = []
    for (r, c), label in np.ndenumerate(labels):
        z = complex(c * PITCH, -r * PITCH) * complex(math.cos(theta), math.sin(theta))
        dx, dy, dt = (0, 0, 0) if rng is None else rng.normal(0, 1, 3) * (place, place, turn)
        if label >= 0:
            found.append(symbol(z.real + at[0] + dx, z.imag + at[1] + dy, theta + dt, int(label)))
    return found


def test_a_symbol_is_off_by_a_quarter_of_the_pitch_at_most():
    for away, members in ((2.9, 2), (3.1, 1)):
        found = grid([symbol(0, 0, 0.0), symbol(PITCH + away, 0, 0.0)], PITCH)
        assert len(found.members) == members
    assert grid([symbol(0, 0, 0.0, label=-1)], PITCH) is None


def test_the_covariance_holds_what_happens():
    rng, normed = np.random.default_rng(1), []
    truth = grid(laid(LABELS), PITCH)
    for _ in range(60):
        noisy = laid(LABELS, rng=rng, place=0.2, turn=math.radians(4))
        found = grid(noisy, PITCH)
        i, j = np.subtract(found.first, truth.first) * PITCH  # cells are numbered from any symbol
        error = np.array(
            [
                found.x_mm - i - truth.x_mm,
                found.y_mm - j - truth.y_mm,
                found.theta_rad - truth.theta_rad,
            ]
        )
        normed.append(error @ np.linalg.solve(found.covariance, error))
    assert 1.5 < np.mean(normed) < 4.5  # chi square of 3 freedoms
