"""Any style, any solid: an outline or a refusal; a part that is closed and of its volume."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from reference.laid_symbols import filled, is_closed, mesh_volume

from generator.alphabet import ALPHABETS, SymbolStyle, check_printable, footprint_half_mm, outlines
from generator.errors import AlphabetError, SolidError
from generator.plane.polygon import (
    distance,
    edges_cross,
    face_vector,
    points_inside,
    signed_area,
    signed_volume,
)
from generator.polyhedron.shapes import prism, pyramid
from generator.printers import PRINTERS
from generator.solid import emboss_whole, panels, prove_closed, triangles, volume
from generator.solid.closed import edges_once
from generator.solid.part import to_part, turn
from generator.solid.plate import inset, regular

ALPHABET = st.sampled_from(list(ALPHABETS.values()))
STYLE = st.builds(
    SymbolStyle,
    pitch_mm=st.floats(3.0, 20.0),
    height_mm=st.floats(0.1, 2.0),
    stroke_mm=st.floats(0.3, 4.0),
    draft_rad=st.floats(0.0, 0.5),
    chamfer_mm=st.floats(0.0, 0.5),
)


def refusal(make, *arguments):
    """Return the error with which a stage refuses, or None."""
    try:
        make(*arguments)
    except (AlphabetError, SolidError) as error:
        return error
    return None


@given(ALPHABET, STYLE, st.sampled_from(list(PRINTERS.values())))
@settings(max_examples=40, deadline=None)
def test_a_style_gives_proper_outlines_or_says_what_to_change(alphabet, style, printer):
    refused = refusal(check_printable, alphabet, style, printer)
    if refused is not None:
        assert refused.fix.startswith(("set ", "give "))
        return
    half = footprint_half_mm(alphabet, style)
    assert half < style.pitch_mm / 2
    for tiers in outlines(alphabet, style):
        for rings in tiers.rings:
            assert not edges_cross(rings)
            assert np.abs(np.concatenate(rings)).max() < half
        shares = [sum(signed_area(ring) for ring in rings) for rings in tiers.rings]
        assert all(a >= b * (1 - 1e-12) for a, b in pairwise(shares))  # it gets narrower
    if style.chamfer_mm == 0.0:  # at the top, the nib keeps half a stroke around every node
        unit = alphabet.reach * style.pitch_mm
        for glyph, tiers in zip(alphabet.glyphs, outlines(alphabet, style), strict=True):
            nodes = unit * np.array([node for stroke in glyph.strokes for node in stroke])
            assert points_inside(nodes, tiers.rings[-1]).all()
            assert distance(nodes, tiers.rings[-1]).min() >= style.stroke_mm / 2 * (1 - 1e-9)


def expand_part(part):
    """Return vertices (N, 3) mm, part frame, and the loops of every planar polygon.

    The body's facets with the feet cut out come first; then per symbol its islands (facet inside
    a hole of the foot), sides from the foot up, and the top.
    """
    points = [part.vertices]
    count = len(part.vertices)
    body = [list(facet.loops) for facet in part.facets]
    found = []
    for embossing in part.embossings:
        R = turn(embossing.rotation_rad)
        for centre, label in zip(embossing.centres_mm, embossing.labels.tolist(), strict=True):
            tiers = embossing.tiers[label]
            numbers = []
            for z, rings in zip(tiers.z_mm, tiers.rings, strict=True):
                numbers.append([])
                for ring in rings:
                    points.append(to_part(embossing, ring @ R.T + centre, z))
                    numbers[-1].append(tuple(range(count, count + len(ring))))
                    count += len(ring)
            body[embossing.facet].append(numbers[0][0][::-1])
            found += [[hole[::-1]] for hole in numbers[0][1:]]
            for lower, upper in pairwise(numbers):
                for a, b in zip(lower, upper, strict=True):
                    ahead = [*range(1, len(a)), 0]
                    found += [[(a[k], a[j], b[j], b[k])] for k, j in enumerate(ahead)]
            found.append(numbers[-1])
    return np.concatenate(points), body + found


def assert_expanded(part):
    """Check planarity to 1e-12, closure and volume of the expanded solid."""
    vertices, polygons = expand_part(part)
    size = float(np.ptp(vertices, axis=0).max())
    loops = [loop for polygon in polygons for loop in polygon]
    assert edges_once(
        np.concatenate([np.array(loop) for loop in loops]),
        np.concatenate([np.roll(loop, -1) for loop in loops]),
    )
    for polygon in polygons:
        corners = [vertices[list(loop)] for loop in polygon]
        normal = face_vector(corners)
        points = np.concatenate(corners)
        off = (points - points[0]) @ (normal / np.linalg.norm(normal))
        assert np.abs(off).max() <= 1e-12 * size
    assert signed_volume(vertices, polygons) == pytest.approx(volume(part), rel=1e-11)


def solids():
    return st.one_of(
        st.builds(prism, st.integers(3, 7), st.floats(25, 60), radius=st.floats(25, 50)),
        st.builds(pyramid, st.integers(3, 6), st.floats(30, 70), radius=st.floats(30, 50)),
    )


@given(
    solids(),
    st.sampled_from(sorted(ALPHABETS)),
    st.floats(-4.0, 4.0),
    st.sampled_from([0.0, 0.1]),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=15, deadline=None)
def test_parts_are_closed_planar_and_of_their_volume(solid, name, turned, chamfer, seed):
    alphabet = ALPHABETS[name]
    pitch = 9.0
    stroke = round(alphabet.stroke_ratio * pitch, 2)
    style = SymbolStyle(pitch, 0.8, stroke, math.radians(8), chamfer)
    tiers, half = outlines(alphabet, style), footprint_half_mm(alphabet, style)
    chance = np.random.default_rng(seed)
    shown = {"order": alphabet.order, "chance": chance, "share": 0.8}
    layout = filled(solid, pitch, half + 6.5, turned=turned, **shown)
    parts = [emboss_whole(solid, layout, tiers, "body")]
    refused = refusal(panels, solid, layout, tiers, 2.0, PRINTERS["fdm-0.4"])
    if refused is None:
        parts += panels(solid, layout, tiers, 2.0, PRINTERS["fdm-0.4"]).parts
    else:
        assert "print it whole" in refused.fix
    for part in parts:
        prove_closed(part)
        mesh = triangles(part)
        assert is_closed(mesh)
        assert mesh_volume(mesh) == pytest.approx(volume(part), rel=1e-9)
        p = mesh.vertices[mesh.triangles]
        areas = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
        assert areas.min() > 0.0
    assert_expanded(parts[-1])


@given(
    st.lists(st.tuples(st.floats(0.5, 2.0), st.floats(0.3, 1.0)), min_size=3, max_size=12),
    st.lists(st.floats(-0.2, 0.4), min_size=12, max_size=12),
)
@settings(max_examples=100, deadline=None)
def test_inset_edges_stay_parallel_at_their_distance(polar, insets):
    steps = np.array([step for _, step in polar])
    angles = np.cumsum(steps) * (2 * math.pi / steps.sum())
    radii = 10 * np.array([radius for radius, _ in polar])
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    assume(not edges_cross([ring]))
    each = np.array(insets[: len(ring)])
    moved = inset(ring, each)
    assume(regular([ring], [moved], 1e-3))
    edge = np.roll(ring, -1, axis=0) - ring
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1) / np.hypot(*edge.T)[:, None]
    for corner in (moved, np.roll(moved, -1, axis=0)):
        reach = np.abs(corner - ring).max() + 1.0
        away = ((corner - ring) * normal).sum(axis=1)
        assert away == pytest.approx(each, abs=1e-12 * reach * 1e3)
    if each.min() >= 0:
        assert points_inside(moved, [ring]).all() or distance(moved, [ring]).min() < 1e-9
