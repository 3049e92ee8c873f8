"""Prove that a part is one closed solid, from its plain body and one shape per symbol.

(1) Body: every directed edge of the facets' loops occurs once, and its reverse once; facets
are planar. (2) Shape: tiers have equal corners, parallel edges and heights that rise or
fall, so its sides are planar and close it up to the loops in the facet. (3) Feet lie inside
their facet and apart from each other. Together: the part is closed, and its facets meet in
their edges alone. No symbol is expanded.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers, foot_half_mm
from generator.errors import SolidError
from generator.plane.polygon import boxes_inside, edges_cross, face_vector, points_inside
from generator.solid.part import Embossing, Part, in_frame, to_part, turn

Ring = NDArray[np.float64]

_PLANARITY = 1e-9  # points may lie off their plane by this share of the part's size


def prove_closed(part: Part) -> None:
    """Prove that a part is closed, planar and free of overlapping symbols.

    Raises `SolidError` that names the facet or the symbol where the proof fails.
    """
    _check_edges(part)
    size = float(np.ptp(part.vertices, axis=0).max())
    on: dict[int, list[Embossing]] = {}
    for embossing in part.embossings:
        on.setdefault(embossing.facet, []).append(embossing)
        for tiers in embossing.tiers:
            if fault := _shape_fault(tiers):
                raise SolidError(fault, place=f"{part.name}: {part.facets[embossing.facet].name}")
    for facet, plain in enumerate(part.facets):
        if len(plain.loops) == 1 and len(plain.loops[0]) == 3 and facet not in on:
            continue  # a triangle is planar
        place = f"{part.name}: {plain.name}"
        corners = [part.vertices[list(loop)] for loop in plain.loops]
        normal = face_vector(corners)
        normal /= np.linalg.norm(normal)
        points = np.concatenate(corners) - corners[0][0]
        if np.abs(points @ normal).max() > _PLANARITY * size:
            fix = "export the model as STEP, or its curved regions as triangles with more digits"
            raise SolidError("a facet is not planar", fix=fix, place=place)
        for embossing in on.get(facet, []):
            flat = in_frame(embossing.T_part_facet, np.concatenate(corners))[:, 2]
            upright = float(embossing.T_part_facet[:3, 2] @ normal)
            if np.abs(flat).max() > _PLANARITY * size or upright < 1 - _PLANARITY:
                raise SolidError("symbols do not stand on their facet", place=place)
            _check_inside(embossing, corners, place)
        _check_apart(on.get(facet, []), place)


def edges_once(start: NDArray[np.int64], end: NDArray[np.int64]) -> bool:
    """Whether every directed edge (start, end) occurs once and its reverse once."""
    count = int(max(start.max(), end.max())) + 1
    there, back = np.sort(start * count + end), np.sort(end * count + start)
    return bool((there == back).all() and (np.diff(there) > 0).all())


def _check_edges(part: Part) -> None:
    """(1) The body closes."""
    start = np.concatenate([loop for facet in part.facets for loop in facet.loops])
    end = np.concatenate([np.roll(loop, -1) for facet in part.facets for loop in facet.loops])
    if not edges_once(start, end):
        raise SolidError(
            "the body is not closed: an edge has not exactly two facets", place=part.name
        )


@lru_cache(maxsize=256)
def _shape_fault(tiers: Tiers) -> str:
    """(2) Say why a symbol does not close up to its foot with planar sides; "" where it does."""
    steps = np.diff(tiers.z_mm)
    sizes = [[len(ring) for ring in rings] for rings in tiers.rings]
    fit = tiers.z_mm[0] == 0.0 and len(sizes) == len(tiers.z_mm) > 1
    fit = fit and all(size == sizes[0] for size in sizes)
    if not fit or not ((steps > 0).all() or (steps < 0).all()):
        return "tiers of a symbol do not correspond"
    for lower, upper in pairwise(tiers.rings):
        for a, b in zip(lower, upper, strict=True):
            u, v = np.roll(a, -1, axis=0) - a, np.roll(b, -1, axis=0) - b
            length = np.hypot(*u.T) * np.hypot(*v.T)
            cross = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
            if (np.abs(cross) > 1e-12 * length).any() or ((u * v).sum(axis=1) <= 0).any():
                return "a side of a symbol is not planar"
    if any(edges_cross(rings) for rings in tiers.rings):
        return "an outline of a symbol crosses itself"
    return ""


def _check_inside(embossing: Embossing, corners: list[Ring], place: str) -> None:
    """(3) Feet lie inside the facet: by their squares, and those that do not, by their outline."""
    R = turn(embossing.rotation_rad)
    rings = [in_frame(embossing.T_part_facet, corner)[:, :2] @ R for corner in corners]
    centres = embossing.centres_mm @ R
    for label in np.unique(embossing.labels).tolist():
        chosen = np.flatnonzero(embossing.labels == label)
        half = foot_half_mm(embossing.tiers[label])
        doubtful = chosen[~boxes_inside(centres[chosen], half, rings)]
        for symbol in doubtful.tolist():
            foot = embossing.tiers[label].rings[0][0] + centres[symbol]
            if not points_inside(foot, rings).all() or edges_cross([*rings, foot]):
                raise SolidError(
                    f"symbol {embossing.names[symbol]} reaches over the edge of its face",
                    fix="keep symbols away from edges by the printer's clearance and the "
                    "panel's inset",
                    place=place,
                )


def _check_apart(embossings: list[Embossing], place: str) -> None:
    """(3) Feet lie apart: symbols of one lattice by their cells, others by box and outline."""
    if not embossings:
        return
    if len(embossings) == 1 and _one_lattice(embossings[0]):
        return
    T = embossings[0].T_part_facet
    feet, names = [], []
    for embossing in embossings:
        R = turn(embossing.rotation_rad)
        for centre, label, name in zip(
            embossing.centres_mm, embossing.labels.tolist(), embossing.names, strict=True
        ):
            foot = embossing.tiers[label].rings[0][0] @ R.T + centre
            feet.append(in_frame(T, to_part(embossing, foot, 0.0))[:, :2])
            names.append(name)
    low = np.array([foot.min(axis=0) for foot in feet])
    high = np.array([foot.max(axis=0) for foot in feet])
    order = np.argsort(low[:, 0], kind="stable")
    reach = np.searchsorted(low[order, 0], high[order, 0], side="right").tolist()
    for k, stop in enumerate(reach):
        one, others = order[k], order[k + 1 : stop]
        close = (low[others, 1] <= high[one, 1]) & (low[one, 1] <= high[others, 1])
        for other in others[close].tolist():
            a, b = feet[one], feet[other]
            if edges_cross([a, b]) or points_inside(a[:1], [b])[0] or points_inside(b[:1], [a])[0]:
                raise SolidError(f"symbols {names[one]} and {names[other]} overlap", place=place)


def _one_lattice(embossing: Embossing) -> bool:
    """Whether all symbols stand in different cells of a lattice that is wider than any foot."""
    pitch = embossing.pitch_mm
    used = np.unique(embossing.labels).tolist()
    if pitch <= 0 or any(foot_half_mm(embossing.tiers[label]) >= pitch / 2 for label in used):
        return False
    centres = embossing.centres_mm @ turn(embossing.rotation_rad)
    cells = np.rint((centres - centres[0]) / pitch)
    off = float(np.abs(centres - centres[0] - cells * pitch).max())
    wide = max(foot_half_mm(embossing.tiers[label]) for label in used)
    apart = len(np.unique(cells, axis=0)) == len(cells)
    return apart and 2 * (wide + off) < pitch
