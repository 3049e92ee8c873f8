"""What the host tells the probe: one byte each, nothing to resynchronise.

A byte that is none of these is counted by the device as a receive error. A lost command is
told by what does not come: the client repeats `START` after silence.
"""

from __future__ import annotations

from probe.errors import PortError

SENSORS = 8  #: sensors among which a probe selects, thesis 4.2


class Command:
    """The commands without a number."""

    START = b"s"  #: send frame after frame
    STOP = b"x"
    ONE = b"g"  #: send one frame
    IDENT = b"i"
    STATISTICS = b"t"


def sensor_command(sensor: int) -> bytes:
    """Return the command that selects a sensor, 0 ... 7.

    Raises
    ------
    PortError
        When there is no such sensor.
    """
    if sensor not in range(SENSORS):
        raise PortError(
            f"there is no sensor {sensor}, a probe has sensors 0 ... {SENSORS - 1}",
            fix="select one of them",
        )
    return str(sensor).encode()


def bits_command(bits: int) -> bytes:
    """Return the command for readings of 8 or 10 bits.

    Raises
    ------
    PortError
        When the probe has no such readings.
    """
    if bits not in (8, 10):
        raise PortError(f"readings of {bits} bits, a probe reads 8 or 10", fix="take 8 or 10")
    return b"b" if bits == 8 else b"a"
