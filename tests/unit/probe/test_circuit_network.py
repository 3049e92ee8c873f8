"""The network worked by hand, against many digits, and at its limits."""

import mpmath
import numpy as np
import pytest

from probe.circuit import effective_resistances, transconductances
from probe.errors import CircuitError


def exact_resistances(g, digits=50):
    """Return the resistances by a 31x31 inverse in many digits."""
    rows, columns = g.shape
    with mpmath.workdps(digits):
        size = rows + columns
        laplacian = mpmath.zeros(size)
        for r, c in np.ndindex(rows, columns):
            x, b = mpmath.mpf(float(g[r, c])), rows + c
            laplacian[r, r] += x
            laplacian[b, b] += x
            laplacian[r, b] -= x
            laplacian[b, r] -= x
        inverse = laplacian[: size - 1, : size - 1] ** -1

        def z(a, b):
            return inverse[a, b] if max(a, b) < size - 1 else mpmath.mpf(0)

        return np.array(
            [
                [float(z(r, r) + z(b, b) - 2 * z(r, b)) for b in range(rows, size)]
                for r in range(rows)
            ]
        )


def scenes(decades):
    rng = np.random.default_rng(decades)
    x = np.arange(16) - 7.5
    radius = np.hypot(x, x[:, None])
    low = 10.0**-decades
    hidden = np.full((16, 16), low)
    hidden[[2, 2, 9], [2, 9, 2]] = 1
    return {
        "even in decades": 10 ** rng.uniform(-decades, 0, (16, 16)),
        "washer": np.where((radius > 2.2) & (radius < 4.8), 1.0, low),
        "hidden corner": hidden,
    }


def test_two_by_two_by_hand():
    g = np.array([[1.0, 2.0], [4.0, 8.0]])
    around = 1 / (1 / 2 + 1 / 8 + 1 / 4)  # the way round of (0, 0): 2, 8, 4 in series
    assert effective_resistances(g)[0, 0] == pytest.approx(1 / (1 + around), rel=1e-15)


@pytest.mark.parametrize("name", scenes(6))
def test_six_decades_of_conductance_against_fifty_digits(name):
    g = 1e-4 * scenes(6)[name]
    error = effective_resistances(g) / exact_resistances(g) - 1
    assert np.abs(error).max() <= 1e-13  # asked: 1.7e-10


def test_a_batch_is_what_its_networks_are_alone():
    batch = np.stack(list(scenes(4).values()))
    alone = [effective_resistances(g) for g in batch]
    np.testing.assert_allclose(effective_resistances(batch), alone, rtol=1e-13)
    alone = [transconductances(g, 0.1, 0.3) for g in batch]
    np.testing.assert_allclose(transconductances(batch, 0.1, 0.3), alone, rtol=1e-12)


def test_a_divider_by_hand():
    g = np.array([[1.0, 2.0], [3.0, 4.0]])
    current = transconductances(g, 0.0, 0.5)
    np.testing.assert_allclose(current * 0.5, g / (np.array([4.0, 6.0]) + 2.0), rtol=1e-15)
    np.testing.assert_array_equal(transconductances(g), g)


def test_driven_rows_agree_with_the_whole_network():
    g, row, column = scenes(4)["even in decades"], 0.05, 0.2
    laplacian = np.zeros((32, 32))
    laplacian[:16, 16:], laplacian[16:, :16] = -g, -g.T
    np.fill_diagonal(laplacian, np.r_[g.sum(1) + 1 / row, g.sum(0) + 1 / column])
    expected = np.linalg.inv(laplacian)[16:, :16].T / row / column
    np.testing.assert_allclose(transconductances(g, row, column), expected, rtol=1e-11)


@pytest.mark.parametrize(("on", "error"), [(1e-4, 0.0016), (1e-2, 0.14), (0.1, 0.63)])
def test_what_the_multiplexer_costs_a_virtual_ground_on_a_washer(on, error):
    g = scenes(4)["washer"]
    read = transconductances(g, on, on)
    assert np.abs(read / g - 1)[g > 0.5].max() == pytest.approx(error, rel=0.15)


def test_networks_that_fall_apart_or_make_no_sense_are_refused():
    apart = np.zeros((16, 16))
    apart[:8, :8] = apart[8:, 8:] = 1
    with pytest.raises(CircuitError, match="falls into parts"):
        effective_resistances(apart)
    empty = np.ones((16, 16))
    empty[3] = 0
    with pytest.raises(CircuitError, match="leak"):
        effective_resistances(empty)
    for bad in (-np.ones((4, 4)), np.full((4, 4), np.nan), np.ones(16)):
        with pytest.raises(CircuitError):
            effective_resistances(bad)
        with pytest.raises(CircuitError):
            transconductances(bad)
