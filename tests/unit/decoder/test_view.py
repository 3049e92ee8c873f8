"""What a view can do, against the figures measured for the thesis's and the robust array."""

import numpy as np
import pytest

from decoder import strength, strength_of_window
from generator.array import array_from, profile
from generator.errors import ArrayError

ROBUST = array_from({"family": "prba", "polynomial": "0x1655", "rows": 63, "columns": 65})


@pytest.mark.parametrize(
    ("shape", "thesis", "robust"),
    [
        ((6, 2), 1, 1),
        ((3, 4), 0, 1),
        ((4, 4), 0, 2),
        ((4, 5), 0, 3),
        ((5, 5), 2, 5),
        ((6, 6), 6, 10),
    ],
)
def test_minimum_distances(shape, thesis, robust):
    assert strength_of_window(profile("thesis").array(), *shape).distance == thesis
    assert strength_of_window(ROBUST, *shape).distance == robust


@pytest.mark.parametrize(("side", "distance"), [(3, 2), (4, 7), (5, 12), (6, 18)])
def test_minimum_distances_over_gf4(side, distance):
    assert strength_of_window(profile("one-touch").array(), side, side).distance == distance


def test_errors_and_erasures():
    able = strength_of_window(ROBUST, 6, 6)
    assert (able.errors, able.erasures, able.identifies, able.cells) == (4, 9, True, 36)
    lost = strength(profile("thesis").array(), [0, 0], [0, 1])
    assert (lost.errors, lost.erasures, lost.identifies, lost.rank) == (0, 0, False, 2)


def test_any_set_of_cells():
    rng = np.random.default_rng(0)
    cells = np.nonzero(rng.random((7, 7)) < 0.5)
    able = strength(ROBUST, *cells)
    everywhere = np.indices((63, 65)).reshape(2, -1)
    words = ROBUST.symbols(everywhere[0][:, None] + cells[0], everywhere[1][:, None] + cells[1])
    assert able.distance == np.count_nonzero(words, axis=1).min()


def test_out_of_reach_is_said():
    array = array_from({"family": "prba", "order": 2, "degree": 48})
    with pytest.raises(ArrayError, match="out of reach"):
        strength_of_window(array, 16, 16)
