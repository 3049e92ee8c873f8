"""Whole layouts of known objects, islands of nets, and codes of objects."""

import numpy as np
import pytest

from generator.array.profiles import profile
from generator.errors import LayoutError
from generator.layout.layout import lay_out
from generator.layout.placement import FaceLayout, Layout, Placement, object_code
from generator.layout.unfold import split, unfold
from generator.polyhedron import shapes

NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
ARRAY = profile("one-touch").array()


def clearances(solid, clearance=1.0):
    return [[np.full(len(loop), clearance) for loop in face.loops] for face in solid.faces]


def laid_out(solid, occupied=NONE, kind="auto", array=ARRAY, pitch=7.0, half=2.7, **options):
    return lay_out(solid, array, pitch, half, clearances(solid), occupied, kind, **options)


def test_the_net_falls_into_islands_where_the_array_is_too_small():
    array = profile("product").array()  # 15 x 15
    solid = shapes.tetrahedron(75.0)
    layout = laid_out(solid, kind="net", array=array, pitch=8.0, half=3.0)
    assert len({(f.placement.row, f.placement.column) for f in layout.faces}) > 1


def test_a_face_identified_by_its_rank_alone_is_one_place():
    layout = laid_out(shapes.box((80.0, 60.0, 12.0)), kind="faces")
    assert sorted(face.places for face in layout.faces) == [1, 1, 1, 1, 63, 63]


def test_faces_without_a_place_are_listed_with_what_would_help():
    solid = shapes.box((80.0, 60.0, 5.0))
    with pytest.raises(LayoutError) as caught:
        laid_out(solid)
    layout = laid_out(solid, allow_blank_faces=True)
    assert layout.blank_faces == (1, 2, 3, 4)
    assert [warning.endswith("left blank") for warning in layout.warnings] == [True]
    assert all(solid.faces[k].name in caught.value.cause for k in (1, 2, 3, 4))
    assert "80.0 x 5.0 mm, 0 cells" in caught.value.cause
    assert "3x2 cells at 7 mm pitch" in caught.value.cause
    pitch = float(caught.value.fix.split("set pitch to ")[1].split(" mm")[0])
    better = laid_out(solid, pitch=pitch, half=2.7 * pitch / 7.0)
    assert all(face.places > 0 for face in better.faces)
    scale = float(caught.value.fix.split("make the object ")[1].split(" times")[0])
    larger = laid_out(shapes.box((80.0 * scale, 60.0 * scale, 5.0 * scale)))
    assert all(face.places > 0 for face in larger.faces)


ROWS, COLUMNS = np.mgrid[:63, :65].reshape(2, -1)[:, :-300]
CUBE = shapes.cube(60.0)


@pytest.mark.parametrize(
    ("solid", "options", "message"),
    [
        (shapes.prism(12, 40.0, side=20.0), {"kind": "net"}, "set layout to faces"),
        (CUBE, {"occupied": (ROWS, COLUMNS), "kind": "faces"},
         r"needs 384 cells, 300 of 4095 are free[\s\S]*profile: auto"),
        (shapes.cube(180.0), {}, "not in blocks"),
    ],
)  # fmt: skip
def test_what_cannot_be_laid_out_is_refused(solid, options, message):
    with pytest.raises(LayoutError, match=message):
        laid_out(solid, **options)


def code_at(*cells, rows=63, columns=65):
    """Return the code of an object with a blank face and one face for each cell."""
    place, none = Placement(0, 0, 0.0, 0.0, 0.0), np.zeros(0, dtype=np.int64)
    faces = [FaceLayout(0, place, none, none, none, np.zeros((0, 2)), 0)]
    for row, column in cells:
        one = np.ones(1, dtype=np.int64)
        faces.append(FaceLayout(1, place, row * one, column * one, one, np.zeros((1, 2)), 0))
    return object_code(Layout("faces", 7.0, tuple(faces)), rows, columns)


def test_codes_count_cells():
    assert code_at((0, 0)) == "222"
    assert code_at((1, 0)) == code_at((2, 0), (1, 0), (1, 5)) == "24Y"  # 65 = 2 * 22 + 21
    # 65534 = ((6 * 22 + 3) * 22 + 8) * 22 + 18
    assert code_at((50, 1284), rows=51, columns=1285) == "C5EU"
    assert len(code_at((2**32 - 1, 2**32 - 1), rows=2**32, columns=2**32)) == 15
    codes = {code_at((r, c)) for r in range(63) for c in range(65)}
    assert len(codes) == 63 * 65
    assert "F" not in "".join(codes)


def test_a_piece_is_split_into_halves():
    net = split(unfold(CUBE), 0)
    assert sorted(map(len, net.pieces)) in ([2, 4], [3, 3])
    assert net.parents.count(-1) == 2
