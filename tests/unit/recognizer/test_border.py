"""Where a face ends: what tactels about a border say of other borders, and what they leave open."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from probe.contact.contract import Touch
from probe.contact.press import press
from probe.simulate.registered import registered_surface
from recognizer.touch import chance
from recognizer.touch.chance import (
    LEAST_SHARE,
    _lines,
    fitting_share,
    joint_share,
    points_on_lattice,
    share_of_borders,
    surely_pressed,
    tip_share,
)
from recognizer.touch.lab import open_lab
from recognizer.touch.pose import face_pose
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch
from recognizer.touch.symbols.template import psi

TIP_MM, PITCH_MM = 1.2666, 5.0
INSIDE = np.linspace(-3.0, 3.0, 13)
SQUARE = np.array([(0, 0), (30, 0), (30, 30), (0, 30)], float)


@pytest.mark.parametrize(
    ("inside", "share"), [(-2, 0), (-1, 0), (0, 0.5), (1, 1), (3, 1), (0.5, 0.8045), (-0.5, 0.1955)]
)
def test_share_of_a_round_tip_over_a_line(inside, share):
    assert tip_share(np.array([float(inside)]))[0] == pytest.approx(share, abs=1e-4)


def readings_at(shift_mm, bare=0.4, factor=1.0):
    """psi of what tactels read if the face ends so many mm farther out than it should."""
    return psi(factor * bare * tip_share((INSIDE + shift_mm) / (TIP_MM / 2)))


def fitting(readings, bare=0.4, unit=0.12):
    expected = np.full(len(INSIDE), bare)
    return fitting_share(INSIDE, readings, expected, TIP_MM, PITCH_MM, unit)


def test_a_border_in_its_place_leaves_few_others():
    assert fitting(readings_at(0.0)) <= 0.16
    assert fitting(readings_at(0.3)) < fitting(readings_at(0.8)) < fitting(readings_at(1.5))
    assert fitting(readings_at(-0.3)) < fitting(readings_at(-0.8)) < fitting(readings_at(-1.5))
    assert fitting(readings_at(1.5)) > 0.6


def test_the_force_on_the_bare_face_need_not_be_known():
    for factor in (0.6, 1.5):
        assert fitting(readings_at(0.0, factor=factor)) <= 0.2


def test_where_nothing_is_pressed_every_border_fits():
    assert fitting(readings_at(0.0, bare=0.0), bare=0.0) == 1.0
    # and where the face should be pressed and is not, this border is the worst of all
    assert fitting(np.zeros(len(INSIDE))) > 0.4


def test_how_much_less_likely_a_border_may_be_that_counts(monkeypatch):
    shares = []
    for slack in (0.25, 1.0, 1e3):
        monkeypatch.setattr(chance, "SLACK", slack)
        shares.append(fitting(readings_at(0.0)))
    monkeypatch.setattr(chance, "SLACK", 0.25)
    assert shares[0] < shares[1] < shares[2] == 1.0
    assert fitting(readings_at(0.0), unit=0.5) > fitting(readings_at(0.0))


def test_lines_that_run_alike_count_once():
    assert joint_share([]) == 1.0
    assert joint_share([(0.0, 0.5), (math.pi / 2, 0.3)]) == pytest.approx(0.15)
    assert joint_share([(0.1, 0.5), (math.pi, 0.3)]) == pytest.approx(0.3)
    assert joint_share([(0.21, 0.5), (math.pi, 0.3)]) == pytest.approx(0.15)


def test_each_line_has_the_tactels_about_its_middle():
    face = SimpleNamespace(polygon_mm=(SQUARE,))
    points = np.array(
        [(15, 1), (15, -1), (15, 3.3), (15, -3.3), (1, 1), (0.5, 4), (29, 15), (1, -1)]
    )
    found = list(_lines(face, points.astype(float)))
    assert [own.tolist() for _, own, _ in found] == [
        [True, True, False, False, False, False, False, False],
        [False, False, False, False, False, False, True, False],
        [False] * 8,
        [False, False, False, False, False, True, False, False],
    ]
    inside = found[0][0]
    assert inside == pytest.approx([1, -1, 3.3, -3.3, 1, 4, 15, -1])
    assert [direction for _, _, direction in found] == pytest.approx(
        [0, math.pi / 2, math.pi, -math.pi / 2]
    )


def test_a_hole_lies_inside_on_its_outer_side():
    hole = np.array([(10, 10), (10, 20), (20, 20), (20, 10)], float)
    face = SimpleNamespace(polygon_mm=(SQUARE, hole))
    found = list(_lines(face, np.array([(9.0, 15.0), (11.0, 15.0)])))
    inside, own, _ = found[4]
    assert inside == pytest.approx([1, -1])
    assert own.all()


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    from generator.pipeline import encode
    from generator.spec import read_specs

    folder = tmp_path_factory.mktemp("border")
    (folder / "box.yaml").write_text("{name: Box, shape: {box: [61 mm, 52 mm, 40 mm]}}")
    database = folder / "lab.db"
    encode(read_specs([folder / "box.yaml"]), folder=folder, database=str(database), formats=())
    return Reader(open_lab(database))


def touched(reader, x, y, force_n=80.0):
    """What the sensor feels, and the place that is right, as the reader finds it."""
    lab = reader.lab
    surface = registered_surface(lab.url, "Box", "F1").surface
    forces = press(surface, reader.sensor, Touch(x, y, 0.2, force_n=force_n)).forces_n
    best = read_touch(reader, reader.signal(100 * forces)).best
    pose = face_pose(best.embossed, lab.arrays[0].face(0), best.hypothesis, best.fit)
    assert pose[:2, 3] == pytest.approx((x, y), abs=0.2)
    return best


def test_at_an_edge_the_face_ends_where_it_should(reader):
    best = touched(reader, 30.0, 5.0)
    share = share_of_borders(best, TIP_MM)
    assert share == pytest.approx(LEAST_SHARE)
    # the same image, a symbol nearer to the edge or farther from it
    place, away = best.hypothesis, round(math.cos(best.fit.theta_rad)) == 0
    for step in (-1, 1):
        moved = replace(place, row=place.row + step * (not away), column=place.column + step * away)
        other = replace(best, hypothesis=moved)
        assert share_of_borders(other, TIP_MM) > 2 * share


def test_amid_a_face_and_without_tips_no_border_is_told(reader):
    best = touched(reader, 30.0, 26.0)
    assert share_of_borders(best, TIP_MM) == 1.0
    assert share_of_borders(touched(reader, 30.0, 5.0), 0.0) == 1.0


def test_a_plate_that_presses_lightly_tells_no_border(reader):
    best = touched(reader, 30.0, 7.0, force_n=25.0)
    light = best.fit.gain * [1.0, 0.5, 0.0, 0.0]
    held = replace(best, fit=replace(best.fit, gain=light))
    assert share_of_borders(held, TIP_MM) == 1.0


def test_tactels_that_would_plainly_read_a_symbol(reader):
    best = touched(reader, 30.0, 5.0)
    image, gain = best.image, np.array([best.fit.gain[0], 0.4, 0.0, 1.2])
    pressed = surely_pressed(image, gain, 0.15).reshape(image.shape)
    assert pressed[0].all()  # the plane falls down the image
    assert not pressed[-1].any()
    dead = replace(image, trust=np.zeros_like(image.trust))
    assert not surely_pressed(dead, gain, 0.15).any()
    loud = replace(image, noise=20.0 * float(image.forces.max()))
    assert not surely_pressed(loud, gain, 0.15).any()


def test_tactels_on_the_lattice(small):
    image = SimpleNamespace(points_mm=np.array([(1.0, 0.0), (0.0, 2.0)]))
    fit = small.fit_of([(0, 0)], [[0.0] * 5], x_mm=3.0, y_mm=4.0, theta_rad=math.pi / 2,
                       nuisance=np.array([0, 0, 0, 0.1]))  # fmt: skip
    assert points_on_lattice(image, fit) == pytest.approx(np.array([(3.0, 5.1), (0.8, 4.0)]))


def test_round_faces_have_no_border():
    found = SimpleNamespace(face=SimpleNamespace(round=object()))
    assert share_of_borders(found, TIP_MM) == 1.0
