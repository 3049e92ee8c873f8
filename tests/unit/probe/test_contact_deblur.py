"""The pad's blur taken back as far as the noise lets: case 7 of the stiff and extreme cases."""

import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.deblur import LEAST_SHARE, blur_of, deblur, thickest_mm, transmitted_share
from probe.contact.layer_influence import influence
from probe.errors import ContactError


def pad(height, **more):
    return SensorType(overlay=Overlay("pad", height, **more))


def blurred(sensor, forces):
    return (blur_of(sensor)[0] @ forces.ravel()).reshape(16, 16)


@pytest.mark.parametrize("height", [1.0, 2.0, 3.0])
def test_the_blur_is_that_of_the_layer(height):
    """Against the layer's own stress at the base on a finer grid: an even square of a tactel."""
    sensor = pad(height)
    grid = influence(sensor, 16)
    pressure = np.zeros((grid.rows, grid.columns))
    pressure[1 + 6 * 16 : 1 + 7 * 16, 1 + 9 * 16 : 1 + 10 * 16] = 1 / sensor.pitch_mm**2
    felt = grid.base_forces_n(pressure)
    force = np.zeros((16, 16))
    force[6, 9] = 1
    assert blurred(sensor, force) == pytest.approx(felt, abs=5e-3 * felt.max())
    assert blurred(sensor, force).sum() == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999, 0.5])
def test_the_thickest_pad_is_where_the_refusal_begins(poisson):
    most = thickest_mm(pad(2.0, poisson=poisson))
    assert transmitted_share(pad(most, poisson=poisson)) == pytest.approx(LEAST_SHARE, rel=1e-6)
    read = np.ones((16, 16))
    deblur(read, pad(0.99 * most, poisson=poisson), noise_n=0.1)
    with pytest.raises(ContactError, match=r"passes.*at most"):
        deblur(read, pad(1.01 * most, poisson=poisson), noise_n=0.1)


@pytest.mark.parametrize("height", [0.05, 1.0, 2.0, 3.0])
def test_without_noise_the_forces_come_back(height):
    true = np.random.default_rng(1).exponential(0.1, (16, 16))
    true[3:9, 4] = 0
    found = deblur(blurred(pad(height), true), pad(height), noise_n=0.0)
    assert found.forces_n == pytest.approx(true, abs=1e-6)
    assert found.resolved == 256


@pytest.mark.parametrize("height", [1.0, 2.0, 3.0, 3.7])
def test_noise_is_held_down_and_told(height):
    """The error is that of the noise and of what was left out; never the plain inverse's."""
    rng = np.random.default_rng(2)
    sensor, noise = pad(height), 0.01
    true = np.kron(rng.exponential(0.3, (4, 4)), np.ones((4, 4)))
    clean = blurred(sensor, true)
    found = deblur(clean + noise * rng.normal(size=(16, 16)), sensor, noise_n=noise)
    assert (found.forces_n >= 0).all()
    assert found.noise_n <= 10 * noise
    error = np.linalg.norm(found.forces_n - true) / np.linalg.norm(true)
    assert error < np.linalg.norm(clean - true) / np.linalg.norm(true)
    assert found.resolved <= {1.0: 256, 2.0: 256, 3.0: 200, 3.7: 150}[height]  # lost as pads grow


@pytest.mark.parametrize(
    ("read", "sensor", "noise", "match"),
    [
        (np.ones((16, 16)), SensorType(), 0.01, "kind 'tab'"),
        (np.ones((16, 16)), pad(4.0), 0.01, r"passes.*at most 3\.75 mm"),
        (np.ones((16, 15)), pad(2.0), 0.01, "shape"),
        (np.full((16, 16), np.nan), pad(2.0), 0.01, "finite"),
        (np.ones((16, 16)), pad(2.0), -1.0, "noise"),
        (np.ones((16, 16)), pad(2.0), math.inf, "noise"),
    ],
)
def test_what_is_refused(read, sensor, noise, match):
    with pytest.raises(ContactError, match=match):
        deblur(read, sensor, noise_n=noise)
