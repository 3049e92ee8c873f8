"""Engines of contact: MuJoCo's and Drake's against numbers worked by hand, and our own."""

import math
import sys
from importlib.util import find_spec
from types import ModuleType

import numpy as np
import pytest
from manifold3d import Manifold
from reference.indenters import Formula, block
from scipy.optimize import brentq

from encoded_objects import validate
from encoded_objects.base.errors import MissingExtraError
from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Contact, Touch, WristStiffness
from probe.contact.engines import ENGINES, Engine, EngineEntry, engine_named
from probe.contact.meshes import AROUND_MM, DEEP_MM, mesh_under
from probe.contact.mujoco import DEEPEST_MM, STIFFER
from probe.contact.tips import Tips
from probe.errors import ProbeError
from probe.simulate.scene import bare_scene
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor
from probe.surface.indenters import FlatPlate
from probe.surface.mesh import mesh

RIGID = WristStiffness(math.inf, math.inf)
TIPS = Tips(points=7)
SENSOR = SensorType()


def plate_with_bars(wide=0.0):
    """Return a plate with two bars of 1.4 mm and more, 1 mm high, as one closed body."""
    bars = [((-6 - wide, -4, -1), (-4.6, 4, 1)), ((1, 2, -1), (9, 3.4 + wide, 1))]
    boxes = [((-30, -30, -5), (30, 30, 0)), *bars]
    size = [np.subtract(high, low) for low, high in boxes]
    solids = [Manifold.cube(s).translate(low) for s, (low, _) in zip(size, boxes, strict=True)]
    made = (solids[0] + solids[1] + solids[2]).to_mesh()
    return np.asarray(made.vert_properties, float)[np.asarray(made.tri_verts)]


def compression_mm(force_n, overlay=SENSOR.overlay):
    """Return how far one tab is pressed by a force: neo-Hookean, of MuJoCo's stiffer elastomer."""
    area = math.pi * overlay.tab_diameter_mm**2 / 4
    modulus = STIFFER * overlay.young_mpa * DEEPEST_MM / overlay.height_mm

    def miss(c):
        stretch = 1 - c / DEEPEST_MM
        return modulus * area / 3 * (stretch**-2 - stretch) - force_n

    return brentq(miss, 0, 0.9 * DEEPEST_MM)


MISSING, EXTRA = find_spec("pydrake") is None, "pip install 'encoded-objects[drake]'"
DRAKE = pytest.param("drake", marks=pytest.mark.skipif(MISSING, reason=EXTRA))


@pytest.fixture(scope="module", params=["mujoco", DRAKE])
def press(request):
    return engine_named(request.param).press


def test_a_plane_bears_all_tabs_alike(press):
    plate = mesh(block((-30, -30, -5), (30, 30, 0)))
    found = press(plate, SENSOR, Touch(0, 0, 0.3, 100.0, wrist=RIGID), TIPS)
    assert found.forces_n.sum() == pytest.approx(100, rel=2e-3)
    assert found.forces_n == pytest.approx(np.full((16, 16), 100 / 256), rel=5e-3)
    deep = compression_mm(100 / 256) if found.level == "mujoco" else 0.2  # as Drake's are stiffened
    assert -found.z_mm == pytest.approx(deep, rel=5e-3)


@pytest.mark.parametrize("engine", [DRAKE])
def test_boxes_bear_as_their_pressure_field_says(engine):
    """A box of modulus E, pressed d deep, bears 4 E / 3 a of a^3 - (a - d)^3; a, half its side."""
    from probe.contact.drake import half_side_mm

    plate = mesh(block((-30, -30, -5), (30, 30, 0)))
    found = engine_named(engine).press(plate, SENSOR, Touch(0, 0, 0.3, 3.0, wrist=RIGID), TIPS)
    a, d = half_side_mm(SENSOR), -found.z_mm
    modulus = SENSOR.overlay.young_mpa * a / SENSOR.overlay.height_mm
    assert 0 < d < 0.1
    one = 4 * modulus / (3 * a) * (a**3 - (a - d) ** 3)
    assert found.forces_n == pytest.approx(np.full((16, 16), one), rel=5e-3)


@pytest.mark.parametrize("engine", [DRAKE])
def test_touches_in_another_engine_are_read(engine, tmp_path):
    spec = tmp_path / "cube.yaml"
    spec.write_text("name: Cube\nshape: {cube: 45 mm}\n")
    found = validate(spec, folder=tmp_path / "run", touches=3, kinds="face", engine=engine)
    assert (found.right, found.wrong) == (3, 0)


def test_an_engine_that_is_not_installed_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pydrake", None)
    monkeypatch.delitem(sys.modules, "probe.contact.drake", raising=False)
    with pytest.raises(MissingExtraError, match=r"engine drake needs pydrake.*objects\[drake\]"):
        engine_named("drake")


def test_rows_and_columns_stand_as_the_sensor_frame_says(press):
    # A block under x > 3, y > 5 of the sensor: the upper right of the image.
    corner = mesh(block((3, 5, -2), (30, 30, 0)))
    forces = press(corner, SENSOR, Touch(0, 0, 0, 20.0, wrist=RIGID), TIPS).forces_n
    centres = SENSOR.centres_mm()
    inside = (centres[..., 0] > 3.7) & (centres[..., 1] > 5.7)
    outside = (centres[..., 0] < 2.3) | (centres[..., 1] < 4.3)
    assert (forces[inside] > 0.1).all()
    assert not forces[outside].any()


def test_the_touch_turns_the_sensor_not_the_image(press):
    # The block lies along the surface's +x; the sensor's +x points along the surface's +y.
    corner = mesh(block((4, -30, -2), (30, 30, 0)))
    forces = press(corner, SENSOR, Touch(0, 0, math.pi / 2, 20.0, wrist=RIGID), TIPS).forces_n
    centres = SENSOR.centres_mm()
    assert (forces[centres[..., 1] < -4.7] > 0).all()  # surface +x is the sensor's -y
    assert not forces[centres[..., 1] > -3.3].any()


def test_moments_balance_the_wrist(press):
    ridge = mesh(block((4, -30, -2), (9, 30, 0)))
    wrist = WristStiffness(3000.0, 3000.0)
    found = press(ridge, SENSOR, Touch(0, 0, 0, 40.0, wrist=wrist), TIPS)
    x, y = np.moveaxis(SENSOR.centres_mm(), -1, 0)
    # what is pressed on the right lifts the right side: a negative turn about y
    assert found.tilt_y_rad < -0.01
    assert found.tilt_y_rad * 3000 == pytest.approx(-(found.forces_n * x).sum(), rel=0.05)
    assert abs(found.tilt_x_rad * 3000 - (found.forces_n * y).sum()) < 0.05 * 40 * 6


def heights_alone(surface):
    """Return a surface of which nothing but its heights is known."""
    return Formula(lambda x, y: surface.heights_mm(np.stack([x, y], axis=1)), surface.top_mm)


def test_only_what_lies_under_the_sensor_is_kept():
    part = mesh(block((-90, -90, -40), (90, 90, 0)))
    reach, deep = 12.7 + AROUND_MM, DEEP_MM
    # A body is cut; heights are closed by a floor deep enough for what is cut off.
    for surface, under, count in ((part, deep, 12), (heights_alone(part), 2 * deep, 12)):
        corners, faces = mesh_under(surface, SENSOR, Touch(50, 0, 0, 1.0))
        low, high = corners.min(axis=0), corners.max(axis=0)
        assert low == pytest.approx([50 - reach, -reach, -under], abs=1e-4)
        assert high == pytest.approx([50 + reach, reach, 0], abs=1e-4)
        assert len(faces) == count


def test_heights_alone_feel_as_their_body_does(press):
    surface = mesh(plate_with_bars(wide=3.0))
    touch = Touch(0.4, -0.3, 0.5, 10.0, 0.01, -0.01)
    body, heights = (press(s, SENSOR, touch, TIPS) for s in (surface, heights_alone(surface)))
    off = np.linalg.norm(heights.forces_n - body.forces_n) / np.linalg.norm(body.forces_n)
    assert off < 0.1
    assert heights.z_mm == pytest.approx(body.z_mm, abs=0.02)


def test_triangles_that_close_no_body_are_taken_as_heights():
    upper = block((-30, -30, -5), (30, 30, 0))
    upper = upper[(upper[:, :, 2] == 0).all(axis=1)]
    corners, faces = mesh_under(mesh(upper), SENSOR, Touch(0, 0, 0, 1.0))
    assert (corners[:, 2].min(), corners[:, 2].max()) == (-2 * DEEP_MM, 0)
    assert len(faces) == 12


@pytest.mark.parametrize(
    ("surface", "sensor", "touch", "says"),
    [
        (FlatPlate(-math.inf), SENSOR, Touch(0, 0, 0, 10.0), "nothing under the sensor"),
        (None, SensorType(overlay=Overlay(kind="pad")), Touch(0, 0, 0, 10.0), "knows tabs"),
        (None, SENSOR, Touch(500, 0, 0, 10.0), "nothing under the sensor"),
        (None, SENSOR, Touch(0, 0, 0, -1.0), "must be finite"),
    ],
)
def test_what_cannot_be_touched_is_refused(press, surface, sensor, touch, says):
    given = surface or mesh(block((-30, -30, -5), (30, 30, 0)))
    with pytest.raises(ProbeError, match=says):
        press(given, sensor, touch, TIPS)


def test_another_engine_is_one_module_and_one_line(monkeypatch):
    def press_alike(surface, sensor, touch, tips):
        assert tips.points == 19
        each = touch.force_n / (sensor.rows * sensor.columns)
        return Contact(np.full((sensor.rows, sensor.columns), each), 0.25, 0.0, 0.0, "third", 1)

    module = ModuleType("third_engine")
    module.ENGINE = Engine(press_alike, points=19, overlays=("tab",))
    monkeypatch.setitem(sys.modules, "third_engine", module)
    monkeypatch.setitem(ENGINES, "third", EngineEntry("third_engine", "everything"))
    rng = np.random.default_rng(3)
    sensor = LevelSensor(SENSOR, LEVELS["sound"], "third")
    reading = sensor.read(bare_scene(FlatPlate(-math.inf)), Touch(0, 0, 0, 128.0), rng)
    counts, contact = reading.counts, reading.contact
    assert (contact.level, contact.z_mm) == ("third", 0.25)
    assert np.ptp(counts.astype(int)) <= 2  # every tactel bears half a newton; the board rounds
    assert counts.min() > 60
