"""Windows of a lab's own array are decoded by every method."""

import numpy as np
import pytest

from decoder import decode, decode_exact
from decoder.any_method import array_of_profile
from decoder.errors import DecoderError
from generator.array import profile
from generator.errors import LabKeyError

KEY = "0123-4567-89AB-CDER"


@pytest.fixture(scope="module", params=["one-touch", "large"])
def array(request):
    return profile(request.param).array_of_lab(KEY)


def views(array, shape, number=50):
    rng = np.random.default_rng(3)
    rows, columns = (rng.integers(size, size=number) for size in (array.rows, array.columns))
    r, c = np.indices(shape)
    return rows, columns, array.symbols(
        (rows[:, None, None] + r) % array.rows, (columns[:, None, None] + c) % array.columns
    )  # fmt: skip


@pytest.mark.parametrize("method", ["table", "logarithm"])
def test_exact_methods(array, method):
    rows, columns, windows = views(array, array.window)
    found = decode_exact(array, windows, method)
    assert found.answered.all()
    np.testing.assert_array_equal(found.rows, rows)
    np.testing.assert_array_equal(found.columns, columns)


def test_the_window_that_no_place_shows_is_the_one_of_the_term_0(array):
    assert array.permutation[0] != 0
    empty = np.full(array.window, array.permutation[0])
    assert not decode_exact(array, empty).answered.any()
    assert decode_exact(array, np.zeros(array.window, np.int64)).answered.all()


def test_a_key_says_whose_array(array):
    _, _, windows = views(array, array.window, 1)
    name = "one-touch" if array.rows == 63 else "large"
    keyed = decode(windows[0], profile=name, lab_key=KEY)
    published = decode(windows[0], profile=name)
    assert (keyed.row, keyed.column) != (published.row, published.column)
    with pytest.raises(DecoderError, match="the same array in every lab"):
        array_of_profile("thesis", KEY)
    with pytest.raises(LabKeyError):
        array_of_profile("one-touch", "0123")
