"""Round faces: facets that unroll as the side does, and what of the kernel's solids unrolls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from generator import encode
from generator.cad.read import polyhedron_from
from generator.errors import ShapeError
from generator.polyhedron import volume
from generator.polyhedron.development import development
from generator.polyhedron.read import curved
from generator.polyhedron.read.kernel import describe_shape
from generator.polyhedron.read.step import polyhedron_of_facets
from generator.polyhedron.shapes import cone, cylinder
from generator.spec import SpecError


@pytest.mark.parametrize(
    ("solid", "turned"),
    [
        (cylinder(60, 80), 0.0),
        (cylinder(12, 5), 0.0),
        (cone(70, 80, 30), math.tau * 20 / math.hypot(20, 80)),
        (cone(60, 60), math.tau * 30 / math.hypot(30, 60)),
        (cone(300, 40, 290), math.tau * 5 / math.hypot(5, 40)),
    ],
)
def test_sides_unroll_as_the_round_ones_do(solid, turned):
    (surface,) = solid.surfaces
    d = development(solid, surface)
    first, last = d.high[0] - d.low[0], d.high[-1] - d.low[-1]
    found = math.atan2(first[0] * last[1] - first[1] * last[0], first @ last) % math.tau
    assert found == pytest.approx(turned, rel=1e-9, abs=1e-12)
    if not turned:
        around = 2 * math.pi * surface.radius_mm
        assert d.low[-1] == pytest.approx([around, 0], rel=1e-12)
        assert d.high[-1] == pytest.approx([around, np.ptp(solid.vertices[:, 2])], rel=1e-12)
    base = solid.vertices[list(solid.faces[0].loops[0])][:, :2]
    places = np.concatenate([base, (base + np.roll(base, 1, axis=0)) / 2])
    off = np.abs(np.hypot(*places.T) - surface.radius_mm).max()
    assert off == pytest.approx(surface.chord_error_mm, rel=1e-6)
    assert surface.chord_error_mm <= 0.0201


def axes(x, y, z, direction=(0, 0, 1)):
    return gp_Ax2(gp_Pnt(x, y, z), gp_Dir(*direction))


def cut(body, tool):
    return BRepAlgoAPI_Cut(body, tool).Shape()


def kinds(solid):
    return [(surface.kind, surface.closed, surface.concave) for surface in solid.surfaces]


@pytest.mark.parametrize(("low", "high"), [(30, 30), (40, 20), (20, 40), (40, 0), (0, 40)])
def test_cylinder_and_cone_either_way_up_and_to_its_tip(low, high):
    if low == high:
        solid = polyhedron_from(BRepPrimAPI_MakeCylinder(30, 60).Shape())
    else:
        solid = polyhedron_from(BRepPrimAPI_MakeCone(low, high, 60).Shape())
    (surface,) = solid.surfaces
    assert kinds(solid) == [("cylinder" if low == high else "cone", True, False)]
    assert surface.half_angle_rad == pytest.approx(math.atan2(abs(low - high), 60))
    assert surface.radius_mm == pytest.approx(max(low, high))
    exact = math.pi * 60 / 3 * (low**2 + low * high + high**2)
    assert volume(solid) == pytest.approx(exact, rel=2e-3)
    if low == high:
        assert surface.chord_error_mm == pytest.approx(30 * (1 - math.cos(math.pi / 88)))
        d = development(solid, surface)
        assert d.low[-1] - d.low[0] == pytest.approx([60 * math.pi, 0], rel=1e-3, abs=1e-9)


def test_bore_is_concave_and_a_cylinder_cut_by_a_cross_bore_stays_blank():
    bore = BRepPrimAPI_MakeCylinder(axes(30, 30, -10), 20, 80).Shape()
    solid = polyhedron_from(cut(BRepPrimAPI_MakeBox(60, 60, 60).Solid(), bore))
    assert (kinds(solid), solid.genus) == ([("cylinder", True, True)], 1)
    across = BRepPrimAPI_MakeCylinder(axes(0, -50, 40, (0, 1, 0)), 8, 100).Shape()
    solid = polyhedron_from(cut(BRepPrimAPI_MakeCylinder(30, 80).Shape(), across))
    assert solid.surfaces == ()
    assert "the outline (cylinder) does not unroll" in solid.notes[0]


def test_fillets_unroll_and_their_corners_stay_blank():
    block = BRepPrimAPI_MakeBox(80, 60, 40).Solid()
    maker = BRepFilletAPI_MakeFillet(block)
    edges = TopExp_Explorer(block, TopAbs_EDGE)
    while edges.More():
        maker.Add(8.0, TopoDS.Edge_s(edges.Current()))
        edges.Next()
    solid = polyhedron_from(maker.Shape())
    assert kinds(solid) == [("cylinder", False, False)] * 12
    (note,) = solid.notes
    assert note.startswith("faces F6 about (4, 4, 4), F7 about (4, 4, 36), ")
    assert "(sphere)" in note
    assert solid.blank


def test_triangles_take_the_points_of_a_cones_straight_edges():
    # Half a cone with a bore: its sides are straight edges that the kernel divides.
    half = BRepPrimAPI_MakeCone(axes(0, 0, 0), 30, 15, 40, math.pi).Shape()
    bore = BRepPrimAPI_MakeCylinder(axes(0, -9, 20, (0, 1, 0)), 4, 90).Shape()
    assert polyhedron_from(cut(half, bore)).blank  # it is closed, or it would have been refused


def test_a_wall_thinner_than_the_division_says_so():
    outer = BRepPrimAPI_MakeSphere(60.0).Shape()
    inner = BRepPrimAPI_MakeSphere(axes(0, 0, 0, (1, 2, 9)), 59.9).Shape()  # divided apart
    half = BRepPrimAPI_MakeBox(gp_Pnt(0, -99, -99), 99, 198, 198).Solid()
    with pytest.raises(ShapeError, match=r"into \d+ facets to \d.* mm, make no") as error:
        polyhedron_from(BRepAlgoAPI_Common(cut(outer, inner), half).Shape())
    assert "walls thicker" in error.value.fix


def test_a_solid_of_many_facets_is_divided_more_coarsely_and_says_so(monkeypatch):
    monkeypatch.setattr(curved, "MOST_FACETS", 600)
    solid = polyhedron_from(BRepPrimAPI_MakeTorus(20, 6).Shape())
    assert len(solid.faces) <= 600
    assert solid.notes[0].startswith("round faces were divided to ")
    assert volume(solid) == pytest.approx(2 * math.pi**2 * 20 * 6**2, rel=0.1)
    monkeypatch.setattr(curved, "MOST_FACETS", 60)
    with pytest.raises(ShapeError, match=r"need \d+ facets, to 1 mm; 60 are allowed"):
        polyhedron_from(BRepPrimAPI_MakeTorus(20, 6).Shape())


def test_points_that_are_one_are_joined_and_facets_joined_to_nothing_refused():
    # A cylinder whose top meets its side in points that are off by less than the tolerance.
    found = describe_shape(BRepPrimAPI_MakeCylinder(30, 80).Shape())
    points = np.array(found["points"])
    number = found["names"].index("F2")
    top = found["faces"][number][0]
    moved = dict(found, points=[*found["points"], *(points[top] + 1e-5).tolist()])
    moved["faces"] = list(found["faces"])
    moved["faces"][number] = [[len(points) + k for k in range(len(top))]]
    solid = polyhedron_of_facets(moved, "file")
    assert len(solid.vertices) == len(points)
    assert kinds(solid) == [("cylinder", True, False)]
    found["points"] = [[0.0, 0.0, float(z > 40)] for _, _, z in found["points"]]
    with pytest.raises(ShapeError, match="make no"):
        polyhedron_of_facets(found, "file")


def test_a_solid_that_is_round_all_over_is_refused(tmp_path):
    torus = BRepPrimAPI_MakeTorus(20, 5).Shape()
    with pytest.raises(SpecError, match="no face of the object carries symbols"):
        encode(torus, name="T", database=str(tmp_path / "lab.db"), folder=tmp_path)
    assert not list(tmp_path.iterdir())
