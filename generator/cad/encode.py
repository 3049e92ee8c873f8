"""Encode a solid from a script, as `encode-object` encodes a spec."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from generator.cad.read import polyhedron_from
from generator.layout.placement import Layout
from generator.pipeline.choose import chosen
from generator.pipeline.encode import encode_planned
from generator.pipeline.files import parts_of
from generator.pipeline.plan import Plan, planned
from generator.polyhedron import Polyhedron
from generator.solid import Part
from generator.spec.option import database_option
from generator.spec.resolved import ShapeSpec
from generator.spec.script import spec_of

DIGITS = 6  #: of a coordinate (mm) by which two solids are told apart


@dataclass(frozen=True, slots=True)
class EncodedSolid:
    """A solid that was encoded and registered."""

    name: str
    database: str  #: URL
    files: tuple[Path, ...]
    symbols: int
    places: int  #: how many places of it can be told apart by touch
    reused: bool  #: registered before, so the same cells again
    warnings: tuple[str, ...]
    polyhedron: Polyhedron  #: mm, frame of the solid that was given
    layout: Layout  #: which cell stands where on which face
    parts: tuple[Part, ...]  #: the printable parts, each with its `T_object_part`


def encode(
    solid: Any,
    *,
    name: str,
    database: str = "lab.db",
    profile: str | None = None,
    folder: Path | str | None = None,
    formats: Sequence[str] | None = None,
    verify: bool = False,
    replace: bool = False,
    **settings: Any,
) -> EncodedSolid:
    """Emboss a solid, write its files and register it.

    Parameters
    ----------
    solid
        One solid of build123d or cadquery, mm.
    name
        In the database and of the files.
    database
        `lab.db`, `sqlite:///lab.db` or `postgresql://host/name`.
    profile
        As in a spec: one-touch, thesis, product, large, fine, auto.
    folder
        For the files; `out/NAME` if left out.
    formats
        Of step, stl, 3mf, glb; the first three if left out, `()` for pictures alone.
    verify
        Read STEP and STL back by independent programs before anything is kept.
    replace
        Allow another solid, or other settings, under a registered name.
    **settings
        What else a spec can say: ``symbols={"pitch": "8 mm"}``, ``print={"parts": "whole"}``,
        ``layout="faces"``, ``encoding={...}``.

    Returns
    -------
    EncodedSolid
        For `to_build123d` and `to_cadquery`.

    Raises
    ------
    GeneratorError
        See `generator.errors`; nothing is written or registered then.
    """
    polyhedron = polyhedron_from(solid)
    url = database_option(database)
    given = {"name": name, "profile": profile, **settings}
    located = spec_of(given, ShapeSpec("solid", {"sha256": _digest(polyhedron)}))
    choice = chosen([located], url, polyhedron)
    plan = planned(choice.specs[0], polyhedron)
    plan = dataclasses.replace(plan, notes=(*plan.notes, *choice.notes))
    product = encode_planned(
        plan,
        folder=Path(folder) if folder is not None else None,
        formats=formats,
        database=url,
        verify=verify,
        replace=replace,
    )
    made, layout = product.made, product.placed.layout
    return EncodedSolid(
        name=made.name,
        database=url,
        files=made.files,
        symbols=made.symbols,
        places=made.places,
        reused=made.reused,
        warnings=made.warnings,
        polyhedron=polyhedron,
        layout=layout,
        parts=_parts(plan, layout),
    )


def _parts(plan: Plan, layout: Layout) -> tuple[Part, ...]:
    return parts_of(plan, layout)[0]


def _digest(polyhedron: Polyhedron) -> str:
    """Return what tells two solids apart: their vertices, rounded, and their faces."""
    vertices = (polyhedron.vertices.round(DIGITS) + 0.0).tolist()
    content = json.dumps([vertices, [face.loops for face in polyhedron.faces]])
    return hashlib.sha256(content.encode()).hexdigest()
