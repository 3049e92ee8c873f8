"""Level "elements": the one-piece pad by finite elements in space, its edge included. Thesis 4.2.

The independent check of level "layer", and the level for what a layer without end cannot tell:
the pad's free sides. Small strain; the surface is rigid and without friction. A pad is
condensed once (`elements_pad`), kept in memory, and serves every further touch.

Heights are asked at the nodes of the top, half an element apart: where a surface has walls,
give their places as `walls_mm`, so that lines of the mesh lie there; otherwise an edge counts
as if it stood at the next node. Strokes that the nodes miss, or are too wide for, are refused
(`elements_seen`).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch
from probe.contact.elements_line import Array
from probe.contact.elements_pad import CondensedPad, PadLines, condense
from probe.contact.elements_seen import refuse_unseen
from probe.contact.elements_unilateral import rest, tips
from probe.contact.heights import heights_at
from probe.contact.settings import CONTACT, ELEMENTS
from probe.errors import ContactError
from probe.surface.contract import HeightMap


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
    if max(abs(tilt_x), abs(tilt_y)) > CONTACT.steepest_rad:
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
        ELEMENTS.rough * deepest,
    )
    if deepest >= height:
        raise ContactError(
            f"{touch.force_n:g} N press the surface {deepest:.3g} mm into a pad of {height:g} mm",
            fix="press with less force, or on more of the surface",
        )
    felt = pad.felt(found.forces)
    pressed = np.maximum(felt, 0.0)  # far from the contact the base pulls a little: nobody feels it
    pressed *= felt.sum() / pressed.sum()
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


@lru_cache(maxsize=ELEMENTS.kept)
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
        overlay.height_mm * (1 - (1 - np.linspace(0, 1, layers + 1)) ** ELEMENTS.finer),
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
            math.ceil(
                math.log1p(margin / size * (ELEMENTS.growth - 1)) / math.log(ELEMENTS.growth)
            ),
        )
        steps = np.cumsum(ELEMENTS.growth ** np.arange(count))
        lines = np.concatenate([lines, lines[-1] + margin * steps / steps[-1]])
    walls = tuple(w for w in walls if 0 < w < lines[-1])
    firm = np.concatenate([firm, walls, lines[-1:]])
    for wall in walls:  # a line there, in place of one too near, and one close by on each side
        apart = np.abs(lines - wall) > ELEMENTS.near * size
        held = (np.abs(lines[:, None] - firm) <= ELEMENTS.tiny * size).any(axis=1)
        lines = np.append(lines[apart | held], wall)
        for beside in (wall - ELEMENTS.beside * size, wall + ELEMENTS.beside * size):
            if 0 < beside < lines.max() and np.abs(lines - beside).min() > ELEMENTS.near * size:
                lines = np.append(lines, beside)
    lines = np.sort(lines)
    return np.asarray(lines[np.append(True, np.diff(lines) > ELEMENTS.tiny * size)])


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
