"""Worlds: each level does to the counts what it says; neighbours, worn symbols, written files."""

import math
import struct
from dataclasses import asdict, dataclass, replace

import numpy as np
import pytest
from reference.indenters import block

from encoded_objects.base.sensor_type import SensorType
from probe.circuit.network import loaded_columns
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import CircuitError, SurfaceError
from probe.simulate.scene import bare_scene
from probe.simulate.world.levels import LEVELS, SOUND, TYPICAL
from probe.simulate.world.sensor import MOUNTINGS, LevelSensor, mount
from probe.simulate.world.surfaces import (
    GAP_MM,
    REACH_MM,
    STEP_MM,
    AdjacentParts,
    DistortedSurface,
    FramePlace,
    place_adjacent,
    worn_scene,
)
from probe.simulate.written import part_mesh, written_triangles
from probe.surface.face import FaceSurface
from probe.surface.indenters import FlatPlate, RaisedStrip
from probe.surface.mesh import mesh
from probe.surface.polygon import polygon

SENSOR = SensorType()
HERE = Touch(x_mm=0.3, y_mm=0.2, theta_rad=0.4, force_n=60.0)
STRIP = RaisedStrip(6.0)
GAIN_S, BREAK_N, LEAK_S = 1e-4, 0.01, 5e-8  # of the film, as the datasheet of the thesis has it


def counts_of(level, surface=None, touch=HERE, seed=3):
    scene = bare_scene(surface or FlatPlate())
    return LevelSensor(SENSOR, level).read(scene, touch, np.random.default_rng(seed)).counts


def film_s(forces_n):
    """Conductance of a sound film of exponent 1."""
    return LEAK_S + GAIN_S * np.maximum(np.asarray(forces_n) - BREAK_N, 0.0)


def assert_read(counts, share, load_ohm=22.0):
    """Check counts against the shares (rows, columns) of the supply that are read."""
    expected = np.clip(8 + 1023 * 150 / (1023 * load_ohm * GAIN_S) * share, 0, 1023)
    assert np.abs(counts - expected).max() <= 0.5 + 1e-6


def brute_force(g, floating, load_ohm):
    """Solve each pair's network of rows + columns anew, every node by Kirchhoff."""
    rows, columns = g.shape
    share = np.empty(g.shape)
    for r in range(rows):
        for c in range(columns):
            A, b = np.zeros((rows + columns,) * 2), np.zeros(rows + columns)
            for i in range(rows):
                for j in range(columns):
                    for a, z in ((i, rows + j), (rows + j, i)):
                        A[a, a] += g[i, j]
                        A[a, z] -= g[i, j]
            A[rows + c, rows + c] += 1 / load_ohm
            for i in range(rows):
                if i == r or not floating[i]:
                    A[i], A[i, i], b[i] = 0.0, 1.0, float(i == r)
            share[r, c] = np.linalg.solve(A, b)[rows + c]
    return share


@pytest.mark.parametrize("loose", [[], [1], [0, 3], [0, 1, 2, 3, 4]])
def test_column_under_load_is_that_of_kirchhoff(loose):
    g = 10 ** np.random.default_rng(len(loose)).uniform(-7, -3, (5, 4))
    floating = np.isin(np.arange(5), loose)
    np.testing.assert_allclose(
        loaded_columns(g, floating, 470.0), brute_force(g, floating, 470.0), rtol=1e-9
    )


@pytest.mark.parametrize(
    ("floating", "load_ohm"), [(np.zeros(4, bool), 220.0), (np.zeros(5, bool), 0.0)]
)
def test_column_under_load_refuses_what_is_no_network(floating, load_ohm):
    with pytest.raises(CircuitError, match="floating rows"):
        loaded_columns(np.ones((5, 4)), floating, load_ohm)


def test_node_that_is_joined_to_nothing_is_refused():
    g = np.ones((3, 3))
    g[1] = 0
    with pytest.raises(CircuitError, match="joined to nothing"):
        loaded_columns(g, np.ones(3, bool), 220.0)


def test_levels_of_one_fault_are_typical_or_sound_but_for_that():
    for name, level in LEVELS.items():
        assert level.name == name
        if name in ("low", "typical", "hard", "mismatch", "sound"):
            continue
        base = SOUND if name in ("places-08", "bleed-2") else TYPICAL
        differ = {k for k, v in asdict(level).items() if v != asdict(base)[k]} - {"name"}
        assert len(differ) == 1, name


@pytest.mark.parametrize("load_ohm", [22.0, 2200.0, 10000.0])
def test_flat_plate_is_read_as_the_divider_of_a_loaded_column(load_ohm):
    g = film_s(HERE.force_n / 256)
    share = g / (16 * g + 1 / load_ohm)
    gain = max(1.0, 150 / (1023 * load_ohm * GAIN_S))
    expected = 8 + 1023 * gain * share
    counts = counts_of(replace(SOUND, load_ohm=load_ohm))
    assert np.abs(counts - expected).max() <= 0.5 + 1e-6


def test_film_on_its_way_back_reads_higher_where_it_was_pressed_more():
    touch = replace(HERE, tilt_x_rad=0.02)
    rocked = replace(touch, force_n=1.4 * 60, tilt_x_rad=-0.02)
    now, before = (tabs(STRIP, SENSOR, t, Tips()).forces_n for t in (touch, rocked))
    felt = np.clip(before, now, 1.4 * now)
    g = film_s(felt)
    assert_read(counts_of(replace(SOUND, hysteresis=0.4), STRIP, touch), g / (g.sum(0) + 1 / 22))
    pressed = now > 0.05
    ratio = felt[pressed] / now[pressed]
    assert ratio.min() < 1.1
    assert ratio.max() == pytest.approx(1.4)  # not one factor for all


def test_mountings_put_each_tactel_where_they_say():
    image = np.arange(256, dtype=np.uint16).reshape(16, 16)
    of = {
        "as drawn": lambda r, c: (r, c),
        "quarter turn": lambda r, c: (15 - c, r),
        "mirrored": lambda r, c: (r, 15 - c),
        "transposed": lambda r, c: (c, r),
        "halves swapped": lambda r, c: (r, (c + 8) % 16),
        "rolled": lambda r, c: (r, (c + 1) % 16),
    }
    assert set(of) == set(MOUNTINGS)
    for mounting, place in of.items():
        found = mount(image, mounting)
        assert all(found[place(r, c)] == image[r, c] for r in range(16) for c in range(16))
        level = replace(TYPICAL, mounting=mounting)
        np.testing.assert_array_equal(
            counts_of(level, STRIP), mount(counts_of(TYPICAL, STRIP), mounting)
        )


def test_mounting_that_would_change_the_shape_is_refused():
    with pytest.raises(CircuitError, match="cannot be mounted 'quarter turn'"):
        mount(np.zeros((12, 32), np.uint16), "quarter turn")


def test_print_is_scaled_from_its_datum():
    print_ = DistortedSurface(RaisedStrip(2.0), 0.0, 0.01, (-30.0, 0.0))
    edge = -30 + 1.01 * (30 + 1.0)  # of the strip of 2 mm about 0, 31 mm from the datum
    within, beyond = print_.heights_mm(np.array([[edge - 1e-3, 0.0], [edge + 1e-3, 0.0]]))
    assert within > beyond


OBLONG = polygon([np.array([(0, 0), (40, 0), (40, 30), (0, 30)])])
TRIANGLE = polygon([np.array([(0, 0), (50, 0), (25, 45)])])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("first", "second"), [(OBLONG, TRIANGLE), (TRIANGLE, OBLONG)])
def test_faces_lie_beside_each_other_and_the_sensor_near_both(first, second, seed):
    place, at = place_adjacent(first, second, np.random.default_rng(seed))
    both = AdjacentParts(FaceSurface(None, first), FaceSurface(None, second), place)
    x, y = np.meshgrid(np.arange(-99.8, 140, 1.0), np.arange(-99.8, 140, 1.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    on_first, on_second = first.contains(points), second.contains(place.into(points))
    assert not (on_first & on_second).any()
    area = {id(OBLONG): 1200.0, id(TRIANGLE): 1125.0}
    assert on_second.sum() == pytest.approx(area[id(second)], rel=0.03)
    heights = both.heights_mm(points)
    assert (heights[on_first] == 0).all()
    assert (heights[on_second] == place.z_mm).all()
    assert (heights[~on_first & ~on_second] == -np.inf).all()
    assert first.contains(at[None])[0]
    assert first.distance_mm(at[None])[0] <= REACH_MM
    beside = second.distance_mm(place.into(at[None]))[0]
    assert beside <= REACH_MM + GAP_MM
    assert abs(place.z_mm) <= STEP_MM


def test_two_bodies_are_one():
    cube = block((0, 0, 0), (10, 10, 10))
    place = FramePlace(22.0, 0.0, -0.5, math.pi / 2)  # from x = 12 to 22
    both = AdjacentParts(mesh(cube), mesh(cube), place)
    solid = both.solid_mm
    volume = np.einsum("ni,ni->n", solid[:, 0], np.cross(solid[:, 1], solid[:, 2])).sum() / 6
    assert volume == pytest.approx(2000, rel=1e-5)
    again = mesh(solid)
    points = np.random.default_rng(1).uniform(-15, 30, (500, 2))
    np.testing.assert_allclose(again.heights_mm(points), both.heights_mm(points), atol=1e-4)


def test_a_face_without_an_outer_edge_is_refused():
    ring = np.linspace(0, 2 * math.pi, 20, endpoint=False)
    radius = np.where(np.arange(20) % 2, 10.0, 4.0)
    star = polygon([np.column_stack([radius * np.cos(ring), radius * np.sin(ring)])])
    with pytest.raises(SurfaceError, match="no edge beside which"):
        place_adjacent(star, OBLONG, np.random.default_rng(1))


TURN = 0.4  # of the face's x axis into the array's
CENTRES = (
    np.array([(i, j) for i in range(3) for j in range(3)])
    * 7.0
    @ np.array([[math.cos(TURN), -math.sin(TURN)], [math.sin(TURN), math.cos(TURN)]])
)


@dataclass(frozen=True)
class Dots:
    """Round dots of 2 mm at CENTRES, 1 mm high, on a face that stands .25 mm too high or low."""

    base_mm: float
    top_mm: float = 1.5

    def heights_mm(self, points_mm: np.ndarray) -> np.ndarray:
        away = np.linalg.norm(points_mm[:, None] - CENTRES, axis=2).min(axis=1)
        return self.base_mm + np.where(away < 2.0, 1.0, 0.0)


def worn_surface(surface, share, seed=1):
    rng = np.random.default_rng(seed)
    return worn_scene(bare_scene(surface), CENTRES, TURN, 7.0, share, rng).surface


@pytest.mark.parametrize("base", [0.0, 0.25, -0.25])
def test_a_worn_symbol_lies_level_with_the_face_around_it(base: float) -> None:
    surface = Dots(base)
    points = np.random.default_rng(1).uniform(-3.0, 14.0, (4000, 2))
    worn = worn_surface(surface, 1.0)
    assert worn.heights_mm(points) == pytest.approx(np.full(4000, base))
    whole = worn_surface(surface, 0.0)
    assert (whole.heights_mm(points) == surface.heights_mm(points)).all()


def test_only_what_is_drawn_is_worn() -> None:
    some = worn_surface(Dots(0.25), 0.5, seed=2)
    assert 0 < len(some.centres_mm) < len(CENTRES)
    left = some.heights_mm(CENTRES)
    gone = (np.abs(CENTRES[:, None] - some.centres_mm).max(axis=2) < 1e-9).any(axis=1)
    assert left == pytest.approx(np.where(gone, 0.25, 1.25))


def binary(triangles, header=b"solid of a lying header"):
    """Bytes of a binary STL."""
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *np.asarray(t, float).ravel(), 0) for t in triangles
    )
    return header.ljust(80, b" ") + struct.pack("<I", len(triangles)) + body


@pytest.mark.parametrize("kind", ["binary", "ascii"])
def test_files_are_read_exactly(tmp_path, kind):
    triangles = np.random.default_rng(0).normal(size=(40, 3, 3)).astype(np.float32)
    file = tmp_path / "part.stl"
    if kind == "binary":
        file.write_bytes(binary(triangles))
    else:
        rows = ["solid x"]
        for t in triangles:
            rows += ["facet normal 0 0 0", " outer loop"]
            rows += [f"  vertex {x!r} {y!r} {z!r}" for x, y, z in t.astype(float).tolist()]
            rows += [" endloop", "endfacet"]
        file.write_text("\n".join([*rows, "endsolid x"]))
    assert np.array_equal(written_triangles(file), triangles.astype(float))
    assert part_mesh(file).top_mm == triangles[..., 2].max()
