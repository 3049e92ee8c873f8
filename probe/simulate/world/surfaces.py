"""Surfaces as worlds have them: printed wrong, worn, side by side, and of no database.

::

    DistortedSurface   a print: strokes too wide, everything scaled
    worn_scene         a share of the symbols is worn down to the face
    AdjacentParts      two faces edge to edge, with a gap and a step
    Ridges, Dots, ...  plain, patterned, rough, letters: whatever they look like, a reader must
                       refuse them

mm, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.errors import SurfaceError
from probe.simulate.scene import Scene
from probe.surface.body import body_of, indexed_triangles, manifold_of
from probe.surface.contract import HeightMap
from probe.surface.face import FaceSurface, endless_face
from probe.surface.indenters import RoughSurface
from probe.surface.polygon import FaceRegion
from probe.surface.symbols import Relief, Strokes

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

GAP_MM = 2.0  #: between the edges of adjacent parts, at most
STEP_MM = 0.4  #: of the second's face above or below the first's, at most
REACH_MM = 9.0  #: the sensor's centre lies on the first part, at most this far from its edge
SAME_MM = 0.01  #: corners that are nearer are the same: two panels fill one seat
FLUSH = 1e-6  #: of the size: corners this far beyond an edge do not lie beyond it
EDGE_POINTS = 9  #: heights along each edge of a worn cell


@dataclass(frozen=True, slots=True)
class DistortedSurface:
    """A surface as a printer leaves it: everything wider by a stroke's excess, and scaled."""

    surface: HeightMap
    wider_mm: float
    scale: float
    about_mm: tuple[float, float]  #: point that the scale leaves where it is

    @property
    def top_mm(self) -> float:
        """Height of the highest point."""
        return self.surface.top_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the highest place within half the excess of each point."""
        centre = np.array(self.about_mm)
        at = (points_mm - centre) / (1 + self.scale) + centre
        highest = self.surface.heights_mm(at)
        if self.wider_mm > 0:
            for turn in range(4):
                angle = turn * math.pi / 2
                by = self.wider_mm / 2 * np.array([math.cos(angle), math.sin(angle)])
                highest = np.maximum(highest, self.surface.heights_mm(at + by))
        return highest

    @property
    def solid_mm(self) -> Array | None:
        """Return the body (n, 3, 3), scaled; its strokes are as wide as drawn."""
        body = body_of(self.surface)
        if body is None:
            return None
        centre = np.array([*self.about_mm, 0.0])
        scales = np.array([1 + self.scale, 1 + self.scale, 1.0])
        scaled: Array = (body - centre) * scales + centre
        return scaled


@dataclass(frozen=True, slots=True, eq=False)
class WornSurface:
    """A surface on which some symbols are worn down to the face."""

    surface: HeightMap
    centres_mm: Array  #: (n, 2) of the worn symbols, surface frame
    rotation_rad: float  #: turns the surface's x axis into the array's
    pitch_mm: float
    bases_mm: Array  #: (n,) height of the face about each: 0 as designed, others where it is bowed

    @property
    def top_mm(self) -> float:
        """Height of the highest point."""
        return self.surface.top_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the heights, none above the face in the cell of a worn symbol."""
        heights = self.surface.heights_mm(points_mm)
        if len(self.centres_mm) == 0 or len(points_mm) == 0:
            return heights
        c, s = np.cos(self.rotation_rad), np.sin(self.rotation_rad)
        turned = np.array([[c, s], [-s, c]])
        high = np.flatnonzero(heights > self.bases_mm.min())
        reach = (points_mm.min(axis=0) - self.pitch_mm, points_mm.max(axis=0) + self.pitch_mm)
        near = ((self.centres_mm > reach[0]) & (self.centres_mm < reach[1])).all(axis=1)
        x, y = np.abs((points_mm[high, None, :] @ turned - (self.centres_mm @ turned)[near]).T)
        within = (x <= self.pitch_mm / 2) & (y <= self.pitch_mm / 2)
        heights = heights.copy()
        lowest = np.where(within, self.bases_mm[near, None], np.inf).min(axis=0, initial=np.inf)
        heights[high] = np.minimum(heights[high], lowest)
        return heights

    @property
    def solid_mm(self) -> Array | None:
        """Return the body (n, 3, 3) without the symbols in these cells."""
        from manifold3d import Manifold, OpType

        body = body_of(self.surface)
        if body is None or len(self.centres_mm) == 0:
            return body
        side, top = self.pitch_mm, self.top_mm
        box = Manifold.cube((side, side, 2 * top)).translate((-side / 2, -side / 2, 0))
        box = box.rotate((0, 0, -math.degrees(self.rotation_rad)))
        places = np.column_stack([self.centres_mm, self.bases_mm]).tolist()
        boxes = [box.translate((x, y, z)) for x, y, z in places]
        gone = Manifold.batch_boolean(boxes, OpType.Add)
        corners, triangles = indexed_triangles(manifold_of(body) - gone)
        return corners[triangles]


def worn_scene(
    scene: Scene,
    centres_mm: Array,
    rotation_rad: float,
    pitch_mm: float,
    share: float,
    rng: np.random.Generator,
) -> Scene:
    """Return a face of which a share of the symbols is worn away, the same ones at every touch.

    `centres_mm` (n, 2) of its symbols are in the face frame, `rotation_rad` turns face x into array
    x.
    """
    if isinstance(scene.surface, FaceSurface):
        salt = int(rng.integers(1 << 31)) if scene.surface.lattice is not None else 0
        return replace(scene, surface=_wear_face(scene.surface, share, salt))
    gone = centres_mm[rng.random(len(centres_mm)) < share]

    def wear(met: Scene) -> Scene:
        return replace(met, surface=wear_cells(met.surface, gone, rotation_rad, pitch_mm))

    if scene.scene_at is None:
        return wear(scene)
    return replace(scene, scene_at=lambda touch: wear(scene.under(touch)))


def wear_cells(
    surface: HeightMap, gone_mm: Array, rotation_rad: float, pitch_mm: float
) -> WornSurface:
    """Return a surface without the symbols whose centres (n, 2) are given.

    The height of the face about each symbol is the median along its cell's edge: cells lie wholly
    on the face but for parts of them, and no symbol reaches their edges.
    """
    along = pitch_mm * np.linspace(-0.5, 0.5, EDGE_POINTS)
    side = np.full(EDGE_POINTS, pitch_mm / 2)
    sides = [(along, side), (along, -side), (side, along), (-side, along)]
    edge = np.concatenate([np.column_stack(pair) for pair in sides])
    c, s = math.cos(rotation_rad), math.sin(rotation_rad)
    points = gone_mm[:, None] + edge @ np.array([[c, -s], [s, c]])
    heights = surface.heights_mm(points.reshape(-1, 2)).reshape(len(gone_mm), len(edge))
    middle: Array = np.median(heights, axis=1) if len(gone_mm) else np.zeros(0)
    bases = np.where(np.isfinite(middle), np.round(middle, 6), 0.0)
    return WornSurface(surface, gone_mm, rotation_rad, pitch_mm, bases)


def _wear_face(face: FaceSurface, share: float, salt: int) -> FaceSurface:
    """Return a registered face without a share of its symbols, drawn by a hash of their cells."""
    lattice = face.lattice
    if lattice is None:
        return face
    label_at = lattice.label_at

    def left(rows: Ints, columns: Ints) -> Ints:
        labels = label_at(rows, columns)
        cell = (rows * 73_856_093) ^ (columns * 19_349_663) ^ salt
        drawn = ((cell * 2_654_435_761) % (1 << 32)) / (1 << 32)
        return np.where(drawn < share, -1, labels)

    return replace(face, lattice=replace(lattice, label_at=left))


def exchange_symbols(face: HeightMap, at_mm: Array, labels: Ints) -> FaceSurface:
    """Return a registered face with other symbols: `labels` (n,) at the places (n, 2)."""
    assert isinstance(face, FaceSurface)
    assert face.lattice is not None
    label_at = face.lattice.label_at
    rows, columns = face.lattice.cells_at(at_mm)

    def other(down: Ints, along: Ints) -> Ints:
        found = label_at(down, along)
        for row, column, label in zip(rows, columns, labels, strict=True):
            found[(down == row) & (along == column)] = label
        return found

    return replace(face, lattice=replace(face.lattice, label_at=other))


def seat_panel(seat: HeightMap, panel: HeightMap, place: FramePlace) -> FaceSurface:
    """Return the face of a seat with the symbols of another panel, or of its own, turned.

    `place` is that of the panel's frame in the seat's; what is about the seat stays.
    """
    assert isinstance(seat, FaceSurface)
    assert isinstance(panel, FaceSurface)
    assert panel.lattice is not None
    lattice = panel.lattice
    turn = lattice.rotation_rad - place.turn_rad
    c, s = math.cos(turn), math.sin(turn)
    x, y = place.x_mm, place.y_mm
    moved = replace(
        lattice, rotation_rad=turn, x_mm=lattice.x_mm - c * x + s * y,
        y_mm=lattice.y_mm - s * x - c * y,
    )  # fmt: skip
    return replace(seat, lattice=moved)


def seats_of(seat: FaceRegion, panel: FaceRegion) -> list[FramePlace]:
    """Return every way in which a panel fills a seat of the same outline."""
    ends = (seat.starts, panel.starts)
    if len(ends[0]) != len(ends[1]):
        return []
    found = []
    middles = [one.mean(axis=0) for one in ends]
    away, own = ((one - middle) @ (1, 1j) for one, middle in zip(ends, middles, strict=True))
    for shift in range(len(own)):
        turn = float(np.angle(np.sum(away * np.roll(own, shift).conj())))
        if np.abs(away - np.roll(own, shift) * np.exp(1j * turn)).max() < SAME_MM:
            c, s = math.cos(turn), math.sin(turn)
            x, y = (middles[0] - np.array([[c, -s], [s, c]]) @ middles[1]).tolist()
            found.append(FramePlace(x, y, 0.0, turn))
    return found


@dataclass(frozen=True, slots=True)
class FramePlace:
    """Where a frame lies in another one: turned about z, then moved."""

    x_mm: float
    y_mm: float
    z_mm: float
    turn_rad: float

    def into(self, points_mm: Array) -> Array:
        """Take points (n, 2) of the outer frame into this one."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        inside: Array = (points_mm - (self.x_mm, self.y_mm)) @ np.array([[c, -s], [s, c]])
        return inside

    def touch_inside(self, touch: Touch) -> Touch:
        """Return a touch of the outer frame as one of this frame."""
        x, y = self.into(np.array([[touch.x_mm, touch.y_mm]]))[0].tolist()
        return replace(touch, x_mm=x, y_mm=y, theta_rad=touch.theta_rad - self.turn_rad)


@dataclass(frozen=True, slots=True, eq=False)
class AdjacentParts:
    """Two surfaces as one, in the frame of the first; between them is nothing."""

    first: HeightMap
    second: HeightMap
    place: FramePlace  #: of the second's frame in the first's

    @property
    def top_mm(self) -> float:
        """Height of the higher one."""
        return max(self.first.top_mm, self.second.top_mm + self.place.z_mm)

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of the higher one at each point."""
        second = self.second.heights_mm(self.place.into(points_mm)) + self.place.z_mm
        return np.maximum(self.first.heights_mm(points_mm), second)

    @property
    def solid_mm(self) -> Array | None:
        """Return both bodies (n, 3, 3) as one."""
        first, second = body_of(self.first), body_of(self.second)
        if first is None or second is None:
            return None
        c, s = math.cos(self.place.turn_rad), math.sin(self.place.turn_rad)
        turned = second @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        moved = turned + np.array([self.place.x_mm, self.place.y_mm, self.place.z_mm])
        both = manifold_of(first) + manifold_of(moved)
        corners, triangles = indexed_triangles(both)
        return corners[triangles]


def place_adjacent(
    first: FaceRegion, second: FaceRegion, rng: np.random.Generator
) -> tuple[FramePlace, Array]:
    """Place a face edge to edge with another one, and draw a place near where they meet.

    Returns the place of the second's frame in the first's, and (2,) a place on the first, at most
    `REACH_MM` from the edge, opposite the second's edge.

    Raises `SurfaceError` if a face has no edge beyond which nothing of it lies.
    """
    start, along, outward, length = _outer_edge(first, rng)
    other, other_along, _, other_length = _outer_edge(second, rng)
    gap, step = rng.uniform(0, GAP_MM), rng.uniform(-1, 1) * STEP_MM
    deep, share, other_share = rng.random(3)
    # Adjacent edges run in opposite directions: the second's outward is the first's inward.
    turn = math.atan2(-along[1], -along[0]) - math.atan2(other_along[1], other_along[0])
    meet = start + share * length * along
    c, s = math.cos(turn), math.sin(turn)
    opposite = np.array([[c, -s], [s, c]]) @ (other + other_share * other_length * other_along)
    shift = meet + gap * outward - opposite
    at = meet - deep * REACH_MM * outward
    if not first.contains(at[None])[0]:
        at = meet - 1e-3 * outward
    place = FramePlace(float(shift[0]), float(shift[1]), step, math.remainder(turn, math.tau))
    return place, at


def _outer_edge(region: FaceRegion, rng: np.random.Generator) -> tuple[Array, Array, Array, float]:
    """Draw an edge beyond which nothing of a face lies: start, direction, outward, length."""
    along = region.ends - region.starts
    lengths = np.hypot(*along.T)
    along = along / lengths[:, None]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    beyond = (outward @ region.starts.T).max(axis=1) - (outward * region.starts).sum(axis=1)
    outer = np.flatnonzero(beyond <= FLUSH * lengths.max())
    if len(outer) == 0:
        raise SurfaceError(
            "a face has no edge beside which another one could lie",
            fix="take faces with a straight outer edge",
        )
    chosen = int(rng.choice(outer, p=lengths[outer] / lengths[outer].sum()))
    return region.starts[chosen], along[chosen], outward[chosen], float(lengths[chosen])


@dataclass(frozen=True, slots=True)
class Ridges:
    """Straight ridges, flat on top."""

    period_mm: float
    width_mm: float
    angle_rad: float
    top_mm: float = 1.0

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of a ridge, or 0."""
        across = points_mm @ np.array([math.cos(self.angle_rad), math.sin(self.angle_rad)])
        return np.where(across % self.period_mm < self.width_mm, self.top_mm, 0.0)


@dataclass(frozen=True, slots=True)
class Dots:
    """Round dots on a square grid."""

    period_mm: float
    diameter_mm: float
    top_mm: float = 1.0

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of a dot, or 0."""
        away = (points_mm / self.period_mm + 0.5) % 1.0 - 0.5
        inside = np.hypot(away[:, 0], away[:, 1]) * self.period_mm < self.diameter_mm / 2
        return np.where(inside, self.top_mm, 0.0)


def draw_ridges(pitch_mm: float, stroke_mm: float, rng: np.random.Generator) -> HeightMap:
    """Return ridges as wide as strokes, or up to twice that, often at the pitch of the symbols."""
    period = pitch_mm * rng.choice([0.25, 1 / 3, 0.5, 1.0, rng.uniform(0.3, 1.2)])
    width = stroke_mm * rng.uniform(1.0, 2.0)
    return Ridges(max(period, 1.5 * width), width, rng.uniform(0, math.pi))


def draw_dots(pitch_mm: float, rng: np.random.Generator) -> HeightMap:
    """Return dots on a grid, often at a part of the pitch of the symbols."""
    period = pitch_mm * rng.choice([0.5, 1.0, rng.uniform(0.4, 1.2)])
    return Dots(period, period * rng.uniform(0.3, 0.7))


def draw_rough(rng: np.random.Generator) -> HeightMap:
    """Return a random surface."""
    return RoughSurface(int(rng.integers(1 << 31)), rng.uniform(0.1, 0.5), rng.uniform(2.0, 8.0))


def draw_text(
    letters: tuple[Strokes, ...],
    reach: float,
    pitch_mm: float,
    relief: Relief,
    rng: np.random.Generator,
) -> HeightMap:
    """Return lines of letters as high and as thick as the symbols.

    Strokes of letters are in lattice units, `reach` is the unit over the pitch. Letters are .8 to
    1.2 of the lab's pitch apart, their strokes no wider than they bear.
    """
    pitch = pitch_mm * rng.uniform(0.8, 1.2)
    thin = Relief(relief.height_mm, min(relief.stroke_mm, 0.14 * pitch), relief.draft_rad)
    lines = rng.integers(len(letters), size=(32, 32))
    lines[rng.random(lines.shape) < 0.15] = -1
    return endless_face(lines, letters, pitch_mm=pitch, unit_mm=reach * pitch, relief=thin)
