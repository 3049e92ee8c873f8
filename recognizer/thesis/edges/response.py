"""What a tactel feels beside the edge of a flat face, through the overlay. Thesis 3.3, 4.2.

0 where the face does not reach, 1 well inside it, as a function of how far the tactel's centre
lies inside. A tab feels the share of its round tip that lies on the face, and a little more
because a partly covered tip bulges into the open; between two tabs, an edge is not felt. A
pad's tactel feels a share of its square, smeared by the pad. Cross-talk and edges that are not
sharp blur both.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.thesis.settings import EDGE_RESPONSE

Array = NDArray[np.float64]


@lru_cache(maxsize=8)
def responses(sensor: SensorType) -> Array:
    """Return responses (blurs, n) at -reach_mm ... reach_mm inside, every step_mm."""
    from scipy.ndimage import gaussian_filter1d

    step = EDGE_RESPONSE.step_mm
    steps = round(EDGE_RESPONSE.reach_mm / step)
    inside = np.arange(-steps, steps + 1) * step
    overlay = sensor.overlay
    if overlay.kind == "tab":
        t = np.clip(inside / (overlay.tab_diameter_mm / 2), -1, 1)
        cover = 0.5 + (np.arcsin(t) + t * np.sqrt(1 - t * t)) / np.pi
        felt = cover * (1 + EDGE_RESPONSE.bulge * (1 - cover))
    else:
        share = np.clip(inside / sensor.pitch_mm + 0.5, 0, 1)
        felt = gaussian_filter1d(
            share, EDGE_RESPONSE.pad * overlay.height_mm / step, mode="nearest"
        )
    blurs = [blur / step for blur in EDGE_RESPONSE.blurs_mm]
    table = np.array([gaussian_filter1d(felt, blur, mode="nearest") for blur in blurs])
    table.setflags(write=False)
    return table


def felt_at(table: Array, inside_mm: Array) -> Array:
    """Return one row of `responses` at distances of any shape."""
    place = np.clip((inside_mm + EDGE_RESPONSE.reach_mm) / EDGE_RESPONSE.step_mm, 0, len(table) - 1)
    k = np.minimum(place.astype(np.intp), len(table) - 2)
    share = place - k
    return np.asarray(table[k] * (1 - share) + table[k + 1] * share)
