"""What of a frame is worth fitting: floors, contacts and dead rows worked by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.options import ReaderOptions
from recognizer.touch.signal import contact_counts, noise_of, signal_of


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
def test_a_contact_is_six_tactels_over_eight_counts_or_a_twentieth_newton(
    value, count, newtons, contact
):
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
