"""What the emulated sensors feel, in a file that the emulator maps.

Little endian, the layout of `emulator/images.h`: the writer counts `lock` to an odd number,
writes the image, and counts it to an even one; the emulator takes an image whole at the
beginning of a scan, and notes its number for that scan.
"""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import PortError
from probe.frame import WRIST

SENSORS = 8
ROWS, COLUMNS = 16, 16  #: of the boards that the firmware runs on
FULL_MV = 5000.0  #: reference of the ADC
REMEMBERED = 4096  #: scans
_SHAPES = ((ROWS, COLUMNS), (SENSORS, ROWS, COLUMNS))
_MILLIVOLTS, _SIEMENS = 0, 1  # what tactels are given in

_LAYOUT = np.dtype(
    [
        ("magic", "S8"),
        ("version", "<u4"),
        ("lock", "<u4"),
        ("number", "<u4"),
        ("kind", "<u4"),
        ("reserved", "<u4", 10),
        ("tactels", "<f4", (SENSORS, ROWS, COLUMNS)),
        ("wrist_mv", "<f4", WRIST),
        ("boots", "<u4"),
        ("scans", "<u4"),
        ("felt", "<u4", REMEMBERED),
    ]
)


class FeltImages:
    """The file, from the writer's side; may be used by several threads."""

    def __init__(self, path: Path) -> None:
        self._file = np.memmap(path, dtype=_LAYOUT, mode="w+", shape=(1,))
        self._one_writer = threading.Lock()
        self._number = 0
        self._file["magic"] = b"PROBEIMG"
        self._file["version"] = 2
        self._file.flush()

    def show(self, tactels_mv: ArrayLike, wrist_mv: ArrayLike | None = None) -> int:
        """Show an image from the next scan on.

        Parameters
        ----------
        tactels_mv
            (16, 16) for all sensors, or (8, 16, 16), mV; the ADC reads 0 ... 5000.
        wrist_mv
            (4,) mV; as before if not given.

        Returns
        -------
        The image's number, 1 for the first; 0 is the sensor without touch.

        Raises
        ------
        PortError
            When a shape is wrong or a voltage is no number.
        """
        tactels = _voltages(tactels_mv, _SHAPES)
        return self._write(_MILLIVOLTS, tactels, wrist_mv)

    def show_conductances(self, tactels_s: ArrayLike, wrist_mv: ArrayLike | None = None) -> int:
        """Make every tactel a resistor from the next scan on; see `show`.

        Parameters
        ----------
        tactels_s
            (16, 16) for all sensors, or (8, 16, 16), S, 0 or more.

        Raises
        ------
        PortError
            When a shape is wrong or a value is no conductance.
        """
        tactels = np.asarray(tactels_s, dtype=np.float64)
        if tactels.shape not in _SHAPES or not (np.isfinite(tactels) & (tactels >= 0)).all():
            raise PortError(
                f"conductances of shape {tactels.shape}, or below 0, or no numbers",
                fix=f"give siemens, {' or '.join(str(shape) for shape in _SHAPES)}",
            )
        return self._write(_SIEMENS, tactels.astype(np.float32), wrist_mv)

    def _write(self, kind: int, tactels: NDArray[np.float32], wrist_mv: ArrayLike | None) -> int:
        wrist = None if wrist_mv is None else _voltages(wrist_mv, ((WRIST,),))
        with self._one_writer:
            self._number += 1
            self._file["lock"] += 1
            self._file["number"] = self._number
            self._file["kind"] = kind
            self._file["tactels"] = tactels
            if wrist is not None:
                self._file["wrist_mv"] = wrist
            self._file["lock"] += 1
            return self._number

    def felt(self, seq: int) -> int:
        """Return the number of the image in frame `seq` since the last reset.

        Parameters
        ----------
        seq
            Number of the frame, as sent or unwrapped; one of the last 4096.
        """
        return int(self._file["felt"][0, seq % REMEMBERED])

    @property
    def scans(self) -> int:
        """Scans begun since the last reset."""
        return int(self._file["scans"][0])

    @property
    def boots(self) -> int:
        """Resets, the first start counted."""
        return int(self._file["boots"][0])


def _voltages(values: ArrayLike, shapes: tuple[tuple[int, ...], ...]) -> NDArray[np.float32]:
    voltages = np.asarray(values, dtype=np.float64)
    if voltages.shape not in shapes:
        raise PortError(
            f"the voltages have shape {voltages.shape}",
            fix=f"give {' or '.join(str(shape) for shape in shapes)}",
        )
    if not (np.abs(voltages) <= 2 * FULL_MV).all():
        raise PortError(
            f"a voltage is no number, or above {2 * FULL_MV:g} mV",
            fix=f"give millivolts; the ADC reads 0 ... {FULL_MV:g}",
        )
    return voltages.astype(np.float32)
