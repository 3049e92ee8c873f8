"""Encode a spec or a solid from a script, as `encode-object` encodes a spec.

::

    a spec: a path, text, a dict      -> Encoded
    a model: a path to STEP, STL, OBJ -> Encoded
    a solid of build123d, cadquery or trimesh -> EncodedSolid
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from encoded_objects.base.yaml_tree import Tree, tree_of
from generator.cad.read import polyhedron_from
from generator.database.open import without_unused
from generator.layout.placement import Layout
from generator.pipeline.encode import encode as encode_specs
from generator.pipeline.encode import plan_in_lab
from generator.pipeline.files import parts_of
from generator.pipeline.made import Encoded, MadeObject
from generator.pipeline.make import MakeJob, make_under_lock
from generator.polyhedron import Polyhedron
from generator.polyhedron.read import MESHES, STEP
from generator.solid import Part
from generator.spec import Problem, SpecError, read_specs
from generator.spec.option import database_option, format_option
from generator.spec.problem import SPEC
from generator.spec.read import SOURCE, spec_of, tree_from
from generator.spec.resolved import ShapeSpec

DIGITS = 6  #: of a coordinate (mm) at which two solids differ


@dataclass(frozen=True, slots=True)
class EncodedSolid:
    """A solid that was encoded and registered."""

    made: MadeObject
    database: str  #: URL
    polyhedron: Polyhedron  #: mm, frame of the solid that was given
    layout: Layout  #: which cell stands where on which face
    parts: tuple[Part, ...]  #: the printable parts, each with its `T_object_part`

    @property
    def name(self) -> str:
        """As it is registered."""
        return self.made.name

    @property
    def faces(self) -> int:
        """How many faces it has; a round face counts as one."""
        return self.made.faces

    @property
    def symbols(self) -> int:
        """How many symbols it bears."""
        return self.made.symbols

    @property
    def places(self) -> int:
        """How many places of it can be distinguished by touch."""
        return self.made.places

    @property
    def files(self) -> tuple[Path, ...]:
        """All that was written."""
        return self.made.files

    @property
    def folder(self) -> Path | None:
        """Where the files stand."""
        return self.made.folder

    @property
    def reused(self) -> bool:
        """Registered before, so the same cells again."""
        return self.made.reused

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is worth knowing before it is printed."""
        return self.made.warnings

    def __str__(self) -> str:
        return str(self.made)


@overload
def encode(
    given: str | Path | Mapping[str, Any],
    *,
    name: str | None = ...,
    database: str | Path | None = ...,
    profile: str | None = ...,
    folder: Path | str | None = ...,
    formats: str | Sequence[str] | None = ...,
    verify: bool = ...,
    replace: bool = ...,
    **settings: Any,
) -> Encoded: ...
@overload
def encode(
    given: Any,
    *,
    name: str,
    database: str | Path | None = ...,
    profile: str | None = ...,
    folder: Path | str | None = ...,
    formats: str | Sequence[str] | None = ...,
    verify: bool = ...,
    replace: bool = ...,
    **settings: Any,
) -> EncodedSolid: ...
def encode(
    given: Any,
    *,
    name: str | None = None,
    database: str | Path | None = None,
    profile: str | None = None,
    folder: Path | str | None = None,
    formats: str | Sequence[str] | None = None,
    verify: bool = False,
    replace: bool = False,
    **settings: Any,
) -> Encoded | EncodedSolid:
    """Emboss what a spec says, or a solid; write its files and register it.

    Parameters
    ----------
    given
        A spec: the path of a YAML file, its text, or its settings as a dict. Or a model: the
        path of a STEP, STL or OBJ file. Or one solid of build123d, cadquery or trimesh, mm.
    name
        In the database and of the files; a spec has its own.
    database
        `lab.db`, `sqlite:///lab.db` or `postgresql://host/name`, in place of the spec's own;
        `lab.db` if neither says one.
    profile
        As in a spec: auto (if left out), one-touch, large, fine, tactel-8, tactel-16, thesis,
        product.
    folder
        For the files; the spec's own or `out/NAME` if left out.
    formats
        Of step, stl, 3mf, glb, mjcf, urdf, sdf, usd, as a list or as `"stl,3mf"`; the first three
        if left out, `()` for pictures alone.
    verify
        Read STEP and STL back by independent programs before anything is kept.
    replace
        Allow another solid, or other settings, under a registered name.
    **settings
        What else a spec can say: ``symbols={"pitch": "8 mm"}``, ``print={"parts": "whole"}``,
        ``layout="faces"``, ``encoding={...}``, ``output={"lab_key": "..."}``.

    Returns
    -------
    Encoded
        Of a spec or a model's file: the objects that were made.
    EncodedSolid
        Of a solid, for `to_build123d` and `to_cadquery`.

    Raises
    ------
    GeneratorError
        See `generator.errors`; nothing is written or registered then.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> folder = mkdtemp()
    >>> spec = {"name": "Cube", "shape": {"cube": "30 mm"}}
    >>> result = encode(spec, database=f"{folder}/lab.db", folder=folder, formats=["stl"])
    >>> print(result)  # doctest: +ELLIPSIS
    Cube: 6 faces, 150 symbols, 9 files in ...
    >>> result.symbols, result.files[0].name
    (150, 'Cube-F1.stl')
    """
    named = {"name": name, "profile": profile, **settings}
    url = None if database is None else database_option(database)
    chosen = None if formats is None else format_option(formats)
    where = None if folder is None else Path(folder)
    if isinstance(given, str | Path | Mapping):
        specs = read_specs([_spec_source(given, named)], database=url)
        return encode_specs(
            specs, folder=where, formats=chosen, database=url, verify=verify, replace=replace
        )
    polyhedron = polyhedron_from(given)
    url = url or database_option("lab.db")
    spec = spec_of(named, ShapeSpec("solid", {"sha256": _digest(polyhedron)}))
    with without_unused(url):
        engine, (plan,), dry_build = plan_in_lab(
            [spec], url, make=True, replace_changed=replace, solid=polyhedron
        )
        assert engine is not None  # it was made
        to_make = MakeJob(
            plan,
            where or plan.spec.folder,
            plan.spec.formats if chosen is None else chosen,
            verify,
            replace,
        )
        made = make_under_lock(engine, to_make, dry_build=dry_build)
    parts = parts_of(plan, made.layout)[0]
    return EncodedSolid(made, url, polyhedron, made.layout, parts)


def _spec_source(given: str | Path | Mapping[str, Any], named: Mapping[str, Any]) -> Path | Tree:
    """Return where the spec is read from; settings given with a YAML file are refused."""
    if isinstance(given, Mapping):
        return tree_from({**given, **{key: one for key, one in named.items() if one is not None}})
    if Path(given).suffix.lower() in (*MESHES, *STEP):
        return tree_from({**named, "shape": {"file": given}})
    if more := [key for key, one in named.items() if one is not None]:
        cause = f"'{more[0]}' stands beside a spec, which says it itself"
        raise SpecError([Problem(cause, "write it in the spec, or give a dict", file=SOURCE)])
    if isinstance(given, str) and "\n" in given:
        return tree_of(given, SOURCE, Path(), SPEC)
    return Path(given)


def _digest(polyhedron: Polyhedron) -> str:
    """Return a digest of a solid: its vertices, rounded, and its faces."""
    vertices = (polyhedron.vertices.round(DIGITS) + 0.0).tolist()
    content = json.dumps([vertices, [face.loops for face in polyhedron.faces]])
    return hashlib.sha256(content.encode()).hexdigest()
