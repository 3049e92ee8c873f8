"""Mixed faces at full load on the default array: at least 0.88 of it is used."""

from types import SimpleNamespace

import numpy as np
import pytest

from generator.layout.occupancy import Occupancy
from generator.layout.torus import cells_at, place_pieces

KINDS = {
    "rectangle": lambda a, b: np.ones((a, b), dtype=bool),
    "triangle": lambda a, _: np.add.outer(np.arange(a + 1), np.arange(a + 1)) <= a,
    "hexagon": lambda a, _: np.add.outer(*[np.abs(np.arange(a + 1) - a / 2)] * 2) <= 0.8 * a,
    "parallelogram": lambda a, b: np.array(
        [[row <= column < row + b for column in range(a + b)] for row in range(a)]
    ),
}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_mixed_faces_fill_the_array(seed):
    random = np.random.default_rng(seed)
    rows, columns, masks = 63, 65, []
    while sum(int(mask.sum()) for mask in masks) < rows * columns:
        kind = list(KINDS)[random.integers(4)]
        masks.append(KINDS[kind](*random.integers(3, 8, 2)))
    size = SimpleNamespace(rows=rows, columns=columns, first=(0, 0))
    occupancy = Occupancy.from_cells([], [], size)
    spots = place_pieces(occupancy, [(mask, (0, 1, 2, 3)) for mask in masks])
    for mask, spot in zip(masks, spots, strict=True):
        if spot is not None:
            before = occupancy.used
            occupancy = occupancy.with_cells(*cells_at(mask, spot, rows, columns))
            assert occupancy.used == before + mask.sum()
    assert occupancy.density >= 0.88
