"""Deflated pieces of text -> zip, the package that a 3MF file is (Open Packaging Conventions).

A piece is deflated for itself and ends at a whole byte, so that text shared by several files is
deflated once and copied, which `zipfile` cannot do. Dates are fixed.
RFC 1951 (deflate); PKWARE APPNOTE 6.3 (zip).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from generator.errors import WriteError

_LEVEL = 4  # of compression: 6 takes twice as long for a few percent
_LAST = b"\x03\x00"  #: an empty block that ends a stream
_ZEROS = bytes(1 << 16)
_LARGEST = (1 << 32) - 1  #: bytes that a zip without extensions can hold
_VERSION, _UNIX, _DEFLATE = 20, 3, 8
_DATE = 0x21  #: 1980-01-01, the earliest that a zip can hold
_MODE = 0o644 << 16
_LOCAL = struct.Struct("<4s5H3L2H")
_CENTRAL = struct.Struct("<4s4B4H3L5H2L")
_END = struct.Struct("<4s4H2LH")


@dataclass(frozen=True, slots=True)
class DeflatedText:
    """A text as deflate blocks that can stand anywhere in a stream."""

    blocks: bytes
    size: int  #: bytes of the text
    crc: int  #: CRC-32 of the text


def deflate_text(pieces: Iterable[bytes]) -> DeflatedText:
    """Return the text of all pieces deflated; no more than one of them is held at a time."""
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    blocks, size, crc = [], 0, 0
    for piece in pieces:
        blocks.append(packer.compress(piece))
        size += len(piece)
        crc = zlib.crc32(piece, crc)
    blocks.append(packer.flush(zlib.Z_FULL_FLUSH))
    return DeflatedText(b"".join(blocks), size, crc)


def zip_package(entries: Mapping[str, Sequence[DeflatedText]]) -> bytes:
    """Return the zip of entries, each by its name (ASCII) and the pieces of its text, in order.

    Raises `WriteError` beyond 4 GiB.
    """
    package = bytearray()
    central = bytearray()
    for name, pieces in entries.items():
        path = name.encode("ascii")
        crc, size = 0, 0
        for piece in pieces:
            crc, size = _crc_of_both(crc, piece), size + piece.size
        if max(size, len(package)) > _LARGEST:
            raise WriteError(
                "a plate exceeds 4 GiB, the most that a 3MF can hold here",
                fix="make smaller objects, or leave 3mf out of formats",
            )
        stored = sum(len(piece.blocks) for piece in pieces) + len(_LAST)
        place = len(package)
        package += _LOCAL.pack(
            b"PK\3\4", _VERSION, 0, _DEFLATE, 0, _DATE, crc, stored, size, len(path), 0
        )
        package += path
        for piece in pieces:
            package += piece.blocks
        package += _LAST
        central += _CENTRAL.pack(
            b"PK\1\2", _VERSION, _UNIX, _VERSION, 0, 0, _DEFLATE, 0, _DATE, crc, stored, size,
            len(path), 0, 0, 0, 0, _MODE, place,
        )  # fmt: skip
        central += path
    count = len(entries)
    end = _END.pack(b"PK\5\6", 0, 0, count, count, len(central), len(package), 0)
    return bytes(package + central + end)


def _crc_of_both(before: int, piece: DeflatedText) -> int:
    """Return the CRC of a text and the piece behind it.

    A CRC is affine in its start: over as many zeros it gives the share of `before`.
    """
    moved, own = before, 0
    for start in range(0, piece.size, len(_ZEROS)):
        zeros = _ZEROS[: piece.size - start]
        moved, own = zlib.crc32(zeros, moved), zlib.crc32(zeros, own)
    return moved ^ own ^ piece.crc
