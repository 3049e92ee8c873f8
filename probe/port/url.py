"""Open a port by its URL.

=========================================  ===================================================
serial:///dev/ttyACM0?baud=1000000         a probe on a serial line
flexitac:///dev/ttyUSB0                    a FlexiTac board, by its own protocol
sim:?rate=100                              a moving pattern from a probe in software
sim:part.stl, sim:lab.db#Cube/face         touches of a part, by `probe.simulate.source`
file:recording.h5?speed=1&loop=1           a recording; speed=0: as fast as it is read
=========================================  ===================================================

Whatever stands behind it speaks the protocol, so one client reads them all. Options follow
the last question mark. A scheme is a module and a line of `SCHEMES`; another package adds one by
an entry point of the group `encoded_objects.ports`, the scheme's name = module:function, where
the function takes an `Address` and returns a `Port`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.errors import PortError, PortUrlError
from probe.port.address import Address, Port, split_url

GROUP = "encoded_objects.ports"
EXAMPLES = "serial:///dev/ttyACM0?baud=1000000, sim: or file:recording.h5"

#: scheme: its opener, and the target that its URL must name
SCHEMES = {
    "serial": ("probe.port.serial_line:open_serial", "device"),
    "flexitac": ("probe.port.flexitac:open_flexitac", "device"),
    "sim": ("probe.port.software:open_simulation", ""),
    "file": ("probe.port.software:open_recording", "recording"),
}

USUAL_TYPES = {"flexitac": "flexitac-16x32"}  #: scheme: sensor type, where it is of one
_TYPE_OPTION = "sensor_type"


def open_port(url: str) -> Port:
    """Open a port; its URL as in the table of the module.

    Raises PortUrlError: the URL cannot be read; PortError: the device is not there, busy or
    forbidden; RecordingError: the file is no recording.
    """
    address = address_of(url)
    return _opener(address)(address)


def address_of(url: str) -> Address:
    """Read a port URL.

    Raises PortUrlError: the scheme is unknown, or its target is missing.
    """
    scheme, colon, _ = url.partition(":")
    if not is_url(url):
        guess = f"serial://{url}" if url.startswith("/dev/") else f"file:{url}"
        known = [f"{name}:" for name in (*SCHEMES, *sorted(_other_schemes()))]
        raise PortUrlError(
            f"this is no port URL, it must begin with {', '.join(known[:-1])} or {known[-1]}",
            fix=f"write {guess}" if not colon else f"write for example {EXAMPLES}",
            place=url,
        )
    address, (_, needed) = split_url(url), SCHEMES.get(scheme, ("", ""))
    if needed and not address.target:
        raise PortUrlError(
            f"the URL names no {needed}", fix=f"write for example {EXAMPLES}", place=url
        )
    return address


def typed_port(url: str, asked: str = "") -> tuple[str, SensorType | None]:
    """Return the URL that opens a port with a type of sensor, and the type if it is known.

    A recording names its own; a simulated probe and a board have the one of their option. The
    type behind a serial line is known by its first frame alone. `asked` is that of `--sensor-type`.
    Raises PortError, RecordingError, SensorTypeError.
    """
    address = address_of(url)
    if address.scheme == "file":
        from probe.recording.read import Recording

        return url, Recording(address.target).sensor_type(asked)
    named = asked or address.options.get(_TYPE_OPTION, "") or USUAL_TYPES.get(address.scheme, "")
    if address.scheme in ("sim", *USUAL_TYPES) and asked and _TYPE_OPTION not in address.options:
        joint = "&" if address.options else "" if url.endswith("?") else "?"
        url = f"{url}{joint}{_TYPE_OPTION}={asked}"
    if not named and address.scheme == "sim":
        return url, SensorType()
    return url, choose_sensor_type(named, "", None, url) if named else None


def is_url(text: str) -> bool:
    """Tell whether a text begins with a scheme that can be opened."""
    scheme, colon, _ = text.partition(":")
    return bool(colon) and (scheme in SCHEMES or scheme in _other_schemes())


def means_port(text: str) -> bool:
    """Tell whether a text is meant for a port, also one that cannot be opened; not a file."""
    return is_url(text) or text.startswith("/dev/") or "://" in text


def _opener(address: Address) -> Callable[[Address], Port]:
    if address.scheme in SCHEMES:
        module, _, name = SCHEMES[address.scheme][0].partition(":")
        opener: Callable[[Address], Port] = getattr(import_module(module), name)
        return opener
    try:
        return _other_schemes()[address.scheme]()
    except (ImportError, AttributeError) as broken:
        raise PortError(
            f"the package that opens {address.scheme}: does not load: {broken}",
            fix="install it again",
            place=address.url,
        ) from broken


def _other_schemes() -> dict[str, Callable[[], Callable[[Address], Port]]]:
    """Return the schemes of other packages, and how each is loaded."""
    from importlib.metadata import entry_points

    return {entry.name: entry.load for entry in entry_points(group=GROUP)}
