"""Open a port by its URL.

=========================================  ===================================================
serial:///dev/ttyACM0?baud=1000000         a probe on a serial line
sim:?rate=100                              a moving pattern from a probe in software
sim:part.stl, sim:lab.db#Cube/face         touches of a part, by `probe.simulate.source`
sim:...?firmware=avr                       the same images through the firmware on an
                                           emulated ATmega328P
file:recording.h5?speed=1&loop=1           a recording; speed=0: as fast as it is read
=========================================  ===================================================

Whatever stands behind it speaks the protocol, so one client reads them all. Options follow
the last question mark.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from urllib.parse import parse_qsl

from probe.errors import PortError
from probe.port.contract import Port

EXAMPLES = "serial:///dev/ttyACM0?baud=1000000, sim: or file:recording.h5"


@dataclass(frozen=True, slots=True)
class Address:
    """A port URL in its parts."""

    url: str
    scheme: str  #: serial, sim or file
    target: str  #: device, part, database#object/face, or recording; empty for the pattern
    options: dict[str, str] = field(default_factory=dict)


def open_port(url: str) -> Port:
    """Open a port.

    Parameters
    ----------
    url
        See the module's table.

    Raises
    ------
    PortError
        When the URL cannot be read, or the device is not there, busy or forbidden.
    RecordingError
        When the file is no recording.
    """
    address = address_of(url)
    if address.scheme == "serial":
        from probe.port.serial_line import open_serial

        return open_serial(address)
    if address.scheme == "file":
        from probe.port.recorded import open_recording

        return open_recording(address)
    from probe.port.simulated import open_simulation

    return open_simulation(address)


def address_of(url: str) -> Address:
    """Read a port URL.

    Raises
    ------
    PortError
        When the scheme is unknown, or what it needs is missing.
    """
    scheme, colon, rest = url.partition(":")
    if not colon or scheme not in ("serial", "sim", "file"):
        guess = f"serial://{url}" if url.startswith("/dev/") else f"file:{url}"
        raise PortError(
            "this is no port URL, it must begin with serial:, sim: or file:",
            fix=f"write {guess}" if not colon else f"write for example {EXAMPLES}",
            place=url,
        )
    target, mark, query = rest.rpartition("?")
    if not mark or "#" in query:  # a question mark within the address of a database
        target, query = rest, ""
    if target.startswith("//"):
        target = target[2:]
    if scheme != "sim" and not target:
        missing = "device" if scheme == "serial" else "recording"
        raise PortError(
            f"the URL names no {missing}", fix=f"write for example {EXAMPLES}", place=url
        )
    try:
        options = dict(parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query)))
    except ValueError as bad:
        raise PortError(
            f"the options {query!r} cannot be read", fix="write name=value&name=value", place=url
        ) from bad
    return Address(url, scheme, target, options)


def number(address: Address, name: str, default: float, least: float = 0.0) -> float:
    """Return an option that is a finite number, at least `least`.

    Raises
    ------
    PortError
        When it is none.
    """
    given = address.options.get(name)
    if given is None:
        return default
    try:
        value = float(given)
    except ValueError:
        value = float("nan")
    if not least <= value < float("inf"):
        raise PortError(
            f"{name}={given!r} is no number from {least:g}",
            fix=f"write for example {name}={default:g}",
            place=address.url,
        )
    return value


def refuse_unknown(address: Address, known: tuple[str, ...]) -> None:
    """Refuse options that this scheme does not have.

    Raises
    ------
    PortError
        With the options that it has.
    """
    unknown = sorted(set(address.options) - set(known))
    if unknown:
        raise PortError(
            f"{address.scheme}: has no option {', '.join(unknown)}",
            fix=f"its options are {', '.join(known)}",
            place=address.url,
        )
