"""Heights as a mesh of few triangles: no height missed by more than asked, no crack."""

from __future__ import annotations

import numpy as np
import pytest

from probe.errors import SurfaceError
from probe.surface.body import close_below, manifold_from, mesh_heights
from probe.surface.mesh import mesh

STEP, BOTTOM = 0.1, -9.0


def scene(cells, rng):
    """Return heights with spikes, a slope and a step: nothing that a mesh could do at once."""
    heights = rng.normal(size=(cells + 1, cells + 1)) * (rng.random((cells + 1, cells + 1)) < 0.05)
    heights += np.linspace(0, 0.3, cells + 1)
    heights[cells // 4 : cells // 2, cells // 3 :] += 1.0
    return heights


def missed(heights, triangles):
    """Return the largest error of the mesh at the places within the grid."""
    corners, faces = close_below(heights, triangles, STEP, BOTTOM)
    cells = len(heights) - 1
    at = STEP * (np.arange(cells + 1) - cells / 2)
    points = np.stack(np.meshgrid(at, at), axis=-1)[1:-1, 1:-1].reshape(-1, 2)
    found = mesh(corners[faces]).heights_mm(points).reshape(cells - 1, cells - 1)
    return float(np.abs(found - heights[1:-1, 1:-1]).max())


@pytest.mark.parametrize("cells", [2, 8, 32])
@pytest.mark.parametrize("tolerance", [0.0, 0.05, 0.5])
def test_no_height_is_missed_by_more_than_the_tolerance(cells, tolerance):
    heights = scene(cells, np.random.default_rng([5, cells]))
    triangles = mesh_heights(heights, tolerance)
    assert missed(heights, triangles) <= tolerance + 1e-9
    assert len(triangles) <= 2 * cells**2


def test_a_tolerance_is_used():
    heights = scene(32, np.random.default_rng(5))
    counts = [len(mesh_heights(heights, t)) for t in (0.0, 0.1, 0.5, 9.0)]
    assert counts[0] > counts[1] > counts[2] > counts[3] == 2
    assert missed(heights, mesh_heights(heights, 0.5)) > 0.25


def test_a_slope_is_two_triangles_and_a_corner_of_it_a_few():
    row, column = np.indices((17, 17)).astype(float)
    assert len(mesh_heights(0.3 * row - 0.2 * column, 1e-9)) == 2
    raised = np.zeros((17, 17))
    raised[0, 0] = 1.0
    # Halved from the whole square down to the smallest triangle at that corner, and no further.
    assert len(mesh_heights(raised, 0.1)) == 2 + 2 * 8


@pytest.mark.parametrize("tolerance", [0.0, 0.2])
def test_the_body_is_closed_and_holds_what_lies_below_the_heights(tolerance):
    heights = scene(16, np.random.default_rng(8))
    triangles = mesh_heights(heights, tolerance)
    body = manifold_from(*close_below(heights, triangles, STEP, BOTTOM))  # refuses cracks
    side = heights.ravel()[triangles].mean(axis=1)
    at = np.stack([triangles % 17, triangles // 17], axis=-1) * STEP
    (x1, y1), (x2, y2) = ((at[:, k] - at[:, 0]).T for k in (1, 2))
    area = (x1 * y2 - x2 * y1) / 2
    assert (area > 0).all()
    assert area.sum() == pytest.approx((16 * STEP) ** 2)
    assert body.volume() == pytest.approx(float((area * (side - BOTTOM)).sum()), rel=1e-5)
    box = body.bounding_box()
    assert box[:3] == pytest.approx((-0.8, -0.8, BOTTOM))
    assert box[3:5] == pytest.approx((0.8, 0.8))


@pytest.mark.parametrize("shape", [(9, 5), (2, 2), (13, 13)])
def test_other_grids_are_refused(shape):
    with pytest.raises(SurfaceError, match="power of two"):
        mesh_heights(np.zeros(shape), 0.1)
