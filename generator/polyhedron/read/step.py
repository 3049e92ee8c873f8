"""STEP: bytes -> polyhedron in mm, through the CAD kernel in a process of its own."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.developable import developable_from
from generator.polyhedron.read.merge import merged
from generator.polyhedron.read.soup import soup_of_loops
from generator.polyhedron.winged import Face, Polyhedron, polyhedron

LONGEST_S = 300.0
KERNEL = "generator.polyhedron.read.kernel"
_AGAIN = "export the model again; the file may be cut off or damaged"
_START, _END = b"ISO-10303-21;", b"END-ISO-10303-21;"


def read_step(content: bytes, place: str) -> Polyhedron:
    """Return the one solid in a STEP file; `place` names it in messages.

    The file's unit is honoured. The kernel (`kernel.py`) is never loaded into this process:
    it can crash on a damaged file, and weighs 300 MB.
    """
    if not content.lstrip().startswith(_START):
        shown = content[:20].decode("ascii", "replace").strip()
        cause = f"it starts with '{shown}', not with '{_START.decode()}': no STEP file"
        raise ShapeError(cause, fix="export the model as STEP", place=place)
    if _END not in content[-200:]:
        cause = f"it ends at byte {len(content)} without '{_END.decode()}'"
        raise ShapeError(cause, fix=_AGAIN, place=place)
    if importlib.util.find_spec("OCP") is None:
        raise ShapeError(
            "reading STEP needs the CAD kernel, which is not installed",
            fix='run: pip install "encoded-objects[cad]", or save the model as STL',
            place=place,
        )
    found = _ask_kernel(content, place)
    if "cause" in found:
        raise ShapeError(found["cause"], fix=found["fix"], place=place)
    return polyhedron_of(found, place, "file")


def polyhedron_of(found: dict[str, Any], place: str, kind: str) -> Polyhedron:
    """Return the solid that the kernel describes (`kernel.described`)."""
    points = np.array(found["points"], dtype=np.float64).reshape(-1, 3)
    if "surfaces" in found:
        return _with_round_faces(found, points, kind)
    vertices, faces = merged(soup_of_loops(points, found["faces"], place))
    return polyhedron(kind, vertices, faces)


def _with_round_faces(found: dict[str, Any], points: NDArray[np.float64], kind: str) -> Polyhedron:
    """Return a solid some of whose faces are round, with a note on those that stay blank."""
    faces = [
        Face(name, tuple(tuple(loop) for loop in loops))
        for name, loops in zip(found["names"], found["faces"], strict=True)
    ]
    solid = polyhedron(kind, points, faces)
    notes = list(solid.notes)
    by_kind: dict[str, list[str]] = {}
    for name, surface in found["kinds"].items():
        by_kind.setdefault(surface, []).append(name)
    for surface, names in by_kind.items():
        what = f"faces {', '.join(names)} stay" if len(names) > 1 else f"face {names[0]} stays"
        why = "outline" if surface in ("cylinder", "cone") else "surface"
        notes.append(f"{what} blank: the {why} ({surface}) does not unroll into a simple strip")
    surfaces = tuple(developable_from(definition) for definition in found["surfaces"])
    return replace(solid, notes=tuple(notes), surfaces=surfaces, blank=tuple(found["blank"]))


def _ask_kernel(content: bytes, place: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        model, answer = Path(folder) / "model.step", Path(folder) / "answer.json"
        model.write_bytes(content)
        command = [sys.executable, "-m", KERNEL, str(model), str(answer)]
        path = os.pathsep.join(entry for entry in sys.path if entry)
        try:
            subprocess.run(  # noqa: S603 - our own module, no shell
                command,
                env={**os.environ, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=LONGEST_S,
                check=True,
            )
            found: dict[str, Any] = json.loads(answer.read_text())
        except subprocess.TimeoutExpired:
            cause = f"the CAD kernel did not finish in {LONGEST_S:.0f} s"
            raise ShapeError(cause, fix="simplify the model", place=place) from None
        except (subprocess.CalledProcessError, OSError, ValueError):
            cause = "the CAD kernel broke down on it"
            raise ShapeError(cause, fix=_AGAIN, place=place) from None
    return found
