"""Which tactels lie on something: where a face ends is felt, whatever symbols it bears. Thesis 6.2.

Signal -> flags of the tactels. Beyond the edge of a face, and of a face around a right angle,
nothing is felt, however deep the plate hangs there; at a corner it tips, stands deepest at the
corner itself, and a plane through its depths says most where least is felt. So gain planes are
judged by what is loaded, and what is not speaks against symbols there and for nothing else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.around import combine_around, mean_of_strongest
from recognizer.touch.settings import DEFAULTS, LoadedAreaSettings
from recognizer.touch.signal import Signal

Flags = NDArray[np.bool_]


def find_loaded_area(
    sensor: SensorType, signal: Signal, settings: LoadedAreaSettings = DEFAULTS.loaded
) -> Flags:
    """Return (rows, columns) where a sensor lies on something, gaps between strokes closed.

    All of them where nothing rises over the noise, and under a pad or a gel, which smear what
    lies between strokes.
    """
    everywhere = np.ones(signal.forces.shape, np.bool_)
    if sensor.overlay.kind != "tab":
        return everywhere
    forces = np.where(signal.trust > 0, signal.forces, 0.0)
    strongest = mean_of_strongest(forces, settings.strongest)
    noise = min(signal.noise, settings.quiet * strongest)
    reach = settings.around // 2
    high = combine_around(forces, reach, np.maximum)
    least = np.maximum(settings.faint * high, settings.sigmas * noise)
    near = combine_around(forces > least, reach, np.logical_or)
    closed = combine_around(near, reach, np.logical_and)
    return closed if closed.any() else everywhere
