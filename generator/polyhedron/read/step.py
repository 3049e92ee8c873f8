"""STEP: bytes -> polyhedron in mm, through the CAD kernel in a process of its own.

A solid of planar faces is merged as a mesh is. One with round faces comes as facets: planar
faces, runs that unroll, triangles of faces that stay blank. Points that are one within the
tolerance of a solid are joined; triangles without area go.
"""

from __future__ import annotations

import importlib.util
import json
import signal
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import install_line
from encoded_objects.base.foreign import run_limited
from generator.errors import ShapeError
from generator.polyhedron.read.merge import merge_triangles
from generator.polyhedron.read.soup import middle_text, soup_of_loops, weld
from generator.polyhedron.winged import Face, Polyhedron, developable_from, polyhedron

Loops = list[list[int]]

#: of the CAD kernel's process, which is stopped then: a cone of 1 MB takes 52 s of a busy machine
LONGEST_S, LEAST_S, SECONDS_MB = 300.0, 60.0, 120.0
MEMORY, MEMORY_FOLD = 2 << 30, 200  #: bytes of address space (it loads .8 GB), and for each byte
MOST_ANSWER = 1 << 30  #: bytes
FACET_WELD = 1e-5  #: points of the kernel's facets nearer than this share of the size are one
LISTED_BLANK = 12  #: blank faces of one kind that a note names with their places

KERNEL = "generator.polyhedron.read.kernel"
_AGAIN = "export the model again; the file may be cut off or damaged"
_START, _END = b"ISO-10303-21;", b"END-ISO-10303-21;"


def read_step(content: bytes, place: str, scale: float = 1.0) -> Polyhedron:
    """Return the one solid in a STEP file, `scale` times larger; `place` names it in messages.

    The file's unit is honoured. The kernel (`kernel.py`) is never loaded into this process:
    it can crash on a damaged file, and weighs 300 MB.
    """
    if not content.lstrip().startswith(_START):
        shown = content[:20].decode("ascii", "replace").strip()
        cause = f"it starts with '{shown}', not with '{_START.decode()}': no STEP file"
        if not shown.isprintable() or "\ufffd" in shown:
            cause = "it is no text: no STEP file"
        raise ShapeError(cause, fix="export the model as STEP", place=place)
    if _END not in content[-200:]:
        cause = f"it ends at byte {len(content)} without '{_END.decode()}'"
        raise ShapeError(cause, fix=_AGAIN, place=place)
    if importlib.util.find_spec("OCP") is None:
        raise ShapeError(
            "reading STEP needs the CAD kernel, which is not installed",
            fix=f"{install_line('cad')}, or save the model as STL",
            place=place,
        )
    found = _ask_kernel(content, place, scale)
    if "cause" in found:
        raise ShapeError(found["cause"], fix=found["fix"], place=place)
    return polyhedron_of(found, place, "file")


def polyhedron_of(found: dict[str, Any], place: str, kind: str) -> Polyhedron:
    """Return the solid that the kernel describes (`kernel.describe_shape`)."""
    if "surfaces" in found:
        return polyhedron_of_facets(found, kind)
    points = np.array(found["points"], dtype=np.float64).reshape(-1, 3)
    vertices, faces = merge_triangles(soup_of_loops(points, found["faces"], place))
    return polyhedron(kind, vertices, faces)


def _ask_kernel(content: bytes, place: str, scale: float) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        model, answer = Path(folder) / "model.step", Path(folder) / "answer.json"
        model.write_bytes(content)
        seconds = min(LONGEST_S, LEAST_S + SECONDS_MB * len(content) / 1e6)
        try:
            code, _ = run_limited(
                KERNEL, [str(model), str(answer), repr(scale)], cpu_s=seconds,
                memory_bytes=MEMORY + MEMORY_FOLD * len(content), written_bytes=MOST_ANSWER,
            )  # fmt: skip
        except TimeoutError:
            code = -signal.SIGXCPU
        if code in (-signal.SIGXCPU, -signal.SIGKILL):
            cause = f"the CAD kernel did not finish in {seconds:.0f} s of processor time"
            raise ShapeError(cause, fix="simplify the model", place=place)
        if code:
            raise ShapeError("the CAD kernel broke down on it", fix=_AGAIN, place=place)
        found: dict[str, Any] = json.loads(answer.read_text())
    return found


def polyhedron_of_facets(found: dict[str, Any], kind: str) -> Polyhedron:
    """Return the solid that `curved_faces` describes, with notes on how and on what stays blank.

    Raises `ShapeError` if the facets are no solid: walls thinner than the chord errors, a damaged
    model.
    """
    points, faces, kept = _weld(np.array(found["points"], dtype=np.float64), found["faces"])
    named = [
        Face(found["names"][old], tuple(tuple(loop) for loop in loops))
        for old, loops in zip(kept, faces, strict=True)
    ]
    try:
        solid = polyhedron(kind, points, named)
    except ShapeError as error:
        raise _facet_error(error, found) from None
    number = {old: new for new, old in enumerate(kept)}
    surfaces = tuple(
        developable_from(surface | {"facets": [number[k] for k in surface["facets"]]})
        for surface in found["surfaces"]
    )
    blank = tuple(number[k] for k in found["blank"] if k in number)
    notes = (*solid.notes, *found["notes"], *_blank_notes(found["kinds"], _places(found)))
    return replace(solid, notes=notes, surfaces=surfaces, blank=blank)


def _weld(
    points: NDArray[np.float64], faces: list[Loops]
) -> tuple[NDArray[np.float64], list[Loops], list[int]]:
    """Join near points; return points, the faces that are left and their old numbers."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    welded, number = weld(points, FACET_WELD * size)
    if len(welded) == len(points):
        return points, faces, list(range(len(faces)))
    left, kept = [], []
    for old, loops in enumerate(faces):
        joined = [_without_repeats([int(number[v]) for v in loop]) for loop in loops]
        joined = [loop for loop in joined if len(loop) >= 3]
        if joined and len(joined) == len(loops):
            left.append(joined)
            kept.append(old)
    used = np.unique(np.array([v for loops in left for loop in loops for v in loop], np.int64))
    return welded[used], [[np.searchsorted(used, loop).tolist() for loop in f] for f in left], kept


def _without_repeats(loop: list[int]) -> list[int]:
    return [v for k, v in enumerate(loop) if v != loop[k - 1]]


def _facet_error(error: ShapeError, found: dict[str, Any]) -> ShapeError:
    """Say of facets what a message about vertices says of a polyhedron."""
    cause = error.cause.strip().splitlines()
    first = cause[1].strip().partition(";")[0] if len(cause) > 1 else error.cause
    where = f"{error.place}: " if error.place and len(cause) == 1 else ""
    return ShapeError(
        f"its round faces, divided into {len(found['faces'])} facets to {found['error_mm']:g} mm, "
        f"make no solid: {where}{first}",
        fix="check that the model is one valid solid, fill inner voids, make walls thicker than "
        "that, or set scale for a larger part",
    )


def _places(found: dict[str, Any]) -> dict[str, str]:
    """Return the middle of the box of each blank face, by name."""
    points = np.array(found["points"], dtype=np.float64)
    corners: dict[str, list[int]] = {}
    for name, loops in zip(found["names"], found["faces"], strict=True):
        own = name.partition(".")[0]
        if own in found["kinds"]:
            corners.setdefault(own, []).extend(v for loop in loops for v in loop)
    return {name: middle_text(points[numbers]) for name, numbers in corners.items()}


def _blank_notes(kinds: dict[str, str], places: dict[str, str]) -> list[str]:
    by_kind: dict[str, list[str]] = {}
    for name, surface in kinds.items():
        by_kind.setdefault(surface, []).append(name)
    notes = []
    for surface, names in by_kind.items():
        listed = [f"{name} about {places[name]}" if name in places else name
                  for name in names[:LISTED_BLANK]]  # fmt: skip
        if len(names) > LISTED_BLANK:
            listed.append(f"{len(names) - LISTED_BLANK} more")
        what = f"faces {', '.join(listed)} stay" if len(names) > 1 else f"face {listed[0]} stays"
        why = "outline" if surface in ("cylinder", "cone") else "surface"
        notes.append(f"{what} blank: the {why} ({surface}) does not unroll into a simple strip")
    return notes
