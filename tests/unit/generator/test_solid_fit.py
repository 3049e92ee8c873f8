"""Panels that fit: no overlap and the gap wherever they meet, and symbols that stay whole."""

import itertools

import numpy as np
import pytest
from manifold3d import Manifold, Mesh64
from random_shapes import convex_hull, extruded, random_convex

from generator.errors import SolidError
from generator.export.check import PanelFile, verify_fit
from generator.export.meshes import stl_chunks
from generator.pipeline.files import parts_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.plane.polygon import distance
from generator.polyhedron.shapes import dodecahedron
from generator.polyhedron.winged import polyhedron
from generator.printers import PRINTERS
from generator.solid import plain_panels, prove_closed, triangles, volume
from generator.solid.fit import beyond, body_volume, cut_off, shortest_edge_mm
from generator.solid.part import Facet, Part, turn
from generator.spec import read_specs
from generator.spec.read import tree_from

FDM = PRINTERS["fdm-0.4"]
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
        return [PanelFile(part.name, tmp_path / part.name, part.T_object_part) for part in parts]

    plain = plain_panels(convex_hull(UNEQUAL), 3.0, FDM, 0.14, "P")
    report = verify_fit(files(plain.fitted), 0.14)
    assert report.overlap_mm3 == 0.0
    assert report.gap_mm == pytest.approx(0.14, abs=1e-4)
    assert report.pairs == 10
    with pytest.raises(SolidError, match=r"panels 'P-F\d' and 'P-F\d' overlap by \d"):
        verify_fit(files(plain.mitred), 0.14)
    with pytest.raises(SolidError, match=r"apart where 0\.2 mm was meant"):
        verify_fit(files(plain.fitted), 0.2)
    assert verify_fit(files(plain.fitted[:1]), 0.14).gap_mm is None
