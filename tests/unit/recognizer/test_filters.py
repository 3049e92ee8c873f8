"""Bias, median, magnification, Sobel: against hand-made images and scipy."""

import numpy as np
import pytest
from scipy import ndimage

from encoded_objects.base.sensor_type import SensorType
from recognizer.thesis.filters import magnify_image, median, sobel, subtract_bias
from recognizer.thesis.merge import magnify_samples
from recognizer.touch.tactile_image import ImageError, tactile_image, touch_image


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


def test_nan_where_undefined_stays_outside():
    values, known = noise(), np.ones((16, 16), bool)
    values[3, 4], known[3, 4] = np.nan, False
    image = tactile_image(values, step_mm=1.0, defined=known)
    for made in (subtract_bias(image), median(image), magnify_image(image)):
        assert np.isfinite(made.values).all()
    # beside the hole counts what is left
    assert magnify_image(image).values[12, 19] == pytest.approx(values[3, 5])
    assert not magnify_image(image).defined[12, 16]


def test_bias_is_what_is_read_without_force():
    image = tactile_image(100 + np.pad(noise(shape=(4, 4)) * 50, 6), step_mm=1.0)
    over = subtract_bias(image)
    assert over.values.min() == 0
    assert over.values[0, 0] == 0
    assert over.values.max() == pytest.approx(image.values.max() - 100)


def test_median_is_that_of_the_neighbourhood():
    values = noise(1)
    expected = ndimage.median_filter(values, 3, mode="nearest")
    assert np.array_equal(median(tactile_image(values, step_mm=1.0)).values, expected)


def test_median_over_holes_is_that_of_what_is_known():
    values, known = noise(2), np.random.default_rng(3).random((16, 16)) > 0.3
    found = median(tactile_image(values, step_mm=1.0, defined=known)).values
    padded = np.pad(np.where(known, values, np.nan), 1, mode="edge")
    for r, c in np.argwhere(known):
        assert found[r, c] == pytest.approx(np.nanmedian(padded[r : r + 3, c : c + 3]))


def test_median_takes_spikes_and_keeps_edges_but_erases_thin_lines():
    step = np.zeros((16, 16))
    step[:, 8:] = 1
    spiked = step.copy()
    spiked[4, 3] = 9
    assert np.array_equal(median(tactile_image(spiked, step_mm=1.0)).values, step)
    line = np.zeros((16, 16))
    line[:, 8] = 1
    assert not median(tactile_image(line, step_mm=1.0)).values.any()


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


def test_sobel_gives_slopes_in_the_image_frame():
    rows, columns = np.indices((12, 12))
    image = tactile_image(3 * columns - 5 * rows, step_mm=0.5)
    x, y = sobel(image)
    assert x[1:-1, 1:-1] == pytest.approx(np.full((10, 10), 6.0))
    assert y[1:-1, 1:-1] == pytest.approx(np.full((10, 10), 10.0))
    values = noise(5)
    x, y = sobel(tactile_image(values, step_mm=1.0))
    assert x == pytest.approx(ndimage.sobel(values, axis=1, mode="nearest") / 8)
    assert y == pytest.approx(-ndimage.sobel(values, axis=0, mode="nearest") / 8)
