"""STL files -> triangles, mm, in the part's own frame.

Binary and ASCII. A binary file is known by its length, 84 + 50 n bytes, whatever its header
says. Stated normals are not read: the corners tell them. Reading is bounded and checked.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError

MOST_TRIANGLES = 20_000_000
_HEAD = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(file: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Return the triangles of an STL file.

    Returns
    -------
    (n, 3, 3) corners, mm; exactly the numbers of the file.

    Raises
    ------
    SurfaceError
        The file cannot be read, is no STL, is cut short, too large, empty, or holds NaN.
    """
    path = Path(file)
    try:
        size = path.stat().st_size
        if size > _HEAD + _FACET.itemsize * MOST_TRIANGLES:
            raise SurfaceError(
                f"{size / 1e9:.3g} GB are more than {MOST_TRIANGLES:,} triangles",
                fix="simplify the mesh",
                place=str(path),
            )
        data = path.read_bytes()
    except OSError as error:
        raise SurfaceError(
            f"cannot be read: {error.strerror}", fix="name an STL file", place=str(path)
        ) from error
    count = int.from_bytes(data[80:_HEAD], "little") if len(data) >= _HEAD else -1
    if len(data) == _HEAD + _FACET.itemsize * count:
        corners = np.frombuffer(data, _FACET, count, _HEAD)["corners"].astype(np.float64)
    elif data.lstrip()[:5].lower() == b"solid" and b"endsolid" in data[-1000:].lower():
        corners = _ascii(data, path)
    elif count >= 0:
        raise SurfaceError(
            f"announces {count:,} triangles, which takes {_HEAD + _FACET.itemsize * count:,} "
            f"bytes; it has {len(data):,}",
            fix="export the part again as STL",
            place=str(path),
        )
    else:
        raise SurfaceError("is no STL file", fix="name an STL file of a part", place=str(path))
    if not len(corners):
        raise SurfaceError("holds no triangle", fix="export the part again", place=str(path))
    if not np.isfinite(corners).all():
        raise SurfaceError("holds NaN or infinity", fix="export the part again", place=str(path))
    return corners


def _ascii(data: bytes, path: Path) -> NDArray[np.float64]:
    words = data.lower().split()
    at = [i for i, word in enumerate(words) if word == b"vertex"]
    try:
        numbers = [float(word) for i in at for word in words[i + 1 : i + 4]]
        return np.array(numbers).reshape(-1, 3, 3)
    except ValueError:
        raise SurfaceError(
            "is an ASCII STL file with broken corners",
            fix="export the part again, best as binary STL",
            place=str(path),
        ) from None
