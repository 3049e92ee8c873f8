"""Level "layer": a one-piece pad between a rigid plate and a surface. Thesis 4.2.

The pad is an elastic layer bonded to the matrix, at small strain and without friction on top; it
ends with the matrix (see `layer_influence` for what that costs near its edge). Heights are sampled
where they can matter (`layer_patch`), contact is found by an active set (`layer_equilibrium`).

Small strain is the model's limit: beyond a mean indentation of half the pad's height the
touch is refused, as is a plate that turns by more than 20 degrees.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch, no_contact, refuse_steep
from probe.contact.layer_equilibrium import LayerContact, deep_mm, descend, equilibrium, plate_of
from probe.contact.layer_influence import Influence, influence, layer_compliance
from probe.contact.layer_patch import (
    DepthWindow,
    LayerPatch,
    Levels,
    centres_mm,
    levels_of,
    patch_under,
)
from probe.contact.neo_hooke import Linear
from probe.contact.plate import PlatePose, rest
from probe.errors import ContactError
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]

DEEPEST = 0.5  #: mean indentation, of the pad's height, beyond which strains are not small
THINNEST = 1.5  # points of a cell that meet a stroke, on the mean, below which that is chance
FEW = 2  # cells on a step, from which on `THINNEST` holds; one may be a sharp corner
TURNED = 0.05  # of the indentation: change by a turn across a cell that may remain
LEAST = 2e-3  # of a cell: indentations below are not resolved
PASSES = 25  # over the surface, each with the plate of the last
FARTHEST_RAD = 0.05  # turn of the plate between two passes
HELD_RAD = 1e-4  # turn in the last pass, where the plate was held


def layer(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    *,
    cells_per_tactel: int = 4,
    samples: int = 16,
) -> Contact:
    """Press a one-piece pad on a surface. No force gives an exactly zero image.

    Parameters
    ----------
    cells_per_tactel
        Along the side of a tactel; 4 gives the tactels to 0.3 %.
    samples
        Points in each cell that can touch: 16, 64 or 256.

    Raises
    ------
    ContactError
        For an overlay that is no pad, nothing under the sensor, a plate that tips or turns by
        more than is small, an indentation beyond small strain, strokes too thin to be sampled,
        a force that is negative or no number, heights that are no numbers.
    """
    grid = influence(sensor, cells_per_tactel)  # refuses overlays and numbers of cells
    if touch.force_n == 0:
        return no_contact(sensor, touch, "layer")
    patch = patch_under(surface, sensor, touch, cells_per_tactel=cells_per_tactel, samples=samples)
    pressed, pose = _find_rest(patch, grid, touch)
    return Contact(
        forces_n=grid.base_forces_n(pressed.levels.image(pressed.pressures)),
        z_mm=pose.z_mm,
        tilt_x_rad=pose.tilt_x_rad,
        tilt_y_rad=pose.tilt_y_rad,
        level="layer",
        iterations=pressed.iterations,
    )


def _find_rest(patch: LayerPatch, grid: Influence, touch: Touch) -> tuple[LayerContact, PlatePose]:
    """Return the contact and the plate at rest.

    Cells and points far below the predicted plate are left out. Those that would be run through are
    taken in, and where the plate turned the levels are computed again; cells once taken in stay, so
    the passes end. A plate that falls far over has too few levels below it: it goes a part of the
    way.
    """
    pose, depth = _predict_rest(patch, touch)
    looks: list[DepthWindow] = []
    floor = -depth
    for _ in range(PASSES):
        above = patch.highest_mm - pose.heights_mm(patch.centres_mm)
        some = above >= min(floor, float(above.max()))
        patch = patch.with_cells(np.flatnonzero(patch.neighbours(some)))
        looks.append(DepthWindow(pose, floor))
        levels = levels_of(patch, grid, looks[-1], looks[:-1])
        pressed, held = _press_levels(levels, touch)
        turn = float(np.abs(pressed.plate[1:]).max()) / levels.reach_mm
        b = min(1.0, FARTHEST_RAD / max(turn, 1e-300)) * pressed.plate
        moved = PlatePose(float(b[0]), float(b[1]) / levels.reach_mm, float(b[2]) / levels.reach_mm)
        pose = PlatePose(
            pose.z_mm + moved.z_mm,
            pose.tilt_x_rad + moved.tilt_x_rad,
            pose.tilt_y_rad + moved.tilt_y_rad,
        )
        moved_mm = moved.heights_mm(centres_mm(grid.rows, grid.columns, grid.dx_mm))
        sunk = grid.sunk_mm(levels.image(pressed.pressures)).ravel()
        missed = levels.left_out_mm > moved_mm + sunk
        depth = float(deep_mm(levels, b).max())
        enough = TURNED * max(depth / grid.dx_mm, LEAST)
        enough = min(enough, HELD_RAD) if held else min(enough, FARTHEST_RAD)
        if turn <= enough and not missed.any():
            refuse_steep(pose.tilt_x_rad, pose.tilt_y_rad)
            _refuse_thin(patch, pose, sunk.reshape(grid.rows, -1)[1:-1, 1:-1])
            _refuse_deep(pressed, sunk, depth, touch)
            return pressed, pose
        floor = min(-depth, float((levels.left_out_mm - moved_mm)[missed].min(initial=0.0)))
    refuse_steep(pose.tilt_x_rad, pose.tilt_y_rad)
    _refuse_deep(pressed, sunk, depth, touch)
    raise ContactError(
        f"the plate does not settle within {PASSES} passes over the surface",
        fix="report the scene; a stiffer wrist helps",
    )


def _press_levels(levels: Levels, touch: Touch) -> tuple[LayerContact, bool]:
    """Return the contact on these levels, and whether the plate had to be held, softly, for it."""
    plate = plate_of(touch, levels)
    pressed = equilibrium(levels, plate)
    if pressed.converged:
        return pressed, False
    return descend(pressed, plate.held(levels.reach_mm)), True


def _predict_rest(patch: LayerPatch, touch: Touch) -> tuple[PlatePose, float]:
    """Predict the plate at rest, and its depth (mm) in the pad.

    The plate is put on independent springs, as stiff as the pad under a stroke one tactel wide.
    """
    matter = np.flatnonzero(patch.highest_mm > -math.inf)
    compliance = layer_compliance(np.array(2 / patch.sensor.pitch_mm), patch.sensor.overlay)
    springs = Linear(patch.dx_mm**2 / float(compliance))
    points, heights = patch.centres_mm[matter], patch.highest_mm[matter]
    pose = rest(points, heights, springs, touch, tolerance=1e-6).pose
    return pose, float((heights - pose.heights_mm(points)).max())


def _refuse_deep(pressed: LayerContact, sunk_mm: Array, deepest_mm: float, touch: Touch) -> None:
    """Refuse strains that are not small."""
    height = pressed.levels.grid.sensor.overlay.height_mm
    p = pressed.pressures
    mean = float(sunk_mm[pressed.levels.cells] @ p / p.sum())
    if mean > DEEPEST * height:
        raise ContactError(
            f"{touch.force_n:g} N press the pad of {height:g} mm in by {mean:.3g} mm on the "
            f"mean, beyond {DEEPEST * height:g} mm strains are not small",
            fix="press with less force, on more of the surface, or take tabs",
        )
    if deepest_mm > height:
        raise ContactError(
            f"{touch.force_n:g} N press the surface {deepest_mm:.3g} mm into a pad of "
            f"{height:g} mm",
            fix="press with less force, on more of the surface, or take tabs",
        )


def _refuse_thin(patch: LayerPatch, pose: PlatePose, sunk_mm: Array) -> None:
    """Refuse strokes whose cover is chance: met by one point of a cell here and there.

    Counted are cells in touch and on a step: points stand out by more than points are apart. What
    is less steep than 45 degrees is no step, however few points it touches.
    """
    samples = len(patch.heights_mm)
    free = pose.heights_mm(patch.centres_mm) + sunk_mm.ravel()
    heights = patch.heights_mm[:, (patch.heights_mm > free[patch.cells]).any(axis=0)]
    apart = patch.dx_mm / math.sqrt(samples)
    many = np.count_nonzero(heights > heights.max(axis=0) - apart, axis=0)
    many = many[many < samples]
    if len(many) >= FEW and many.sum() < THINNEST * len(many):
        raise ContactError(
            f"of {samples} points in a cell of {patch.dx_mm:.3g} mm only {many.mean():.2g} meet "
            "the strokes, on the mean: they are too thin to be felt by their true width",
            fix="take more cells per tactel or more samples per cell, or a wider stroke",
        )
