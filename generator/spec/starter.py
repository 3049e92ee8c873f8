"""Commented specs to begin with: what `encode-object init SHAPE` writes."""

from __future__ import annotations

import json
import os
from pathlib import Path

from encoded_objects.base.document import Problem, suggest
from generator.spec.problem import SpecError
from generator.spec.shape import EXAMPLES, OTHER_NAMES, is_model

_POLYHEDRON = """shape:
  polyhedron:
    # corners x, y, z in mm, numbered from 0
    vertices: [[0, 0, 0], [80, 0, 0], [0, 80, 0], [0, 0, 80]]
    # vertices of each face, counter-clockwise seen from outside; a hole: [[outer], [hole]]
    faces: [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]"""

_TEMPLATE = """\
# {name}: make it with  encode-object {file}
# A line that starts with # is off: delete the # to use it. The values shown are those
# that hold without it. Lengths: 40, 40 mm, 4 cm, 1.6 in. Angles: 10 deg, 0.17 rad.
version: 1
name: {name}
{shape}

# profile: auto          # auto | one-touch | large | fine | tactel-8, -16 | thesis | product
# sensor_type: fsr-16    # what will touch it: probe-sensor types lists them; or a YAML file
# layout: auto           # auto | net (one lattice through the unfolded object) | faces
# copies: 1              # each copy has cells of its own, so that two are told apart
# holes to hold it by, symbols keep clear:  mount: {{screws: M3}}, {{rod: 12 mm}}, {{hole: M8}},
# {{magnets: 8 x 2 mm}}, or the flange of a robot: ISO 9409-1-50-4-M6

# symbols:
#   pitch: 5 mm          # distance between neighbouring symbols
#   height: 1 mm         # best a multiple of the layer height
#   stroke: 1 mm         # width of the strokes at their top
#   draft: 5 deg         # slope of their sides
#   chamfer: 0 mm        # of their top edges
#   alphabet: tactel-8   # thesis-2 | letters-4 | dense-4, -8 | tactel-4, -8, -16 | letters.yaml

# print:
#   parts: panels        # panels (mitred plates, no supports) | whole (one body)
#   wall: 3 mm           # thickness of the panels
#   gap: 0.14 mm         # between panels in the finished object
#   blank: []            # faces without symbols: [F4, F7]; down: F4  is what one body stands on
#   printer: fdm-0.4     # encode-object printers lists them

# robot:                 # what mjcf, urdf, sdf and usd files say
#   density: 1.24 g/cm3
#   collision: touch     # touch (simulators feel the symbols) | body (convex pieces: fast)

# output:
#   folder: out/{folder}
#   formats: [step, stl, 3mf]        # and bambu, glb, stpz, mjcf, urdf, sdf, usd
#   database: sqlite:///lab.db       # or postgresql://host/name
"""


def starter(shape: str, file: str = "", model: str = "") -> str:
    """Return a commented spec for one of the shapes of `EXAMPLES`, or for a model's file.

    >>> starter("cube").splitlines()[5]
    'shape: {cube: 60 mm}'
    """
    name = "Part" if shape == "file" else shape.replace("_", " ").capitalize()
    folder = name.lower().replace(" ", "-")
    line = _POLYHEDRON if shape == "polyhedron" else f"shape: {EXAMPLES[shape]}"
    if model:
        name, line = json.dumps(Path(model).stem), f"shape: {{file: {json.dumps(model)}}}"
    if shape == "file":
        line += "    # .step, .stl or .obj, relative to this file"
        line += "\n# shape: {file: part.stl, scale: 25.4}    # a model in inches"
    file = file or f"{folder}.yaml"
    return _TEMPLATE.format(name=name, file=file, shape=line, folder=folder)


def starter_named(shape: str, file: Path | None = None) -> tuple[str, str]:
    """Return the kind of a shape or a model, and a spec `file`; raises `SpecError` for neither."""
    name = file.name if file else ""
    if is_model(Path(shape)):
        return "file", starter("file", name, os.path.relpath(shape, file.parent if file else "."))
    word = shape.lower().replace("-", "_").replace(" ", "_")
    kind = OTHER_NAMES.get(word, word)
    if kind not in EXAMPLES:
        fix = suggest(word, EXAMPLES, f"choose one of {', '.join(EXAMPLES)}")
        raise SpecError([Problem(f"unknown shape '{shape}'", fix)])
    return kind, starter(kind, name)
