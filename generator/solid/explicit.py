"""Part -> all its vertices and planar polygons, nothing instanced: for tests and other tools."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.plane.polygon import face_vector
from generator.solid.emboss import to_part, turn
from generator.solid.part import Part


@dataclass(frozen=True, slots=True)
class Polygon:
    """One planar face of the expanded solid."""

    name: str
    loops: tuple[tuple[int, ...], ...]  #: vertices; outer first, holes reversed
    normal: NDArray[np.float64]  #: (3,) outward unit normal
    embossing: int  #: -1 for the body
    symbol: int  #: within the embossing; -1 for the body


@dataclass(frozen=True, slots=True)
class ExpandedSolid:
    """The expanded solid."""

    vertices: NDArray[np.float64]  #: (N, 3) mm, part frame
    polygons: tuple[Polygon, ...]


def expand_part(part: Part) -> ExpandedSolid:
    """Return every vertex and every planar polygon of a part.

    The body's facets come first, in their order; then per symbol its islands (facet inside a
    hole of the foot), sides from the foot up, and the top. Vertices of the body come first.
    """
    points = [part.vertices]
    count = len(part.vertices)
    loops = [list(facet.loops) for facet in part.facets]
    found: list[tuple[str, tuple[tuple[int, ...], ...], int, int]] = []
    for number, embossing in enumerate(part.embossings):
        R = turn(embossing.rotation_rad)
        facet = part.facets[embossing.facet].name
        for symbol, label in enumerate(embossing.labels.tolist()):
            tiers = embossing.tiers[label]
            name = f"{facet}/{embossing.names[symbol]}"
            numbers: list[list[tuple[int, ...]]] = []
            for z, rings in zip(tiers.z_mm, tiers.rings, strict=True):
                tier = []
                for ring in rings:
                    flat = ring @ R.T + embossing.centres_mm[symbol]
                    points.append(to_part(embossing, flat, z))
                    tier.append(tuple(range(count, count + len(ring))))
                    count += len(ring)
                numbers.append(tier)
            loops[embossing.facet].append(numbers[0][0][::-1])
            found += [(f"{name}/inside", (hole[::-1],), -1, -1) for hole in numbers[0][1:]]
            for lower, upper in pairwise(numbers):
                for a, b in zip(lower, upper, strict=True):
                    ahead = [*range(1, len(a)), 0]
                    found += [
                        (f"{name}/side", ((a[k], a[j], b[j], b[k]),), number, symbol)
                        for k, j in enumerate(ahead)
                    ]
            found.append((f"{name}/top", tuple(numbers[-1]), number, symbol))
    vertices = np.concatenate(points)
    body = [
        (facet.name, tuple(outline), -1, -1)
        for facet, outline in zip(part.facets, loops, strict=True)
    ]
    polygons = []
    for name, outline, number, symbol in body + found:
        normal = face_vector([vertices[list(loop)] for loop in outline])
        polygons.append(Polygon(name, outline, normal / np.linalg.norm(normal), number, symbol))
    return ExpandedSolid(vertices, tuple(polygons))
