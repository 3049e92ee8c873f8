"""Cylinder and cone from spec to file and back: registered, sliced, read by simulated touch.

Needs the Debian package `prusa-slicer`; without it one of these tests fails.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet.known import alphabet_from
from generator.alphabet.outline import outlines
from generator.array import array_from
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.pipeline import encode
from generator.plane.polygon import distance, points_inside
from generator.polyhedron.development import development
from generator.polyhedron.winged import developable_from
from generator.spec import read_specs
from probe.simulate.registered import registered_object
from probe.simulate.scene import TouchRanges, bare_scene, random_touches
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor
from probe.simulate.written import round_part
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.signal import signal_of

SHAPES = {
    "cylinder": "{cylinder: {diameter: 36 mm, height: 30 mm}}",
    "cone": "{cone: {diameter: 46 mm, top_diameter: 26 mm, height: 30 mm}}",
}


@pytest.fixture(scope="module", params=SHAPES)
def made(request, tmp_path_factory):
    """A round object: its folder, what was made, and what the database knows."""
    folder: Path = tmp_path_factory.mktemp(request.param)
    spec = folder / "spec.yaml"
    spec.write_text(f"name: Round\nshape: {SHAPES[request.param]}\n")
    url = f"sqlite:///{folder / 'lab.db'}"
    result = encode(read_specs([spec]), folder=folder / "out", database=url,
                    formats=("stl", "3mf", "glb"), verify=True)  # fmt: skip
    with read_transaction(open_database(url, writable=False)) as connection:
        return folder / "out", result.objects[0], read_object(connection, "Round")


def stl(path: Path) -> np.ndarray:
    kind = np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    return np.frombuffer(path.read_bytes()[84:], kind)["v"].astype(float)


def outermost(triangles: np.ndarray, start: np.ndarray, along: np.ndarray) -> float:
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
    folder, told, known = made
    (surface,) = [developable_from(one) for one in known.spec["surfaces"]]
    d = development(known.polyhedron, surface)
    face = known.layout.faces[surface.carrier]
    array = array_from(known.array.definition)
    assert (array.symbols(face.rows, face.columns) == face.labels).all()
    tiers = outlines(alphabet_from(known.alphabet), known.style)
    (part,) = known.parts
    triangles = stl(folder / Path(part.file).name) @ part.T_object_part[:3, :3].T
    triangles = triangles + part.T_object_part[:3, 3]
    rotation, h = -face.placement.rotation_rad, known.style.height_mm
    R = np.array([[np.cos(rotation), -np.sin(rotation)], [np.sin(rotation), np.cos(rotation)]])
    rng = np.random.default_rng(1)
    right = np.column_stack([d.high[:, 1] - d.low[:, 1], d.low[:, 0] - d.high[:, 0]])
    asked = raised = 0
    for label, centre in zip(face.labels.tolist(), face.centres_mm, strict=True):
        for q in rng.uniform(-0.35, 0.35, (4, 2)) * known.style.pitch_mm:
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
            asked, raised = asked + 1, raised + int(on)
    assert asked > 60
    assert 0.2 < raised / asked < 0.8
    assert told.symbols == sum(len(one.labels) for one in known.layout.faces)


def test_the_slicer_repairs_nothing_and_prints_the_symbols(made, tmp_path):
    folder, _, known = made
    slicer = shutil.which("prusa-slicer")
    if slicer is None:
        pytest.fail("prusa-slicer is missing: apt-get install prusa-slicer (Debian package)")

    def run(*command: str) -> str:
        done = subprocess.run([slicer, *command], capture_output=True, text=True, timeout=300,
                              check=True)  # fmt: skip
        return done.stdout

    found = run("--info", str(folder / "Round.stl"))
    assert "manifold = yes" in found
    assert "number_of_parts =  1" in found
    assert not re.search("open_edges|facets_reversed|degenerate_facets", found)
    two = run("--info", str(folder / "Round.3mf"))
    assert two.count("manifold = yes") == 2
    if known.entry.object_type == "cone":
        return  # sliced like the cylinder, in twice the time
    gcode = tmp_path / "round.gcode"
    run("--export-gcode", "--layer-height", "0.2", "--first-layer-height", "0.2", "--skirts", "0",
        "--perimeters", "1", "--fill-density", "0", "-o", str(gcode),
        str(folder / "Round.stl"))  # fmt: skip
    layers: dict[float, list[tuple[float, float]]] = {}
    z = 0.0
    for line in gcode.read_text().splitlines():
        if match := re.match(r"G1 Z([\d.]+)", line):
            z = float(match[1])
        elif match := re.match(r"G1 X([-\d.]+) Y([-\d.]+) E", line):
            layers.setdefault(z, []).append((float(match[1]), float(match[2])))
    height = float(np.ptp(known.polyhedron.vertices[:, 2]))
    assert max(layers) == pytest.approx(height + known.style.height_mm)
    middle = np.array([(min(x) + max(x)) / 2 for x in zip(*layers[0.2], strict=True)])
    rim = np.hypot(*(np.array(layers[0.2]) - middle).T).max()
    assert rim == pytest.approx(known.spec["surfaces"][0]["radius_mm"], abs=0.4)
    # Between base and top every third layer at least has symbols outside of the round side.
    base = known.spec["surfaces"][0]["radius_mm"]
    out = [np.hypot(*(np.array(points) - middle).T).max() - base
           for level, points in layers.items() if 3.0 < level < height - 3.0]  # fmt: skip
    assert np.mean(np.array(out) > 0.4) > 0.33


#: Large enough that one touch shows symbols enough; smaller ones need a scan.
TOUCHED = {
    "Tube": "{cylinder: {diameter: 90 mm, height: 40 mm}}",
    "Cone": "{cone: {diameter: 100 mm, top_diameter: 70 mm, height: 40 mm}}",
}
INSIDE_MM = 12.0


@pytest.fixture(scope="module")
def touched(tmp_path_factory):
    """A database, and the round face of each of its objects as it was written."""
    folder = tmp_path_factory.mktemp("touched")
    spec, database = folder / "one.yaml", str(folder / "lab.db")
    parts = {}
    for name, shape in TOUCHED.items():
        spec.write_text(f"name: {name}\nshape: {shape}\n")
        encode(read_specs([spec]), folder=folder, database=database, formats=("stl",))
        held = registered_object(database, name)
        (face,) = [face for face in held.faces if face.round is not None]
        (part,) = [part for part in held.parts if part.format == "stl"]
        parts[name] = round_part(folder / part.file, held, part, face)
    return database, parts


@pytest.mark.parametrize("name", ["Tube", "Cone"])
def test_a_plate_sees_the_written_face_fall_away_under_it(touched, name):
    part = touched[1][name]
    rng = np.random.default_rng(5)
    drawn = random_touches(part.region, rng, TouchRanges(margin_mm=INSIDE_MM))
    for _, touch in zip(range(3), drawn, strict=False):
        about = rng.uniform(-8.0, 8.0, (400, 2))
        at = np.array([touch.x_mm, touch.y_mm])
        heights = part.under(touch).surface.heights_mm(at + about)
        over = heights + part.round.bend(*at).falls_mm(about)
        assert over.min() > -0.05
        assert over.max() < 1.05
        assert np.mean(np.abs(over) < 0.05) > 0.3  # between symbols
        assert np.mean(np.abs(over - 1.0) < 0.05) > 0.2  # on their tops


@pytest.mark.parametrize("name", ["Tube", "Cone"])
def test_one_touch_of_the_written_part_tells_object_face_and_pose(touched, name):
    database, parts = touched
    reader, part = Reader(open_lab(database), SensorType()), parts[name]
    sensor = LevelSensor(reader.sensor, LEVELS["typical"])
    surface = part.round.surface
    rng, answered = np.random.default_rng(8), 0
    drawn = random_touches(part.region, rng, TouchRanges((40.0, 120.0), margin_mm=INSIDE_MM))
    for _, touch in zip(range(5), drawn, strict=False):
        counts = sensor.read(part.scene(), touch, rng).counts
        answer = recognise(reader, signal_of(counts.astype(np.float64)))
        if not answer:
            continue
        answered += 1
        assert (answer.object, answer.face) == (name, "F2")
        T = answer.T_face_probe
        turn = math.atan2(T[1, 0], T[0, 0])
        assert T[:2, 3] == pytest.approx([touch.x_mm, touch.y_mm], abs=0.2)
        assert math.degrees(math.remainder(turn - touch.theta_rad, 2 * math.pi)) == pytest.approx(
            0.0, abs=1.0
        )
        # Seen from the object: on the tops of the symbols, and flat on the round face.
        x, y, z = answer.T_object_probe[:3, 3]
        alpha = surface.half_angle_rad
        outside = (math.hypot(x, y) - surface.radius_mm) * math.cos(alpha) + z * math.sin(alpha)
        assert outside == pytest.approx(1.0, abs=0.05)
        radial = np.array([x, y, 0.0]) / math.hypot(x, y)
        outward = math.cos(alpha) * radial + math.sin(alpha) * np.array([0.0, 0.0, 1.0])
        assert answer.T_object_probe[:3, 2] == pytest.approx(outward, abs=1e-3)
        there = part.round.tangent(touch.x_mm, touch.y_mm) @ (touch.x_mm, touch.y_mm, 1.0, 1.0)
        assert answer.T_object_probe[:3, 3] == pytest.approx(there[:3], abs=0.25)
    assert answered >= 4


def test_the_reader_takes_no_blank_round_face_for_an_encoded_one(touched):
    database, parts = touched
    reader, part = Reader(open_lab(database), SensorType()), parts["Tube"]
    radius = part.round.surface.radius_mm
    rng = np.random.default_rng(2)
    drawn = random_touches(part.region, rng, TouchRanges(margin_mm=INSIDE_MM))
    for _, touch in zip(range(3), drawn, strict=False):
        blank = bare_scene(Blank(radius, (touch.x_mm, touch.y_mm)))
        counts = LevelSensor(reader.sensor, LEVELS["typical"]).read(blank, touch, rng).counts
        assert not recognise(reader, signal_of(counts.astype(np.float64)))


class Blank:
    """A cylinder without symbols, its axis along y, touched at a place."""

    top_mm = 0.0

    def __init__(self, radius_mm: float, at_mm: tuple[float, float]) -> None:
        self.radius_mm, self.x_mm = radius_mm, at_mm[0]

    def heights_mm(self, points_mm: np.ndarray) -> np.ndarray:
        across = points_mm[:, 0] - self.x_mm
        return np.sqrt(np.maximum(self.radius_mm**2 - across**2, 0.0)) - self.radius_mm
