"""How full the array gets with mixed faces at full load, and how long placing takes.

`pytest tests/bench/test_density.py -s` prints the figures; the small array is
checked by the default tests too (tests/unit/generator/test_layout_density.py).
"""

import random
from types import SimpleNamespace

import numpy as np
import pytest

from generator.array.profiles import profile
from generator.layout.layout import lay_out
from generator.layout.occupancy import Occupancy
from generator.layout.torus import place_pieces
from generator.polyhedron import shapes

NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))


def mixed_faces(cells, seed=5):
    """Masks of rectangles, triangles, hexagons and parallelograms with `cells` cells in all."""
    choose, masks, total = random.Random(seed), [], 0
    while total < 0.999 * cells:
        kind = choose.choice(["rectangle", "triangle", "hexagon", "parallelogram"])
        if kind == "rectangle":
            mask = np.ones((choose.randint(3, 7), choose.randint(3, 7)), dtype=bool)
        elif kind == "triangle":
            n = choose.randint(4, 8)
            mask = np.add.outer(np.arange(n), np.arange(n)) < n
        elif kind == "hexagon":
            n = choose.randint(5, 8)
            square = (np.arange(n) - (n - 1) / 2) ** 2
            mask = np.add.outer(square, square) <= (n / 2) ** 2 + 0.1
        else:
            height, width = choose.randint(3, 6), choose.randint(3, 6)
            lean = np.subtract.outer(np.arange(height), np.arange(width + height - 1))
            mask = (lean <= 0) & (lean > -width)
        masks.append(mask)
        total += int(mask.sum())
    return masks


def loaded(rows, columns, turns, seed=5):
    masks = mixed_faces(rows * columns, seed)
    occupancy = Occupancy.from_cells(
        *NONE, SimpleNamespace(rows=rows, columns=columns, first=(0, 0))
    )
    spots = place_pieces(occupancy, [(mask, turns) for mask in masks])
    cells = []
    for mask, spot in zip(masks, spots, strict=True):
        if spot is not None:
            r, c = np.nonzero(np.rot90(mask, spot.quarter))
            cells.append(((r + spot.row) % rows, (c + spot.column) % columns))
    full = occupancy.with_cells(*(np.concatenate(part) for part in zip(*cells, strict=True)))
    assert full.used == sum(len(part[0]) for part in cells)
    return full.density


@pytest.mark.parametrize("turns", [(0,), (0, 1, 2, 3)], ids=["no-turns", "turns"])
@pytest.mark.parametrize(
    ("rows", "columns", "least"),
    [(63, 65, 0.88), (127, 129, 0.90), (255, 257, 0.90), (51, 1285, 0.90)],
)
def test_density(benchmark, rows, columns, least, turns):
    density = benchmark.pedantic(loaded, (rows, columns, turns), rounds=1)
    benchmark.extra_info["density"] = round(density, 3)
    print(f"{rows}x{columns} turns {turns}: density {density:.3f}")
    assert density >= (least if len(turns) > 1 else least - 0.05)


def test_cube_in_an_empty_63x65(benchmark):
    occupancy = Occupancy.from_cells(*NONE, SimpleNamespace(rows=63, columns=65, first=(0, 0)))
    pieces = [(np.ones((8, 8), dtype=bool), (0, 1, 2, 3))] * 6
    assert None not in benchmark(place_pieces, occupancy, pieces)


def test_layout_of_the_60_mm_cube(benchmark):
    solid, array = shapes.cube(60.0), profile("one-touch").array()
    clearances = [[np.full(len(loop), 1.0) for loop in face.loops] for face in solid.faces]
    layout = benchmark(lay_out, solid, array, 7.0, 2.7, clearances, NONE)
    assert sum(len(face.rows) for face in layout.faces) == 384
