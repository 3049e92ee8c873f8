"""The solids that a person can name: cube, box, prisms, pyramids, regular solids, round ones.

Lengths in mm. Prisms and pyramids stand on z = 0 with their axis on z; the base runs
counter-clockwise seen from above, its first edge in front (y < 0) along +x. Octahedron
and dodecahedron have their centre at the origin.

Prism over n corners (cube and box have n = 4): vertices 1 to n are the base, n + 1 to 2n
lie above them; F1 is the base, F2 to Fn+1 the sides in order (F2 in front), Fn+2 the top.
On a side the frame's origin is its lower left corner seen from outside, x level, y up.
Pyramid: vertices 1 to n are the base, n + 1 the apex; F1 is the base, F2 to Fn+1 the sides.

Tag: F1 is the top, the only face that carries symbols, F2 the base. With a frame, F1 stands
`FRAME_STEP_MM` over it, so that clamps and screws stay below a probe.

Cylinder and cone: F1 is the base, F2 the side (its facets go on as F2.2, F2.3, ...
counter-clockwise seen from above, the first in front), F3 the top. The facets are not inscribed:
their lines lie so far out that the unrolled side has the width 2 pi r of the round one (a cone:
its angle 2 pi sin(half angle)). Lines then stand a little outside the round side and the middles
of facets inside; the greatest distance of both is the chord error, pi^2 r / (3 N^2) to first
order, which sets the number N of facets.

Thesis 6.3, figures 6.14 to 6.19, whose screens show the faces F3 of the cube, F6 of the
parallelepiped and F2 of the triangular prism.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.errors import ShapeError
from generator.polyhedron.winged import Developable, Face, FaceLike, Polyhedron, polyhedron

SHORTEST_MM, LONGEST_MM = 1.0, 5000.0  #: lengths of a named shape
LENGTH_RATIO = 200.0  #: most a length may exceed another one of the same solid
TAG_MM = 3.0  #: thickness of a tag: holds still under 30 N, and M3 screws sink into it
FRAME_STEP_MM = 1.0  #: of a tag's frame below its face
MOST_SIDES = 64  #: of a prism or pyramid
#: Of a round face's facets: a tenth of a printed layer; also of round faces that are read.
CHORD_ERROR_MM = 0.02
FACETS = (24, 240)  #: fewest and most to a full circle; also of round faces that are read


def cube(side: float) -> Polyhedron:
    """Return a cube: 8 vertices, F1 base, F2 front, F3 right, F4 back, F5 left, F6 top."""
    check_lengths("cube", side=side)
    return _prism("cube", _rectangle(side, side), side)


def box(size: Sequence[float]) -> Polyhedron:
    """Return a parallelepiped of `size` = (x, y, z); faces as those of a cube."""
    if isinstance(size, str) or not isinstance(size, Sequence) or len(size) != 3:
        raise ShapeError(f"box has three lengths, not {size!r}", fix="write [80 mm, 80 mm, 120 mm]")
    x, y, z = size
    check_lengths("box", x=x, y=y, z=z)
    return _prism("box", _rectangle(x, y), z)


def triangular_prism(side: float, height: float) -> Polyhedron:
    """Return a right prism over an equilateral triangle: F1 base, F2 to F4 sides, F5 top."""
    check_lengths("triangular_prism", side=side, height=height)
    return _prism("triangular_prism", _regular_polygon(3, side), height)


def prism(
    sides: int, height: float, side: float | None = None, radius: float | None = None
) -> Polyhedron:
    """Return a right prism over a regular polygon given by its side or its circumradius."""
    side = _side("prism", sides, side, radius)
    check_lengths("prism", side=side, height=height)
    return _prism("prism", _regular_polygon(sides, side), height)


def pyramid(
    sides: int, height: float, side: float | None = None, radius: float | None = None
) -> Polyhedron:
    """Return a right pyramid over a regular polygon given by its side or its circumradius."""
    side = _side("pyramid", sides, side, radius)
    check_lengths("pyramid", side=side, height=height)
    return _pyramid("pyramid", _regular_polygon(sides, side), height)


def tetrahedron(side: float) -> Polyhedron:
    """Return a regular tetrahedron with edges of `side`: a pyramid of three sides, F1 its base."""
    check_lengths("tetrahedron", side=side)
    return _pyramid("tetrahedron", _regular_polygon(3, side), side * math.sqrt(2.0 / 3.0))


def octahedron(side: float) -> Polyhedron:
    """Return a regular octahedron with edges of `side`.

    Vertices: 1 to 4 on +x, +y, -x, -y, 5 on +z, 6 on -z. F1 to F4 are the upper faces from
    the quadrant x, y > 0 on, F5 to F8 the lower ones below them.
    """
    check_lengths("octahedron", side=side)
    r = side / math.sqrt(2.0)
    vertices = [(r, 0, 0), (0, r, 0), (-r, 0, 0), (0, -r, 0), (0, 0, r), (0, 0, -r)]
    upper = [(i, (i + 1) % 4, 4) for i in range(4)]
    lower = [((i + 1) % 4, i, 5) for i in range(4)]
    return polyhedron("octahedron", vertices, upper + lower)


def dodecahedron(side: float) -> Polyhedron:
    """Return a regular dodecahedron with edges of `side`.

    Vertices 1 to 8: (-, -, -), (-, -, +), ... (+, +, +) of the inscribed cube; 9 to 12 in
    the plane x = 0, 13 to 16 in z = 0, 17 to 20 in y = 0, each from -, - to +, +. Faces F1
    to F12 lie towards (0, -, -), (0, -, +), (0, +, -), (0, +, +) and these turned to
    (-, -, 0) ... (+, +, 0), then (-, 0, -) ... (+, 0, +).
    """
    check_lengths("dodecahedron", side=side)
    golden = (1.0 + math.sqrt(5.0)) / 2.0
    a = side * golden / 2.0  # half the edge of the inscribed cube
    short, long = a / golden, a * golden
    signs = [(s, t) for s in (-1, 1) for t in (-1, 1)]
    vertices = [(a * s, a * t, a * u) for s in (-1, 1) for t in (-1, 1) for u in (-1, 1)]
    vertices += [(0.0, s * short, t * long) for s, t in signs]
    vertices += [(s * short, t * long, 0.0) for s, t in signs]
    vertices += [(s * long, 0.0, t * short) for s, t in signs]
    # Normals (0, s golden, t) and its rotations, by the icosahedron dual to it.
    towards = [(0.0, s * golden, float(t)) for s, t in signs]
    towards += [(s * golden, float(t), 0.0) for s, t in signs]
    towards += [(float(s), 0.0, t * golden) for s, t in signs]
    points = np.array(vertices)
    return polyhedron("dodecahedron", points, [_cap(points, np.array(n)) for n in towards])


def tag(size: Sequence[float], thickness: float = TAG_MM, frame: float = 0.0) -> Polyhedron:
    """Return a plate of `size` = (x, y) with symbols on F1 alone, inside a lower frame if asked."""
    x, y = size
    lengths = {"x": x, "y": y, "thickness": thickness, **({"frame": frame} if frame else {})}
    check_lengths("tag", **lengths)
    top, base = _rectangle(x, y), _rectangle(x + 2.0 * frame, y + 2.0 * frame)
    levels = [(base, 0.0), (top, thickness)]
    if frame:
        if thickness < 2.0 * FRAME_STEP_MM:
            fix = f"set thickness to {2.0 * FRAME_STEP_MM:g} mm or more, 3 mm prints well"
            raise ShapeError(f"a tag of {thickness:g} mm has no room for a lower frame", fix=fix)
        step = thickness - FRAME_STEP_MM
        levels[1:1] = [(base, step), (top, step)]
    low, high, last = (0, 1, 2, 3), (4, 5, 6, 7), 4 * len(levels) - 4
    faces: list[FaceLike] = [tuple(range(last, last + 4)), (1, 0, 3, 2)]
    for k in range(0, last, 8):
        faces += [tuple(k + i for i in (a, b, b + 4, a + 4)) for a, b in pairwise((*low, 0))]
    if frame:
        faces.append([high, (8, 11, 10, 9)])
    vertices = np.concatenate([np.column_stack([ring, np.full(4, z)]) for ring, z in levels])
    return replace(polyhedron("tag", vertices, faces), blank=tuple(range(1, len(faces))))


def polyhedron_of(vertices: ArrayLike, faces: Sequence[FaceLike]) -> Polyhedron:
    """Return the polyhedron of vertices [[x, y, z], ...] and faces [[0, 1, 2], ...]: F1, F2, ...

    Vertices count from 0, counter-clockwise seen from outside; a face with holes is a list of
    loops, the outer one first.
    """
    return polyhedron("polyhedron", vertices, faces)


SHAPES: dict[str, Callable[..., Polyhedron]] = {
    "cube": cube,
    "box": box,
    "triangular_prism": triangular_prism,
    "tetrahedron": tetrahedron,
    "octahedron": octahedron,
    "dodecahedron": dodecahedron,
    "prism": prism,
    "pyramid": pyramid,
    "polyhedron": polyhedron_of,
}


def _prism(kind: str, base: NDArray[np.float64], height: float) -> Polyhedron:
    n = len(base)
    vertices, sides = _between(base, base, height)
    faces = [(1, 0, *range(n - 1, 1, -1)), *sides, tuple(range(n, 2 * n))]
    return polyhedron(kind, vertices, faces)


def _pyramid(kind: str, base: NDArray[np.float64], height: float) -> Polyhedron:
    vertices, sides = _between(base, np.zeros((1, 2)), height)
    return polyhedron(kind, vertices, [(1, 0, *range(len(base) - 1, 1, -1)), *sides])


def _between(
    base: NDArray[np.float64], top: NDArray[np.float64], height: float
) -> tuple[NDArray[np.float64], list[tuple[int, ...]]]:
    """Return vertices and sides between a ring (n, 2) on z = 0 and one above it, or one point."""
    n, ahead = len(base), [*range(1, len(base)), 0]
    rings = [
        np.column_stack([ring, np.full(len(ring), z)]) for ring, z in ((base, 0.0), (top, height))
    ]
    if len(top) == 1:
        return np.concatenate(rings), [(k, j, n) for k, j in enumerate(ahead)]
    return np.concatenate(rings), [(k, j, n + j, n + k) for k, j in enumerate(ahead)]


def _rectangle(x: float, y: float) -> NDArray[np.float64]:
    return 0.5 * np.array([(-x, -y), (x, -y), (x, y), (-x, y)], dtype=np.float64)


def _regular_polygon(sides: int, side: float) -> NDArray[np.float64]:
    """Corners (n, 2) of a regular polygon around the origin, its first edge in front along +x."""
    step = 2.0 * math.pi / sides
    angles = -math.pi / 2.0 - step / 2.0 + step * np.arange(sides)
    radius = side / (2.0 * math.sin(math.pi / sides))
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _cap(points: NDArray[np.float64], normal: NDArray[np.float64]) -> tuple[int, ...]:
    """Return the vertices farthest along `normal`, counter-clockwise, the lowest number first."""
    height = points @ normal
    corners = np.flatnonzero(height > height.max() - 1e-6 * np.ptp(height))
    spokes = points[corners] - points[corners].mean(axis=0)
    across = np.cross(normal / np.linalg.norm(normal), spokes[0])
    angle = np.arctan2(spokes @ across, spokes @ spokes[0])
    return tuple(int(v) for v in corners[np.argsort(angle % (2.0 * math.pi))])


def _side(shape: str, sides: int, side: float | None, radius: float | None) -> float:
    """Return the side of a regular polygon of which the side or the circumradius is given."""
    if isinstance(sides, bool) or not isinstance(sides, int) or not 3 <= sides <= MOST_SIDES:
        fix = "give a whole number; a cylinder needs no more than 64 sides"
        raise ShapeError(f"{shape} has 3 to {MOST_SIDES} sides, not {sides!r}", fix=fix)
    if side is not None and radius is None:
        return side
    if radius is not None and side is None:
        check_lengths(shape, radius=radius)
        return 2.0 * radius * math.sin(math.pi / sides)
    which = "both side and radius" if side is not None else "neither side nor radius"
    raise ShapeError(f"{shape} is given {which}", fix="give one of the two")


def check_lengths(shape: str, **lengths: float) -> None:
    """Refuse lengths that are no lengths, out of range, or out of proportion."""
    for name, length in lengths.items():
        if isinstance(length, bool) or not isinstance(length, int | float | np.floating):
            raise ShapeError(f"{shape}: {name} is {length!r}, not a length", fix="write 60 mm")
        if not SHORTEST_MM <= length <= LONGEST_MM:
            raise ShapeError(
                f"{shape}: {name} is {length:.6g} mm; allowed are {SHORTEST_MM:g} to "
                f"{LONGEST_MM:g} mm",
                fix=f"give {name} in that range, with its unit",
            )
    short, long = min(lengths, key=lengths.__getitem__), max(lengths, key=lengths.__getitem__)
    if lengths[long] > LENGTH_RATIO * lengths[short]:
        raise ShapeError(
            f"{shape}: {long} of {lengths[long]:.6g} mm is more than "
            f"{LENGTH_RATIO:g} times {short} of {lengths[short]:.6g} mm",
            fix=f"set {short} to {lengths[long] / LENGTH_RATIO:.4g} mm or more",
        )


def cylinder(diameter: float, height: float) -> Polyhedron:
    """Return a cylinder: F1 base, F2 side, F3 top."""
    check_lengths("cylinder", diameter=diameter, height=height)
    radius = diameter / 2.0
    count = _count(radius)
    out = radius * (math.pi / count) / math.sin(math.pi / count)
    error = max(out - radius, radius - out * math.cos(math.pi / count))
    return _round_solid("cylinder", count, (out, out), height, (radius, 0.0, error))


def cone(diameter: float, height: float, top_diameter: float = 0.0) -> Polyhedron:
    """Return a cone, or its lower part up to `top_diameter`: F1 base, F2 side, F3 top."""
    lengths = {"diameter": diameter, "height": height}
    check_lengths("cone", **lengths, **({"top_diameter": top_diameter} if top_diameter else {}))
    if top_diameter >= diameter:
        raise ShapeError(
            f"cone: top_diameter of {top_diameter:g} mm is not less than diameter of "
            f"{diameter:g} mm",
            fix="turn the cone upside down, or write shape: {cylinder: ...}",
        )
    radius, top = diameter / 2.0, top_diameter / 2.0
    count = _count(radius)
    sine = (radius - top) / math.hypot(radius - top, height)
    # Facets around the apex open by 2 pi sine / N each, so their lines lie at this angle.
    leaning = math.asin(math.sin(math.pi * sine / count) / math.sin(math.pi / count))
    apex = radius / math.tan(math.asin(sine))  # height of the tip
    low, high = ((apex - z) * math.tan(leaning) for z in (0.0, height))
    error = max(low - radius, radius - low * math.cos(math.pi / count))
    radii = low, high if top else 0.0
    return _round_solid("cone", count, radii, height, (radius, math.asin(sine), error))


def _count(radius: float) -> int:
    """Return the number of facets, a multiple of four."""
    wanted = math.pi * math.sqrt(radius / (3.0 * CHORD_ERROR_MM))
    return min(max(4 * math.ceil(wanted / 4.0), FACETS[0]), FACETS[1])


def _round_solid(
    kind: str,
    count: int,
    radii: tuple[float, float],
    height: float,
    surface: tuple[float, float, float],
) -> Polyhedron:
    """Return the solid between two rings below and above; a ring of radius 0 is one point.

    `surface`: radius, half angle and chord error of the round face.
    """
    angles = -math.pi / 2.0 - math.pi / count + 2.0 * math.pi / count * np.arange(count)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    low, high = radii
    vertices, sides = _between(low * circle, high * circle if high else np.zeros((1, 2)), height)
    faces = [Face("F1", (tuple(range(count))[::-1],))]
    faces += [Face(f"F2.{k + 1}" if k else "F2", (loop,)) for k, loop in enumerate(sides)]
    if high:
        faces.append(Face("F3", (tuple(range(count, 2 * count)),)))
    solid = polyhedron(kind, vertices, faces)
    radius, half_angle, error = surface
    facets = tuple(range(1, count + 1))
    side = Developable(kind, facets, radius, half_angle, True, False, error)
    return replace(solid, surfaces=(side,))


#: Shapes that are made in one piece, as no flat panels.
ROUND_SHAPES: dict[str, Callable[..., Polyhedron]] = {
    "cylinder": cylinder,
    "cone": cone,
    "tag": tag,
}
