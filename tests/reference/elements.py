"""What finite elements say of pads and tabs: the reference of the layer and of the tabs' law.

`elements.json` keeps the answers of `tests/reference/elements_*.py` at commit 677fc8b8, on
scikit-fem 12.0; `docs/contact.md` says how far they are right, tests at that commit held them
against closed formulas and one another. Pads of 2 mm, tabs of 1.2666 mm; 1 MPa, nu = .4999.

    washer, sphere  `indented`, force 80 and 40 N, on a round pad: pressure at the base each .1 mm
    paraboloid      `elements`, R = 60 mm, two to a tactel, three layers, 6 mm of margin
    tab H mm        `compressed`, parts=10: N at `STRAINS`
    tab covered     `partly_covered`, 1 mm, parts=5, strain .1, by share `COVERED`: of the whole
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch

ELEMENTS = json.loads(Path(__file__).with_suffix(".json").read_text())
STRAINS = np.array([0.001, 0.1, 0.2, 0.3, 0.4, 0.5])
COVERED = np.array([0.25, 0.5, 0.75])
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(24)


def tactels_n(name: str, sensor: SensorType, touch: Touch) -> np.ndarray:
    """Return the force on each tactel (rows, columns) in a level touch of a round indenter."""
    pressure = ELEMENTS[name]["base_mpa"]
    stress = CubicSpline(np.arange(len(pressure)) / 10, pressure)
    c, s = math.cos(touch.theta_rad), math.sin(touch.theta_rad)
    x, y = np.moveaxis(sensor.centres_mm(), -1, 0)[..., None, None]
    step = POINTS * sensor.pitch_mm / 2
    x = x + c * touch.x_mm + s * touch.y_mm + step
    y = y - s * touch.x_mm + c * touch.y_mm + step[:, None]
    return stress(np.hypot(x, y)) @ WEIGHTS @ WEIGHTS * sensor.pitch_mm**2 / 4
