"""Level "layer": a one-piece pad between a rigid plate and a surface. Thesis 4.2.

Surface + sensor + touch -> force on each tactel and the plate's pose. The pad is an elastic
layer bonded to the matrix, at small strain and without friction on top; it ends with the
matrix (see `layer_influence` for what that costs near its edge). Heights are sampled where
they can matter (`layer_patch`), contact is found by an active set (`layer_active_set`).

Small strain is the model's limit: beyond a mean indentation of half the pad's height the
touch is refused, as is a plate that turns by more than 20 degrees.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Contact, Touch
from probe.contact.layer_active_set import Pressed, equilibrium
from probe.contact.layer_descent import descended
from probe.contact.layer_influence import influence
from probe.contact.layer_kernel import layer_compliance
from probe.contact.layer_patch import Patch, centres_mm, neighbours, patch_under
from probe.contact.layer_solve import Plate, plate_of, pressure_image
from probe.contact.neo_hooke import Linear
from probe.contact.plate import load_of, rest
from probe.errors import ContactError
from probe.sensor import Sensor
from probe.surface.contract import Surface

Array = NDArray[np.float64]

STEEPEST_RAD = 0.35  #: tilts beyond are not small
DEEPEST = 0.5  #: mean indentation, of the pad's height, beyond which strains are not small
THINNEST = 1.5  #: points in touch per cell, on the mean, below which a cover is chance
_FEW = 8  # cells in touch, from which on THINNEST is asked
_MARGIN = 0.5  # of the foreseen indentation, further down which cells are sampled in full


def layer(
    surface: Surface,
    sensor: Sensor,
    touch: Touch,
    *,
    cells_per_tactel: int = 4,
    samples: int = 16,
) -> Contact:
    """Press a one-piece pad on a surface.

    Parameters
    ----------
    surface
        Heights in the surface frame.
    sensor
        Its overlay must be a pad.
    touch
        Pose, force and wrist. No force gives an exactly zero image.
    cells_per_tactel
        Cells along the side of a tactel; 4 gives the tactels to 0.3 %.
    samples
        Points in each cell that can touch: 16, 64 or 256.

    Returns
    -------
    Contact
        Forces (rows, columns) in N, which sum to the touch's force.

    Raises
    ------
    ContactError
        For an overlay that is no pad, nothing under the sensor, a plate that tips or turns by
        more than is small, an indentation beyond small strain, strokes too thin to be sampled,
        a force that is negative or no number, heights that are no numbers.
    """
    grid = influence(sensor, cells_per_tactel)
    if touch.force_n == 0:
        return _untouched(sensor, touch)
    return press_patch(patch_under(surface, grid, touch, samples), touch)


def press_patch(patch: Patch, touch: Touch) -> Contact:
    """Press the pad on a patch; x, y and theta of the touch are those of the patch.

    For many forces and tilts at one place: the surface is not asked again where it is known.
    Parameters, returned value and errors as for `layer`.
    """
    sensor = patch.grid.sensor
    place = (touch.x_mm, touch.y_mm, touch.theta_rad)
    if place != (patch.touch.x_mm, patch.touch.y_mm, patch.touch.theta_rad):
        raise ContactError(
            "the touch stands elsewhere than the patch",
            fix="make the patch with the touch's x, y and theta",
        )
    if touch.force_n == 0:
        return _untouched(sensor, touch)
    plate = plate_of(touch, sensor.reach_mm)
    patch, first = _foreseen(patch, touch)
    pressed = equilibrium(patch, plate, first)
    if not pressed.converged:
        pressed = descended(pressed, plate)
    _refuse(pressed, plate)
    z, turn_x, turn_y = pressed.plate
    return Contact(
        forces_n=patch.grid.base_forces_n(pressure_image(pressed.patch, pressed.pressures)),
        z_mm=float(z),
        tilt_x_rad=float(turn_x / plate.reach_mm),
        tilt_y_rad=float(turn_y / plate.reach_mm),
        level="layer",
        iterations=pressed.iterations,
    )


def _foreseen(patch: Patch, touch: Touch) -> tuple[Patch, Array]:
    """Return the patch sampled where it can touch, and about where the plate comes to rest.

    The plate is put on springs that do not know of each other: about what a stroke of one
    tactel's width feels.
    """
    grid, pad = patch.grid, patch.grid.sensor.overlay
    highest = patch.highest_mm
    matter = np.flatnonzero(highest > -math.inf)
    wave = np.array(2 / grid.sensor.pitch_mm)
    compliance = layer_compliance(
        wave, height_mm=pad.height_mm, young_mpa=pad.young_mpa, poisson=pad.poisson
    )
    springs = Linear(grid.dx_mm**2 / float(compliance))
    points = centres_mm(grid)
    found = rest(points[matter], highest[matter], springs, load_of(touch), tolerance=1e-6)
    pose, reach = found.pose, grid.sensor.reach_mm
    depth = highest - pose.heights_mm(points)
    near = neighbours(depth > -_MARGIN * depth.max(), grid)
    b = np.array([pose.z_mm, pose.tilt_x_rad * reach, pose.tilt_y_rad * reach])
    return patch.with_cells(np.flatnonzero(near)), b


def _refuse(pressed: Pressed, plate: Plate) -> None:
    """Refuse what lies beyond the model."""
    patch = pressed.patch
    pad = patch.grid.sensor.overlay
    turn = float(np.abs(pressed.plate[1:]).max()) / plate.reach_mm
    if turn > STEEPEST_RAD:
        raise ContactError(
            f"the plate tips: it comes to rest at a tilt of {math.degrees(turn):.3g} degrees, "
            f"beyond {math.degrees(STEEPEST_RAD):.3g}",
            fix="move the sensor, press with less force, or take a stiffer wrist",
        )
    many = pressed.touching.sum(axis=0)
    cells = int((many > 0).sum())
    if cells >= _FEW and many.sum() < THINNEST * cells:
        raise ContactError(
            f"of {len(pressed.touching)} points in a cell of {patch.grid.dx_mm:.3g} mm only "
            f"{many.sum() / cells:.2g} are in touch on the mean: the strokes are too thin to be "
            "felt by their true width",
            fix="take more cells per tactel or more samples per cell, or a wider stroke",
        )
    sunk = patch.grid.sunk_mm(pressure_image(patch, pressed.pressures)).ravel()[patch.cells]
    mean = float(sunk @ pressed.pressures / pressed.pressures.sum())
    if mean > DEEPEST * pad.height_mm:
        raise ContactError(
            f"{plate.force_n:g} N press the pad of {pad.height_mm:g} mm in by {mean:.3g} mm on "
            f"the mean, beyond {DEEPEST * pad.height_mm:g} mm strains are not small",
            fix="press with less force, on more of the surface, or take tabs",
        )


def _untouched(sensor: Sensor, touch: Touch) -> Contact:
    zeros = np.zeros((sensor.rows, sensor.columns))
    return Contact(zeros, math.inf, touch.tilt_x_rad, touch.tilt_y_rad, "layer", iterations=0)
