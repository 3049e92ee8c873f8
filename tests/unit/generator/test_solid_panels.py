"""Panels: mitres, insets, texts on backs; no overlap, the gap wherever they meet, whole symbols."""

import itertools
import math

import numpy as np
import pytest
from manifold3d import Manifold, Mesh64
from random_shapes import convex_hull, extruded, random_convex

from generator.errors import SolidError
from generator.export.check import verify_fit
from generator.export.meshes import stl_chunks
from generator.layout.placement import Layout
from generator.pipeline.files import parts_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.plane.polygon import distance, triangle_areas
from generator.polyhedron.shapes import box, dodecahedron
from generator.polyhedron.winged import polyhedron
from generator.printers import PRINTERS
from generator.solid import (
    panels,
    plain_panels,
    prove_closed,
    symbol_clearance_mm,
    top_inset_mm,
    top_insets_mm,
    triangles,
    volume,
)
from generator.solid.fit import beyond, body_volume, cut_off, shortest_edge_mm
from generator.solid.part import Facet, Part, turn
from generator.solid.plate import inset, mitre, regular, shared_insets
from generator.solid.triangulate import triangulate_rings, without_slivers
from generator.spec import read_specs
from generator.spec.read import tree_from

FDM = PRINTERS["fdm-0.4"]
EMPTY = Layout("faces", 7.0, ())


def test_mitre_of_a_cube_by_hand():
    # Back edge: 3 mm + gap 0.1. At 45 degrees from there to under the land: 2.8 mm.
    side = mitre(math.pi / 2, 3.0, FDM)
    assert (side.top_mm, side.land_mm, side.back_mm) == pytest.approx((0.3, 0.2, 3.1), rel=1e-12)
    assert top_inset_mm(math.pi / 2, 3.0, FDM) == side.top_mm
    assert top_inset_mm(math.radians(120), 3.0, FDM) == 0.0
    assert top_inset_mm(1.5 * math.pi, 3.0, FDM) == 0.0
    assert mitre(1.5 * math.pi, 3.0, FDM).back_mm == pytest.approx(-2.9)
    assert math.isfinite(top_inset_mm(1e-12, 3.0, FDM))
    clear = [symbol_clearance_mm(math.radians(angle), 1.0) for angle in (90, 270, 300)]
    assert clear == pytest.approx([0.0, 1.0, math.sqrt(3)])  # symbols apart at reflex edges


@pytest.mark.parametrize("bend", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
def test_inset_at_flat_corners_has_its_limit(bend):
    ring = np.array([[0.0, 0.0], [5.0, -bend], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    assert inset(ring, np.ones(5))[1] == pytest.approx([5.0, 1.0 - bend], abs=1e-6)
    insets = shared_insets(ring, np.array([1.0, 2.0, 1.0, 1.0, 1.0]))
    assert insets.tolist() == [2.0, 2.0, 1.0, 1.0, 1.0]
    assert inset(ring, insets)[1] == pytest.approx([5.0, 2.0 - bend], abs=1e-6)
    assert regular([ring], [inset(ring, insets)], 0.1)


def test_too_thick_walls_name_the_face_and_a_wall_that_fits():
    thin = box([60.0, 60.0, 8.0])
    with pytest.raises(SolidError, match=r"F2: .*set wall to 3.7 mm or less") as caught:
        panels(thin, EMPTY, (), 5.0, FDM)
    assert caught.value.place == "F2"
    assert len(panels(thin, EMPTY, (), 3.7, FDM).parts) == 6
    with pytest.raises(SolidError, match="print it whole"):
        panels(box([60.0, 60.0, 1.0]), EMPTY, (), 3.0, FDM)
    with pytest.raises(SolidError, match="wall nan"):
        panels(thin, EMPTY, (), math.nan, FDM)
    for gap in (0.0, math.nan):
        with pytest.raises(SolidError, match="set gap to more than 0"):
            panels(thin, EMPTY, (), 3.0, FDM, gap_mm=gap)


def test_collinear_edges_with_different_neighbours():
    # A step on one side of a block: the bottom has two edges in one line.
    flat = [(0, 0), (30, 0), (60, 0), (60, 30), (0, 30)]
    vertices = [(x, y, 0) for x, y in flat]
    vertices += [(0, 0, 30), (30, 0, 30), (60, 8, 30), (60, 30, 30), (0, 30, 30)]
    faces = [
        [0, 4, 3, 2, 1], [5, 6, 9], [6, 8, 9], [6, 7, 8], [0, 1, 6, 5], [1, 2, 7], [1, 7, 6],
        [2, 3, 8, 7], [3, 4, 9, 8], [4, 0, 5, 9],
    ]  # fmt: skip
    solid = polyhedron("polyhedron", np.array(vertices, dtype=float), faces)
    insets = top_insets_mm(solid, 0, 3.0, FDM)[0]
    assert insets[3] == insets[4]
    for part in panels(solid, EMPTY, (), 3.0, FDM).parts:
        prove_closed(part)


def test_points_on_a_line_are_kept_without_flat_triangles():
    outer = np.array([[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 3], [1, 3], [0, 3], [0, 1.0]])
    hole = np.array([[1, 1], [1, 2], [2, 2], [2, 1.0]])
    found = triangulate_rings([outer, hole], np.arange(13), "plate")
    areas = triangle_areas(np.concatenate([outer, hole])[found])
    assert set(found.ravel()) == set(range(13))
    assert areas.min() > 1e-3
    assert areas.sum() == pytest.approx(8.0)
    with pytest.raises(SolidError, match="plate"):
        triangulate_rings([outer, hole + np.array([1.5, 0.0])], np.arange(13), "plate")


OFF_MM = 5e-7  #: of a point from a line of 10 mm: less than 32 bits hold at 20 mm


def test_a_triangle_thinner_than_stl_holds_is_flipped_away():
    points = np.array([(10.0, 10.0), (15.0, 10.0 - OFF_MM), (20.0, 10.0), (15.0, 15.0)])
    found = without_slivers(points, np.array([[0, 1, 2], [0, 2, 3]]))
    rounded = points.astype(np.float32).astype(float)
    assert triangle_areas(rounded[found]).min() > 1.0
    assert triangle_areas(points[found]).sum() == pytest.approx(25.0 + 5.0 * OFF_MM, rel=1e-12)


def backs(solid, name, code):
    """Return what stands on each back, and the warnings."""
    made = panels(solid, EMPTY, (), 3.0, FDM, name=name, code=code)
    said = [{e.names[0].rpartition(" figure")[0] for e in part.embossings} for part in made.parts]
    return said, made.warnings


def test_a_code_goes_before_numbers_and_what_finds_no_room_is_told():
    said, warnings = backs(box((40.0, 14.0, 14.0)), "Tiny", "K7M")
    assert said[2] == {"8"}  # a back of 8 x 8 mm
    assert "mark by hand" in warnings[-1]
    unnamed = sum(not any("F" in text for text in texts) for texts in said)
    assert warnings[-1].count("F") == unnamed
    said, warnings = backs(box((60.0, 40.0, 12.0)), "Tiny", "K7M")
    assert all(any("F" in text for text in texts) for texts in said)
    assert [w.split(" the ")[0] for w in warnings] == ["no room for"]
    said, warnings = backs(box((60.0, 60.0, 60.0)), "\u7acb", "K7M")
    assert [texts & {"K7M", f"F{k}"} for k, texts in enumerate(said, 1)] == [
        {"K7M", f"F{k}"} for k in range(1, 7)
    ]


UNEQUAL = np.array([(0, 0, 0), (60, 0, 0), (60, 80, 0), (0, 80, 0), (30, 40, 70)], dtype=float)
BIPYRAMID = np.array(
    [(40, 0, 0), (0, 28, 0), (-44, 5, 0), (0, -30, 0), (0, 0, 50), (0, 0, -35)], dtype=float
)
ELL = np.array([(0, 0), (60, 0), (60, 20), (20, 20), (20, 60), (0, 60)], dtype=float)
FORK = np.array([(0, 0), (9, 0), (9, 9), (6, 9), (6, 3), (3, 3), (3, 9), (0, 9)], dtype=float)


def hull_of_14():
    points = np.random.default_rng(14).normal(size=(14, 3))
    return convex_hull(50 * points / np.linalg.norm(points, axis=1)[:, None])


def dented():
    """A hull whose corners are moved in and out: faces meet in corners, convex or not."""
    hull = random_convex(np.random.default_rng([1, 38, True]))
    scale = np.random.default_rng(3).uniform(0.75, 1.1, size=(len(hull.vertices), 1))
    return polyhedron("dented", hull.vertices * scale, [face.loops for face in hull.faces])


def seated(part):
    mesh = triangles(part)
    T = part.T_object_part
    points = mesh.vertices @ T[:3, :3].T + T[:3, 3]
    return Manifold(Mesh64(points, mesh.triangles.astype(np.uint64)))


def measured(parts):
    """Return overlap (mm3) and smallest gap (mm, 3 at most) of all pairs."""
    pairs = list(itertools.combinations(map(seated, parts), 2))
    overlap = sum(float((one ^ other).volume()) for one, other in pairs)
    return overlap, min(float(one.min_gap(other, 3.0)) for one, other in pairs)


@pytest.mark.parametrize(
    ("solid", "cuts", "gap"),
    [
        (dodecahedron(40.0), False, 0.14),
        (convex_hull(UNEQUAL), True, 0.14),
        (convex_hull(UNEQUAL), True, 0.05),
        (convex_hull(UNEQUAL), True, 2.0),
        (convex_hull(BIPYRAMID), True, 0.14),
        (hull_of_14(), True, 0.14),
        (extruded([ELL], 50.0), False, 0.14),
        (dented(), True, 0.14),
    ],
)
def test_panels_keep_the_gap_everywhere(solid, cuts, gap):
    made = plain_panels(solid, 2.0, FDM, gap, "P")
    overlap, found = measured(made.fitted)
    assert overlap == 0.0
    assert gap - 1e-6 <= found <= gap + 0.003
    for part in made.fitted:
        prove_closed(part)
        assert volume(part) == pytest.approx(float(seated(part).volume()), rel=1e-12)
        assert shortest_edge_mm(part) >= 0.05
    assert any(a is not b for a, b in zip(made.mitred, made.fitted, strict=True)) == cuts
    if cuts:  # mitres alone are too near or run into each other; the cuts cost little
        assert measured(made.mitred)[1] < gap - 0.001
        before, after = (sum(map(volume, parts)) for parts in (made.mitred, made.fitted))
        assert (0.99 if gap < 1 else 0.9) < after / before < 1.0


@pytest.mark.parametrize("gap", [0.14, 2])
def test_symbols_stand_on_what_the_cuts_leave(gap):
    faces = [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    shape = {"polyhedron": {"vertices": UNEQUAL.tolist(), "faces": faces}}
    spec = {"name": "P", "print": {"gap": gap}, "shape": shape}
    plan = plan_object(*read_specs([tree_from(spec)]))
    layout = lay_out_object(plan, NO_CELLS)
    parts, _ = parts_of(plan, layout)
    assert sum(part.symbols for part in parts) == sum(len(face.labels) for face in layout.faces)
    for part in parts:
        prove_closed(part)
        top = [part.vertices[list(loop), :2] for loop in part.facets[0].loops]
        for embossing in part.embossings:
            if embossing.face is None:
                continue
            R = turn(embossing.rotation_rad)
            T = embossing.T_part_facet
            for centre, label in zip(embossing.centres_mm, embossing.labels, strict=True):
                foot = (embossing.tiers[label].rings[0][0] @ R.T + centre) @ T[:2, :2].T + T[:2, 3]
                assert distance(foot, top).min() >= FDM.edge_min_mm / 2 - 1e-9
    assert measured(parts)[0] == 0.0


def test_a_piece_of_a_fork_is_cut_alone():
    solid = extruded([FORK], 2.0)
    facets = tuple(Facet(face.name, face.loops) for face in solid.faces)
    body = Part("solid", solid.vertices, facets, (), np.eye(4))
    up, down = np.array([0.0, 1.0, 0.0]), np.array([0.0, -1.0, 0.0])
    pieces = beyond(body, up, 5.0)
    assert [int(piece.sum()) for piece in pieces] == [4, 4]
    cut = cut_off(body, up, 5.0, pieces[0], "lid")
    assert body_volume(body) - body_volume(cut) == pytest.approx(3 * 4 * 2)
    assert [len(facet.loops[0]) for facet in cut.facets if facet.name == "lid"] == [4]
    # Along the arms the fork would fall in two.
    (handle,) = beyond(body, down, -2.0)
    assert cut_off(body, down, -2.0, handle, "lid") is not None
    (bridge,) = beyond(body, down, -5.0)
    assert bridge.sum() == 8
    assert cut_off(body, down, -5.0, bridge, "lid") is None


def test_written_panels_are_put_together(tmp_path):
    def files(parts):
        for part in parts:
            (tmp_path / part.name).write_bytes(b"".join(stl_chunks(triangles(part))))
        return parts, [tmp_path / part.name for part in parts]

    plain = plain_panels(convex_hull(UNEQUAL), 3.0, FDM, 0.14, "P")
    report = verify_fit(*files(plain.fitted), 0.14)
    assert report.overlap_mm3 == 0.0
    assert report.gap_mm == pytest.approx(0.14, abs=1e-4)
    assert report.pairs == 10
    with pytest.raises(SolidError, match=r"panels 'P-F\d' and 'P-F\d' overlap by \d"):
        verify_fit(*files(plain.mitred), 0.14)
    with pytest.raises(SolidError, match=r"apart where 0\.2 mm was meant"):
        verify_fit(*files(plain.fitted), 0.2)
    assert verify_fit(*files(plain.fitted[:1]), 0.14).gap_mm is None
