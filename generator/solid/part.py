"""The intermediate solid: vertices, planar facets with loops, and what stands on them.

A part is a plain polyhedral body plus embossings. An embossing repeats a few outlines (tiers)
on one facet: 20,000 symbols are as small as the list of their centres, and exporters instance
each outline. Part frame: mm, as the part lies on the printer's bed (z up); its box is centred on
x and y and stands on z = 0. A point q of a symbol (its own axes, mm) lies at
T_part_facet (R q + centre, z) with R the turn by rotation_rad and z the tier's height. The x axis
of symbols runs along the array's columns: it stands at minus the placement's rotation in the face.
Thesis 5.5, 6.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.errors import SolidError
from generator.layout.placement import FaceLayout
from generator.plane.polygon import plane_axes
from generator.polyhedron.winged import Polyhedron

Frame = NDArray[np.float64]  #: (4, 4), T_to_from


def plane_frame(origin: NDArray[np.float64], ahead: NDArray[np.float64],
                normal: NDArray[np.float64]) -> Frame:  # fmt: skip
    """Return the frame at `origin` with z along `normal` and x along `ahead` in the plane."""
    frame = np.eye(4)
    frame[:3, :3] = np.stack(plane_axes(normal, ahead), axis=1)
    frame[:3, 3] = origin
    return frame


def in_frame(T_to_from: Frame, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) points given in the `to` frame in the `from` frame."""
    result: NDArray[np.float64] = (points - T_to_from[:3, 3]) @ T_to_from[:3, :3]
    return result


def transform(T_to_from: Frame, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) points given in the `from` frame in the `to` frame."""
    result: NDArray[np.float64] = points @ T_to_from[:3, :3].T + T_to_from[:3, 3]
    return result


def edge_numbers(polyhedron: Polyhedron) -> dict[tuple[int, int], int]:
    """Return the edge number of every directed pair of neighbouring vertices."""
    numbers: dict[tuple[int, int], int] = {}
    for number, edge in enumerate(polyhedron.edges):
        numbers[edge.start, edge.end] = number
        numbers[edge.end, edge.start] = number
    return numbers


Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BentSymbol:
    """A symbol on a round face, in the frame of the face's axis."""

    name: str  #: "r12c34"
    z_mm: tuple[float, ...]  #: height of each tier
    rings: tuple[tuple[tuple[Points, ...], ...], ...]
    """[tier][ring][edge] (degree, 3): Bezier curve of an edge, without its end."""


@dataclass(frozen=True, slots=True)
class Rim:
    """The arc of a circle that a round face ends in; at the tip of a cone radius 0."""

    vertices: tuple[int, ...]  #: of the part, to the right; the first again where it is closed
    radius_mm: float
    height_mm: float  #: along the axis


@dataclass(frozen=True, slots=True)
class AnalyticFace:
    """A cylinder or cone face of a part, in place of facets."""

    name: str
    facets: tuple[int, ...]  #: of the part, that it stands for
    T_part_axis: Points  #: (4, 4); z along the axis from the lower rim to the upper, line 0 at x
    low: Rim
    high: Rim
    angle_rad: float  #: from the first line to the last, about z
    concave: bool
    symbols: tuple[BentSymbol, ...]

    @property
    def closed(self) -> bool:
        """Whether it goes all around the axis."""
        return self.low.vertices[0] == self.low.vertices[-1]

    @property
    def slope(self) -> float:
        """Radius that it gains for each mm along the axis; 0 for a cylinder."""
        return (self.high.radius_mm - self.low.radius_mm) / (
            self.high.height_mm - self.low.height_mm
        )

    def radius_at(self, height_mm: Points, z_mm: Points) -> Points:
        """Return the radius of the face moved outward by z, at heights along the axis."""
        moved = z_mm * math.hypot(1.0, self.slope) * (-1.0 if self.concave else 1.0)
        radius: Points = self.low.radius_mm + self.slope * (height_mm - self.low.height_mm) + moved
        return radius


@dataclass(frozen=True, slots=True)
class Facet:
    """A planar polygon of the body, before its embossing is cut in."""

    name: str
    loops: tuple[tuple[int, ...], ...]  #: body vertices; outer counter-clockwise seen from outside


@dataclass(frozen=True, slots=True)
class Embossing:
    """Symbols on one facet; tiers with falling z are engraved instead."""

    facet: int  #: number of the facet in the part
    face: int | None  #: face of the object, None for marks such as edge numbers
    T_part_facet: NDArray[np.float64]  #: (4, 4); z outward, the facet lies in z = 0
    rotation_rad: float  #: of the symbols' x axis in the facet frame
    centres_mm: NDArray[np.float64]  #: (n, 2) facet frame
    labels: NDArray[np.int64]  #: (n,) which outline of `tiers`
    names: tuple[str, ...]  #: (n,) name of each symbol, "r12c34"
    tiers: tuple[Tiers, ...]  #: one per label, in the symbol's own axes
    pitch_mm: float = 0.0  #: of the lattice that all centres lie on; 0 where there is none


@dataclass(frozen=True, slots=True)
class WrappedSymbols:
    """Symbols on a round face: not instanced, each bends over the facets under it.

    Their sides and tops are facets of the part.
    """

    face: int  #: face of the object
    facets: tuple[int, ...]  #: of the part that carry them
    first: int  #: facet of the part with which the symbols' own facets begin
    symbols: NDArray[np.int64]  #: (m,) symbol that each of the facets from `first` on belongs to
    labels: NDArray[np.int64]  #: (n,)
    names: tuple[str, ...]  #: (n,) name of each symbol, "r12c34"
    feet: tuple[Facet, ...]  #: what the symbols cut out of the facets that carry them


@dataclass(frozen=True, slots=True)
class Part:
    """One printable body."""

    name: str
    vertices: NDArray[np.float64]  #: (V, 3) mm, part frame; the body alone
    facets: tuple[Facet, ...]
    embossings: tuple[Embossing, ...]
    T_object_part: NDArray[np.float64]  #: (4, 4)
    wrapped: tuple[WrappedSymbols, ...] = ()
    analytic: tuple[AnalyticFace, ...] = ()  #: what some of the facets stand for

    @property
    def seated(self) -> NDArray[np.float64]:
        """Vertices (V, 3) of the body in the object frame, mm."""
        return transform(self.T_object_part, self.vertices)

    @property
    def symbols(self) -> int:
        """Number of symbols; marks such as edge numbers do not count."""
        flat = sum(len(e.labels) for e in self.embossings if e.face is not None)
        return flat + sum(len(w.labels) for w in self.wrapped)

    def moved(
        self, by_mm: NDArray[np.float64], R_new_old: NDArray[np.float64] | None = None
    ) -> Part:
        """Return the part turned by (3, 3), then shifted by (3,) mm in its own frame.

        In the object it stays in place.
        """
        T_new_old = np.eye(4)
        T_new_old[:3, 3] = by_mm
        T_object_part = self.T_object_part.copy()
        vertices = self.vertices
        if R_new_old is not None:
            T_new_old[:3, :3] = R_new_old
            T_object_part[:3, :3] = T_object_part[:3, :3] @ R_new_old.T
            vertices = vertices @ R_new_old.T
        T_object_part[:3, 3] -= T_object_part[:3, :3] @ by_mm
        return replace(
            self,
            vertices=vertices + by_mm,
            embossings=tuple(
                replace(one, T_part_facet=T_new_old @ one.T_part_facet) for one in self.embossings
            ),
            analytic=tuple(
                replace(face, T_part_axis=T_new_old @ face.T_part_axis) for face in self.analytic
            ),
            T_object_part=T_object_part,
        )


def embossing_of(
    layout: FaceLayout,
    tiers: tuple[Tiers, ...],
    facet: int,
    T_part_face: NDArray[np.float64],
    pitch_mm: float,
) -> Embossing:
    """Return the embossing of one face on a facet of the part; T_part_face (4, 4).

    Raises `SolidError` if a label has no outline.
    """
    labels = layout.labels
    if len(labels) and not (labels.min() >= 0 and labels.max() < len(tiers)):
        raise SolidError(
            f"symbol {int(labels.max())} on an alphabet of {len(tiers)} symbols",
            fix="take an alphabet of the array's order",
            place=f"face {layout.face + 1}",
        )
    cells = zip(layout.rows.tolist(), layout.columns.tolist(), strict=True)
    return Embossing(
        facet=facet,
        face=layout.face,
        T_part_facet=T_part_face,
        rotation_rad=-layout.placement.rotation_rad,
        centres_mm=layout.centres_mm,
        labels=labels,
        names=tuple(f"r{row}c{column}" for row, column in cells),
        tiers=tiers,
        pitch_mm=pitch_mm,
    )


def to_part(embossing: Embossing, points: NDArray[np.float64], z_mm: float) -> NDArray[np.float64]:
    """Return (n, 3) part points of (n, 2) points in the facet frame at height `z_mm`."""
    T = embossing.T_part_facet
    flat: NDArray[np.float64] = points @ T[:3, :2].T + (T[:3, 3] + z_mm * T[:3, 2])
    return flat


def turn(angle_rad: float) -> NDArray[np.float64]:
    """Return the (2, 2) rotation by an angle; exact at quarter turns."""
    quarters = angle_rad / (np.pi / 2)
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    if abs(quarters - round(quarters)) < 1e-15:
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[round(quarters) % 4]
    return np.array([[c, -s], [s, c]], dtype=np.float64)
