"""Wavefront OBJ: text -> polygons in mm. Polygons may be non-convex; textures are ignored."""

from __future__ import annotations

import codecs

import numpy as np

from generator.errors import ShapeError
from generator.polyhedron.read.soup import Soup, soup_of_loops

MOST_POLYGONS = 500_000  #: of a mesh: bounds time and memory
_AGAIN = "export the model again as a mesh of polygons"
# fmt: off
_IGNORED = frozenset([
    "vt", "vn", "vp", "g", "o", "s", "mg", "l", "p", "usemtl", "mtllib", "usemap", "maplib", "lod",
    "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj",
])
_FREE_FORM = frozenset([
    "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp",
    "end", "con",
])
# fmt: on


def read_obj(content: bytes, place: str) -> Soup:
    """Return the polygons of an OBJ file; `place` names it in messages."""
    points: list[tuple[float, ...]] = []
    faces: list[tuple[tuple[int, ...]]] = []
    text = _text(content, place).replace("\\\r\n", " \n").replace("\\\n", " ")
    for line, row in enumerate(text.splitlines(), start=1):
        word, *rest = row.split("#", 1)[0].split() or [""]
        where = f"{place}:{line}"
        if word == "v":
            points.append(_point(rest, where))
        elif word == "f":
            faces.append((_loop(rest, len(points), where),))
        elif word in _FREE_FORM:
            cause = f"'{word}' is a free-form curve or surface; faces must be planar polygons"
            raise ShapeError(cause, fix=_AGAIN, place=where)
        elif word and word not in _IGNORED:
            raise ShapeError(f"'{word[:20]}' is no word of OBJ", fix=_AGAIN, place=where)
    if len(faces) > MOST_POLYGONS:
        cause = f"{len(faces)} polygons; {MOST_POLYGONS} are allowed"
        raise ShapeError(cause, fix="simplify the model", place=place)
    return soup_of_loops(np.array(points, dtype=np.float64).reshape(-1, 3), faces, place)


def _text(content: bytes, place: str) -> str:
    """Return the text of a file in UTF-8, or in UTF-16 that begins with its byte order mark."""
    if content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return content.decode("utf-16", "replace")
    if (zero := content.find(b"\0")) >= 0:
        cause = f"it is no plain text: byte {zero} is zero"
        raise ShapeError(cause, fix="save it as text (UTF-8), or export it again", place=place)
    return content.decode("utf-8-sig", "replace")


def _point(words: list[str], place: str) -> tuple[float, ...]:
    try:
        x, y, z = (float(word) for word in words[:3])  # a weight or colours may follow
    except ValueError:
        shown = " ".join(words)[:60]
        why = "it has three numbers"
        for word in words[2::-1]:
            try:
                float(word)
            except ValueError:
                why = f"'{word[:20]}' is no number"
        raise ShapeError(f"'v {shown}' is not a point: {why}", fix=_AGAIN, place=place) from None
    if not np.isfinite((x, y, z)).all():
        raise ShapeError("a coordinate is not a number", fix=_AGAIN, place=place)
    return x, y, z


def _loop(words: list[str], count: int, place: str) -> tuple[int, ...]:
    """Return the corners of an `f` line, from 0: OBJ counts from 1, or from the end below 0."""
    try:
        given = [int(word.split("/", 1)[0]) for word in words]
    except ValueError:
        shown = " ".join(words)[:60]
        raise ShapeError(f"'f {shown}' does not name vertices", fix=_AGAIN, place=place) from None
    loop = tuple(v - 1 if v > 0 else count + v for v in given)
    for v, named in zip(loop, given, strict=True):
        if named == 0 or not 0 <= v < count:
            cause = f"there is no vertex {named}; {count} are defined so far"
            raise ShapeError(cause, fix=_AGAIN, place=place)
    if len(loop) < 3:
        raise ShapeError(f"a face of {len(loop)} vertices", fix=_AGAIN, place=place)
    return loop
