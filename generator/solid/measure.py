"""Box and volume of a part, from its plain body and one shape per symbol; inertia of meshes.

Sums over the tetrahedra that the triangles span with the origin are exact but for rounding
(F. Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.plane.polygon import signed_area, signed_volume
from generator.solid.part import Part, to_part, turn

Floats = NDArray[np.float64]


def symbol_volume(tiers: Tiers) -> float:
    """Return what a symbol adds to its body, mm^3; negative when engraved.

    Between two tiers every corner moves on a straight line, so the cross-section is a
    quadratic function of height and Simpson's rule is exact.
    """
    total = 0.0
    pairs = zip(tiers.z_mm, tiers.rings, tiers.z_mm[1:], tiers.rings[1:], strict=False)
    for z0, lower, z1, upper in pairs:
        middle = [(a + b) / 2 for a, b in zip(lower, upper, strict=True)]
        areas = [sum(signed_area(ring) for ring in rings) for rings in (lower, middle, upper)]
        total += (z1 - z0) * (areas[0] + 4 * areas[1] + areas[2]) / 6
    return total


def volume(part: Part) -> float:
    """Return the volume of a part with all its symbols, in closed form, mm^3."""
    total = signed_volume(part.vertices, [facet.loops for facet in part.facets])
    for embossing in part.embossings:
        counts = np.bincount(embossing.labels, minlength=len(embossing.tiers))
        for count, tiers in zip(counts.tolist(), embossing.tiers, strict=True):
            if count:
                total += count * symbol_volume(tiers)
    return total


def box(part: Part) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and highest x, y, z of a part with all its symbols, mm."""
    low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
    for embossing in part.embossings:
        R = turn(embossing.rotation_rad)
        for label in np.unique(embossing.labels).tolist():
            centres = to_part(embossing, embossing.centres_mm[embossing.labels == label], 0.0)
            tiers = embossing.tiers[label]
            for z, rings in zip(tiers.z_mm, tiers.rings, strict=True):
                shape = to_part(embossing, np.concatenate(rings) @ R.T, z)
                shape -= embossing.T_part_facet[:3, 3]
                low = np.minimum(low, centres.min(axis=0) + shape.min(axis=0))
                high = np.maximum(high, centres.max(axis=0) + shape.max(axis=0))
    return low, high


@dataclass(frozen=True, slots=True, eq=False)
class Inertia:
    """Of a body of density 1, in the axes of its corners."""

    volume: float  #: mm^3
    centre: Floats  #: (3,) mm
    tensor: Floats  #: (3, 3) mm^5, about the centre


def inertia_of(corners: Floats) -> Inertia:
    """Return volume, centre and inertia of closed meshes.

    `corners`: (n, 3, 3) of their triangles, counter-clockwise from outside, mm.
    """
    middle = corners.reshape(-1, 3).mean(axis=0)  # near the origin rounding is least
    a, b, c = np.moveaxis(corners - middle, 1, 0)
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    whole = a + b + c
    volume = float(six.sum()) / 6
    centre = six @ whole / 24 / volume
    second = np.zeros((3, 3))
    for points in (whole, a, b, c):
        second += (points * six[:, None]).T @ points / 120
    second -= volume * np.outer(centre, centre)
    return Inertia(volume, middle + centre, np.trace(second) * np.eye(3) - second)
