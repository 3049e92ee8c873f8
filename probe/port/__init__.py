"""Where bytes come from: a serial line, a simulated probe, a recording."""

from probe.port.address import Port
from probe.port.listing import PortEntry, list_ports
from probe.port.url import open_port

__all__ = ["Port", "PortEntry", "list_ports", "open_port"]
