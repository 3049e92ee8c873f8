"""When frames are one touch: films whose images are alike by a given correlation."""

from types import SimpleNamespace

import numpy as np
import pytest

from probe.frame import frame_from
from recognizer.touch.lab import radii_of
from recognizer.touch.source import cut_touches

SHAPE = (16, 16)
REST = np.zeros(SHAPE)


def images(count, seed=0):
    """Images that have nothing in common, with two rows that feel nothing, of one sum."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        image = np.where(rng.random(SHAPE) < 0.4, rng.uniform(300, 900, SHAPE), 0.0)
        image[-2:] = 0.0
        found.append(image * (40_000 / image.sum()))
    return found


def like(image, other, correlation):
    """A mixture of two images, of their sum, that is alike to the first by a correlation."""
    low, high = 0.0, 1.0
    for _ in range(60):
        share = (low + high) / 2
        mixed = np.rint((1 - share) * image + share * other)
        alike = np.corrcoef(image.ravel(), mixed.ravel())[0, 1] > correlation
        low, high = (share, high) if alike else (low, share)
    return mixed


def cut(*film):
    frames = [
        frame_from(np.rint(image), t_ns=n, seq=n, wrist=[0, 0, 0, 0], pose=None)
        for n, image in enumerate(film)
    ]
    return [(touch.seq, touch.frames) for touch in cut_touches(frames)]


@pytest.mark.parametrize(("correlation", "touches"), [(0.605, 1), (0.595, 2)])
def test_images_alike_by_six_tenths_are_one_touch(correlation, touches):
    a, b = images(2)
    assert len(cut(*[a] * 30, *[like(np.rint(a), b, correlation)] * 30, REST)) == touches


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(("by", "frames"), [(0.045, 20), (0.055, 10)])
def test_a_rest_keeps_its_sum_within_a_twentieth(by, frames, way):
    (a,) = images(1)
    assert cut(*[a] * 10, *[a * (1 + way * by)] * 10, REST)[0][1] == frames


@pytest.mark.parametrize(("correlation", "frames"), [(0.905, 20), (0.895, 10)])
def test_and_its_image_by_nine_tenths(correlation, frames):
    a, b = images(2)
    assert cut(*[a] * 10, *[like(np.rint(a), b, correlation)] * 10, REST)[0][1] == frames


@pytest.mark.parametrize(("frames", "touches"), [(5, [(0, 22), (30, 5)]), (4, [(0, 22)])])
def test_five_frames_are_a_rest(frames, touches):
    a, b = images(2)
    assert cut(*[a] * 30, *[b] * frames, REST) == touches


@pytest.mark.parametrize(("frames", "read"), [(21, 21), (22, 22), (23, 22)])
def test_twenty_two_frames_are_averaged(frames, read):
    (a,) = images(1)
    assert cut(*[a] * frames, REST) == [(0, read)]


@pytest.mark.parametrize(("count", "touches"), [(63, 1), (64, 65)])
def test_after_64_unlike_images_each_is_a_touch(count, touches):
    several = images(count + 1, seed=3)
    assert len(cut(*several[:-1], *[several[-1]] * 30, REST)) == touches


def cylinder(radius, half_angle=0.0, concave=False):
    return SimpleNamespace(radius_mm=radius, half_angle_rad=half_angle, concave=concave)


STEPS = [15.0 * 1.35**n for n in range(12)]  # 15 to 407 mm


@pytest.mark.parametrize("radius", [15.0, 17.0, 17.8, 26.0, 60.0, 130.0, 260.0, 399.0])
def test_a_cylinder_has_the_radius_that_is_nearest_by_its_ratio(radius):
    nearest = min(STEPS, key=lambda step: abs(np.log(step / radius)))
    assert radii_of([cylinder(radius)]) == pytest.approx((nearest,))


def test_radii_end_at_15_and_400_mm():
    assert radii_of([cylinder(3.0)]) == pytest.approx((15.0,))
    assert radii_of([cylinder(5000.0)]) == pytest.approx((STEPS[11],))
    assert radii_of([cylinder(3.0), cylinder(5000.0), cylinder(15.0)]) == pytest.approx(
        (STEPS[0], STEPS[11])
    )


def test_a_cone_has_all_radii_from_its_largest_down():
    angle = np.arccos(0.5)  # across the surface the largest radius is 2 x 20 mm
    assert radii_of([cylinder(20.0, angle)]) == pytest.approx(tuple(STEPS[:4]))


def test_nothing_is_felt_in_a_hole():
    assert radii_of([cylinder(30.0, concave=True)]) == ()
