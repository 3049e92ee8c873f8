"""STL, binary and ASCII: bytes -> triangles in mm. Normals in the file are not used.

The one reader of STL, for models that people bring and (`generator.database.part_file`)
for written parts: it names the line or the byte at fault.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.read.soup import Soup, soup_of_triangles

MOST_TRIANGLES = 500_000  #: of a mesh: bounds time and memory
MOST_PART_TRIANGLES = 20_000_000  #: of a part that was written; in binary STL they take 1 GB
_AGAIN = "export the model again; the file may be cut off"
_MARK = b"\xef\xbb\xbf"  # of bytes' order, before some texts
_HEAD, _RECORD = 84, 50
_FRAME = {b"solid", b"facet", b"outer", b"endloop", b"endfacet", b"endsolid"}


def read_stl(content: bytes, place: str) -> Soup:
    """Return the triangles of an STL file; `place` names it in messages."""
    return soup_of_triangles(stl_triangles(content, place), place)


def stl_triangles(
    content: bytes, place: str, *, most: int = MOST_TRIANGLES, padded: bool = True
) -> NDArray[np.float64]:
    """Return the corners (n, 3, 3) of a file's triangles, mm; exactly its numbers.

    At most `most` of them; `padded`: bytes may follow the last triangle of a binary file, as some
    programs leave. Raises `ShapeError` if it is no STL, is cut short, too large, or holds NaN or
    infinity.
    """
    text = content.removeprefix(_MARK)
    if _is_ascii(text):
        return _ascii_triangles(text, place, most)
    return _binary_triangles(content, place, most, padded)


def _is_ascii(content: bytes) -> bool:
    """Tell the two kinds apart: binary headers may start with 'solid' as well."""
    if len(content) >= _HEAD and len(content) == _HEAD + _RECORD * _count(content):
        return False
    head = content[:1000]
    return content.lstrip()[:5].lower() == b"solid" and b"\0" not in head


def _count(content: bytes) -> int:
    return int.from_bytes(content[80:84], "little")


def _binary_triangles(content: bytes, place: str, most: int, padded: bool) -> NDArray[np.float64]:
    if len(content) < _HEAD:
        cause = f"neither ASCII nor binary STL: {len(content)} bytes, and the header alone has 84"
        raise ShapeError(cause, fix=_AGAIN, place=place)
    count = _count(content)
    if len(content) < _HEAD + _RECORD * count:
        whole = (len(content) - _HEAD) // _RECORD
        cause = (
            f"it announces {count} triangles, but ends at byte {len(content)} after {whole} of them"
        )
        raise ShapeError(cause, fix=_AGAIN, place=place)
    end = _HEAD + _RECORD * count
    if len(content) > end and not padded:
        cause = (
            f"it announces {count} triangles, which end at byte {end} of {len(content)}; "
            "nothing may follow"
        )
        raise ShapeError(cause, fix=_AGAIN, place=place)
    _check_count(count, place, most)
    record = np.dtype([("floats", "<f4", (12,)), ("attribute", "<u2")])
    floats = np.frombuffer(content, record, count, _HEAD)["floats"].astype(np.float64)
    corners = floats[:, 3:].reshape(-1, 3, 3)
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=(1, 2)))
    if len(bad):
        at = _HEAD + _RECORD * int(bad[0])
        cause = f"triangle {bad[0] + 1} at byte {at} has a corner that is not a number"
        raise ShapeError(cause, fix=_AGAIN, place=place)
    return corners


def _ascii_triangles(content: bytes, place: str, most: int) -> NDArray[np.float64]:
    corners: list[tuple[float, ...]] = []
    ended, line, in_facet = False, 0, 0
    for line, text in enumerate(content.splitlines(), start=1):
        words = text.split()
        if not words:
            continue
        word = words[0].lower()
        if word == b"vertex":
            corners.append(_vertex(words, f"{place}:{line}"))
            in_facet += 1
        elif word not in _FRAME:
            shown = words[0][:20].decode("ascii", "replace")
            raise ShapeError(f"'{shown}' is no word of STL", fix=_AGAIN, place=f"{place}:{line}")
        elif word in (b"facet", b"endfacet"):
            if in_facet != (0 if word == b"facet" else 3):
                cause = f"a facet with {in_facet} corners; it has 3"
                raise ShapeError(cause, fix=_AGAIN, place=f"{place}:{line}")
            in_facet = 0
        ended = word == b"endsolid"
    if not ended:
        raise ShapeError("it ends without 'endsolid'", fix=_AGAIN, place=f"{place}:{line}")
    if in_facet:
        raise ShapeError("its last facet is not ended", fix=_AGAIN, place=f"{place}:{line}")
    _check_count(len(corners) // 3, place, most)
    return np.array(corners, dtype=np.float64).reshape(-1, 3, 3)


def _vertex(words: list[bytes], place: str) -> tuple[float, ...]:
    try:
        x, y, z = (float(word) for word in words[1:])
    except ValueError:
        shown = b" ".join(words).decode("ascii", "replace")[:60]
        raise ShapeError(
            f"'{shown}' is not a corner: a vertex has three numbers", fix=_AGAIN, place=place
        ) from None
    if not np.isfinite((x, y, z)).all():
        raise ShapeError("a corner is not a number", fix=_AGAIN, place=place)
    return x, y, z


def _check_count(count: int, place: str, most: int) -> None:
    if count > most:
        raise ShapeError(
            f"{count} triangles; {most} are allowed",
            fix="simplify the model: planar faces need few triangles",
            place=place,
        )
