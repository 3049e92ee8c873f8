"""Holes by which a part is held: flange of a robot, screws, magnets, a rod, a bolt.

Polyhedron + mount -> the same solid with round holes that are faces of it: true cylinders and cones
in STEP, facets elsewhere, holes in the registered outlines. The face that is mounted and the walls
of holes carry no symbols, and the layout keeps symbols clear of the edges of holes. Lengths in mm.

Sizes are those of standards: clearance holes ISO 273 (medium), heads of socket screws ISO 4762 in
counterbores DIN 974-1, of countersunk screws ISO 15065 (90 degrees), flanges ISO 9409-1 with their
pin (ISO 2338) on the pitch circle, midway between two screws. What is printed for a fit is wider by
`FIT_MM`; what ends blind ends flat, as a magnet needs it, or in a tip of 45 degrees, which needs no
supports.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.plane.polygon import points_inside
from generator.polyhedron.frame import face_frame, face_polygon
from generator.polyhedron.shapes import CHORD_ERROR_MM, FACETS
from generator.polyhedron.winged import Developable, Face, Polyhedron, polyhedron

Points = NDArray[np.float64]
Profile = tuple[tuple[float, float], ...]  #: (depth, radius) from the mounted face inward, mm


@dataclass(frozen=True, slots=True)
class Screw:
    """Holes for a metric screw; diameters, mm."""

    clear_mm: float  #: ISO 273, medium
    head_mm: float  #: counterbore, DIN 974-1
    head_high_mm: float  #: of a socket head, ISO 4762
    sunk_mm: float  #: countersink, ISO 15065


SCREWS = {
    "M3": Screw(3.4, 6.5, 3.0, 6.3),
    "M4": Screw(4.5, 8.0, 4.0, 9.4),
    "M5": Screw(5.5, 10.0, 5.0, 10.4),
    "M6": Screw(6.6, 11.0, 6.0, 12.6),
    "M8": Screw(9.0, 15.0, 8.0, 17.3),
    "M10": Screw(11.0, 18.0, 10.0, 20.0),
}
#: ISO 9409-1 by designation: pitch circle, number and thread of screws, diameter of the pin.
FLANGES = {
    "ISO 9409-1-31.5-4-M5": (31.5, 4, "M5", 5.0),
    "ISO 9409-1-40-4-M6": (40.0, 4, "M6", 6.0),
    "ISO 9409-1-50-4-M6": (50.0, 4, "M6", 6.0),
    "ISO 9409-1-63-4-M6": (63.0, 4, "M6", 6.0),
    "ISO 9409-1-80-6-M8": (80.0, 6, "M8", 8.0),
    "ISO 9409-1-100-6-M8": (100.0, 6, "M8", 8.0),
}
FIT_MM = 0.2  #: that a hole is wider than the magnet, pin or rod in it: prints come out small
WALL_MM = 1.2  #: least plastic around a hole: three beads of .4 mm
SKIN_MM = 0.8  #: least plastic over a pocket: four layers of .2 mm
LEAST_MM = 1.0  #: diameter of a hole that prints
LAND_MM = 0.4  #: least depth of a clearance hole under a countersink
SEAT = 1.5  #: plastic under a screw's head, in diameters of its thread
INSET_MM = 2.0  #: from the edges of a face to the holes in its corners
ROD_DEPTH = 2.0  #: of a rod's socket, in diameters; one is the least
CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


@dataclass(frozen=True, slots=True)
class Mount:
    """How a part is held.

    ========  ===============================================================
    kind      size
    ========  ===============================================================
    flange    designation, of `FLANGES`
    screws    thread, of `SCREWS`: one in each corner, heads sunk
    magnets   diameter and height: a pocket in each corner
    rod       diameter: a socket in the middle
    hole      diameter: through the middle
    ========  ===============================================================
    """

    kind: str
    size: str | float | tuple[float, float]
    face: str = ""  #: name of the face that is mounted; empty where it is chosen


@dataclass(frozen=True, slots=True)
class Bore:
    """A round hole about an axis normal to the mounted face."""

    centre: Points  #: (2,) in the face's frame
    profile: Profile  #: begins at depth 0; ends at radius 0, in a floor, or at the face behind
    behind: int | None = None  #: face that it comes out of

    @property
    def widest_mm(self) -> float:
        """Its largest radius."""
        return max(radius for _, radius in self.profile)


def least_thickness_mm(mount: Mount | None) -> float:
    """Return how thick a plate must be for the pockets and the sunk heads of a mount; or 0."""
    if mount is None or isinstance(mount.size, float):
        return 0.0
    if isinstance(mount.size, tuple):
        return mount.size[1] + FIT_MM + SKIN_MM
    thread, pocket = mount.size, 0.0
    if mount.kind == "flange":
        _, _, thread, pin = FLANGES[mount.size]
        pocket = pin / 2 + SKIN_MM
    screw = SCREWS[thread]
    return max((screw.sunk_mm - screw.clear_mm) / 2 + LAND_MM, pocket)


def fasteners(mount: Mount) -> tuple[str, ...]:
    """Return what has to be bought for a mount; nothing for a hole, whose bolt is not known."""
    size = mount.size
    if isinstance(size, tuple):
        return (f"{len(CORNERS)} magnets of {size[0]:g} x {size[1]:g} mm",)
    if isinstance(size, float):
        return (f"a rod of {size:g} mm",) if mount.kind == "rod" else ()
    _, count, thread, pin = FLANGES.get(size, (0.0, len(CORNERS), size, 0.0))
    return (f"{count} screws {thread}", *([f"a pin of {pin:g} mm"] if pin else []))


def with_mount(solid: Polyhedron, mount: Mount, face: int) -> Polyhedron:
    """Return the solid with a mount's holes in a planar face; that face and they stay blank.

    Raises
    ------
    ShapeError
        The holes do not fit the face, or what lies behind it.
    """
    space = _Space(solid, face)
    low, high = space.outline[0].min(axis=0), space.outline[0].max(axis=0)
    bores = _bores(space, mount, (low + high) / 2.0, (high - low) / 2.0)
    for one, other in combinations(bores, 2):
        apart = np.linalg.norm(one.centre - other.centre) - one.widest_mm - other.widest_mm
        if apart < WALL_MM:
            raise space.too_small(one)
    return _drilled(solid, face, bores)


def _bores(space: _Space, mount: Mount, middle: Points, half: Points) -> tuple[Bore, ...]:
    """Return the holes of a mount about the middle of a face, or in the corners of its box."""
    size = mount.size
    if isinstance(size, tuple):
        radius, deep = (size[0] + FIT_MM) / 2, size[1] + FIT_MM
        places = middle + (half - INSET_MM - radius) * CORNERS
        return tuple(
            space.pocket(place, ((0.0, radius), (deep, radius)), deep + SKIN_MM) for place in places
        )
    if mount.kind == "rod" and isinstance(size, float):
        radius = (size + FIT_MM) / 2
        rest = radius + 2 * WALL_MM  # for the tip
        deep = min(ROD_DEPTH * size, max(size, space.behind(middle, radius)[0] - rest))
        profile = ((0.0, radius), (deep, radius), (deep + radius, 0.0))
        return (space.pocket(middle, profile, deep + rest),)
    if isinstance(size, float):
        bore = Bore(middle, ((0.0, size / 2),))
        deep, behind = space.through(bore, size / 2)
        return (Bore(middle, (*bore.profile, (deep, size / 2)), behind),)
    if mount.kind == "screws":
        head = max(SCREWS[size].head_mm, SCREWS[size].sunk_mm) / 2
        places = middle + (half - INSET_MM - head) * CORNERS
        return tuple(space.screwed(place, size) for place in places)
    circle, count, thread, pin = FLANGES[str(size)]
    turns = 2.0 * math.pi * (np.arange(count) + 0.5) / count
    places = middle + circle / 2 * np.column_stack([np.cos(turns), np.sin(turns)])
    screws = [space.screwed(place, thread) for place in places]
    radius, at = (pin + FIT_MM) / 2, middle + np.array([circle / 2, 0.0])
    deep = min(pin, max(pin / 2, space.behind(at, radius)[0] - SKIN_MM))
    return (*screws, space.pocket(at, ((0.0, radius), (deep, radius)), deep + SKIN_MM))


class _Space:
    """What lies behind a face of a solid."""

    def __init__(self, solid: Polyhedron, face: int) -> None:
        self.solid, self.face, self.T = solid, face, face_frame(solid, face)
        self.outline = face_polygon(solid, face)

    def too_small(self, bore: Bore) -> ShapeError:
        """Return the refusal of a hole that the face has no room for."""
        low, high = self.outline[0].min(axis=0), self.outline[0].max(axis=0)
        return ShapeError(
            f"the mount does not fit face {self.solid.faces[self.face].name} of "
            f"{high[0] - low[0]:.4g} x {high[1] - low[1]:.4g} mm: a hole of "
            f"{2 * bore.profile[0][1]:g} mm at ({', '.join(f'{x:.4g}' for x in bore.centre - low)})"
            f" mm needs {WALL_MM:g} mm around it",
            fix="take a smaller mount, a larger part, or another face (face: NAME)",
        )

    def require_room(self, bore: Bore) -> None:
        """Refuse a hole that leaves the face, or is too narrow to be printed."""
        if 2 * bore.profile[0][1] < LEAST_MM:
            raise ShapeError(
                f"a hole of {2 * bore.profile[0][1]:g} mm is too narrow to be printed",
                fix=f"write {LEAST_MM:g} mm or more",
            )
        edge = bore.centre + (bore.profile[0][1] + WALL_MM) * _circle(64)
        if not points_inside(edge, self.outline).all():
            raise self.too_small(bore)

    def through(self, bore: Bore, radius: float) -> tuple[float, int]:
        """Return depth and number of the parallel face that a hole comes out of, so wide there."""
        self.require_room(bore)
        depth, behind = self.behind(bore.centre, radius)
        if behind is None:
            raise ShapeError(
                f"a hole of {2 * radius:g} mm through {self.solid.faces[self.face].name} does not "
                "come out of one parallel face",
                fix="mount another face (face: NAME), or take magnets or a rod, which go in blind",
            )
        return depth, behind

    def pocket(self, place: Points, profile: Profile, needed_mm: float) -> Bore:
        """Return a blind hole; refuse one that would break through."""
        self.require_room(Bore(place, profile))
        depth, _ = self.behind(place, profile[0][1])
        if depth < needed_mm - 1e-9:
            raise ShapeError(
                f"a hole of {2 * profile[0][1]:g} mm needs {needed_mm:.3g} mm behind face "
                f"{self.solid.faces[self.face].name}, which has {depth:.3g} mm there",
                fix="take a thicker part, a smaller mount, or another face (face: NAME)",
            )
        return Bore(place, profile)

    def screwed(self, place: Points, thread: str) -> Bore:
        """Return a screw's hole, its head sunk into the face behind."""
        screw, across = SCREWS[thread], float(thread[1:])
        clear, head, sunk = screw.clear_mm / 2, screw.head_mm / 2, screw.sunk_mm / 2
        bore = Bore(place, ((0.0, clear),))
        deep, behind = self.through(bore, clear)
        room = deep - screw.head_high_mm - FIT_MM
        if room >= across:
            seat = min(SEAT * across, room)
            self.through(bore, head)
            profile: Profile = ((0.0, clear), (seat, clear), (seat, head), (deep, head))
            return Bore(place, profile, behind)
        seat = deep - (sunk - clear)
        if seat < LAND_MM - 1e-9:
            raise ShapeError(
                f"{deep:.3g} mm of plastic are too thin to sink the head of {thread}, which needs "
                f"{sunk - clear + LAND_MM:.3g} mm",
                fix="take a smaller screw or a thicker part",
            )
        self.through(bore, sunk)
        return Bore(place, ((0.0, clear), (seat, clear), (deep, sunk)), behind)

    def behind(self, place: Points, radius: float) -> tuple[float, int | None]:
        """Return the least depth behind a circle, and the parallel face that all of it meets.

        The circle is that of a hole with plastic around it.
        """
        rim = np.vstack([place, place + (radius + WALL_MM) * _circle(32)])
        starts = self.T[:3, 3] + rim @ self.T[:3, :2].T
        inward = -self.T[:3, 2]
        depth, met = np.full(len(starts), np.inf), np.full(len(starts), -1)
        for number in range(len(self.solid.faces)):
            T = face_frame(self.solid, number)
            slope = float(inward @ T[:3, 2])
            if slope < 1e-9:
                continue
            along = (T[:3, 3] - starts) @ T[:3, 2] / slope
            inside = points_inside(
                (starts + along[:, None] * inward - T[:3, 3]) @ T[:3, :2],
                face_polygon(self.solid, number),
            )
            nearer = inside & (along > 1e-6) & (along < depth)
            depth[nearer], met[nearer] = along[nearer], number
        one = int(met[0])
        level = (met == one).all() and one >= 0 and np.ptp(depth) < 1e-6
        finite = depth[met >= 0]
        return float(finite.min()) if len(finite) else 0.0, one if level else None


def _circle(count: int) -> Points:
    """Return points (count, 2) of the unit circle, clockwise."""
    turns = -2.0 * math.pi * np.arange(count) / count
    return np.column_stack([np.cos(turns), np.sin(turns)])


def _drilled(solid: Polyhedron, face: int, bores: Sequence[Bore]) -> Polyhedron:
    """Return the solid with bores; walls are named after its last face."""
    T = face_frame(solid, face)
    points: list[Points] = [solid.vertices]
    count = len(solid.vertices)
    loops = [list(each.loops) for each in solid.faces]
    names = [each.name for each in solid.faces]
    last = int(names[-1].partition(".")[0][1:])
    surfaces, blank = [], [*solid.blank, face]

    def add(name: str, *own: tuple[int, ...]) -> int:
        names.append(name)
        loops.append(list(own))
        blank.append(len(names) - 1)
        return len(names) - 1

    for bore in bores:
        facets = 4 * math.ceil(math.pi * math.sqrt(bore.widest_mm / CHORD_ERROR_MM / 2) / 4)
        facets = min(max(facets, FACETS[0]), FACETS[1])
        rings: list[tuple[int, ...]] = []
        for depth, radius in bore.profile:
            flat = bore.centre + radius * _circle(facets if radius else 1)
            points.append(T[:3, 3] + flat @ T[:3, :2].T - depth * T[:3, 2])
            rings.append(tuple(range(count, count + len(flat))))
            count += len(flat)
        loops[face].append(rings[0])
        for (high, upper), (low, lower), above, below in zip(
            bore.profile, bore.profile[1:], rings, rings[1:], strict=False
        ):
            last += 1
            if high == low:  # a shoulder
                ring = (below, above[::-1]) if lower > upper else (above[::-1], below)
                add(f"F{last}", *ring)
                continue
            ahead = [*range(1, facets), 0]
            walls: Sequence[tuple[int, ...]]
            if lower:
                walls = [(below[k], below[j], above[j], above[k]) for k, j in enumerate(ahead)]
            else:  # a tip: to the right of a facet, with the tip up, is the one before it
                walls = [(above[j], above[k], below[0]) for k, j in enumerate(ahead)][::-1]
            own = [
                add(f"F{last}.{k + 1}" if k else f"F{last}", wall) for k, wall in enumerate(walls)
            ]
            widest = max(upper, lower)
            surfaces.append(
                Developable(
                    "cylinder" if upper == lower else "cone", tuple(own), widest,
                    abs(math.atan2(lower - upper, low - high)), True, True,
                    widest * (1.0 - math.cos(math.pi / facets)),
                )
            )  # fmt: skip
        if bore.behind is not None:
            loops[bore.behind].append(rings[-1][::-1])
        elif bore.profile[-1][1]:
            last += 1
            add(f"F{last}", rings[-1][::-1])
    faces = [Face(name, tuple(own)) for name, own in zip(names, loops, strict=True)]
    made = polyhedron(solid.kind, np.concatenate(points), faces)
    return replace(
        made,
        notes=(*solid.notes, *made.notes),
        surfaces=(*solid.surfaces, *surfaces),
        blank=tuple(dict.fromkeys(blank)),
    )
