"""From the block `shape:` to one shape by name and sizes (mm)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from difflib import get_close_matches
from pathlib import Path

from encoded_objects.base.yaml_tree import Tree
from generator.spec.resolved import ShapeSpec
from generator.spec.shape import EXAMPLES, KINDS, Shape

Refuse = Callable[[str, str, str], None]
"""Takes path, cause and fix of a problem."""


def resolved_shape(shape: Shape, tree: Tree, refuse: Refuse) -> ShapeSpec | None:
    """Return the one shape that is given; None after a refusal.

    Parameters
    ----------
    shape
        The block as it was read.
    tree
        The object it belongs to.
    refuse
        Takes path, cause and fix of each problem.
    """
    given = [kind for kind in KINDS if getattr(shape, kind) is not None]
    if not given:
        refuse("shape", "the shape has no size", f"write shape: {EXAMPLES['cube']}")
        return None
    if len(given) > 1:
        written = [key for key in tree.value["shape"] if key in given]
        refuse(
            f"shape.{written[1]}",
            f"an object has one shape, not {' and '.join(written)}",
            "leave one out; several objects stand in a list under objects:",
        )
        return None
    kind = given[0]
    value = getattr(shape, kind)
    if shape.scale is not None and kind != "file":
        refuse("shape.scale", f"a {kind} has a size, no scale", "leave it out, and write the size")
        return None
    if kind == "box":
        return ShapeSpec(kind, {"size": list(value)})
    if kind == "polyhedron":
        _check_faces(value.faces, len(value.vertices), refuse)
        faces = [[list(loop) for loop in face] for face in value.faces]
        return ShapeSpec(kind, {"vertices": [list(v) for v in value.vertices], "faces": faces})
    if kind == "file":
        return _model_file(value, shape.scale or 1.0, tree.folder, refuse)
    if isinstance(value, float):
        return ShapeSpec(kind, {"side": value})
    sizes = value.model_dump(exclude_none=True)
    if kind in ("prism", "pyramid") and ("side" in sizes) == ("radius" in sizes):
        given_sizes = "both side and radius" if "side" in sizes else "neither side nor radius"
        refuse(f"shape.{kind}", f"'{kind}' has {given_sizes}", f"write shape: {EXAMPLES[kind]}")
        return None
    return ShapeSpec(kind, sizes)


def _check_faces(faces: list[tuple[tuple[int, ...], ...]], vertices: int, refuse: Refuse) -> None:
    """Refuse faces that name vertices which are not there."""
    for number, loops in enumerate(faces):
        wrong = [vertex for loop in loops for vertex in loop if not 0 <= vertex < vertices]
        if wrong:
            refuse(
                f"shape.polyhedron.faces.{number}",
                f"face {number} names vertex {wrong[0]}, but there are {vertices}",
                f"use vertices 0 to {vertices - 1}",
            )


def _model_file(name: str, scale: float, folder: Path, refuse: Refuse) -> ShapeSpec | None:
    """Return a shape that is read from a model file, which must be there."""
    from generator.polyhedron.read import MESHES, STEP

    path = folder / name
    if path.suffix.lower() not in (*STEP, *MESHES):
        refuse(
            "shape.file",
            f"'{name}' is no model that is read here",
            f"give a file that ends in {', '.join((*STEP, *MESHES))}",
        )
        return None
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        refuse("shape.file", f"cannot read '{path}': {reason}", _similar_model(path))
        return None
    scaled = {} if scale == 1.0 else {"scale": scale}  # as if it had been left out
    return ShapeSpec("file", {"sha256": digest, **scaled}, path)


def _similar_model(path: Path) -> str:
    """Return a fix that names models like `path` beside it."""
    from generator.polyhedron.read import MESHES, STEP

    try:
        models = [f.name for f in path.parent.iterdir() if f.suffix.lower() in (*STEP, *MESHES)]
    except (OSError, ValueError):
        return f"check the folder '{path.parent}'; file names are relative to the spec"
    near = get_close_matches(path.name, sorted(models), n=1, cutoff=0.5)
    return f"did you mean '{near[0]}'?" if near else "file names are relative to the spec"
