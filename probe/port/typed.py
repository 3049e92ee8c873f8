"""Which sensor type stands behind a port's URL, before it is opened.

A recording tells its own; a simulated probe feels with the one that it is told; a scheme of one
sensor has it (`flexitac:`). What a serial line carries is known by its first frame alone.
"""

from __future__ import annotations

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.port.url import USUAL_TYPES, address_of

OPTION = "sensor_type"


def typed_port(url: str, asked: str = "") -> tuple[str, SensorType | None]:
    """Return the URL that opens a port with a type, and the type if it is known.

    Parameters
    ----------
    url
        Of a port.
    asked
        Name or file of a type, as `--sensor-type` gives it; empty: as the port tells.

    Raises
    ------
    PortError
        The URL is none.
    RecordingError
        It is that of a recording that cannot be read.
    SensorTypeError
        No such type, or one of another shape than the recording's images.
    """
    address = address_of(url)
    if address.scheme == "file":
        from probe.recording.read import Recording

        return url, Recording(address.target).sensor_type(asked)
    named = asked or address.options.get(OPTION, "") or USUAL_TYPES.get(address.scheme, "")
    if address.scheme == "sim" and asked and OPTION not in address.options:
        joint = "&" if address.options else "" if url.endswith("?") else "?"
        url = f"{url}{joint}{OPTION}={asked}"
    if not named and address.scheme == "sim":
        return url, SensorType()
    return url, choose_sensor_type(named, "", None, url) if named else None
