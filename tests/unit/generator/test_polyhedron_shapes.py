"""Named shapes: counts, closed forms, the thesis's names of faces, refused lengths."""

import math

import pytest

from generator.errors import ShapeError
from generator.polyhedron import (
    SHAPES,
    dihedral,
    face_area,
    face_normal,
    volume,
)

R2, R3, R5 = math.sqrt(2), math.sqrt(3), math.sqrt(5)
HEXAGON = 1.5 * R3 * 40**2
PYRAMID_SIDE = 0.5 * 60 * math.hypot(50, 30)

# name, arguments, vertices, edges, faces, volume mm^3, area mm^2, angle at every edge (degrees)
CLOSED_FORMS = [
    ("cube", {"side": 60.0}, 8, 12, 6, 60.0**3, 6 * 60.0**2, 90.0),
    ("box", {"size": (80, 80, 120)}, 8, 12, 6, 768000.0, 51200.0, 90.0),
    (
        "triangular_prism",
        {"side": 80.0, "height": 120.0},
        *(6, 9, 5, R3 / 4 * 80**2 * 120, R3 / 2 * 80**2 + 3 * 80 * 120, None),
    ),
    (
        "tetrahedron",
        {"side": 120.0},
        *(4, 6, 4, 120**3 / (6 * R2), R3 * 120**2, math.degrees(math.acos(1 / 3))),
    ),
    (
        "octahedron",
        {"side": 60.0},
        *(6, 12, 8, R2 / 3 * 60**3, 2 * R3 * 60**2, math.degrees(math.acos(-1 / 3))),
    ),
    (
        "dodecahedron",
        {"side": 40.0},
        *(20, 30, 12, (15 + 7 * R5) / 4 * 40**3, 3 * math.sqrt(25 + 10 * R5) * 40**2),
        math.degrees(math.acos(-1 / R5)),
    ),
    (
        "prism",
        {"sides": 6, "side": 40.0, "height": 60.0},
        *(12, 18, 8, HEXAGON * 60, 2 * HEXAGON + 6 * 40 * 60, None),
    ),
    (
        "prism",
        {"sides": 6, "radius": 40.0, "height": 60.0},
        *(12, 18, 8, HEXAGON * 60, 2 * HEXAGON + 6 * 40 * 60, None),
    ),
    (
        "pyramid",
        {"sides": 4, "side": 60.0, "height": 50.0},
        *(5, 8, 5, 60.0**2 * 50 / 3, 60.0**2 + 4 * PYRAMID_SIDE, None),
    ),
]


@pytest.mark.parametrize("case", CLOSED_FORMS, ids=lambda case: f"{case[0]}-{case[1]}")
def test_closed_forms(case):
    name, arguments, vertices, edges, faces, mm3, mm2, angle = case
    solid = SHAPES[name](**arguments)
    assert solid.kind == name
    assert (len(solid.vertices), len(solid.edges), len(solid.faces)) == (vertices, edges, faces)
    assert (solid.euler_characteristic, solid.genus, solid.notes) == (2, 0, ())
    assert volume(solid) == pytest.approx(mm3, rel=1e-13)
    assert sum(face_area(solid, k) for k in range(faces)) == pytest.approx(mm2, rel=1e-13)
    if angle is not None:
        angles = [math.degrees(dihedral(solid, k)) for k in range(edges)]
        assert angles == pytest.approx([angle] * edges, abs=1e-12)


def test_faces_of_a_cube_lie_where_the_documentation_says():
    solid = SHAPES["cube"](side=60.0)
    outward = [face_normal(solid, k).round(12).tolist() for k in range(6)]
    assert outward == [[0, 0, -1], [0, -1, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    assert [face.name for face in solid.faces] == ["F1", "F2", "F3", "F4", "F5", "F6"]
    assert not solid.vertices.flags.writeable


@pytest.mark.parametrize(
    ("name", "arguments", "says", "fix"),
    [
        ("cube", {"side": 0.0}, "side is 0 mm", "in that range"),
        ("cube", {"side": -60.0}, "side is -60 mm", "in that range"),
        ("cube", {"side": math.nan}, "side is nan mm", "in that range"),
        ("cube", {"side": 60_000.0}, "1 to 5000 mm", "unit"),
        ("cube", {"side": "60"}, "not a length", "60 mm"),
        ("cube", {"side": True}, "not a length", "60 mm"),
        ("box", {"size": [10, 20]}, "three lengths", "[80 mm, 80 mm, 120 mm]"),
        ("box", {"size": [2, 80, 1000]}, "more than 200 times", "set x to 5 mm or more"),
        ("prism", {"sides": 2, "side": 40, "height": 60}, "3 to 64 sides", "whole number"),
        ("prism", {"sides": 6.0, "side": 40, "height": 60}, "3 to 64 sides", "whole number"),
        ("prism", {"sides": 6, "height": 60}, "neither side nor radius", "one of the two"),
        ("pyramid", {"sides": 6, "side": 9, "radius": 9, "height": 6}, "both", "one of the two"),
    ],
)
def test_refused_lengths_say_what_is_allowed(name, arguments, says, fix):
    with pytest.raises(ShapeError) as caught:
        SHAPES[name](**arguments)
    assert says in caught.value.cause
    assert fix in caught.value.fix
