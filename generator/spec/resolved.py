"""One object, all settings resolved: what the pipeline works from; mm and radians.

Nothing but `source`, which is for messages, depends on how the spec was written.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from encoded_objects.base.yaml_tree import Tree
from generator.alphabet.known import ALPHABETS, Alphabet
from generator.alphabet.outline import SymbolStyle
from generator.errors import GeneratorError
from generator.polyhedron.mount import Mount
from generator.printers import Printer, printer_named

AUTO = "auto"  # profile by default: array and pitch are chosen when the objects are made
EXPLICIT = "explicit"  # stands for the profile's name where an encoding is written out
GAP_MM = 0.14  # between assembled panels


@dataclass(frozen=True, slots=True)
class ShapeSpec:
    """A shape by name and sizes.

    ============================================  ===============================================
    kind                                          parameters
    ============================================  ===============================================
    cube, tetrahedron, octahedron, dodecahedron   side
    box                                           size: [x, y, z]
    triangular_prism                              side, height
    prism, pyramid                                sides, height, side or radius
    cylinder                                      diameter, height
    cone                                          diameter, height, top_diameter (0 if left out)
    tag                                           size: [x, y], thickness, frame (0 if left out)
    polyhedron                                    vertices: [[x, y, z], ...],
                                                  faces: [[loop, hole, ...], ...]
    file                                          sha256 (of the content of `file`), scale (1 if
                                                  left out)
    solid                                         sha256 (of the faces of a solid from a script)
    ============================================  ===============================================

    All but `file` and `solid` are what the functions of `generator.polyhedron.shapes.SHAPES`
    and `generator.polyhedron.shapes.ROUND_SHAPES` take.
    """

    kind: str
    parameters: Mapping[str, Any]
    file: Path | None = None  #: the model, for kind "file"


@dataclass(frozen=True, slots=True)
class ObjectSpec:
    """One object to make."""

    name: str  #: copies are called NAME-1, NAME-2, ...
    shape: ShapeSpec
    profile: str  #: name of the array's profile; "explicit" where the encoding is written out
    encoding: Mapping[str, Any]  #: the array, complete: what `array.definition()` returns
    alphabet: Alphabet
    style: SymbolStyle
    layout: Literal["auto", "net", "faces"]
    parts: Literal["panels", "whole"]
    wall_mm: float  #: thickness of panels
    gap_mm: float  #: between panels where they meet in the finished object
    printer: Printer
    formats: tuple[str, ...]  #: of step, stl, 3mf, bambu, glb, stpz, mjcf, urdf, sdf, usd
    folder: Path  #: for the files; relative to the current folder
    database: str  #: URL
    source: Tree = field(repr=False, compare=False)  #: its settings as written, and their places
    lab_key: str = ""  #: of the database, where the spec says it
    down: str = ""  #: face that one body stands on, or none; empty where it is chosen
    blank: tuple[str, ...] = ()  #: names of faces that carry no symbols
    mount: Mount | None = None  #: holes by which it is held
    colours: int = 1  #: of the filament: 2 where it is changed for the symbols
    density_kg_m3: float = 1240.0  #: of what is printed, for robots and simulators
    collision: Literal["touch", "body"] = "touch"  #: what other bodies hit there
    sensor: SensorType = USUAL_SENSOR  #: what will touch it
    #: name of the file or set that was given: files of a set bear it
    origin: str = field(default="", compare=False)
    coarser: str = field(default="", compare=False)  #: why symbols of the usual pitch do not print
    array_key: str = ""  #: lab key that `encoding` was made from; empty: the published array

    @property
    def meaning(self) -> dict[str, Any]:
        """What a spec means, as plain values; equal specs mean the same object.

        Names, folders, formats, the database and settings for robots do not count; a default counts
        as if it had been written; a file counts by its content.
        """
        gap = {} if self.gap_mm == GAP_MM else {"gap_mm": self.gap_mm}  # older specs had none
        down = {"down": self.down} if self.down else {}
        blank = {"blank": sorted(set(self.blank))} if self.blank else {}
        alphabet, name = self.alphabet, self.alphabet.name
        style = {name: round(value, 9) for name, value in asdict(self.style).items()}
        return {
            "shape": {"kind": self.shape.kind, **self.shape.parameters},
            "array": dict(self.encoding),
            "alphabet": name if ALPHABETS.get(name) == alphabet else alphabet.definition(),
            "style": style,
            "layout": self.layout,
            "parts": self.parts,
            "wall_mm": self.wall_mm,
            "printer": self._printer_meaning(),
            **gap,
            **({"mount": asdict(self.mount)} if self.mount else {}),
            **down,
            **blank,
        }

    def _printer_meaning(self) -> Any:
        """Return the name of a known printer, or the values of another one."""
        try:
            known = printer_named(self.printer.name) == self.printer
        except GeneratorError:
            known = False
        where = ("blocked_mm", "model")  # only say where parts lie, and older specs had none
        own = {name: value for name, value in asdict(self.printer).items() if name not in where}
        return self.printer.name if known else own
