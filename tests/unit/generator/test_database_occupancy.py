"""Taken cells as bits: the same cells come back, wherever on the array."""

import numpy as np
import pytest
from sqlalchemy import func, insert, select

from generator.database import tables
from generator.database.cells import free_cells, occupied_cells, take_cells
from generator.database.open import open_database
from generator.database.transaction import read_transaction, write_transaction
from generator.layout.occupancy import TILE

PLACES = {
    "corner": (np.array([0, 0, 63, 64, 127]), np.array([0, 64, 63, 64, 0])),
    "far": (np.array([0, 2**62, 2**63 - 2]), np.array([2**63 - 2, 5, 2**63 - 2])),
    "none": (np.empty(0, np.int64), np.empty(0, np.int64)),
    "many": tuple(np.unravel_index(np.random.default_rng(2).permutation(200 * 300)[:9000],
                                   (200, 300))),
}  # fmt: skip


@pytest.fixture
def engine(lab_url):
    engine = open_database(lab_url)
    arrays = [
        {"definition": "{}", "definition_sha256": str(k), "profile": "p", "rows": 2**63 - 1,
         "columns": 2**63 - 1, "window_rows": 3, "window_columns": 2, "order": 4}
        for k in range(2)
    ]  # fmt: skip
    with write_transaction(engine) as connection:
        connection.execute(insert(tables.arrays), arrays)
    return engine


def listed(cells):
    return list(zip(*(part.tolist() for part in cells), strict=True))


@pytest.mark.parametrize("place", PLACES)
def test_cells_come_back_sorted(engine, place):
    cells = PLACES[place]
    with write_transaction(engine) as connection:
        take_cells(connection, 1, cells)
    with read_transaction(engine) as connection:
        assert listed(occupied_cells(connection, 1)) == sorted(listed(cells))
        assert listed(occupied_cells(connection, 2)) == []


def test_cells_are_added_and_freed_one_by_one(engine):
    chance = np.random.default_rng(7)
    held = set()
    for _ in range(12):
        some = chance.integers(0, 150, (2, 40))
        cells = set(listed(some))
        with write_transaction(engine) as connection:
            if chance.random() < 0.6:
                take_cells(connection, 1, tuple(some))
                held |= cells
            else:
                free_cells(connection, 1, tuple(some))
                held -= cells
        with read_transaction(engine) as connection:
            assert listed(occupied_cells(connection, 1)) == sorted(held)


def test_a_block_of_cells_is_few_rows(engine):
    block = tuple(index.ravel() for index in np.mgrid[10 : 10 + 4 * TILE, 0 : 4 * TILE])
    with write_transaction(engine) as connection:
        take_cells(connection, 1, block)
    with read_transaction(engine) as connection:
        count = connection.execute(select(func.count()).select_from(tables.occupancy)).scalar_one()
        assert count == 20
        assert len(occupied_cells(connection, 1)[0]) == 16 * TILE**2
