"""What is known of one sensor beyond its type: a value that the reader takes.

No copy is like its type: some tactels never answer, some read high with nothing on them, gains and
the places of tips differ, rows may float while another one is read. Touches show all of it
(`recognizer.sensor`), and it stays from touch to touch. Arrays are (rows, columns), sensor frame,
mm. Thesis 4.2.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.errors import CircuitError
from recognizer.errors import SensorStateError

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


# Known of a tactel before any touch: standard deviations.
GAIN_SD = 0.2  #: of the logarithm of a tactel's gain
ASIDE_SD_MM = 0.15  #: of a tip's place, each way

# Of floating rows.
LEAST_READING = 1e-4  #: of the largest; one below it is taken for it
TOLERANCE = 1e-4  #: of the conductances


@dataclass(frozen=True, slots=True, eq=False)
class SensorState:
    """What was learned of one sensor. Arrays are copied in, and read-only."""

    sensor: str  #: name of the sensor, or of its type
    touches: int  #: that it rests on
    newtons: bool  #: whether offsets are newtons; gains and offsets hold for such readings alone
    dead: Flags  #: tactels that never answer
    hot: Flags  #: tactels that read high with nothing on them
    offset: Array  #: reading with nothing on a tactel, over that of most
    gain: Array  #: how strongly a tactel answers; 1 as most do
    gain_deviation: Array  #: standard deviation
    aside_mm: Array  #: (rows, columns, 2) from where the type has a tip to where it stands
    aside_deviation_mm: Array  #: (rows, columns, 2) standard deviation
    floating: bool = False  #: whether nothing holds a row while another one is read
    drift: float = 0.0  #: by which the background rose from the first touches to the last
    mounting: tuple[str, ...] | None = None
    """Changes of `sensor.wiring` that bring images to where the sensor has them, by a touch that
    was placed by hand; (): as drawn; None: never checked. Images are read with them undone."""

    def __post_init__(self) -> None:
        shape = np.shape(self.dead)
        for item in fields(self):
            value = getattr(self, item.name)
            if not isinstance(value, np.ndarray):
                continue
            array = np.array(value, bool if item.name in ("dead", "hot") else np.float64)
            wanted = (*shape, 2) if item.name.startswith("aside") else shape
            if array.shape != wanted or not np.isfinite(array).all():
                raise SensorStateError(
                    f"{item.name} of a sensor has shape {array.shape}, or holds no numbers",
                    fix=f"give {wanted} finite values",
                    place=self.sensor,
                )
            array.setflags(write=False)
            object.__setattr__(self, item.name, array)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.dead.shape
        return rows, columns

    @property
    def is_learned(self) -> bool:
        """Whether touches are read by it: it is not there for the mounting alone."""
        return self.touches > 0 or self.mounting is None

    @property
    def masked(self) -> Flags:
        """(rows, columns) tactels without information about a touch."""
        return self.dead | self.hot

    def correct(self, readings: Array, *, newtons: bool) -> Array:
        """Return readings (rows, columns) with the network inverted and offsets taken off.

        Gains and offsets hold only in the unit in which they were learned; a calibration in newtons
        has undone the network itself.
        """
        if newtons != self.newtons:
            return readings
        inverted = invert_floating(readings) if self.floating else readings
        return np.asarray(inverted - self.offset)

    def level(self, forces: Array, *, newtons: bool) -> Array:
        """Return forces (rows, columns) as tactels of equal gain would read them."""
        return np.asarray(forces / self.gain) if newtons == self.newtons else forces


def unknown_state(sensor: SensorType, *, newtons: bool = False, name: str = "") -> SensorState:
    """Return the state of a sensor without any touch."""
    shape = (sensor.rows, sensor.columns)
    none, one = np.zeros(shape), np.ones(shape)
    aside = np.zeros((*shape, 2))
    return SensorState(
        sensor=name or sensor.name, touches=0, newtons=newtons, dead=none > 0, hot=none > 0,
        offset=none, gain=one, gain_deviation=GAIN_SD * one,
        aside_mm=aside, aside_deviation_mm=ASIDE_SD_MM + aside,
    )  # fmt: skip


def invert_floating(readings: Array) -> Array:
    """Return (rows, columns) readings if all other rows were held, 0 or more.

    Figure 4.5 of the thesis, uncalibrated: a reading is taken as one over the resistance between
    its row and column, as it is while the load of the column is small. Neither the supply nor the
    background matters (`docs/recognizer.md`). Readings that no network can give come back as they
    are.
    """
    from probe.circuit.network import solve_floating

    over = np.maximum(readings, LEAST_READING * float(np.max(readings, initial=1e-12)))
    try:
        return np.asarray(solve_floating(1.0 / over, TOLERANCE).conductance_s)
    except CircuitError:
        return np.asarray(np.maximum(readings, 0.0))
