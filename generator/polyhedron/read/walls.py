"""Round walls of a mesh: strips of facets -> the cylinders and cones that they were divided from.

Facets of a wall are trapezoids, or triangles up to the tip of a cone, side by side, each with an
edge on either rim. They are a wall if both rims lie on circles about one axis and every line
between facets in a plane with it. What turns slowly into another curvature is a spline, strips
that follow each other up a sphere or a fillet bend both ways: both stay facets. Lengths in mm,
angles in rad.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.polyhedron.frame import size
from generator.polyhedron.winged import Developable, Polyhedron

SMOOTH_RAD = 0.36  #: facets of one curved surface meet at no more: circles of 18 sides and more
BEND = 0.5  #: radius, as a share of the size, above which narrow faces are planar ones
FEWEST = 4  #: facets of a wall: three of one width are always on a circle
LEAST_ARC_RAD = 0.6  #: of a wall
CHORD_ERROR_MM = 0.3  #: of 80 mm in 30 sides .22; beyond, facets are wide enough for symbols
OFF_CHORD = 0.05  #: of corners from the wall, as a share of the chord error
OFF_SIZE = 2e-5  #: or of the size, to which numbers of a file are rounded
WIDEST = 3.0  #: times the usual one that a step of a wall is at most: planes beside it are wider
ALIKE = 2.5  #: times as high as its neighbour that a strip of a surface bent both ways is at most
JUMP = 1.5  #: times that the curvature changes where a wall ends

Floats = NDArray[np.float64]
Loop = tuple[int, ...]
Wall = tuple[Developable, list[Loop]]  #: with its facets as loops that unroll


@dataclass(frozen=True, slots=True)
class _Strip:
    """Facets from left to right, and the lines beside and between them."""

    facets: list[int]
    low: list[int]  #: vertices, one more than facets
    high: list[int]

    def part(self, first: int, last: int) -> _Strip:
        ends = slice(first, last + 1)
        return _Strip(self.facets[first:last], self.low[ends], self.high[ends])

    @property
    def closed(self) -> bool:
        return (self.low[0], self.high[0]) == (self.low[-1], self.high[-1])


@dataclass(frozen=True, slots=True)
class _Fit:
    """The cylinder or cone through the corners of a strip."""

    radii_mm: tuple[float, float]  #: of the lower and the upper rim
    height_mm: float
    steps_rad: Floats  #: from line to line
    up: bool  #: whether the upper rim is the one to write above
    concave: bool

    @property
    def chord_error_mm(self) -> float:
        """Greatest distance of the facets from the round wall."""
        return max(self.radii_mm) * (1.0 - math.cos(float(self.steps_rad.max()) / 2.0))


def round_walls(solid: Polyhedron, normals: Floats) -> list[Wall]:
    """Return the round walls of a solid whose faces have unit normals (F, 3)."""
    loops = [face.loops[0] if len(face.loops) == 1 else () for face in solid.faces]
    found, taken = [], set[int]()
    for strip in _strips(loops, normals):
        for part, fit in _parts(solid.vertices, strip, OFF_SIZE * size(solid)):
            if taken.isdisjoint(part.facets):
                taken.update(part.facets)
                found.append((part, fit))
    kept = _bent_once(found, solid, normals)
    return [_wall(strip, fit) for strip, fit in sorted(kept, key=lambda one: min(one[0].facets))]


def _strips(loops: Sequence[Loop], normals: Floats) -> Iterator[_Strip]:
    """Give all strips of triangles or quadrangles that meet smoothly, as long as they are."""
    # (start, end) of an edge -> its face, and where in the loop it starts
    place: dict[tuple[int, int], tuple[int, int]] = {}
    for face, loop in enumerate(loops):
        if len(loop) in (3, 4):
            place |= {(v, loop[k + 1 - len(loop)]): (face, k) for k, v in enumerate(loop)}
    smooth, seen = math.cos(SMOOTH_RAD), set[tuple[int, int]]()

    def walk(face: int, k: int, to_right: int) -> Iterator[tuple[int, int]]:
        first, count = (face, k), len(loops[face])
        while True:
            loop = loops[face]
            start = k + 1 if to_right else k - 1  # the right edge goes up, the left one down
            start, end = loop[start % count], loop[(start + 1) % count]
            other, at = place.get((end, start), (face, 0))
            if other == face or len(loops[other]) != count:
                return
            if normals[face] @ normals[other] < smooth:
                return
            face, k = other, (at + 1 if to_right else at - 1) % count
            yield face, k
            if (face, k) == first:
                return

    for face, loop in enumerate(loops):
        for k in range({3: 3, 4: 2}.get(len(loop), 0)):
            if (face, k) in seen:
                continue
            right = list(walk(face, k, 1))
            closed = right[-1:] == [(face, k)]
            left = [] if closed else list(walk(face, k, 0))
            chain = [(face, k), *right[:-1]] if closed else [*left[::-1], (face, k), *right]
            seen.update((f, at % 2 if len(loop) == 4 else at) for f, at in chain)
            if len(chain) >= FEWEST and len({f for f, _ in chain}) == len(chain):
                low = [loops[f][at] for f, at in chain]
                high = [loops[f][at - 1] for f, at in chain]
                f, at = chain[-1]
                low.append(loops[f][(at + 1) % len(loop)])
                high.append(loops[f][(at + 2) % len(loop)])
                yield _Strip([f for f, _ in chain], low, high)


def _parts(vertices: Floats, strip: _Strip, off: float) -> Iterator[tuple[_Strip, _Fit]]:
    """Give the longest runs of a strip that are walls."""

    def fit(first: int, last: int) -> _Fit | None:
        own = strip.part(first, last)
        return _fit(vertices[own.low], vertices[own.high], off)

    count = len(strip.facets)
    whole = fit(0, count)
    if whole is not None:
        if strip.closed or whole.steps_rad.sum() >= LEAST_ARC_RAD:
            yield strip, whole
        return
    if strip.closed:  # begin where a run begins, and end where it comes back to
        strip = _Strip(strip.facets * 2, strip.low[:-1] * 2, strip.high[:-1] * 2)
        works = [fit(k, k + FEWEST) is not None for k in range(count)]
        k = next((k for k in range(count) if works[k] and not works[k - 1]), -1)
        if k < 0:
            return
        strip = strip.part(k, k + count)
    first = 0
    while first + FEWEST <= count:
        last, step = first + FEWEST - 1, 1
        while step:
            longer = last + step
            if longer <= count and fit(first, longer) is not None:
                last, step = longer, 2 * step
            else:
                step //= 2
        best = fit(first, last)
        if best is None or last - first < FEWEST:
            first += 1
            continue
        if best.steps_rad.sum() >= LEAST_ARC_RAD and _jumps(vertices, strip, first, last, best):
            yield strip.part(first, last), best
        first = last


def _jumps(vertices: Floats, strip: _Strip, first: int, last: int, fit: _Fit) -> bool:
    """Whether the curvature changes at once where a run ends and the strip goes on."""
    middle = (vertices[strip.low] + vertices[strip.high]) / 2
    steps = np.diff(middle, axis=0)
    width = np.linalg.norm(steps, axis=1)
    along = steps / width[:, None]
    turn = np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0))
    curvature = 2.0 * turn / (width[1:] + width[:-1])  # [k] between facets k and k + 1
    own = 2.0 / sum(fit.radii_mm)
    ends = [curvature[k] for k in (first - 1, last - 1) if 0 <= k < len(curvature)]
    return all(not 1.0 / JUMP < end / own < JUMP for end in ends)


def _fit(low: Floats, high: Floats, off: float) -> _Fit | None:
    """Return the wall through rims (n, 3), if they are on circles about one axis."""
    pointed = [bool((rim == rim[0]).all()) for rim in (low, high)]
    used = [k for k in (0, 1) if not pointed[k]]
    if not used:
        return None
    rims = [(low, high)[k] - (low, high)[k].mean(axis=0) for k in used]
    z = np.linalg.svd(np.concatenate(rims), full_matrices=False)[2][2]
    z = z * np.sign((high - low).sum(axis=0) @ z)
    x = rims[0][0] - (rims[0][0] @ z) * z
    x /= max(float(np.linalg.norm(x)), 1e-12)
    frame = np.column_stack([x, np.cross(z, x), z])
    place = (np.stack([low, high]) - low[0]) @ frame  # (2, n, 3)
    # |p|^2 = 2 p c + a constant of each circle, for all points of circles about c
    flat = place[used, :, :2]
    flat = flat - flat.mean(axis=1, keepdims=True)
    squares = (place[used, :, :2] ** 2).sum(axis=2)
    squares -= squares.mean(axis=1, keepdims=True)
    centre = np.linalg.lstsq(2.0 * flat.reshape(-1, 2), squares.ravel(), rcond=None)[0]
    arms = place[:, :, :2] - centre
    reach, height = np.hypot(arms[..., 0], arms[..., 1]), place[..., 2]
    spokes = arms[used[0]]
    turned = np.unwrap(np.arctan2(spokes[:, 1], spokes[:, 0]))
    steps = np.diff(turned)
    if not (steps > 0.0).all() and not (steps < 0.0).all():
        return None
    if np.abs(steps).max() > WIDEST * np.median(np.abs(steps)):
        return None
    radii = reach.mean(axis=1)
    error = max(radii) * (1.0 - math.cos(float(np.abs(steps).max()) / 2.0))
    off = max(off, OFF_CHORD * error)
    if error > CHORD_ERROR_MM or np.abs(steps).max() > SMOOTH_RAD * (1 + 1e-6):
        return None
    aside = arms[0] * arms[1, :, ::-1] * [1.0, -1.0]
    twist = np.abs(aside.sum(axis=1)) / max(radii)
    if max(np.ptp(reach, axis=1).max() / 2, np.ptp(height, axis=1).max() / 2, twist.max()) > off:
        return None
    rises = float(height[1].mean() - height[0].mean())
    largest = int(np.abs(z).argmax())
    return _Fit(
        (float(radii[0]), float(radii[1])), rises, np.abs(steps),
        up=bool(z[largest] > 0.0) if not any(pointed) else pointed[1], concave=bool(steps[0] < 0.0),
    )  # fmt: skip


def _bent_once(
    found: list[tuple[_Strip, _Fit]], solid: Polyhedron, normals: Floats
) -> list[tuple[_Strip, _Fit]]:
    """Leave out strips that go on smoothly over their rims, as those of spheres and fillets do."""
    left = {(edge.start, edge.end): edge.left for edge in solid.edges}
    left |= {(edge.end, edge.start): edge.right for edge in solid.edges}
    strip_of = {facet: k for k, (strip, _) in enumerate(found) for facet in strip.facets}
    slant = [math.hypot(fit.height_mm, fit.radii_mm[0] - fit.radii_mm[1]) for _, fit in found]
    ahead: list[set[int]] = [set() for _ in found]  # strips as high, that one goes on into
    bends = set()
    for k, (strip, _) in enumerate(found):
        for rim in (strip.low[::-1], strip.high):
            pairs = [
                (left[start, end], left[end, start]) for start, end in pairwise(rim) if start != end
            ]
            turns = ((float(normals[over] @ normals[own]), over) for over, own in pairs)
            cosine, other = min(turns, default=(-1.0, 0))
            turn = math.acos(min(1.0, max(-1.0, cosine)))
            if turn > SMOOTH_RAD:
                continue
            if slant[k] < BEND * size(solid) * turn:
                bends.add(k)
            n = strip_of.get(other, k)
            if n != k and max(slant[k], slant[n]) < ALIKE * min(slant[k], slant[n]):
                ahead[k].add(n)
    bends |= {k for k, each in enumerate(ahead) if len(each) > 1}
    bends |= {k for k, each in enumerate(ahead) if each & bends}
    return [one for k, one in enumerate(found) if k not in bends]


def _wall(strip: _Strip, fit: _Fit) -> Wall:
    facets, low, high = strip.facets, strip.low, strip.high
    (a, b) = fit.radii_mm
    if not fit.up:
        facets, low, high = facets[::-1], high[::-1], low[::-1]
    corners = pairwise(zip(low, high, strict=True))
    loops: list[Loop] = [(p, q, s, r) if r != s else (p, q, r) for (p, r), (q, s) in corners]
    bent = abs(a - b) > OFF_CHORD * fit.chord_error_mm + 1e-3 * max(a, b)
    lean = math.atan2(abs(a - b), fit.height_mm) if bent else 0.0
    kind = "cone" if bent else "cylinder"
    shape = Developable(
        kind, tuple(facets), max(a, b), lean, strip.closed, fit.concave, fit.chord_error_mm
    )
    return shape, loops
