"""Parts of known solids: closed, planar, of the right volume, without self-intersection."""

import numpy as np
import pymeshlab
import pytest
from reference.laid_symbols import filled, is_closed, mesh_volume

from generator.alphabet import SymbolStyle, alphabet_named, footprint_half_mm, outlines
from generator.errors import SolidError
from generator.layout.placement import FaceLayout, Layout
from generator.polyhedron.frame import volume as body_volume
from generator.polyhedron.shapes import cube, tetrahedron
from generator.printers import PRINTERS
from generator.solid import (
    body_mesh,
    emboss_whole,
    prove_closed,
    symbol_meshes,
    triangles,
    volume,
)

FDM = PRINTERS["fdm-0.4"]


SOLIDS = {"cube": cube(60.0), "tetrahedron": tetrahedron(90.0)}


def symbols(alphabet="dense-4", **style):
    known = alphabet_named(alphabet)
    chosen = SymbolStyle(**style)
    return outlines(known, chosen), footprint_half_mm(known, chosen), known.order


def assert_one_solid(mesh, wanted_volume):
    t = mesh.triangles
    assert is_closed(mesh)
    assert len(np.unique(t)) == len(mesh.vertices)
    assert mesh_volume(mesh) == pytest.approx(wanted_volume, rel=1e-9)
    checked = pymeshlab.MeshSet()
    # As an STL holds them. In float64 neighbours in a slanted plane differ by 1e-15, and the
    # checker's triangle test takes the rounding of two parallel planes for an intersection.
    single = mesh.vertices.astype(np.float32).astype(np.float64)
    checked.add_mesh(pymeshlab.Mesh(single, t.astype(np.int32)))
    measures = checked.get_topological_measures()
    assert measures["is_mesh_two_manifold"]
    assert measures["boundary_edges"] == 0
    checked.compute_selection_by_self_intersections_per_face()
    assert checked.current_mesh().selected_face_number() == 0


def test_mesh_owners_and_separate_bodies_add_up():
    tiers, half, order = symbols()
    solid = SOLIDS["cube"]
    part = emboss_whole(solid, filled(solid, 7.0, half + 0.8, order=order), tiers, "cube")
    mesh, plain, stands = triangles(part), body_mesh(part), symbol_meshes(part)
    assert_one_solid(plain, body_volume(solid))
    assert len(stands) == 6
    assert all(is_closed(stand) and stand.embossings.min() >= 0 for stand in stands)
    raised = volume(part) - body_volume(solid)
    assert sum(map(mesh_volume, stands)) == pytest.approx(raised, rel=1e-9)
    owned = mesh.embossings >= 0
    assert (mesh.symbols >= 0).tolist() == owned.tolist()
    assert len(set(zip(mesh.embossings[owned], mesh.symbols[owned], strict=True))) == 384
    facets = [part.embossings[e].facet for e in mesh.embossings[owned]]
    assert mesh.facets[owned].tolist() == facets


def test_symbols_beyond_an_edge_or_on_each_other_are_found():
    tiers, half, order = symbols()
    solid = SOLIDS["cube"]
    layout = filled(solid, 7.0, half + 0.8, order=order)
    face = layout.faces[0]

    def with_centres(change, pitch=7.0):
        centres = face.centres_mm.copy()
        centres[0] += change
        moved = FaceLayout(0, face.placement, face.rows, face.columns, face.labels, centres, 1)
        return emboss_whole(solid, Layout("faces", pitch, (moved,)), tiers, "cube")

    prove_closed(with_centres((0.01, 0.0)))  # off the lattice, but free
    assert_one_solid(triangles(with_centres((0.01, 0.0))), volume(with_centres((0.01, 0.0))))
    with pytest.raises(SolidError, match="reaches over the edge"):
        prove_closed(with_centres((-4.0, 0.0)))
    with pytest.raises(SolidError, match="overlap"):
        prove_closed(with_centres(face.centres_mm[1] - face.centres_mm[0] + 0.3))
    with pytest.raises(SolidError, match="overlap"):
        triangles(with_centres((-4.0, 0.0)))
    missing = FaceLayout(
        0, face.placement, face.rows, face.columns, face.labels + 1, face.centres_mm, 1
    )
    with pytest.raises(SolidError, match="symbol 4 on an alphabet of 4"):
        emboss_whole(solid, Layout("faces", 7.0, (missing,)), tiers, "cube")


def test_an_open_body_is_found():
    tiers, _, _ = symbols()
    part = emboss_whole(SOLIDS["cube"], Layout("faces", 7.0, ()), tiers, "cube")
    prove_closed(part)
    opened = type(part)(
        part.name, part.vertices, part.facets[:-1], part.embossings, part.T_object_part
    )
    with pytest.raises(SolidError, match="not closed"):
        prove_closed(opened)
