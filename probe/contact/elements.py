"""Level "elements": the one-piece pad by finite elements in space, its edge included. Thesis 4.2.

The independent check of level "layer", and the level for the pad's free sides, which a layer
without end leaves out. Small strain; the surface is rigid and without friction. A pad is
condensed once (`elements_pad`), kept in memory, and serves every further touch.

Heights are sampled at the nodes of the top, half an element apart: where a surface has walls,
give their places as `walls_mm`, so that lines of the mesh lie there; otherwise an edge counts
as if it stood at the next node. A stroke thinner than the mesh can lie between nodes, or count as
if it were as wide as the mesh. Once the touch is solved, lines with many points run through the
nodes, along x and along y, and find both; such strokes are refused. mm, sensor frame.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import STEEPEST_RAD, Contact, Touch, heights_at
from probe.contact.elements_pad import Array, CondensedPad, PadLines, condense
from probe.contact.elements_unilateral import rest, tips
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Value = TypeVar("Value", np.float64, np.bool_)

KEPT = 2  # condensed pads
ROUGH = 0.25  # of the deepest point: strokes between the nodes that rise less are accepted
GROWTH = 1.5  # from element to element of the margin
WALL_LINES = 0.15  # of an element: from a wall to the lines next to it
NEAR = 0.1  # of an element: no two lines are as near as that, but walls and tactels
TINY = 1e-6  # of an element: the same place
FINER = 1.6  # elements get thinner towards the top, by this power
SIGHT_STEP_MM = 0.01  # between the points of a line, the thinnest stroke that a face can carry
SIGHT_POINTS = 4000  # of a line, at most
SIGHT_LINES = 70  # each way, at most
COVERED = 0.25  # of the place of a node that bears alone: less is not the node's to bear


def elements(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    *,
    per_tactel: int = 2,
    layers: int = 3,
    margin_mm: float = 0.0,
    walls_mm: tuple[ArrayLike, ArrayLike] = ((), ()),
    memory_gb: float = 4.0,
) -> Contact:
    """Press a one-piece pad on a surface.

    Parameters
    ----------
    surface
        Heights in the surface frame.
    sensor
        Its overlay must be a pad.
    touch
        Pose, force and wrist.
    per_tactel, layers
        Quadratic elements along a tactel, and through the pad.
    margin_mm
        How far the pad reaches beyond the matrix, on each side; 0: the sides are free there.
    walls_mm
        Places |x| and |y|, sensor frame, where more lines of the mesh are wanted.
    memory_gb
        What condensing the pad may take at most.

    Returns
    -------
    Contact
        Force on each tactel: the stress at the pad's base over the tactel's square.

    Raises
    ------
    ContactError
        For an overlay that is no pad, a mesh that is too large, a force that is negative or no
        number, nothing under the pad, strokes too thin for the mesh, a plate that tips, a tilt
        that is not small, or a surface that would go through the pad.
    """
    _check_touch(sensor, touch)
    pad = condensed_pad(sensor, per_tactel, layers, margin_mm, walls_mm, memory_gb)
    nodes = pad.nodes_mm
    heights = heights_at(surface, touch, nodes)
    height = sensor.overlay.height_mm
    if touch.force_n == 0:
        empty = np.zeros((sensor.rows, sensor.columns))
        return Contact(empty, np.inf, touch.tilt_x_rad, touch.tilt_y_rad, "elements", 0)
    lines, grid = (pad.x, pad.y), (pad.x.size, pad.y.size)
    if not np.isfinite(heights).any():
        low = heights.reshape(grid)
        refuse_unseen(surface, touch, lines, low, low, np.zeros(grid, dtype=bool), 0.0)
    found = rest(nodes, heights, pad.between, pad.displaced, touch, height / 50)
    z, tilt_x, tilt_y = (float(v) for v in found.plate)
    if max(abs(tilt_x), abs(tilt_y)) > STEEPEST_RAD:
        raise tips()
    sunk = pad.displaced(found.forces)
    deepest = float(sunk.max())
    top = sunk + z + tilt_x * nodes[:, 1] - tilt_y * nodes[:, 0]
    bears = found.forces.reshape(grid) > 0
    refuse_unseen(
        surface,
        touch,
        lines,
        heights.reshape(grid),
        top.reshape(grid),
        bears,
        ROUGH * deepest,
    )
    if deepest >= height:
        raise ContactError(
            f"{touch.force_n:g} N press the surface {deepest:.3g} mm into a pad of {height:g} mm",
            fix="press with less force, or on more of the surface",
        )
    base = pad.base_forces(found.forces)
    pressed = np.maximum(base, 0.0)  # far from the contact the base pulls a little
    pressed *= base.sum() / pressed.sum()
    return Contact(pressed, z, tilt_x, tilt_y, "elements", found.iterations)


def condensed_pad(
    sensor: SensorType,
    per_tactel: int = 2,
    layers: int = 3,
    margin_mm: float = 0.0,
    walls_mm: tuple[ArrayLike, ArrayLike] = ((), ()),
    memory_gb: float = 4.0,
) -> CondensedPad:
    """Return the pad of a sensor, from memory if it has been there; parameters as `elements`."""
    walls = tuple(tuple(np.unique(np.abs(np.asarray(w, float))).tolist()) for w in walls_mm)
    return _condense(sensor, per_tactel, layers, float(margin_mm), walls[0], walls[1], memory_gb)


@lru_cache(maxsize=KEPT)
def _condense(
    sensor: SensorType,
    per_tactel: int,
    layers: int,
    margin_mm: float,
    walls_x: tuple[float, ...],
    walls_y: tuple[float, ...],
    memory_gb: float,
) -> CondensedPad:
    if per_tactel < 1 or layers < 1 or not 0 <= margin_mm < np.inf:
        raise ContactError(
            f"{per_tactel} elements on a tactel, {layers} layers, margin {margin_mm:g} mm; at "
            "least one element both ways, and a margin of 0 mm or more",
            fix="take per_tactel=2, layers=3, margin_mm=0",
        )
    overlay, pitch = sensor.overlay, sensor.pitch_mm
    lines = PadLines(
        _element_boundaries(sensor.columns, pitch, per_tactel, margin_mm, walls_x),
        _element_boundaries(sensor.rows, pitch, per_tactel, margin_mm, walls_y),
        overlay.height_mm * (1 - (1 - np.linspace(0, 1, layers + 1)) ** FINER),
    )
    tactels = ((sensor.rows + 1) // 2) * ((sensor.columns + 1) // 2)
    needed = lines.bytes_needed(tactels) / 1e9
    if needed > memory_gb:
        raise ContactError(
            f"the pad would take {needed:.3g} GB ({lines.unknowns} unknowns on a quarter, "
            f"{lines.top_nodes} nodes on its top), allowed are {memory_gb:g} GB",
            fix="take fewer elements per tactel or layers, or raise memory_gb",
        )
    edges = _edges(sensor.columns, pitch), _edges(sensor.rows, pitch)
    return condense(lines, overlay.young_mpa, overlay.poisson, edges)


def _edges(tactels: int, pitch: float) -> Array:
    return np.asarray((np.arange(tactels + 1) - tactels / 2) * pitch, dtype=np.float64)


def _element_boundaries(
    tactels: int, pitch: float, per_tactel: int, margin: float, walls: tuple[float, ...]
) -> Array:
    """Return element boundaries from 0 to the pad's edge: tactels divided, margin, walls."""
    edges = _edges(tactels, pitch)
    firm = np.unique(np.append(edges[edges >= 0], 0.0))
    parts = np.ceil(np.diff(firm) / pitch * per_tactel - 1e-9).astype(int)
    lines: Array = np.interp(
        np.arange(parts.sum() + 1), np.concatenate([[0], np.cumsum(parts)]), firm
    )
    size = pitch / per_tactel
    if margin > 0:
        count = max(
            1,
            math.ceil(math.log1p(margin / size * (GROWTH - 1)) / math.log(GROWTH)),
        )
        steps = np.cumsum(GROWTH ** np.arange(count))
        lines = np.concatenate([lines, lines[-1] + margin * steps / steps[-1]])
    walls = tuple(w for w in walls if 0 < w < lines[-1])
    firm = np.concatenate([firm, walls, lines[-1:]])
    for wall in walls:  # a line there, in place of one too near, and one close by on each side
        apart = np.abs(lines - wall) > NEAR * size
        held = (np.abs(lines[:, None] - firm) <= TINY * size).any(axis=1)
        lines = np.append(lines[apart | held], wall)
        for near in (wall - WALL_LINES * size, wall + WALL_LINES * size):
            if 0 < near < lines.max() and np.abs(lines - near).min() > NEAR * size:
                lines = np.append(lines, near)
    lines = np.sort(lines)
    return np.asarray(lines[np.append(True, np.diff(lines) > TINY * size)])


def _check_touch(sensor: SensorType, touch: Touch) -> None:
    overlay = sensor.overlay
    if overlay.kind != "pad":
        raise ContactError(
            f"level elements presses a one-piece pad, the overlay is of kind {overlay.kind!r}",
            fix="take level tabs, or an overlay of kind 'pad'",
        )
    if not (
        0 < overlay.height_mm < math.inf
        and 0 < overlay.young_mpa < math.inf
        and 0 <= overlay.poisson <= 0.5
    ):
        raise ContactError(
            f"a pad of {overlay.height_mm:g} mm, E = {overlay.young_mpa:g} MPa, "
            f"nu = {overlay.poisson:g}; height and E must be above 0, nu in 0 ... 0.5",
            fix="correct the overlay",
        )
    wrist = touch.wrist
    numbers = (touch.x_mm, touch.y_mm, touch.theta_rad, touch.tilt_x_rad, touch.tilt_y_rad)
    if not all(math.isfinite(v) for v in numbers):
        raise ContactError("the pose of the touch is no number", fix="give finite mm and rad")
    for name, value in (
        ("force", touch.force_n),
        ("tilt stiffness about x", wrist.tilt_x_nmm_rad),
        ("tilt stiffness about y", wrist.tilt_y_nmm_rad),
    ):
        if not 0 <= value < math.inf:
            raise ContactError(
                f"the {name} is {value:g}, it must be 0 or more, and finite",
                fix="correct the touch",
            )


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
        rows = np.arange(across.size)[:: -(-across.size // SIGHT_LINES)]
        seen, top = ((grid if swapped else grid.T)[rows] for grid in (heights_mm, top_mm))
        bearing = (bears if swapped else bears.T)[rows]
        fine = _places(along)
        points = np.stack(np.meshgrid(fine, across[rows]), axis=-1)
        asked = points[..., ::-1] if swapped else points
        found = heights_at(surface, touch, asked)
        after = np.searchsorted(along, fine)
        # A neighbouring node bears no more than an edge that is not on a line of the mesh.
        around = _neighbour_maximum(top)
        hidden = found > np.maximum(around[:, after - 1], around[:, after]) + slack_mm
        # A node that stands out of both of its neighbours has at least its place's share there.
        near = np.pad(seen, ((0, 0), (1, 1)), constant_values=-np.inf)
        lower = np.maximum(near[:, :-2], near[:, 2:])
        ridge = bearing & (seen > lower + slack_mm)
        nearest = np.searchsorted((along[1:] + along[:-1]) / 2, fine)
        starts = np.searchsorted(nearest, np.arange(along.size))
        half = np.where(np.isfinite(lower), (lower + seen) / 2, lower)
        there = np.add.reduceat(found > half[:, nearest], starts, axis=1)
        full = there >= COVERED * np.diff(np.append(starts, fine.size))
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
    parts = np.clip(np.ceil(np.diff(along) / SIGHT_STEP_MM), 4, SIGHT_POINTS // along.size).astype(
        int
    )
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
