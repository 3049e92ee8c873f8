"""Solids with round faces from the kernel: what unrolls, what stays blank."""

from __future__ import annotations

import math

import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from generator import encode
from generator.cad.read import polyhedron_from
from generator.polyhedron import volume
from generator.polyhedron.development import development
from generator.spec import SpecError


def axes(x: float, y: float, z: float, direction: tuple[float, float, float] = (0, 0, 1)):
    return gp_Ax2(gp_Pnt(x, y, z), gp_Dir(*direction))


def fillet(radius: float):
    block = BRepPrimAPI_MakeBox(80, 60, 40).Solid()
    maker = BRepFilletAPI_MakeFillet(block)
    edges = TopExp_Explorer(block, TopAbs_EDGE)
    while edges.More():
        maker.Add(radius, TopoDS.Edge_s(edges.Current()))
        edges.Next()
    return maker.Shape()


def kinds(solid) -> list[tuple[str, bool, bool]]:
    return [(surface.kind, surface.closed, surface.concave) for surface in solid.surfaces]


def test_cylinder():
    solid = polyhedron_from(BRepPrimAPI_MakeCylinder(30, 80).Shape())
    (surface,) = solid.surfaces
    assert kinds(solid) == [("cylinder", True, False)]
    assert surface.radius_mm == pytest.approx(30)
    assert surface.chord_error_mm == pytest.approx(30 * (1 - math.cos(math.pi / 88)))
    assert surface.chord_error_mm <= 0.02
    assert volume(solid) == pytest.approx(math.pi * 900 * 80, rel=2e-3)
    d = development(solid, surface)
    assert d.low[-1] - d.low[0] == pytest.approx([60 * math.pi, 0], rel=1e-3, abs=1e-9)


@pytest.mark.parametrize(("low", "high"), [(40, 20), (20, 40), (40, 0), (0, 40)])
def test_cone_either_way_up_and_to_its_tip(low, high):
    solid = polyhedron_from(BRepPrimAPI_MakeCone(low, high, 60).Shape())
    assert kinds(solid) == [("cone", True, False)]
    assert solid.surfaces[0].half_angle_rad == pytest.approx(math.atan2(abs(low - high), 60))
    exact = math.pi * 60 / 3 * (low**2 + low * high + high**2)
    assert volume(solid) == pytest.approx(exact, rel=2e-3)


def test_half_a_cylinder_is_open():
    half = BRepPrimAPI_MakeCylinder(30, 80, math.pi).Shape()
    assert kinds(polyhedron_from(half)) == [("cylinder", False, False)]


def test_bore_is_concave_and_goes_through():
    block = BRepPrimAPI_MakeBox(60, 60, 60).Solid()
    bore = BRepPrimAPI_MakeCylinder(axes(30, 30, -10), 20, 80).Shape()
    solid = polyhedron_from(BRepAlgoAPI_Cut(block, bore).Shape())
    assert kinds(solid) == [("cylinder", True, True)]
    assert solid.genus == 1


def test_fillets_unroll_and_their_corners_stay_blank():
    solid = polyhedron_from(fillet(8.0))
    assert kinds(solid) == [("cylinder", False, False)] * 12
    (note,) = solid.notes
    assert note.startswith("faces F6, F7")
    assert "(sphere)" in note
    assert solid.blank


def test_cylinder_cut_by_a_cross_bore_stays_blank():
    across = BRepPrimAPI_MakeCylinder(axes(0, -50, 40, (0, 1, 0)), 8, 100).Shape()
    cut = BRepAlgoAPI_Cut(BRepPrimAPI_MakeCylinder(30, 80).Shape(), across).Shape()
    solid = polyhedron_from(cut)
    assert solid.surfaces == ()
    assert "the outline (cylinder) does not unroll" in solid.notes[0]


def test_triangles_take_the_points_of_a_cones_straight_edges():
    # Half a cone with a bore: its sides are straight edges that the kernel divides.
    half = BRepPrimAPI_MakeCone(axes(0, 0, 0), 30, 15, 40, math.pi).Shape()
    bore = BRepPrimAPI_MakeCylinder(axes(0, -9, 20, (0, 1, 0)), 4, 90).Shape()
    solid = polyhedron_from(BRepAlgoAPI_Cut(half, bore).Shape())
    assert solid.blank  # and it is closed, or it would have been refused


def test_a_solid_that_is_round_all_over_is_refused(tmp_path):
    torus = BRepPrimAPI_MakeTorus(40, 10).Shape()
    with pytest.raises(SpecError, match="no face of the object carries symbols"):
        encode(torus, name="T", database=str(tmp_path / "lab.db"), folder=tmp_path)
    assert not list(tmp_path.iterdir())
