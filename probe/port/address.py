"""A port, and its URL in parts: scheme, target, options.

A port is bytes both ways, and knows nothing of packets. `probe.port.open_port(url)` makes one,
`probe.client` reads frames from it, and opens it again when it went away.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol
from urllib.parse import parse_qsl

from probe.errors import PortUrlError


class Port(Protocol):
    """A byte stream to a probe. Every method raises `PortError` once the device is gone."""

    @property
    def url(self) -> str:
        """The URL that opens this port again."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that came, waiting at most `timeout_s` for the first; b"" if nothing.

        Raises EOFError at the end of a port that ends (a recording played once).
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        ...

    def close(self) -> None:
        """Let go of the device; may be called twice."""
        ...


@dataclass(frozen=True, slots=True)
class Address:
    """A port URL in its parts."""

    url: str
    scheme: str  #: serial, sim, file, or that of another package
    target: str  #: device, part, database#object/face, or recording; empty for the pattern
    options: dict[str, str] = field(default_factory=dict)


def split_url(url: str) -> Address:
    """Return the parts of a URL of any scheme; PortUrlError when its options cannot be read."""
    scheme, _, rest = url.partition(":")
    target, mark, query = rest.rpartition("?")
    if not mark or "#" in query:  # a question mark within the address of a database
        target, query = rest, ""
    try:
        options = dict(parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query)))
    except ValueError as bad:
        raise PortUrlError(
            f"the options {query!r} cannot be read", fix="write name=value&name=value", place=url
        ) from bad
    return Address(url, scheme, target.removeprefix("//"), options)


def number(
    address: Address, name: str, default: float, *, least: float = 0.0, most: float
) -> float:
    """Return an option that is a number of `least` to `most`; PortUrlError when it is none."""
    given = address.options.get(name)
    if given is None:
        return default
    try:
        value = float(given)
    except ValueError:
        value = float("nan")
    if not least <= value <= most:
        raise PortUrlError(
            f"{name}={given!r} is no number from {least:g} to {most:g}",
            fix=f"write for example {name}={default:g}",
            place=address.url,
        )
    return value


def refuse_unknown(address: Address, known: tuple[str, ...]) -> None:
    """Refuse options that this scheme does not have (PortUrlError), with those that it has."""
    unknown = sorted(set(address.options) - set(known))
    if unknown:
        raise PortUrlError(
            f"{address.scheme}: has no option {', '.join(unknown)}",
            fix=f"its options are {', '.join(known)}",
            place=address.url,
        )
