"""The formats that an object is written in: one line of `EXPORTERS` each.

A format writes a file for each part (`write_part`), files of the whole object (`write`), or both.
`--verify` reads them back by a program that shares nothing with the writer. Functions are given
as "module:name" and load when they are used: few formats are wanted at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from generator.export.atomic import StagedFile, Staging
    from generator.export.bed import Size
    from generator.export.robot.model import RobotModel
    from generator.export.threemf import PrintFile, SlicerSettings
    from generator.polyhedron import Polyhedron
    from generator.solid import Mesh, Part

Content = bytes | Iterable[bytes | memoryview]
Files = Iterator[tuple[str, Content]]  #: name and content of each file


@dataclass(frozen=True)
class ExportedObject:
    """An object as writers need it; values that several of them share are made once."""

    name: str
    polyhedron: Polyhedron
    parts: Sequence[Part]
    meshes: Sequence[Mesh]  #: of each part, part frame, mm
    bed_mm: Size = (250.0, 210.0)
    slicer: SlicerSettings | None = None  #: None for a printer without a nozzle
    density_kg_m3: float = 1240.0
    stroke_mm: float = 1.0  #: of the symbols
    touch: bool = True  #: simulators feel them

    @cached_property
    def plates(self) -> tuple[PrintFile, ...]:
        """The parts on the plates of the printer."""
        from generator.export.threemf import print_files

        return print_files(self.name, self.parts, self.bed_mm, self.slicer)

    @cached_property
    def robot(self) -> RobotModel:
        """One rigid body."""
        from generator.export.robot.model import robot_model

        return robot_model(
            self.name, self.polyhedron, self.parts, self.meshes,
            density_kg_m3=self.density_kg_m3, stroke_mm=self.stroke_mm, touch=self.touch,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Exporter:
    """One format. Functions: "module:name", or the function itself."""

    name: str  #: in `formats`
    suffix: str  #: of its files; those with this one are verified
    write_part: str | Callable[[Part, Mesh], Content] = ""
    write: str | Callable[[ExportedObject], Files] = ""
    verify_part: str | Callable[[Part, Path], object] = ""
    verify: str | Callable[[ExportedObject, Path], object] = ""
    registered: bool = False  #: the database holds the digest of its files of parts
    kept: bool = False  #: files that stand are kept when a set is resumed
    robot: bool = False  #: written from `ExportedObject.robot`


_STEP, _ROBOT = "generator.export.step", "generator.export.robot"
_CHECK = "generator.export.check"
EXPORTERS = {
    each.name: each
    for each in (
        Exporter("step", ".step", f"{_STEP}:write_part", f"{_STEP}:write_assembly",
                 f"{_CHECK}:verify_step", registered=True, kept=True),
        Exporter("stl", ".stl", "generator.export.meshes:write_stl",
                 verify_part=f"{_CHECK}:verify_stl", registered=True, kept=True),
        Exporter("3mf", ".3mf", write="generator.export.threemf:write_plates", kept=True),
        Exporter("bambu", ".3mf", write="generator.export.bambu:write_projects", kept=True),
        Exporter("glb", ".glb", write="generator.export.meshes:write_glb", kept=True),
        Exporter("stpz", ".stpz", f"{_STEP}:write_part_gzipped", f"{_STEP}:write_assembly_gzipped"),
        Exporter("mjcf", ".xml", write=f"{_ROBOT}.xml_files:write_mjcf",
                 verify=f"{_ROBOT}.xml_files:verify_mjcf", robot=True),
        Exporter("urdf", ".urdf", write=f"{_ROBOT}.xml_files:write_urdf",
                 verify=f"{_ROBOT}.xml_files:verify_urdf", robot=True),
        Exporter("sdf", ".sdf", write=f"{_ROBOT}.xml_files:write_sdf",
                 verify=f"{_ROBOT}.xml_files:verify_sdf", robot=True),
        Exporter("usd", ".usdc", write=f"{_ROBOT}.usd:write", verify=f"{_ROBOT}.usd:verify",
                 robot=True),
    )
}  # fmt: skip


def stage_formats(
    exported: ExportedObject,
    formats: Sequence[str],
    staging: Staging,
    *,
    verify: bool = False,
    progress: Callable[[str, float], None] = lambda _what, _share: None,
) -> dict[str, list[StagedFile]]:
    """Write an object in some formats; return the files of each.

    Files of parts come first, each part in all formats, then assemblies, then all else. Files that
    several formats need (the meshes of a robot model) are written once. Raises `SolidError` if a
    file does not pass its verification, `MissingExtraError` without the library that reads a
    format, `WriteError` if a file cannot be written.
    """
    chosen = [exporter for name, exporter in EXPORTERS.items() if name in formats]
    staged: dict[str, list[StagedFile]] = {exporter.name: [] for exporter in chosen}
    of_parts = [exporter for exporter in chosen if exporter.write_part]
    count = len(exported.parts)
    for number, (part, mesh) in enumerate(zip(exported.parts, exported.meshes, strict=True)):
        progress(f"writing {part.name}", 0.1 + 0.6 * number / count)
        for exporter in of_parts:
            content = _load(exporter.write_part)(part, mesh)
            file = staging.write(part.name + exporter.suffix, content, digest=exporter.registered)
            staged[exporter.name].append(file)
            if verify and exporter.verify_part:
                progress(f"verifying {part.name}", 0.1 + 0.6 * (number + 0.5) / count)
                _load(exporter.verify_part)(part, file.staged)
    names: set[str] = set()
    for exporter in sorted(chosen, key=lambda one: not one.write_part):
        if not exporter.write:
            continue
        progress(f"writing {exporter.name}", 0.7)
        for name, content in _load(exporter.write)(exported):
            if name not in names:
                names.add(name)
                staged[exporter.name].append(staging.write(name, content))
        if verify and exporter.verify:
            for file in staged[exporter.name]:
                if file.path.suffix == exporter.suffix:
                    _load(exporter.verify)(exported, file.staged)
    return staged


def _load(function: str | Callable[..., Any]) -> Callable[..., Any]:
    if not isinstance(function, str):
        return function
    module, _, name = function.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found
