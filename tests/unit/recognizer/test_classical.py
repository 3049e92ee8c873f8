"""The thesis's way of reading, whole: scans of faces of the thesis's profile, by touch alone."""

import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.arm import Arm
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.scan import JointErrors, follow_poses, raster, surface_to_sensor, touch_at
from probe.simulate.registered import registered_surface
from recognizer.scan.mosaic.planar import transform_points
from recognizer.thesis.merge import merge_touches, relative_poses
from recognizer.thesis.read import read_classically
from recognizer.thesis.scan import read_scan
from recognizer.touch.lab import open_lab
from recognizer.touch.recognition import NO_CONTACT
from recognizer.touch.tactile_image import tactile_image

SENSOR = SensorType()
CUBE = "{name: Cube, shape: {cube: 80 mm}, profile: thesis}"
OTHER = """
name: Stranger
shape: {cube: 80 mm}
encoding: {family: prba, polynomial: "0x1655", rows: 63, columns: 65}
symbols: {alphabet: thesis-2, pitch: 12 mm}
"""


@pytest.fixture(scope="module")
def lab(make_lab):
    return open_lab(make_lab(CUBE) / "lab.db")


class Scan:
    """Touches of a face by an arm with backlash and noise, felt with defects."""

    def __init__(self, url, name, face, seed):
        scene = registered_surface(url, name, face)
        rng = np.random.default_rng(seed)
        plan = raster([scene.region.starts], SENSOR, theta_rad=0.0, least_cover=0.4)
        middle = scene.centre_mm()
        T_base_face = surface_to_sensor(300, 0, 0.2, 100) @ surface_to_sensor(*-middle, 0)
        wanted = [T_base_face @ surface_to_sensor(x, y, 0.0) for x, y in plan.places_mm]
        arm = follow_poses(Arm(), wanted, JointErrors(), rng)
        tips = Tips(lengths_mm=rng.normal(0, 0.03, (16, 16)))
        gains = np.exp(rng.normal(0, 0.1, (16, 16)))
        self.believed, self.readings, self.true = arm.believed, [], []
        for T_base_sensor in arm.true:
            touch = touch_at(np.linalg.inv(T_base_face) @ T_base_sensor, 80.0)
            felt = gains * tabs(scene.surface, SENSOR, touch, tips).forces_n
            self.readings.append(np.maximum(felt + rng.normal(0, 0.02, (16, 16)), 0))
            self.true.append([touch.x_mm, touch.y_mm, touch.theta_rad])
        self.true = np.array(self.true)


@pytest.fixture(scope="module")
def scan(lab):
    return Scan(lab.url, "Cube", "F2", seed=3)


def pattern(points):
    x, y = np.moveaxis(points, -1, 0)
    return 2 + np.sin(0.45 * x + 0.3) * np.cos(0.35 * y) + np.sin(0.2 * x - 0.4 * y)


def test_products_find_steps_to_a_quarter_of_a_tactel_where_something_is_felt_in_common():
    step = 4 * SENSOR.pitch_mm
    blob = np.zeros((16, 16))
    blob[6:9, 9:11] = 1.0
    blob[10:12, 8:10] = 0.8
    wrong = np.array([[0.0, 0, 0], [step + SENSOR.pitch_mm / 2, SENSOR.pitch_mm / 4, 0]])
    found = merge_touches(SENSOR, [blob, np.roll(blob, -4, axis=1)], wrong)
    assert found.poses[1, :2] == pytest.approx([step, 0.0], abs=1e-9)
    apart = merge_touches(SENSOR, [np.roll(blob, -9, axis=1), np.roll(blob, 5, axis=1)], wrong)
    assert apart.poses == pytest.approx(relative_poses(wrong))


def test_bad_tactels_are_filled_by_other_touches():
    poses = np.array([[0.0, 0, 0], [6.7, 0, 0]])
    trust = np.ones((16, 16))
    trust[:, 9] = 0
    felt = [pattern(transform_points(pose, SENSOR.centres_mm())) for pose in poses]
    readings = [np.where(trust > 0, one, np.nan) for one in felt]
    found = merge_touches(SENSOR, readings, poses, "believed", trust=trust)
    at = found.image.xy_mm(*np.indices(found.image.values.shape))
    inner = (np.abs(at[..., 0] - 2.4) < 0.5) & (np.abs(at[..., 1]) < 10)
    assert found.image.defined[inner].all()
    assert np.abs(found.image.values - pattern(at))[inner].max() < 0.3


def test_a_scan_names_object_face_and_place(lab, scan):
    found = read_scan(lab, SENSOR, scan.readings, scan.believed, "bounded")
    answer = found.recognition
    assert (answer.object, answer.face) == ("Cube", "F2")
    assert found.grid.window.shape == (6, 6)
    x, y, theta = scan.true[-1]
    assert math.dist(answer.T_face_probe[:2, 3], (x, y)) < 3.0
    turned = math.atan2(answer.T_face_probe[1, 0], answer.T_face_probe[0, 0])
    assert abs(math.remainder(turned - theta, math.tau)) < math.radians(2)
    assert answer.margin > 10


def test_no_contact_and_blank_surfaces_are_told(lab):
    empty = tactile_image(np.zeros((60, 60)), step_mm=0.4)
    assert read_classically(lab, empty).recognition.reason == NO_CONTACT
    rows, columns = np.indices((100, 100))
    for blank in (1.0 * (columns % 25 < 5), 1.0 + rows / 50):  # ridges, a tilted plane
        assert not read_classically(lab, tactile_image(blank, step_mm=0.4)).recognition


def test_an_object_of_another_lab_is_not_taken_for_one_of_ours(lab, make_lab):
    scan = Scan(f"{make_lab(OTHER)}/lab.db", "Stranger", "F1", seed=5)
    found = read_scan(lab, SENSOR, scan.readings, scan.believed, "believed")
    assert len(found.grid.members) > 24  # its symbols are read, and are none of ours
    assert not found.recognition
