"""Cut a stream of bytes at its delimiters.

Bytes in pieces of any size -> the blocks between delimiters. COBS leaves no zero byte inside
a packet, so after any damage the next zero is the end of a packet, and the one after it ends
a whole packet. What stands before the first delimiter may be the tail of a packet.
"""

from __future__ import annotations

from probe.protocol.packet import LONGEST

DELIMITER = b"\0"


class Splitter:
    """Collects bytes until their delimiter comes; never holds more than `LONGEST` + 1."""

    __slots__ = ("_rest",)

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Return the blocks that `data` completes, without delimiters and empty blocks.

        Of a block without end only the beginning is kept: it is too long to be a packet, and
        stays so.
        """
        *blocks, rest = (self._rest + data).split(DELIMITER)
        self._rest = rest[: LONGEST + 1]
        return [block for block in blocks if block]
