"""Whether the nodes of a pad's top saw the surface that lies under it.

Heights are asked at the nodes alone, so a stroke thinner than the mesh can lie between them, or
count as if it were as wide as the mesh. Once the touch is solved, lines with many points run
through the nodes, along x and along y, and find both. mm, sensor frame.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.contact.elements_line import Array
from probe.contact.heights import heights_at
from probe.contact.settings import ELEMENT_SIGHT
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Value = TypeVar("Value", np.float64, np.bool_)


def refuse_unseen(
    surface: HeightMap,
    touch: Touch,
    lines: tuple[Array, Array],
    heights_mm: Array,
    top_mm: Array,
    bears: NDArray[np.bool_],
    slack_mm: float,
) -> None:
    """Refuse a touch whose strokes are too thin for the mesh.

    Parameters
    ----------
    lines
        (mx,) and (my,) coordinates of the nodes, ascending.
    heights_mm
        (mx, my) of the surface at the nodes.
    top_mm
        (mx, my) of the pressed top at the nodes.
    bears
        (mx, my) nodes that bear a force.
    slack_mm
        Strokes that stand out by less are roughness.

    Raises
    ------
    ContactError
        When something lies between the nodes, or a node bears for a thinner stroke.
    """
    x, y = lines
    for along, across, swapped in ((x, y, False), (y, x, True)):
        rows = np.arange(across.size)[:: -(-across.size // ELEMENT_SIGHT.lines)]
        seen, top = ((grid if swapped else grid.T)[rows] for grid in (heights_mm, top_mm))
        bearing = (bears if swapped else bears.T)[rows]
        fine = _places(along)
        points = np.stack(np.meshgrid(fine, across[rows]), axis=-1)
        asked = points[..., ::-1] if swapped else points
        found = heights_at(surface, touch, asked)
        after = np.searchsorted(along, fine)
        # What a node beside it bears is no more than an edge that is not on a line of the mesh.
        around = _neighbour_maximum(top)
        hidden = found > np.maximum(around[:, after - 1], around[:, after]) + slack_mm
        # A node that stands out of both of its neighbours has at least its place's share there.
        beside = np.pad(seen, ((0, 0), (1, 1)), constant_values=-np.inf)
        lower = np.maximum(beside[:, :-2], beside[:, 2:])
        ridge = bearing & (seen > lower + slack_mm)
        nearest = np.searchsorted((along[1:] + along[:-1]) / 2, fine)
        starts = np.searchsorted(nearest, np.arange(along.size))
        half = np.where(np.isfinite(lower), (lower + seen) / 2, lower)
        there = np.add.reduceat(found > half[:, nearest], starts, axis=1)
        full = there >= ELEMENT_SIGHT.covered * np.diff(np.append(starts, fine.size))
        thin = ridge & ~full & ~_neighbour_maximum(bearing & full)
        if hidden.any() or thin.any():
            height = found[hidden].max() if hidden.any() else seen[thin].max()
            raise ContactError(
                f"strokes that rise to {height:.4g} mm are too thin for a mesh with nodes "
                f"{np.diff(along).max():.2g} mm apart",
                fix="give the strokes' walls_mm, more elements per_tactel, or take level layer",
            )


def _places(along: Array) -> Array:
    """Return points along a line of nodes, several around each, ascending, ends left out."""
    parts = np.clip(
        np.ceil(np.diff(along) / ELEMENT_SIGHT.step_mm), 4, ELEMENT_SIGHT.points // along.size
    ).astype(int)
    return np.concatenate(
        [
            a + (b - a) * (np.arange(n) + 0.5) / n
            for a, b, n in zip(along[:-1], along[1:], parts, strict=True)
        ]
    )


def _neighbour_maximum(rows: NDArray[Value]) -> NDArray[Value]:
    """Return the largest of each value and those in the rows before and after it."""
    found = rows.copy()
    np.maximum(found[1:], rows[:-1], out=found[1:])
    np.maximum(found[:-1], rows[1:], out=found[:-1])
    return found
