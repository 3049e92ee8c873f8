"""What a pad feels of symbols: the layer model pressed on them, once for a style.

A pad carries what it feels farther than a cell, and bridges what stands close together, so
its response is no blur of the symbol alone. Each symbol is pressed among others by
`probe.contact.layer`, on tactels far finer than the real ones; what its own cell passes on
is kept. Thesis 4.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import Alphabet, SymbolStyle
from probe.contact.contract import Touch, WristStiffness
from probe.contact.layer import layer
from probe.surface.face import endless_face
from probe.surface.symbols import Relief
from recognizer.touch.settings import TemplateSettings

Array = NDArray[np.float64]

STIFF = 1e9  #: N mm / rad: the plate stays level


def pad_responses(
    alphabet: Alphabet,
    style: SymbolStyle,
    sensor: SensorType,
    axis_mm: Array,
    settings: TemplateSettings,
) -> Array:
    """Return the pressure at the base (order, n, n), 1 where it is highest, over a cell.

    Parameters
    ----------
    axis_mm
        (n,) offsets from the cell's centre, both ways; rows run upwards.
    """
    from scipy.ndimage import map_coordinates

    pitch, fine = style.pitch_mm, style.pitch_mm / settings.pad_fine
    across = settings.pad_cells * settings.pad_fine
    probe = SensorType(across, across, fine, sensor.overlay)
    side = settings.pad_cells * pitch
    force = settings.pad_light * sensor.overlay.young_mpa * side * side
    rng = np.random.default_rng(1)
    found = []
    for label in range(alphabet.order):
        total = np.zeros((across, across))
        for _ in range(settings.pad_among):
            labels = rng.integers(alphabet.order, size=(4, 4))
            labels[1, 1] = label
            face = endless_face(
                labels,
                tuple(glyph.strokes for glyph in alphabet.glyphs),
                pitch_mm=pitch,
                unit_mm=alphabet.reach * pitch,
                relief=Relief(style.height_mm, style.stroke_mm, 0.0),  # only tops are pressed
            )
            at = Touch(1.5 * pitch, -1.5 * pitch, 0.0, force, wrist=WristStiffness(STIFF, STIFF))
            total += layer(face, probe, at, cells_per_tactel=2).forces_n
        found.append(total[::-1] / settings.pad_among)  # rows upwards
    where = axis_mm / fine + (across - 1) / 2
    grid = np.stack(np.meshgrid(where, where, indexing="ij"))
    smooth = np.array([map_coordinates(one, grid, order=3, mode="nearest") for one in found])
    return np.asarray(np.maximum(smooth, 0.0) / max(float(smooth.max()), 1e-300))
