"""What making objects takes of a sensor type: its size, and the pitch of symbols that it proposes.

Name or YAML file -> `SensorSize`. Making imports nothing of the probe: the type comes to it here,
as a value, and without a name nothing of the probe is loaded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SENSOR_FILES = (".yaml", ".yml")  #: how names of files of types end; others are names of types


@dataclass(frozen=True, slots=True)
class SensorSize:
    """What touches the objects; the default is `fsr-16`.

    Examples
    --------
    >>> SensorSize().across_mm
    25.4
    """

    name: str = "fsr-16"
    half_mm: tuple[float, float] = (12.7, 12.7)  #: half width and half height of the matrix
    pitch_mm: float = 5.0  #: of the symbols that it proposes

    @property
    def across_mm(self) -> float:
        """Side of the square of the same area."""
        return 2 * math.sqrt(self.half_mm[0] * self.half_mm[1])

    @property
    def coarseness(self) -> float:
        """How many times larger its symbols are than those of `fsr-16`."""
        return self.pitch_mm / USUAL_SENSOR.pitch_mm


USUAL_SENSOR = SensorSize()


def sensor_size(name: str) -> SensorSize:
    """Return what making takes of a type, by its name or that of its file.

    Raises
    ------
    DocumentError
        No such type, or a file that cannot be used.

    Examples
    --------
    >>> sensor_size("gel-24x32").pitch_mm
    3.0
    """
    from probe.sensor_types import proposed_pitch_mm
    from probe.sensor_types.read import sensor_type_named

    sensor = sensor_type_named(name)
    return SensorSize(sensor.name, sensor.half_mm, proposed_pitch_mm(sensor))
