"""Whether written panels fit: no overlap, and the gap, as `T_object_part` puts them together.

STL files and poses -> volume that two panels both fill, and their smallest distance, by the
booleans of manifold3d, which share nothing with what cut the panels. Lengths in mm.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from manifold3d import Error, Manifold, Mesh64
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.export.settings import READ_BACK
from generator.polyhedron.read.settings import MODEL
from generator.polyhedron.read.stl import stl_triangles

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PanelFile:
    """A written panel and where it belongs."""

    name: str
    path: Path  #: binary STL
    T_object_part: Floats  #: (4, 4)


@dataclass(frozen=True, slots=True)
class FitReport:
    """How the panels of an object fit."""

    pairs: int  #: that come nearer to each other than `READ_BACK.fit_reach_mm`
    overlap_mm3: float  #: that two panels both fill, all pairs together
    gap_mm: float | None  #: smallest distance of two panels; None where no pair is near


def verify_fit(panels: Sequence[PanelFile], gap_mm: float) -> FitReport:
    """Put written panels together and measure.

    Raises
    ------
    SolidError
        Two panels overlap or are nearer than `gap_mm`; names both.
    """
    solids = [_solid(panel) for panel in panels]
    boxes = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
    reach = max(READ_BACK.fit_reach_mm, 2 * gap_mm)
    pairs, total, smallest = 0, 0.0, reach
    for one, other in itertools.combinations(range(len(panels)), 2):
        apart = np.maximum(boxes[one, 0] - boxes[other, 1], boxes[other, 0] - boxes[one, 1])
        if apart.max() >= reach:
            continue
        gap = float(solids[one].min_gap(solids[other], reach))
        overlap = 0.0
        if apart.max() < 0:
            overlap = float((solids[one] ^ solids[other]).volume())
        names = f"panels '{panels[one].name}' and '{panels[other].name}'"
        if overlap > READ_BACK.fit_overlap_mm3:
            raise _misfit(f"{names} overlap by {overlap:.4f} mm3", panels[one])
        if gap < gap_mm - READ_BACK.fit_rounding_mm:
            raise _misfit(f"{names} are {gap:.4f} mm apart where {gap_mm:g} mm was meant",
                          panels[one])  # fmt: skip
        pairs += gap < reach
        total += overlap
        smallest = min(smallest, gap)
    return FitReport(pairs, total, smallest if pairs else None)


def _solid(panel: PanelFile) -> Manifold:
    """Return a written panel as it stands in the object."""
    corners = stl_triangles(
        panel.path.read_bytes(), str(panel.path), most=MODEL.most_part_triangles, padded=False
    )
    points, numbers = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    T = panel.T_object_part
    seated = points @ T[:3, :3].T + T[:3, 3]
    solid = Manifold(Mesh64(seated, numbers.reshape(-1, 3).astype(np.uint64)))
    if solid.status() != Error.NoError:
        raise _misfit(f"'{panel.name}' is no closed mesh", panel)
    return solid


def _misfit(cause: str, panel: PanelFile) -> SolidError:
    return SolidError(
        cause,
        fix="do not print them; report the spec together with this message",
        place=str(panel.path),
    )
