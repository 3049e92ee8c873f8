"""Parts made to be mistaken for registered ones: what is drawn, and what a reader must see."""

import numpy as np
import pytest

from probe.simulate.registered import registered_surface
from probe.simulate.world.surfaces import exchange_symbols, seat_panel, seats_of
from probe.surface.polygon import polygon

SQUARE = polygon([np.array([[0.0, 0], [60, 0], [60, 60], [0, 60]])])
OBLONG = polygon([np.array([[0.0, 0], [60, 0], [60, 40], [0, 40]])])


@pytest.fixture(scope="module")
def lab_database(make_lab):
    return str(make_lab("{name: Cube, shape: {cube: 60 mm}, profile: one-touch}") / "lab.db")


@pytest.mark.parametrize(
    ("seat", "panel", "ways"), [(SQUARE, SQUARE, 4), (OBLONG, OBLONG, 2), (SQUARE, OBLONG, 0)]
)
def test_a_panel_fills_a_seat_in_as_many_ways_as_it_looks_alike(seat, panel, ways):
    found = seats_of(seat, panel)
    assert len(found) == ways
    for place in found:
        inside = place.into(seat.starts)
        assert panel.contains(0.99 * (inside - panel.starts.mean(0)) + panel.starts.mean(0)).all()


def test_a_panel_in_another_seat_has_its_own_symbols(lab_database):
    seat, panel = (registered_surface(lab_database, "Cube", face) for face in ("F1", "F2"))
    points = np.random.default_rng(0).uniform(5, 55, (400, 2))
    for place in seats_of(seat.region, panel.region):
        there = seat_panel(seat.surface, panel.surface, place).heights_mm(points)
        assert there == pytest.approx(panel.surface.heights_mm(place.into(points)), abs=1e-9)
        assert not np.allclose(there, seat.surface.heights_mm(points))


def test_exchanged_symbols_are_others_and_no_more(lab_database):
    scene = registered_surface(lab_database, "Cube", "F1")
    held = scene.surface.lattice
    at = np.array([[30.0, 30.0], [12.0, 40.0]])
    rows, columns = held.cells_at(at)
    labels = (held.label_at(rows, columns) + 1) % 4
    found = exchange_symbols(scene.surface, at, labels).lattice
    assert found.label_at(rows, columns).tolist() == labels.tolist()
    everywhere = [grid.ravel() for grid in np.indices((16, 16))]
    differ = found.label_at(*everywhere) != held.label_at(*everywhere)
    assert differ.sum() <= 2
