"""Wavefront OBJ: text -> polygons in mm. Polygons may be non-convex; textures are ignored."""

from __future__ import annotations

import numpy as np

from generator.errors import ShapeError
from generator.polyhedron.read.settings import MODEL
from generator.polyhedron.read.soup import Soup, soup_of_loops

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
    text = content.decode("utf-8", "replace").replace("\\\r\n", " \n").replace("\\\n", " ")
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
    if len(faces) > MODEL.most_polygons:
        cause = f"{len(faces)} polygons; {MODEL.most_polygons} are allowed"
        raise ShapeError(cause, fix="simplify the model", place=place)
    return soup_of_loops(np.array(points, dtype=np.float64).reshape(-1, 3), faces, place)


def _point(words: list[str], place: str) -> tuple[float, ...]:
    try:
        x, y, z = (float(word) for word in words[:3])  # a weight or colours may follow
    except ValueError:
        shown = " ".join(words)[:60]
        raise ShapeError(
            f"'v {shown}' is not a point: it has three numbers", fix=_AGAIN, place=place
        ) from None
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
