"""What a face promises, against geometry done one pose and one edge at a time."""

import math

import numpy as np
import pytest
import shapely
from random_shapes import extruded

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet.outline import SymbolStyle
from generator.layout.obstacle import solid_edges
from generator.layout.placement import FaceLayout, Placement
from generator.layout.recognition_rate import answered_share, measured_types
from generator.layout.sensor_view import (
    MEETS_MM2,
    SAG_MM,
    SensorView,
    beside_obstacles,
    face_views,
    round_views,
)
from generator.polyhedron import face_polygon, shapes
from generator.polyhedron.development import development
from generator.polyhedron.frame import face_frame, face_normal

VIEW = SensorView((12.7, 9.0), 2.52)
SQUARE = np.array([[0, 0], [40, 0], [40, 40], [0, 40]], dtype=float)
HOLE = np.array([[12, 12], [12, 25], [30, 25], [30, 12]], dtype=float)  # clockwise
ELL = np.array([[0, 0], [50, 0], [50, 12], [14, 12], [14, 60], [0, 60]], dtype=float)
TRIANGLE = np.array([[-3, 5], [60, -8], [25, 44]], dtype=float)


def lattice(loop, pitch=7.0, rotation=0.3, anchor=(60, 61)):
    """Symbols on a turned lattice over the box of a loop, placed across the array's seam."""
    low, size = loop.min(axis=0), np.ptp(loop, axis=0)
    j, i = (g.ravel() for g in np.meshgrid(range(6), range(6)))
    c, s = np.cos(rotation), np.sin(rotation)
    u, v = (j + 0.5) * pitch, -(i + 0.5) * pitch
    shift = np.array([5.0, -30.0])
    u_, v_ = u - shift[0], v - shift[1]
    centres = np.stack([c * u_ + s * v_, -s * u_ + c * v_], axis=1)
    inside = ((centres >= low) & (centres <= low + size)).all(axis=1)
    rows, columns = (anchor[0] + i) % 63, (anchor[1] + j) % 65
    return FaceLayout(
        0, Placement(*anchor, rotation, *shift), rows[inside], columns[inside],
        np.zeros(inside.sum(), dtype=np.int64), centres[inside], 1,
    )  # fmt: skip


def rectangle(views, k, less_mm=0.0):
    """The sensor's rectangle at a pose, face frame."""
    c, s = np.cos(views.turn_rad[k]), np.sin(views.turn_rad[k])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (np.array(VIEW.half_mm) - less_mm)
    return shapely.Polygon(corners @ [[c, s], [-s, c]] + views.centre_mm[k])


@pytest.mark.parametrize("loops", [(SQUARE,), (SQUARE, HOLE), (ELL,), (TRIANGLE,)])
def test_views_are_those_of_each_pose_by_itself(loops):
    face, outline = lattice(loops[0]), shapely.Polygon(loops[0], loops[1:])
    views = face_views(loops, face, 7.0, VIEW, 150)
    assert len(views.seen) == 150
    for k in range(150):
        whole = shapely.intersects_xy(rectangle(views, k, VIEW.symbol_half_mm), *face.centres_mm.T)
        assert views.seen[k] == whole.sum()
        c, s = np.cos(0.3), np.sin(0.3)
        lattice_mm = face.centres_mm[whole] @ np.array([[c, s], [-s, c]])
        lines = [len(np.unique(np.rint(one / 7.0 * 2))) for one in lattice_mm.T]
        assert views.lines[k] == min(lines)
        share = outline.intersection(rectangle(views, k)).area / rectangle(views, k).area
        assert views.loaded[k] == pytest.approx(share, abs=1e-9)
        away = np.hypot(*(face.centres_mm - views.centre_mm[k]).T)
        assert views.around[k] == (away <= 20.0).sum()


def test_a_type_of_your_own_is_taken_for_the_one_most_like_it():
    mine = SensorType(33, 31, 2.0, name="mine")  # 62 x 66 mm: the mat is 64 x 64
    assert answered_share(mine) is measured_types()["mat-32x32"]
    fine = SensorType(40, 40, 0.6, name="fine")
    assert answered_share(fine) is measured_types()["gel-24x32"]
    small = SensorType(12, 12, 2.2, name="small")  # 26 mm, as fsr-8x8, and three tactels a symbol
    assert answered_share(small) is None
    same = SensorType(name="same")
    assert answered_share(same) is None


STAIRS = [(0, 0), (120, 0), (120, 20), (80, 20), (80, 35), (40, 35), (40, 50), (0, 50)]
RAMP = [(0, 0), (110, 0), (110, 50), (60, 20), (0, 20)]
LOW = [(0, 0), (90, 0), (90, 20), (45, 20), (45, 20.9), (0, 20.9)]  # a step lower than a symbol


def above(corners, height):
    """The part of a polygon in space above a height, seen from above."""
    kept = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if a[2] >= height:
            kept.append(a)
        if (a[2] - height) * (b[2] - height) < 0:
            kept.append(a + (b - a) * (height - a[2]) / (b[2] - a[2]))
    return shapely.Polygon([corner[:2] for corner in kept])


@pytest.mark.parametrize("outline", [STAIRS, RAMP, LOW])
def test_a_sensor_meets_what_rises_inside_its_rectangle(outline):
    along_y = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # outlines are (x, z)
    solid, height = extruded([np.array(outline, float)], 60.0, pose=along_y), 1.0
    for number in range(len(solid.faces)):
        loops, frame = face_polygon(solid, number), face_frame(solid, number)
        views = face_views(loops, lattice(loops[0]), 7.0, VIEW, 60)
        views = beside_obstacles(views, solid_edges(solid), frame, height, VIEW)
        rising = [
            above((solid.vertices[list(face.loops[0])] - frame[:3, 3]) @ frame[:3, :3], height)
            for other, face in enumerate(solid.faces)
            if face_normal(solid, other) @ frame[:3, 2] > 1e-9
        ]
        for k in range(60):
            met = sum(part.intersection(rectangle(views, k)).area for part in rising)
            assert views.blocked[k] == (met > MEETS_MM2)
        meets = {4: ("F6",), 5: ("F5",), 6: ("F8",), 8: ()} if outline is STAIRS else {}
        assert views.meets == meets.get(number, views.meets)  # walls, not their tops
        assert bool(views.meets) == views.blocked.any()


def test_a_round_face_shows_what_lies_near_the_line_that_it_is_touched_along():
    radius, height = 30.0, 80.0
    solid = shapes.cylinder(2 * radius, height)
    (surface,) = solid.surfaces
    flat = development(solid, surface)
    width = float(np.ptp(flat.outline[:, 0]))
    at = np.stack(np.meshgrid(np.arange(4, width, 7), np.arange(4, height, 7)), -1).reshape(-1, 2)
    none = np.zeros(len(at), np.int64)
    face = FaceLayout(surface.carrier, Placement(0, 0, 0.0, -0.5, -0.5), none, none, none, at, 1)
    style = SymbolStyle(pitch_mm=7.0)
    views = round_views(solid_edges(solid), surface, flat, face, style, VIEW, 200)
    half = radius * math.acos(1 - SAG_MM / radius)
    for k in range(200):
        near = abs(at[:, 0] - views.centre_mm[k, 0]) <= half
        whole = shapely.intersects_xy(rectangle(views, k, VIEW.symbol_half_mm), *at.T)
        assert views.seen[k] == (near & whole).sum()
        there = shapely.Polygon(flat.outline).intersection(rectangle(views, k))
        assert views.loaded[k] == pytest.approx(there.area / rectangle(views, k).area, abs=1e-9)
    assert not views.blocked.any()
