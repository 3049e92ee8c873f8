"""What of a frame is worth fitting, and how films of frames are cut into touches."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.frame import frame_from
from recognizer.touch.lab import radii_of
from recognizer.touch.options import ReaderOptions
from recognizer.touch.signal import contact_counts, noise_of, signal_of
from recognizer.touch.source import ENOUGH, cut_touches, every_frame


def rows_of(*sums, turned=False):
    """Readings (rows, 5) whose rows sum to these; transposed, their columns do."""
    image = np.zeros((len(sums), 5))
    image[:] = np.array(sums, float)[:, None] / 5
    return image.T.copy() if turned else image


def trusted(*sums, turned=False):
    """Which rows (or columns) of such readings are trusted."""
    trust = signal_of(rows_of(*sums, turned=turned), floor=0.0).trust
    trust = trust.T if turned else trust
    assert (trust == trust[:, :1]).all()
    assert set(trust.ravel()) <= {0.0, 1.0}
    return trust[:, 0].astype(bool).tolist()


def six(value, others=0.0, count=6):
    image = np.full(36, others)
    image[3 : 3 + count] = value
    return image.reshape(6, 6)


@pytest.mark.parametrize(
    ("value", "count", "newtons", "contact"),
    [
        (8.01, 6, False, True),
        (8.0, 6, False, False),
        (4000.0, 5, False, False),
        (0.0501, 6, True, True),
        (0.05, 6, True, False),
        (9.0, 5, True, False),
    ],
)
def test_a_contact_is_six_tactels_over_eight_counts_or_50_mn(value, count, newtons, contact):
    found = signal_of(six(value, count=count), floor=0.0, newtons=newtons)
    assert found.contact is contact
    assert found.newtons is newtons


def test_the_sixth_highest_is_the_one_that_counts():
    image = np.arange(36.0).reshape(6, 6)  # the six highest: 30 ... 35
    assert signal_of(image, floor=0.0, options=ReaderOptions(contact_counts=29.9)).contact
    assert not signal_of(image, floor=0.0, options=ReaderOptions(contact_counts=30.0)).contact
    stiff = ReaderOptions(contact_n=30.0)
    assert not signal_of(image, floor=0.0, options=stiff, newtons=True).contact


def test_bad_tactels_count_neither_for_the_floor_nor_for_a_contact():
    image = six(4000.0) + 100.0
    image[0, :3] = 0.0
    trust = np.full((6, 6), 0.5)
    trust[image > 1000] = 0.0
    trust[0, :3] = 0.0
    found = signal_of(image, trust=trust)
    assert not found.contact
    assert found.forces[5].tolist() == [0.0] * 6  # the floor is what the good ones read
    np.testing.assert_array_equal(found.trust, trust)
    assert signal_of(image, trust=np.where(trust > 0, 0.0, 0.5)).contact


def test_nothing_is_felt_where_every_tactel_is_bad():
    found = signal_of(six(4000.0), trust=np.zeros((6, 6)), newtons=True)
    assert not found.forces.any()
    assert not found.trust.any()
    assert (found.contact, found.newtons) == (False, True)


def test_where_a_type_has_no_tactel_nothing_is_trusted():
    sensor = SensorType(rows=6, columns=6, missing=((5, 5),))
    trust = np.ones((6, 6))
    trust[5, 5] = 0.0
    np.testing.assert_array_equal(signal_of(six(50.0), floor=0.0, sensor=sensor).trust, trust)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("changed", "dead"),
    [
        # what reads nothing between two that do; at the rim it is rather the edge of a face
        *(({n: 0.0}, [n]) for n in (1, 3, 7)), *(({n: 0.0}, []) for n in (0, 8)),
        # less than a fiftieth of the median, which one large sum leaves as it is
        ({4: 1.9}, [4]), ({4: 2.0}, []), ({4: 3.0}, []),
        ({4: 1.9, 2: 400.0}, [4]), ({4: 2.0, 2: 400.0}, []), ({4: 3.0, 2: 400.0}, []),
        # both neighbours read more than three tenths of it
        *(({4: 0.0, n: beside}, [4]) for n in (3, 5) for beside in (31.0, 50.0)),
        *(({4: 0.0, n: beside}, []) for n in (3, 5) for beside in (30.0, 20.0)),
    ],
)  # fmt: skip
def test_which_rows_and_columns_are_dead(changed, dead, turned):
    sums = [changed.get(number, 100.0) for number in range(9)]
    assert trusted(*sums, turned=turned) == [number not in dead for number in range(9)]


def test_what_a_bad_tactel_reads_keeps_no_row_alive():
    image = rows_of(*[100.0] * 4, 0.0, *[100.0] * 4)
    image[4, 2] = 500.0
    trust = np.ones((9, 5))
    trust[4, 2] = 0.0
    found = signal_of(image, trust=trust, floor=0.0)
    assert not found.trust[4].any()
    assert found.trust[[0, 1, 2, 3, 5, 6, 7, 8]].all()


def test_noise_is_worked_by_hand():
    free = np.random.default_rng(10).normal(5.0, 0.5, 180)
    assert noise_of(np.r_[free, np.linspace(20, 200, 76)]) == pytest.approx(0.5, rel=0.2)
    mostly_pressed = np.r_[np.arange(5) / 10, 10.0 + np.arange(15)]  # a quarter is free
    assert noise_of(mostly_pressed) < 0.5
    assert noise_of(np.full(9, 3.5)) == 0.0
    assert noise_of(np.full(9, 3.0)) == pytest.approx(np.sqrt(1 / 12))  # counts are rounded
    one_below = np.array([0.0] * 3 + [1.0] * 13)  # mode 1, three one below it
    assert noise_of(one_below) == pytest.approx(np.sqrt(3 / (3 + 13 / 2) + 1 / 12))
    # the mode is that of the two closest, 10.25; one reading lies .25 below; the least step is .5
    few = np.array([10.0, 10.5, 20.0])
    assert noise_of(few) == pytest.approx(math.sqrt(0.25**2 + 0.5**2 / 12))
    # what is read again and again has no step: the noise is that of rounding to .25
    assert noise_of(np.array([0.5] * 10 + [0.75])) == pytest.approx(0.25 / math.sqrt(12))


def test_a_contact_rises_by_six_deviations_of_a_noisy_type():
    assert contact_counts(SensorType(noise=4.0)) == pytest.approx(24.0)
    assert contact_counts(SensorType(noise=1.0)) == pytest.approx(8.0)
    assert contact_counts(SensorType(bits=12)) == pytest.approx(8.0 * 4095 / 1023)
    assert contact_counts(SensorType(exponent=0.5)) == pytest.approx(64.0)  # forces are squares


def test_the_law_of_a_type_is_taken_off_counts_alone():
    image = six(4.0 * contact_counts(SensorType()))
    rooted = replace(SensorType(), exponent=0.5)
    found = signal_of(image, floor=0.0, sensor=rooted)
    np.testing.assert_allclose(found.forces, image**2)
    assert (signal_of(image, floor=0.0, sensor=rooted, newtons=True).forces == image).all()
    assert (signal_of(image, floor=0.0, sensor=SensorType()).forces == image).all()
    for law in (rooted, replace(SensorType(), exponent=2.0)):
        seen = [signal_of(six(counts), floor=0.0, sensor=law).contact for counts in (7.0, 9.0)]
        assert seen == [False, True]  # eight counts of any law


RNG = np.random.default_rng(8)
A, B, C = (np.where(RNG.random((16, 16)) < 0.35, RNG.uniform(60, 300, (16, 16)), 0.0)
           for _ in range(3))  # fmt: skip
REST = np.zeros((16, 16))
DOWN = np.linspace(0.1, 0.9, 9)


def film(*images):
    """Frames of images, with the noise of a reading and the background of a board."""
    rng = np.random.default_rng(1)
    for seq, image in enumerate(images):
        counts = 3 + image * (1 + 0.02 * rng.standard_normal(image.shape))
        pose = np.eye(4)
        pose[0, 3] = seq
        yield frame_from(np.rint(counts.clip(0, 1023)), t_ns=seq * 1000, seq=seq,
                         wrist=[seq, 0, 0, 1], pose=pose)  # fmt: skip


def pressed(image, hold=40):
    """Images of a press: down, held, up, and away."""
    return [image * x for x in DOWN] + [image] * hold + [image * x for x in DOWN[::-1]] + [REST] * 5


def cut(*images, **named):
    return list(cut_touches(film(*images), **named))


def test_a_press_is_one_touch_read_where_it_rests():
    (touch,) = cut(*[REST] * 7, *pressed(A))
    assert touch.seq == 7
    assert touch.frames == ENOUGH
    assert touch.t_ns >= (7 + len(DOWN)) * 1000 - 1000
    assert touch.counts - 3 == pytest.approx(A, abs=0.02 * 300)
    middle = touch.t_ns / 1000 + ENOUGH // 2
    assert touch.pose[0, 3] == middle
    assert touch.wrist[0] == pytest.approx(middle, abs=0.6)


def test_a_touch_is_told_as_soon_as_it_rests():
    frames = film(*pressed(A, hold=500))
    next(cut_touches(frames))
    assert next(frames).seq <= len(DOWN) + ENOUGH + 1


def test_a_slow_press_is_not_read_before_it_rests():
    rise = [A * x for x in np.linspace(0.1, 1.0, 300)]
    (touch,) = cut(*rise, *[A] * 30)
    assert touch.counts.sum() == pytest.approx((A + 3).sum(), rel=0.03)


EDGE = np.where(np.arange(16) < 2, 80.0, REST)  # a tilted probe feels its rim first


@pytest.mark.parametrize(
    ("images", "touches"),
    [
        ([*pressed(A), *pressed(A), *pressed(B)], 3),  # also at the same place
        ([*[A * 0.5] * 30, *[A] * 30, *[A * 0.7] * 30], 1),  # pressed harder
        ([EDGE, EDGE, *pressed(A)], 1),
        ([np.roll(A, step, axis=1) for step in range(4) for _ in range(30)], 4),  # a slide
    ],
)
def test_how_many_touches_a_film_shows(images, touches):
    assert len(cut(*images)) == touches


def test_places_that_follow_each_other_without_a_rest_are_touches():
    found = cut(*[A] * 30, *[B] * 30, *[C] * 30)
    assert [touch.seq for touch in found] == [0, 30, 60]
    for touch, image in zip(found, (A, B, C), strict=True):
        assert np.corrcoef(touch.counts.ravel(), image.ravel())[0, 1] > 0.99


def test_images_that_do_not_follow_each_other_are_touches():
    found = cut(A, B, C, A)
    assert [(touch.seq, touch.frames) for touch in found] == [(0, 1), (1, 1), (2, 1), (3, 1)]
    assert [touch.seq for touch in cut(REST, A, REST, B)] == [1, 3]


def test_nothing_is_touched():
    assert cut() == []
    assert cut(*[REST] * 50) == []
    spike = REST.copy()
    spike[3, 3] = 500
    assert cut(*[spike] * 50) == []
    stuck = np.where(np.arange(16)[:, None] == 4, 700.0, REST)
    assert len(cut(*[stuck] * 40)) == 1
    assert cut(*[stuck] * 40, trust=np.where(stuck > 0, 0.0, 1.0)) == []  # bad tactels


def test_frames_by_number():
    images = [REST, A, A, B, B]
    found = list(every_frame(film(*images), 2))
    assert [(touch.seq, touch.frames) for touch in found] == [(0, 2), (2, 2), (4, 1)]
    assert len(list(every_frame(film(*images)))) == 5


SHAPE = (16, 16)


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


def cut_film(*film):
    frames = [frame_from(np.rint(image), t_ns=n, seq=n) for n, image in enumerate(film)]
    return [(touch.seq, touch.frames) for touch in cut_touches(frames)]


def at_limits():
    """Films, and their touches (number, frames averaged); each limit from both sides."""
    a, b = images(2)
    for correlation, touches in ((0.605, [(0, 22)]), (0.595, [(0, 22), (30, 22)])):
        yield [*[a] * 30, *[like(np.rint(a), b, correlation)] * 30], touches
    for change in (0.045, -0.045, 0.055, -0.055):  # of the sum, while it rests
        frames = 20 if abs(change) < 0.05 else 10
        yield [*[a] * 10, *[a * (1 + change)] * 10], [(0, frames)]
    for correlation, frames in ((0.905, 20), (0.895, 10)):  # of the image
        yield [*[a] * 10, *[like(np.rint(a), b, correlation)] * 10], [(0, frames)]
    for frames, touches in ((5, [(0, 22), (30, 5)]), (4, [(0, 22)])):  # of a rest
        yield [*[a] * 30, *[b] * frames], touches
    for frames in (21, 22, 23):
        yield [a] * frames, [(0, min(frames, 22))]


@pytest.mark.parametrize(("film", "touches"), list(at_limits()))
def test_what_is_a_rest_and_when_another_touch_begins(film, touches):
    assert cut_film(*film, REST) == touches


@pytest.mark.parametrize(("count", "touches"), [(63, 1), (64, 65)])
def test_after_64_unlike_images_each_is_a_touch(count, touches):
    several = images(count + 1, seed=3)
    assert len(cut_film(*several[:-1], *[several[-1]] * 30, REST)) == touches


def cylinder(radius, half_angle=0.0, concave=False):
    return SimpleNamespace(radius_mm=radius, half_angle_rad=half_angle, concave=concave)


STEPS = [15.0 * 1.35**n for n in range(12)]  # 15 to 407 mm


@pytest.mark.parametrize(
    ("faces", "radii"),
    [
        # that nearest by its ratio, from 15 to 400 mm
        *(([cylinder(radius)], [min(STEPS, key=lambda step, r=radius: abs(np.log(step / r)))])
          for radius in (3.0, 15.0, 17.0, 17.8, 26.0, 60.0, 130.0, 260.0, 399.0, 5000.0)),
        ([cylinder(3.0), cylinder(5000.0), cylinder(15.0)], [STEPS[0], STEPS[11]]),
        # of a cone all from its largest down, across the surface 2 x 20 mm; of a hole none
        ([cylinder(20.0, np.arccos(0.5))], STEPS[:4]),
        ([cylinder(30.0, concave=True)], []),
    ],
)  # fmt: skip
def test_radii_that_are_searched_for_round_faces(faces, radii):
    assert radii_of(faces) == pytest.approx(tuple(radii))
