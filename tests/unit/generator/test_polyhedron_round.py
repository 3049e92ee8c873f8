"""Round faces, which unroll; what the kernel holds becomes an object and comes back."""

import math

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox as Box
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone as Cone
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder as Cylinder
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere as Sphere
from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus as Torus
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from reference.kernel import inertia_of

from generator import encode
from generator.cad.read import polyhedron_from
from generator.cad.result import _kernel_solid
from generator.database.round_face import Bend, round_face
from generator.errors import DatabaseError, ShapeError
from generator.polyhedron import volume
from generator.polyhedron.development import development
from generator.polyhedron.read import curved
from generator.polyhedron.read.kernel import describe_shape
from generator.polyhedron.read.step import polyhedron_of_facets
from generator.polyhedron.shapes import cone, cylinder
from generator.solid import box
from generator.solid import volume as part_volume
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
        solid = polyhedron_from(Cylinder(30, 60).Shape())
    else:
        solid = polyhedron_from(Cone(low, high, 60).Shape())
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
    bore = Cylinder(axes(30, 30, -10), 20, 80).Shape()
    solid = polyhedron_from(cut(Box(60, 60, 60).Solid(), bore))
    assert (kinds(solid), solid.genus) == ([("cylinder", True, True)], 1)
    across = Cylinder(axes(0, -50, 40, (0, 1, 0)), 8, 100).Shape()
    solid = polyhedron_from(cut(Cylinder(30, 80).Shape(), across))
    assert solid.surfaces == ()
    assert "the outline (cylinder) does not unroll" in solid.notes[0]


def test_fillets_unroll_and_their_corners_stay_blank():
    block = Box(80, 60, 40).Solid()
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
    half = Cone(axes(0, 0, 0), 30, 15, 40, math.pi).Shape()
    bore = Cylinder(axes(0, -9, 20, (0, 1, 0)), 4, 90).Shape()
    assert polyhedron_from(cut(half, bore)).blank  # it is closed, or it would have been refused


def test_a_wall_thinner_than_the_division_says_so():
    outer = Sphere(60.0).Shape()
    inner = Sphere(axes(0, 0, 0, (1, 2, 9)), 59.9).Shape()  # divided apart
    half = Box(gp_Pnt(0, -99, -99), 99, 198, 198).Solid()
    with pytest.raises(ShapeError, match=r"into \d+ facets to \d.* mm, make no") as error:
        polyhedron_from(BRepAlgoAPI_Common(cut(outer, inner), half).Shape())
    assert "walls thicker" in error.value.fix


def test_a_solid_of_many_facets_is_divided_more_coarsely_and_says_so(monkeypatch):
    monkeypatch.setattr(curved, "MOST_FACETS", 600)
    solid = polyhedron_from(Torus(20, 6).Shape())
    assert len(solid.faces) <= 600
    assert solid.notes[0].startswith("round faces were divided to ")
    assert volume(solid) == pytest.approx(2 * math.pi**2 * 20 * 6**2, rel=0.1)
    monkeypatch.setattr(curved, "MOST_FACETS", 60)
    with pytest.raises(ShapeError, match=r"need \d+ facets, to 1 mm; 60 are allowed"):
        polyhedron_from(Torus(20, 6).Shape())


def test_points_that_are_one_are_joined_and_facets_joined_to_nothing_refused():
    # A cylinder whose top meets its side in points that are off by less than the tolerance.
    found = describe_shape(Cylinder(30, 80).Shape())
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


def test_a_bend_in_turned_axes_falls_alike_and_a_wide_one_is_flat():
    points = np.random.default_rng(4).uniform(-12, 12, (20, 2))
    bend, angle = Bend(35.0, 0.4, 0.3), 1.1
    c, s = math.cos(angle), math.sin(angle)
    turned = points @ np.array([[c, -s], [s, c]])  # the same points in axes turned by the angle
    assert bend.turned(angle).falls_mm(turned) == pytest.approx(bend.falls_mm(points), abs=1e-12)
    assert Bend(1e12, 0.3).falls_mm(points) == pytest.approx(0.0, abs=1e-9)
    assert Bend(1e7, 0.3).unrolled_mm(points, 1.0) == pytest.approx(points, abs=1e-4)
    slim, straight = Bend(40.0, 0.7, 1e-7), Bend(40.0, 0.7)
    assert slim.falls_mm(points) == pytest.approx(straight.falls_mm(points), abs=1e-4)


def test_beyond_the_face_and_at_the_tip_of_a_cone_all_is_finite():
    solid = cone(60, 60)
    face = round_face(solid, solid.surfaces[0])
    tip = face.development.high[0]
    assert (face.tangent(*tip) @ (*tip, 0, 1))[:3] == pytest.approx([0, 0, 60], abs=0.02)  # facets
    points = np.random.default_rng(5).uniform(-12, 12, (20, 2))
    far = np.array([[0.0, 500.0], [-500.0, 3.0], *points])
    for bend in (Bend(20.0, 0.0), Bend(20.0, 0.0, 0.5), face.bend(*tip)):
        assert np.isfinite(bend.falls_mm(far)).all()
        assert np.isfinite(bend.unrolled_mm(far, 1.0)).all()


def block(x: float = 30.0, y: float = 35.0, z: float = 40.0):
    return Box(gp_Pnt(5, 6, 7), x, y, z).Solid()


def encoded(folder, solid=None, **options):
    given = {"name": "Block", "formats": (), "folder": folder / "out"} | options
    return encode(solid or block(), database=str(folder / "lab.db"), **given)


def test_parts_come_back_as_valid_solids_where_the_solid_was(tmp_path):
    result = encoded(tmp_path, print={"parts": "whole"})
    (part,) = result.parts
    solid = _kernel_solid(part)
    mm3, centre, _ = inertia_of([(solid, np.eye(4))])
    assert BRepCheck_Analyzer(solid).IsValid()
    assert mm3 == pytest.approx(part_volume(part), rel=1e-9)
    assert mm3 > 30 * 35 * 40
    assert math.dist(centre, (20, 23.5, 27)) < 0.5
    low, high = box(part)
    assert high - low == pytest.approx([32, 37, 41])  # F1 is blank: it is down


def test_the_same_solid_again_keeps_its_cells_and_another_is_refused(tmp_path):
    first = encoded(tmp_path)
    again = encoded(tmp_path, block())
    assert (first.reused, again.reused) == (False, True)
    assert again.layout.faces[0].rows.tolist() == first.layout.faces[0].rows.tolist()
    with pytest.raises(DatabaseError, match="another spec"):
        encoded(tmp_path, block(31.0))
    replaced = encoded(tmp_path, block(31.0), replace=True)
    assert not replaced.reused
    assert any("destroy its printed parts" in said for said in replaced.warnings)
    assert replaced.layout.faces[0].placement != first.layout.faces[0].placement  # beside it
    back = encoded(tmp_path, block(), replace=True)
    assert back.layout.faces[0].placement == first.layout.faces[0].placement  # freed for others


def test_settings_are_those_of_a_spec_and_errors_name_them(tmp_path):
    pitch = np.float64(8)  # of a notebook
    result = encoded(tmp_path, symbols={"pitch": pitch}, layout="faces", profile="large")
    assert (result.layout.pitch_mm, result.layout.kind) == (8.0, "faces")
    for given, said in (
        ({"profile": "lagre"}, r"encode\(\):2:10: error: unknown profile 'lagre'"),
        ({"symbols": {"pich": 8}}, "unknown setting 'pich'"),
        ({"symbols": {"pitch": object()}}, "not a plain value"),
        ({"copies": 2}, "one solid is encoded at a time"),
    ):
        with pytest.raises(SpecError, match=said):
            encoded(tmp_path, **given)


def test_what_is_no_single_solid_with_a_plane_is_refused_and_leaves_nothing(tmp_path):
    two = BRepAlgoAPI_Fuse(block(), Box(gp_Pnt(90, 0, 0), 9, 9, 9).Solid()).Shape()
    for solid, cause in (
        (two, "2 solids"),
        (Sphere(20.0).Shell(), "no solid, but 1 loose face;"),
        (3.0, "float is no solid of build123d, cadquery or trimesh"),
        (Torus(20, 5).Shape(), "no face of the object carries symbols"),
    ):
        with pytest.raises((ShapeError, SpecError), match=cause):
            encoded(tmp_path, solid)
    assert not list(tmp_path.iterdir())


def test_symbols_keep_out_of_a_slot_that_is_too_narrow_for_them(tmp_path):
    lid = Box(gp_Pnt(20, 0, 41.5), 60, 60, 20).Solid()
    post = Box(gp_Pnt(0, 0, 0), 20, 60, 61.5).Solid()
    floor = Box(gp_Pnt(0, 0, 0), 80, 60, 40).Solid()
    solid = BRepAlgoAPI_Fuse(BRepAlgoAPI_Fuse(floor, post).Shape(), lid).Shape()
    result = encoded(tmp_path, solid, print={"parts": "whole"}, formats=("stl",), verify=True)
    assert any("nearer than 2.8 mm in front of" in warning for warning in result.warnings)
    vertices = result.polyhedron.vertices
    slot = [
        len(laid.labels)
        for face, laid in zip(result.polyhedron.faces, result.layout.faces, strict=True)
        if np.ptp(z := vertices[list(face.loops[0])][:, 2]) < 1e-9 and z[0] in (40.0, 41.5)
    ]
    assert slot == [0, 0]


def test_a_spec_is_a_file_its_text_or_its_settings(tmp_path):
    text = "name: Cube\nshape: {cube: 30 mm}\n"
    (tmp_path / "cube.yaml").write_text(text)
    settings = {"name": "Cube", "shape": {"cube": "30 mm"}}
    given = {"database": str(tmp_path / "lab.db"), "formats": ("stl",), "folder": tmp_path / "out"}
    first = encode(settings, **given)
    assert (first.name, first.faces, first.symbols, first.folder) == (
        "Cube", 6, 150, tmp_path / "out",
    )  # fmt: skip
    assert str(first) == f"Cube: 6 faces, 150 symbols, {len(first.files)} files in {first.folder}"
    for again in (text, tmp_path / "cube.yaml", str(tmp_path / "cube.yaml")):
        assert encode(again, **given).objects[0].reused  # the same spec: the same cells
    two = encode({"objects": [settings, settings | {"name": "Second"}]}, **given)
    assert (two.name, two.symbols, str(two).count("\n")) == ("Cube, Second", 300, 1)
    typed = given | {"formats": "STL", "database": tmp_path / "lab.db"}
    assert encode(text, **typed).objects[0].reused
    for wrong in ("", ["obj"], 5):
        with pytest.raises(SpecError, match="--format: error: "):
            encode(text, **given | {"formats": wrong})
    with pytest.raises(SpecError, match="'layout' stands beside a spec"):
        encode(text, layout="net", **given)
    with pytest.raises(SpecError, match=r"encode\(\):1:1: error: unknown setting 'nam'"):
        encode({"nam": "Cube", "shape": {"cube": "30 mm"}}, **given)
