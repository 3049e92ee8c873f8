"""A probe on a serial line, or on a pseudo-terminal in its place.

The line is locked for one client (`exclusive`), and the driver is asked to hand on bytes at
once: FTDI chips collect them for 16 ms otherwise. Baud rates 500,000, 1,000,000 and
2,000,000 are exact for a 16 MHz AVR; 115,200 is 2.1 % off.
"""

from __future__ import annotations

import errno
import grp
import os
import select
import termios
from contextlib import suppress
from pathlib import Path

import serial

from probe.errors import PortError
from probe.port.address import Address, Port, number, refuse_unknown
from probe.port.listing import list_ports

_CHUNK = 65536
_BAUD = 1_000_000  #: where the address names none
_MOST_BAUD = 20_000_000  #: more than any USB chip takes
_WRITE_TIMEOUT_S = 1.0  #: a line that takes no byte for so long is broken


def open_serial(address: Address) -> Port:
    """Open and lock a serial line.

    Raises PortError: it is not there, busy, forbidden, or cannot run at this baud rate.
    """
    refuse_unknown(address, ("baud",))
    return open_line(address, int(number(address, "baud", _BAUD, least=1, most=_MOST_BAUD)))


def open_line(address: Address, baud: int) -> SerialLine:
    """Open and lock the line that an address names, at a speed; see `open_serial`."""
    try:
        line = serial.Serial(
            address.target, baud, timeout=0, write_timeout=_WRITE_TIMEOUT_S, exclusive=True
        )
        line.reset_input_buffer()
    except (OSError, ValueError, termios.error) as failed:  # pyserial's own is an OSError
        raise _explain_refusal(address, failed, baud) from failed
    with suppress(OSError, ValueError):  # a pty or a CDC device has no such mode
        line.set_low_latency_mode(True)
    return SerialLine(address.url, line)


class SerialLine:
    """An open serial line, a `Port`."""

    def __init__(self, url: str, line: serial.Serial) -> None:
        self.url = url  #: opens this port again
        self._line = line

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that came; b"" when none came in `timeout_s`."""
        try:
            descriptor = self._line.fileno()
            ready, _, _ = select.select([descriptor], [], [], timeout_s)
            if not ready:
                return b""
            data = os.read(descriptor, _CHUNK)
        except BlockingIOError:
            return b""
        except (OSError, ValueError) as gone:
            raise self._gone() from gone
        if not data:  # ready to be read, and nothing there: the end of the line
            raise self._gone()
        return data

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        try:
            self._line.write(data)
        except (OSError, ValueError) as gone:
            raise self._gone() from gone

    def close(self) -> None:
        """Unlock and let go of the line."""
        self._line.close()

    def _gone(self) -> PortError:
        return PortError("the device went away", fix="plug it in again", place=self.url)


def _explain_refusal(address: Address, failed: Exception, baud: int) -> PortError:
    device, number_ = Path(address.target), getattr(failed, "errno", None)
    if not os.path.exists(device):
        there = ", ".join(entry.url for entry in list_ports()) or "none"
        cause, fix = f"there is no {device}", f"plug the probe in; ports that are there: {there}"
    elif number_ in (errno.EACCES, errno.EPERM):
        cause = f"no permission to open {device}"
        fix = f"join its group: sudo usermod -a -G {_group(device)} $USER, then log in again"
    elif number_ in (errno.EAGAIN, errno.EBUSY):
        cause = f"{device} is in use by another programme"
        fix = f"close it; fuser {device} names it"
    elif isinstance(failed, ValueError):
        cause = f"{device} cannot run at {baud} baud"
        fix = "take 500000, 1000000 or 2000000, as the firmware was built"
    else:
        cause, fix = f"{device} cannot be opened: {failed}", "give the device of a serial line"
    return PortError(cause, fix=fix, place=address.url)


def _group(device: Path) -> str:
    gid = device.stat().st_gid
    try:
        return grp.getgrgid(gid).gr_name
    except KeyError:
        return str(gid)
