"""STEP: bytes -> polyhedron in mm, through the CAD kernel in a process of its own."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.base.errors import install_line
from generator.errors import ShapeError
from generator.polyhedron.read.facets import polyhedron_of_facets
from generator.polyhedron.read.merge import merge_triangles
from generator.polyhedron.read.settings import MODEL
from generator.polyhedron.read.soup import soup_of_loops
from generator.polyhedron.winged import Polyhedron, polyhedron

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
    """Return the solid that the kernel describes (`kernel.described`)."""
    if "surfaces" in found:
        return polyhedron_of_facets(found, kind)
    points = np.array(found["points"], dtype=np.float64).reshape(-1, 3)
    vertices, faces = merge_triangles(soup_of_loops(points, found["faces"], place))
    return polyhedron(kind, vertices, faces)


def _ask_kernel(content: bytes, place: str, scale: float) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        model, answer = Path(folder) / "model.step", Path(folder) / "answer.json"
        model.write_bytes(content)
        command = [sys.executable, "-m", KERNEL, str(model), str(answer), repr(scale)]
        path = os.pathsep.join(entry for entry in sys.path if entry)
        try:
            subprocess.run(  # noqa: S603 - our own module, no shell
                command,
                env={**os.environ, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=MODEL.longest_s,
                check=True,
            )
            found: dict[str, Any] = json.loads(answer.read_text())
        except subprocess.TimeoutExpired:
            cause = f"the CAD kernel did not finish in {MODEL.longest_s:.0f} s"
            raise ShapeError(cause, fix="simplify the model", place=place) from None
        except (subprocess.CalledProcessError, OSError, ValueError):
            cause = "the CAD kernel broke down on it"
            raise ShapeError(cause, fix=_AGAIN, place=place) from None
    return found
