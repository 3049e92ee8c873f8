"""Cylinder and cone from spec to file and back: registered, sliced, read by simulated touch.

Needs the Debian package `prusa-slicer`; without it one of these tests fails.
"""

import math
import re
import shutil
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects import Reader, encode, open_lab
from generator.alphabet.known import alphabet_from
from generator.alphabet.outline import outlines
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.plane.polygon import distance, points_inside
from generator.polyhedron.development import development
from generator.polyhedron.winged import developable_from
from probe.simulate.registered import registered_object
from probe.simulate.scene import TouchRanges, bare_scene, random_touches
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor
from probe.simulate.written import round_part, written_triangles

#: Large enough that one touch shows symbols enough; smaller ones need a scan.
SHAPES = {
    "cylinder": {"cylinder": {"diameter": "90 mm", "height": "40 mm"}},
    "cone": {"cone": {"diameter": "100 mm", "top_diameter": "70 mm", "height": "40 mm"}},
}
INSIDE_MM = 12.0


@pytest.fixture(scope="module", params=SHAPES)
def made(request, tmp_path_factory):
    """A round object: its folder, what the database knows, its written round face, a reader."""
    folder = tmp_path_factory.mktemp(request.param)
    database, spec = str(folder / "lab.db"), {"name": "Round", "shape": SHAPES[request.param]}
    encode(spec, database=database, folder=folder, formats=("stl", "3mf"))
    with read_transaction(open_database(database, writable=False)) as connection:
        known = read_object(connection, "Round")
    held = registered_object(database, "Round")
    (face,) = [face for face in held.faces if face.round is not None]
    (part,) = [part for part in held.parts if part.format == "stl"]
    written = round_part(folder / part.file, held, part, face)
    return SimpleNamespace(
        folder=folder, known=known, part=part, written=written, reader=Reader(open_lab(database))
    )


def drawn(made, rng, number, *ranges):
    """Return random touches of the round face."""
    touches = random_touches(made.written.region, rng, TouchRanges(*ranges, margin_mm=INSIDE_MM))
    return [touch for _, touch in zip(range(number), touches, strict=False)]


def outermost(triangles, start, along):
    """Return how far along a ray the last triangle is (Moeller and Trumbore, 1997)."""
    a = triangles[:, 0]
    u, v = triangles[:, 1] - a, triangles[:, 2] - a
    p = np.cross(along, v)
    det = (u * p).sum(axis=1)
    det = np.where(np.abs(det) > 1e-12, det, np.inf)
    s = start - a
    b = (s * p).sum(axis=1) / det
    q = np.cross(s, u)
    c = (q @ along) / det
    t = (v * q).sum(axis=1) / det
    hit = (b >= 0) & (c >= 0) & (b + c <= 1) & (t > 0) & (t < 10) & np.isfinite(det)
    return float(t[hit].max())


def test_the_surface_bears_the_registered_symbols_where_the_database_says(made):
    known = made.known
    (surface,) = [developable_from(one) for one in known.spec["surfaces"]]
    d = development(known.polyhedron, surface)
    face = known.layout.faces[surface.carrier]
    tiers = outlines(alphabet_from(known.alphabet), known.style)
    T = made.part.T_object_part
    triangles = written_triangles(made.folder / made.part.file) @ T[:3, :3].T + T[:3, 3]
    rotation, h = -face.placement.rotation_rad, known.style.height_mm
    R = np.array([[np.cos(rotation), -np.sin(rotation)], [np.sin(rotation), np.cos(rotation)]])
    rng = np.random.default_rng(1)
    right = np.column_stack([d.high[:, 1] - d.low[:, 1], d.low[:, 0] - d.high[:, 0]])
    raised = []
    for label, centre in zip(face.labels[::3].tolist(), face.centres_mm[::3], strict=True):
        q = rng.uniform(-0.35, 0.35, 2) * known.style.pitch_mm
        top, foot = tiers[label].rings[-1], tiers[label].rings[0]
        on, off = points_inside(q[None], top)[0], not points_inside(q[None], foot)[0]
        near = min(distance(q[None], top)[0], distance(q[None], foot)[0])
        if near < 0.1 or on == off:
            continue  # on a side of the symbol
        at = centre + R @ q
        beside = ((at - d.low) * right).sum(axis=1)
        facet = int(np.flatnonzero((beside[:-1] >= 0) & (beside[1:] < 0))[0])
        T = d.T_object_flat[facet]
        start = T[:3, :2] @ at + T[:3, 3] - 0.5 * T[:3, 2]
        height = outermost(triangles, start, T[:3, 2]) - 0.5
        assert height == pytest.approx(h if on else 0.0, abs=1e-3)
        raised.append(on)
    assert len(raised) > 60
    assert 0.2 < np.mean(raised) < 0.8


def test_the_slicer_repairs_nothing(made):
    slicer = shutil.which("prusa-slicer")
    if slicer is None:
        pytest.fail("prusa-slicer is missing: apt-get install prusa-slicer (Debian package)")
    for name, meshes in (("Round.stl", 1), ("Round.3mf", 2)):
        command = [slicer, "--info", str(made.folder / name)]
        found = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert found.count("manifold = yes") == meshes
        assert "number_of_parts =  1\n" in found
        assert not re.search("open_edges|facets_reversed|degenerate_facets", found)


def test_a_plate_sees_the_written_face_fall_away_under_it(made):
    rng = np.random.default_rng(5)
    for touch in drawn(made, rng, 3):
        about = rng.uniform(-8.0, 8.0, (400, 2))
        at = np.array([touch.x_mm, touch.y_mm])
        heights = made.written.under(touch).surface.heights_mm(at + about)
        over = heights + made.written.round.bend(*at).falls_mm(about)
        assert over.min() > -0.05
        assert over.max() < 1.05
        assert np.mean(np.abs(over) < 0.05) > 0.3  # between symbols
        assert np.mean(np.abs(over - 1.0) < 0.05) > 0.2  # on their tops


def test_one_touch_of_the_written_part_tells_object_face_and_pose(made):
    surface, tangent = made.written.round.surface, made.written.round.tangent
    sensor, answered = LevelSensor(made.reader.sensor, LEVELS["typical"]), 0
    rng = np.random.default_rng(8)
    for touch in drawn(made, rng, 5, (40.0, 120.0)):
        answer = made.reader.read(sensor.read(made.written.scene(), touch, rng).counts)
        if not answer:
            continue
        answered += 1
        assert (answer.object, answer.face) == ("Round", "F2")
        T = answer.T_face_probe
        turn = math.remainder(math.atan2(T[1, 0], T[0, 0]) - touch.theta_rad, math.tau)
        assert T[:2, 3] == pytest.approx([touch.x_mm, touch.y_mm], abs=0.2)
        assert math.degrees(turn) == pytest.approx(0.0, abs=1.0)
        # Seen from the object: on the tops of the symbols, and flat on the round face.
        x, y, z = answer.T_object_probe[:3, 3]
        alpha = surface.half_angle_rad
        outside = (math.hypot(x, y) - surface.radius_mm) * math.cos(alpha) + z * math.sin(alpha)
        assert outside == pytest.approx(1.0, abs=0.05)
        radial = np.array([x, y, 0.0]) / math.hypot(x, y)
        outward = math.cos(alpha) * radial + math.sin(alpha) * np.array([0.0, 0.0, 1.0])
        assert answer.T_object_probe[:3, 2] == pytest.approx(outward, abs=1e-3)
        there = tangent(touch.x_mm, touch.y_mm) @ (touch.x_mm, touch.y_mm, 1.0, 1.0)
        assert answer.T_object_probe[:3, 3] == pytest.approx(there[:3], abs=0.25)
    assert answered >= 4


def test_the_reader_takes_no_blank_round_face_for_an_encoded_one(made):
    radius, rng = made.written.round.surface.radius_mm, np.random.default_rng(2)
    for touch in drawn(made, rng, 3):
        blank = bare_scene(Blank(radius, touch.x_mm))
        counts = LevelSensor(made.reader.sensor, LEVELS["typical"]).read(blank, touch, rng).counts
        assert not made.reader.read(counts)


class Blank:
    """A cylinder without symbols, its axis along y, touched at a place."""

    top_mm = 0.0

    def __init__(self, radius_mm, x_mm):
        self.radius_mm, self.x_mm = radius_mm, x_mm

    def heights_mm(self, points_mm):
        across = points_mm[:, 0] - self.x_mm
        return np.sqrt(np.maximum(self.radius_mm**2 - across**2, 0.0)) - self.radius_mm
