"""Squares of tactels and quantiles, against numpy's own and a loop."""

import numpy as np
import pytest

from recognizer.touch.signal import combine_around, quantile


@pytest.mark.parametrize("shape", [(16, 16), (12, 32), (3, 1)])
@pytest.mark.parametrize("reach", [0, 1, 2, 3])
@pytest.mark.parametrize(
    ("combine", "of"), [(np.maximum, np.max), (np.logical_or, np.any), (np.logical_and, np.all)]
)
def test_squares_end_at_the_rim(shape, reach, combine, of):
    image = np.random.default_rng(4).random(shape)
    image = image if combine is np.maximum else image > (0.9 if combine is np.logical_or else 0.1)
    given = image.copy()
    found = combine_around(image, reach, combine)
    for row, column in np.ndindex(shape):
        around = image[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) :]
        assert found[row, column] == of(around[:, : min(reach, column) + reach + 1])
    assert found.dtype == image.dtype
    assert (image == given).all()


@pytest.mark.parametrize("count", [1, 2, 25, 256])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.6, 0.85, 1.0])
def test_quantiles_are_numpys(count, share):
    values = np.random.default_rng(count).random((3, count))
    assert quantile(np.sort(values), share).tolist() == np.quantile(values, share, axis=1).tolist()
