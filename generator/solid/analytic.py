"""Round faces as cylinders and cones, with symbols bent onto them: what CAD programs want.

The printed form of a round face is a strip of facets, which stand for this face. It stays a strip
where a CAD program could not close it up with its neighbours: a rim that two planar faces share,
or that borders on facets of a blank face. Lengths in mm, angles in rad, frame of the face's axis.

A point (x, y) of the development at height z lies on the surface moved outward by z: on a
cylinder x goes around and y along the axis, on a cone angle and distance about the tip do. A
straight line becomes a helix or a geodesic, written as a Bezier curve through points of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import SymbolStyle, Tiers
from generator.alphabet.printable import gap_inside_mm
from generator.layout.placement import FaceLayout
from generator.polyhedron.check import directed_edges
from generator.polyhedron.development import Development, development
from generator.polyhedron.winged import Developable, Polyhedron
from generator.printers import Printer
from generator.solid.part import AnalyticFace, BentSymbol, Part, Points, Rim, transform, turn

_LEAST_FACETS = 3  # fewer facets do not tell an axis
_ON_CIRCLE = 1e-6  # vertices off their circle by less, as a share of the size, lie on it
#: Outlines of symbols in STEP lie this near to the round face: CAD programs keep 1e-4.
BEND_ERROR_MM = 2e-6
_DEGREES = (2, 9)  # of their Bezier curves; the highest is for symbols at the tip of a cone
_SAMPLES = 12  # points of a curve at which that is checked


class RoundSurfaceMap:
    """From the plane of a development to the round face."""

    def __init__(self, face: AnalyticFace, development: Development) -> None:
        self.face = face
        low, high = development.low, development.high
        self.origin = low[0]
        self.up = (high[0] - low[0]) / np.hypot(*(high[0] - low[0]))
        if face.slope == 0.0:
            self.right = np.array([self.up[1], -self.up[0]])
            self.spread = face.angle_rad / float((low[-1] - low[0]) @ self.right)
            return
        a, b = face.low.radius_mm, face.high.radius_mm
        self.tip = low[0] + a / (a - b) * (high[0] - low[0])
        arms = low - self.tip
        turns = np.unwrap(np.arctan2(arms[:, 1], arms[:, 0]))
        self.first, self.way = float(turns[0]), math.copysign(1.0, turns[-1] - turns[0])
        self.spread = face.angle_rad / float(turns[-1] - turns[0])
        sine = abs(math.sin(math.atan(face.slope)))
        self.slant = a / sine / float(np.hypot(*arms[0]))  # lines stand outside the round face

    def __call__(self, flat: Points, z_mm: Points) -> Points:
        """Return points (..., 2) of the plane at heights (...) on the round face, (..., 3)."""
        face = self.face
        moved = -z_mm if face.concave else z_mm
        if face.slope == 0.0:
            offset = flat - self.origin
            angle = offset @ self.right * self.spread
            radius, height = face.low.radius_mm + moved, offset @ self.up
        else:
            arms = flat - self.tip
            turned = np.arctan2(arms[..., 1], arms[..., 0]) - self.first
            angle = (self.way * turned % (2.0 * math.pi)) * self.way * self.spread
            along = np.hypot(arms[..., 0], arms[..., 1]) * self.slant
            lean = math.atan(face.slope)
            sine, cosine = abs(math.sin(lean)), math.cos(lean)
            tip = face.low.height_mm - face.low.radius_mm / face.slope
            radius = along * sine + moved * cosine
            height = tip + math.copysign(1.0, face.slope) * (along * cosine - moved * sine)
        bent: Points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)
        return bent


def bend_lines(
    place: RoundSurfaceMap,
    starts: Points,
    steps: Points,
    z_mm: Points,
    walls: NDArray[np.int64],
) -> list[Points]:
    """Return the control points of lines on the round face, each (degree, 3) without its end.

    `starts`, `steps` (k, 2), `z_mm` (k,): where a line begins, how far it goes, and its height;
    `walls` (k,): lines of one number get one degree, as a ruled surface needs it.
    """
    found: list[Points] = [np.zeros((0, 3))] * len(starts)
    left = np.arange(len(starts))
    for n in range(_DEGREES[0], _DEGREES[1] + 1):
        controls = _interpolate(place, starts[left], steps[left], z_mm[left], n)
        bad = np.unique(walls[left][_off(place.face, controls, z_mm[left]) > BEND_ERROR_MM])
        again = np.isin(walls[left], bad) & (n < _DEGREES[1])
        for k, own in zip(left[~again].tolist(), controls[~again], strict=True):
            found[k] = own[:-1]
        left = left[again]
        if not len(left):
            break
    return found


def _interpolate(
    place: RoundSurfaceMap, starts: Points, steps: Points, z_mm: Points, n: int
) -> Points:
    """Return the Bezier curves (k, n + 1, 3) of degree n through n + 1 points of each line."""
    t = 0.5 - 0.5 * np.cos(np.pi * np.arange(n + 1) / n)
    flat = starts[:, None, :] + t[None, :, None] * steps[:, None, :]
    points = place(flat, np.broadcast_to(z_mm[:, None], flat.shape[:2]))
    controls = np.asarray(np.linalg.solve(_bernstein(t, n), points), dtype=np.float64)
    controls[:, 0], controls[:, -1] = points[:, 0], points[:, -1]
    return controls


def _bernstein(t: Points, n: int) -> Points:
    """Return the Bernstein polynomials of degree n at t, (len(t), n + 1)."""
    binomials = np.array([math.comb(n, k) for k in range(n + 1)])
    k = np.arange(n + 1)
    polynomials: Points = binomials * np.power(t[:, None], k) * np.power(1.0 - t[:, None], n - k)
    return polynomials


def _off(face: AnalyticFace, controls: Points, z_mm: Points) -> Points:
    """Return how far curves leave the surface moved outward by z, (k,) mm."""
    t = np.linspace(0.0, 1.0, _SAMPLES)
    points = _bernstein(t, controls.shape[1] - 1) @ controls
    radius: Points = face.radius_at(points[..., 2], z_mm[:, None])
    off: Points = np.abs(np.hypot(points[..., 0], points[..., 1]) - radius).max(axis=1)
    return off


def analytic_faces(
    polyhedron: Polyhedron,
    layouts: Mapping[int, FaceLayout],
    tiers: tuple[Tiers, ...],
    facets: Mapping[int, tuple[int, ...]],
) -> tuple[AnalyticFace, ...]:
    """Return the round faces that can be written as cylinders and cones.

    The polyhedron's vertices and faces are the first ones of the part; mm, object frame. `layouts`
    (symbols) and `facets` (of the part, symbols included) go by the carrier of a round face.
    """
    found = []
    for surface in polyhedron.surfaces:
        face = _plain_face(polyhedron, surface, facets[surface.carrier])
        if face is not None:
            found.append((face, surface))
    holders = _planar_holders(polyhedron)
    while True:
        faces = [face for face, _ in found]
        closing = [pair for pair in found if _closes(pair[0], faces, holders)]
        if len(closing) == len(found):
            break
        found = closing
    return tuple(
        _with_symbols(face, polyhedron, surface, layouts[surface.carrier], tiers)
        if surface.carrier in layouts
        else face
        for face, surface in found
    )


def round_volume(part: Part) -> float | None:
    """Return by how much the body of a part is larger than its mesh, mm^3; None if nowhere round.

    Circular sectors less triangles, at every height a quadratic of the radius.
    """
    if not part.analytic:
        return None
    return sum(_sector_volume(part.vertices, face) for face in part.analytic)


def _sector_volume(vertices: Points, face: AnalyticFace) -> float:
    """Return what round sectors hold more than their triangles."""
    T = np.linalg.inv(face.T_part_axis)
    low = vertices[list(face.low.vertices)] @ T[:2, :3].T + T[:2, 3]
    reach = np.hypot(*low.T)
    angles = np.unwrap(np.arctan2(low[:, 1], low[:, 0]))
    a, b = face.low.radius_mm, face.high.radius_mm
    squares = (a * a + a * b + b * b) / 3.0 * (face.high.height_mm - face.low.height_mm)
    steps = np.abs(np.diff(angles))
    total = 0.5 * squares * float((steps - (reach[1:] / a) ** 2 * np.sin(steps)).sum())
    return -total if face.concave else total


def _plain_face(
    polyhedron: Polyhedron, surface: Developable, facets: tuple[int, ...]
) -> AnalyticFace | None:
    """Return a round face without its symbols; None where its vertices are not on circles."""
    d = development(polyhedron, surface)
    if len(surface.facets) < _LEAST_FACETS:
        return None
    axis = _axis(polyhedron.vertices, d, surface)
    if axis is None:
        return None
    T, reach = axis
    closed = surface.closed
    ends = transform(np.linalg.inv(T).astype(np.float64), polyhedron.vertices[d.vertices])
    angles = np.unwrap(np.arctan2(ends[:, 0, 1], ends[:, 0, 0]))
    height = float(ends[:, 1, 2].mean())
    # Lines of a named shape stand outside its round face, see `polyhedron.shapes`.
    pushed = reach[0] - surface.radius_mm if surface.radius_mm < reach[0] and closed else 0.0
    grown = 1.0 - pushed / reach[0]
    slack = _ON_CIRCLE * max(1.0, *reach, height)
    off = np.ptp(np.hypot(ends[:, :, 0], ends[:, :, 1]), axis=0).max()
    if off > slack or np.ptp(ends[:, :, 2], axis=0).max() > slack:
        return None
    low, high = ([*d.vertices[:, k].tolist()] for k in (0, 1))
    return AnalyticFace(
        name=polyhedron.faces[surface.carrier].name,
        facets=facets,
        T_part_axis=T,
        low=Rim(tuple(low), reach[0] * grown, 0.0),
        high=Rim(tuple(high), reach[1] * grown, height),
        angle_rad=2.0 * math.pi * float(np.sign(angles[-1] - angles[0]))
        if closed
        else float(angles[-1] - angles[0]),
        concave=surface.concave,
        symbols=(),
    )


def _axis(
    vertices: Points, d: Development, surface: Developable
) -> tuple[Points, tuple[float, float]] | None:
    """Return the axis' frame, and the radii of the rings of vertices below and above."""
    low, high = vertices[d.vertices[:, 0]], vertices[d.vertices[:, 1]]
    up = high - low
    up /= np.linalg.norm(up, axis=1)[:, None]
    z = up.mean(axis=0)
    if surface.kind == "cone":  # all lines lean to the axis by one angle
        across = np.linalg.svd(up - z)[2][2]
        z = across * np.sign(across @ z)
    z /= np.linalg.norm(z)
    x = low[0] - low[1] - ((low[0] - low[1]) @ z) * z
    x /= np.linalg.norm(x)
    flat = (low - low[0]) @ np.column_stack([x, np.cross(z, x)])
    # |p|^2 = 2 p c + const for all points of a circle about c.
    rows = np.column_stack([2.0 * flat, np.ones(len(flat))])
    answer, _, rank, _ = np.linalg.lstsq(rows, (flat**2).sum(axis=1), rcond=None)
    if rank < 3:
        return None
    centre = low[0] + answer[0] * x + answer[1] * np.cross(z, x)
    arm = low[0] - centre
    reach = float(np.linalg.norm(arm))
    T = np.eye(4)
    T[:3, 0] = arm / reach
    T[:3, 1] = np.cross(z, T[:3, 0])
    T[:3, 2], T[:3, 3] = z, centre
    above = high[0] - centre
    pointed = (d.vertices[:, 1] == d.vertices[0, 1]).all()
    return T, (reach, 0.0 if pointed else float(np.linalg.norm(above - (above @ z) * z)))


def _closes(
    face: AnalyticFace, faces: Sequence[AnalyticFace], holders: Mapping[tuple[int, int], int]
) -> bool:
    """Whether each rim borders on one planar face, or on the whole rim of another round face."""
    others = [  # as the other face runs along its rims
        ring
        for other in faces
        if other is not face
        for ring in (other.low.vertices, other.high.vertices[::-1])
    ]
    for rim, seen in ((face.low, face.low.vertices[::-1]), (face.high, face.high.vertices)):
        if rim.radius_mm > 0.0 and seen not in others:
            adjacent = {holders.get(step) for step in pairwise(seen)}
            if len(adjacent) != 1 or None in adjacent:
                return False
    return True


def _planar_holders(polyhedron: Polyhedron) -> dict[tuple[int, int], int]:
    """Return the planar face at each directed edge."""
    bent = {facet for surface in polyhedron.surfaces for facet in surface.facets}
    return {
        step: number
        for number, face in enumerate(polyhedron.faces)
        if number not in bent
        for step in directed_edges(face.loops)
    }


def _with_symbols(
    face: AnalyticFace,
    polyhedron: Polyhedron,
    surface: Developable,
    layout: FaceLayout,
    tiers: tuple[Tiers, ...],
) -> AnalyticFace:
    place = RoundSurfaceMap(face, development(polyhedron, surface))
    R = turn(-layout.placement.rotation_rad)
    labels = layout.labels.tolist()
    starts, steps, heights, walls, first = [], [], [], [], 0
    for centre, label in zip(layout.centres_mm, labels, strict=True):
        for z, tier in zip(tiers[label].z_mm, tiers[label].rings, strict=True):
            corners = [ring @ R.T for ring in tier]
            starts += [ring + centre for ring in corners]
            steps += [np.roll(ring, -1, axis=0) - ring for ring in corners]
            count = sum(map(len, tier))
            heights.append(np.full(count, z))
            walls.append(first + np.arange(count))
        first += count
    curves = iter(bend_lines(place, *map(np.concatenate, (starts, steps, heights, walls))))
    cells = zip(layout.rows.tolist(), layout.columns.tolist(), strict=True)
    shapes = []
    for (row, column), label in zip(cells, labels, strict=True):
        rings = tuple(
            tuple(tuple(next(curves) for _ in ring) for ring in tier) for tier in tiers[label].rings
        )
        shapes.append(BentSymbol(f"r{row}c{column}", tiers[label].z_mm, rings))
    return replace(face, symbols=tuple(shapes))


def least_facet_width(development: Development, height_mm: float) -> float:
    """Return the least width of a facet at a height, as a share of its width on the surface.

    Over 1 on a convex face, under 1 in a hole; 0 or less where facets vanish below that height.
    """
    d = development
    shares = []
    for points in (d.low, d.high):
        across = np.diff(points, axis=0)
        width = np.hypot(across[:, 0], across[:, 1])
        grown = np.linalg.norm(np.diff(d.bends, axis=0), axis=1) * height_mm
        with np.errstate(divide="ignore"):
            share = np.where(width > 0.0, grown / np.where(width > 0.0, width, 1.0), np.inf)
        shares.append(share.max())
    outward = _widens_outwards(d)
    return 1.0 if outward else 1.0 - float(max(shares))


def bend_problem(
    development: Development, tiers: tuple[Tiers, ...], style: SymbolStyle, printer: Printer
) -> str:
    """Return why a printer loses symbols on a face, "" where it does not."""
    share = least_facet_width(development, style.height_mm)
    if share <= 0.0:
        return f"symbols of {style.height_mm:g} mm meet in its middle"
    stroke = share * style.stroke_mm
    if stroke < printer.stroke_min_mm * (1 - 1e-9):
        return (
            f"its bend narrows strokes to {stroke:.2g} mm, {printer.name} needs "
            f"{printer.stroke_min_mm:g} mm"
        )
    gap = share * min(gap_inside_mm(shape) for shape in tiers)
    least = printer.gap_inside_mm
    if gap < least * (1 - 1e-9):
        return (
            f"its bend narrows gaps in a symbol to {gap:.3g} mm, {printer.name} needs {least:g} "
            "mm; a larger pitch helps"
        )
    return ""


def _widens_outwards(development: Development) -> bool:
    d = development
    T = d.T_object_flat[0]
    across = T[:3, :2] @ (d.low[1] - d.low[0])
    return bool((d.bends[1] - d.bends[0]) @ across >= 0.0)
