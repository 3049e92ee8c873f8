"""The serial ports of this machine, and which of them may be a probe."""

from __future__ import annotations

from dataclasses import dataclass

#: USB vendors of the boards that the firmware is made for, and of their serial chips.
VENDORS = {
    0x2341: "Arduino",
    0x2A03: "Arduino",
    0x16C0: "Teensy",
    0x0403: "FTDI",
    0x10C4: "Silicon Labs CP210x",
    0x1A86: "WCH CH340",
}


@dataclass(frozen=True, slots=True)
class PortEntry:
    """A serial port. Whether a probe answers there is known only after opening it."""

    url: str
    device: str
    description: str
    vendor: str  #: by name, or 4 hexadecimal digits; empty if it is not on USB
    product: str
    serial_number: str
    likely: bool  #: of a kind of board that runs the firmware


def list_ports() -> list[PortEntry]:
    """Return the serial ports on USB, likely probes first, and no port is opened."""
    from serial.tools import list_ports as tool

    entries = [
        PortEntry(
            url=f"serial://{port.device}",
            device=port.device,
            description=port.description or "",
            vendor=VENDORS.get(port.vid) or port.manufacturer or f"{port.vid:04x}",
            product=port.product or f"{port.pid:04x}",
            serial_number=port.serial_number or "",
            likely=port.vid in VENDORS,
        )
        for port in tool.comports()
        if port.vid is not None
    ]
    return sorted(entries, key=lambda entry: (not entry.likely, entry.device))
