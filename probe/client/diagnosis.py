"""What to say when nothing that was heard is a packet of a probe."""

from __future__ import annotations

from collections.abc import Mapping

from probe.errors import PortError
from probe.protocol import VERSION, Damage


def no_probe(damages: Mapping[Damage, int], waited_s: float, url: str) -> PortError:
    """Return the error for a port at which no probe answered.

    Parameters
    ----------
    damages
        How many blocks failed, and why.
    waited_s
        How long a packet was waited for.
    url
        Of the port.
    """
    if damages[Damage.VERSION]:
        cause = f"the device speaks another version of the protocol, not {VERSION}"
        fix = "flash the firmware that belongs to this programme"
    elif any(damages.values()):
        cause = "what comes from the device are no packets of a probe"
        fix = "try another baud rate; if that does not help, it has not the probe's firmware"
    else:
        cause = f"the device was silent for {waited_s:g} s"
        fix = "try another baud rate, and see whether it has power and the probe's firmware"
    return PortError(cause, fix=fix, place=url)
