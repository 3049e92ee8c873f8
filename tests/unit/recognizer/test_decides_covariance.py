"""How sure a pose is, and what a tactel costs: by hand, and by loops over all neighbours."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from reference.touch_loops import log_likelihoods

from recognizer.touch.options import ReaderOptions
from recognizer.touch.symbols import linearize
from recognizer.touch.symbols.fit import covariances
from recognizer.touch.symbols.linearize import psi_deviation

SHAPE = (5, 6)
USUAL = 0.15  # standard deviation of psi with which normal matrices are made


def normals(count, seed=3):
    """Well-conditioned normal matrices (count, 11, 11) of unlike scales."""
    rng = np.random.default_rng(seed)
    scale = np.array([3.0, 2.0, 90.0, 1.0, 1.0, 1.0, 200.0, 4.0, 9.0, 9.0, 9.0])
    roots = rng.normal(size=(count, 30, 11)) * scale
    return np.einsum("bki,bkj->bij", roots, roots)


def asked(normal, *, hardens, form=(0.0, 0.0, 0.0, 0.0), away=None, noise=USUAL):
    """Covariances of lattices that all have one form."""
    count = len(normal)
    pose = np.zeros((count, 7))
    pose[:, :3] = 5.0, -9.0, 1.0  # of no importance
    pose[:, 3:] = form
    image = SimpleNamespace(
        pressing=SimpleNamespace(hardens=hardens), shape=SHAPE, options=ReaderOptions()
    )
    left = np.zeros((count, SHAPE[0] * SHAPE[1])) if away is None else away
    return covariances(image, SimpleNamespace(pose=pose, normal=normal), left, noise)


def inverses(normal):
    """The first three unknowns of the inverse, by solving for each column."""
    return np.stack([np.linalg.solve(one, np.eye(11)[:, :3])[:3] for one in normal])


@pytest.mark.parametrize(
    ("form", "times"),
    [
        ((0.0, 0.0, 0.0, 0.0), 0.6),
        ((0.6, 0.4, 0.2, 0.01), 0.6 + 0.025 * 4**2),  # each one standard deviation away
        ((1.2, 0.0, 0.0, 0.0), 0.6 + 0.025 * 4**2),
        ((0.0, -0.8, 0.0, 0.0), 0.6 + 0.025 * 4**2),
        ((0.0, 0.0, -0.4, 0.0), 0.6 + 0.025 * 4**2),
        ((0.0, 0.0, 0.0, 0.03), 0.6 + 0.025 * 9**2),
    ],
)
def test_under_tabs_a_form_far_from_what_was_known_widens_it(form, times):
    normal = normals(2)
    found = asked(normal, hardens=True, form=form, away=np.ones((2, 30)))
    np.testing.assert_allclose(found, times * inverses(normal), rtol=1e-6)


@pytest.mark.parametrize("hardens", [True, False])
def test_it_grows_with_the_square_of_the_noise(hardens):
    normal = normals(1)
    usual, twice, half = (
        asked(normal, hardens=hardens, noise=noise) for noise in (USUAL, 2 * USUAL, USUAL / 2)
    )
    np.testing.assert_allclose(twice, 4 * usual)
    np.testing.assert_allclose(half, usual / 4)


def alike(left):
    """One plus the sum over the eight neighbours of the autocorrelation, by loops."""
    left = np.clip(left, -0.6, 0.6)
    left = left - left.mean()
    rows, columns = left.shape
    total = 0.0
    for r in range(rows):
        for c in range(columns):
            for down in (-1, 0, 1):
                for right in (-1, 0, 1):
                    inside = 0 <= r + down < rows and 0 <= c + right < columns
                    if inside and (down or right):
                        total += left[r, c] * left[r + down, c + right]
    return 1.0 + total / (left**2).sum()


def smooth(seed):
    """A field whose neighbours are alike, with two tactels that are far off."""
    field = np.random.default_rng(seed).normal(size=(SHAPE[0] + 2, SHAPE[1] + 2))
    field = 0.1 * (field[1:, 1:] + field[:-1, 1:] + field[1:, :-1] + 2 * field[:-1, :-1])
    field = field[: SHAPE[0], : SHAPE[1]] + 0.3
    field[1, 2], field[3, 4] = 5.0, -7.0
    return field


def test_under_a_pad_neighbours_that_err_alike_widen_it():
    fields = [smooth(seed) for seed in range(40)]
    widened = [field for field in fields if alike(field) > 1.2][:6]
    normal = normals(len(widened))
    found = asked(normal, hardens=False, away=np.stack([f.ravel() for f in widened]))
    for one, inverse, field in zip(found, inverses(normal), widened, strict=True):
        np.testing.assert_allclose(one, 1.18 * alike(field) * inverse, rtol=1e-6)
    for way in ((1, 0), (0, 1), (1, 1), (1, -1)):  # rows, columns and both diagonals alike
        field = np.zeros(SHAPE)
        field[2, 2] = field[2 + way[0], 2 + way[1]] = 0.5
        (one,) = asked(normal[:1], hardens=False, away=field.reshape(1, -1))
        np.testing.assert_allclose(one, 1.18 * alike(field) * inverses(normal[:1])[0], rtol=1e-6)


def test_neighbours_that_err_against_each_other_do_not_narrow_it():
    rows, columns = np.indices(SHAPE)
    for field in (0.2 * (-1.0) ** (rows + columns), 0.0 * rows, 0.0 * rows + 0.3):
        (found,) = asked(normals(1), hardens=False, away=field.reshape(1, -1))
        np.testing.assert_allclose(found, 1.18 * inverses(normals(1))[0], rtol=1e-6)


def test_what_the_image_does_not_show_is_wide_and_the_rest_is_not():
    normal = normals(1)
    normal[0, 1] = normal[0, :, 1] = 0.0  # nothing says anything of y
    (found,) = asked(normal, hardens=True)
    rest = np.delete(np.delete(normal[0], 1, 0), 1, 1)
    truth = 0.6 * np.linalg.inv(rest)[:2, :2]
    np.testing.assert_allclose(found[np.ix_([0, 2], [0, 2])], truth, rtol=1e-6)
    assert found[1, 1] == pytest.approx(0.6 * 1e12 / 1e-8)  # 1e12: the least information
    sd = np.sqrt(np.diag(found))
    np.testing.assert_allclose(found[1, [0, 2]] / (sd[1] * sd[[0, 2]]), 0.0, atol=1e-9)


def test_two_unknowns_that_the_image_does_not_tell_apart_are_wide_together():
    normal = np.diag([4.0, 9.0, *[1.0] * 9])[None].copy()
    normal[0, 0, 1] = normal[0, 1, 0] = 6.0 * (1 - 1e-12)
    (found,) = asked(normal, hardens=True)
    # unit diagonal: eigenvalues 2 and, held up, 1e-8, along (1, 1) and (1, -1) over root 2
    pair = np.array([[0.25 + 0.5e8, 0.25 - 0.5e8], [0.25 - 0.5e8, 0.25 + 0.5e8]])
    pair *= np.outer([1 / 2, 1 / 3], [1 / 2, 1 / 3])
    np.testing.assert_allclose(found[:2, :2], 0.6 * pair, rtol=1e-6)
    assert found[2, 2] == pytest.approx(0.6)


def psi(response):
    return math.log(1 + 3 * response) / math.log(4)


def read_at(value, faint):
    """Deviation of psi where readings scatter by a share of what a plateau presses: by steps."""
    step = 1e-6
    response = (4**value - 1) / 3
    return faint * (psi(response + step) - psi(response)) / step


def by_hand(seen, table, press, bare, trust, noise, faint=0.0):
    """Log-likelihoods of the symbols at one tactel, and of none, nats."""
    found = []
    for value, by_x, by_y in table:
        own = read_at(value, faint) * press / noise
        width = math.sqrt(0.8**2 + value**2 + by_x**2 + by_y**2 + own**2)
        away = (seen - value) / (width * noise / press)
        found.append(trust * (-min(away**2 / 2, 8.0) - math.log(width)))
    none = []
    for value in (0.0, psi(bare)):  # beyond the edge of the face, or over it
        width = math.hypot(0.8, value, read_at(value, faint) * press / noise)
        away = (seen - value) / (width * noise / press)
        none.append(trust * (-min(away**2 / 2, 8.0) - math.log(width)))
    return [*found, max(none)]


def costs(seen, tables, press, bare, trust, noise, faint=0.0):
    b, n, q = len(seen), len(trust), len(tables[0][0])
    every = np.zeros((b, n, q, 6), np.float32)
    every[..., :3] = tables
    every[..., 3:] = 9.0  # what is fitted of the form is no noise
    felt = SimpleNamespace(
        psi=np.array(seen), press=np.array(press), bare=np.array(bare),
        trust=np.array(trust), faint=np.full((b, n), faint),
    )  # fmt: skip
    return log_likelihoods(felt, every, np.array(noise))


@pytest.mark.parametrize("faint", [0.0, 0.03, 0.2])
def test_every_tactel_under_every_plane(faint):
    rng = np.random.default_rng(1)
    b, n, q = 2, 40, 3
    seen, press = rng.uniform(0, 1.3, (b, n)), rng.uniform(0.2, 1.0, (b, n))
    bare = np.where(rng.random((b, n)) < 0.5, 0.0, rng.uniform(0, 0.9, (b, n)))
    trust = rng.uniform(0, 1, n)
    tables = rng.normal(size=(b, n, q, 3)) * [0.5, 0.4, 0.7] + [0.5, 0.0, 0.0]
    noise = np.array([0.12, 0.3])
    found = costs(seen, tables, press, bare, trust, noise, faint)
    assert found.shape == (b, n, q + 1)
    for i in range(b):
        for k in range(n):
            truth = by_hand(
                seen[i, k], tables[i, k], press[i, k], bare[i, k], trust[k], noise[i], faint
            )
            np.testing.assert_allclose(found[i, k], truth, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(
    ("seen", "value", "nats"),
    [
        (0.0, 0.0, -math.log(0.8)),
        (0.6, 0.6, 0.0),  # 0.8 and 0.6 make 1
        (0.75, 0.6, -0.5),  # one standard deviation
        (0.3, 0.6, -2.0),
        (9.0, 0.6, -8.0),  # a spike costs 8 nats
        (-9.0, 0.6, -8.0),
    ],
)
def test_a_tactel_by_hand(seen, value, nats):
    found = costs([[seen]], [[[(value, 0.0, 0.0)]]], [[1.0]], [[0.0]], [1.0], [0.15])
    assert found[0, 0, 0] == pytest.approx(nats, abs=1e-5)
    hung = costs([[seen]], [[[(value, 0.0, 0.0)]]], [[0.0]], [[0.0]], [1.0], [0.15])
    width = math.hypot(0.8, value)
    away = (seen - value) * 1e-3 / 0.15 / width  # where nothing presses hardly anything is told
    assert hung[0, 0, 0] == pytest.approx(-min(away**2 / 2, 8) - math.log(width), abs=1e-5)


def test_slopes_count_by_the_square_of_how_far_tactels_are_displaced(monkeypatch):
    # 0.8, 0.6 and a slope of 2 over half a mm: the root of 0.64 + 0.36 + 1
    monkeypatch.setattr(linearize, "DISPLACED_MM", 0.5)
    table = np.zeros((1, 1, 1, 6), np.float32)
    table[..., 0], table[..., 1] = 0.6, 2.0
    felt = SimpleNamespace(faint=np.zeros((1, 1)))
    width = psi_deviation(felt, table, np.full((1, 1), 0.15))
    assert width[0, 0, 0] == pytest.approx(math.sqrt(2.0))


@pytest.mark.parametrize(("faint", "counts"), [(0.0299, False), (0.0301, True)])
def test_noise_of_readings_counts_from_three_hundredths_of_a_plateau(faint, counts):
    felt = SimpleNamespace(faint=np.full((1, 1), faint))
    width = psi_deviation(felt, np.zeros((1, 1, 1, 6), np.float32), np.full((1, 1), 0.15))
    own = 3 / math.log(4) * faint / 0.15 if counts else 0.0
    assert width[0, 0, 0] == pytest.approx(math.hypot(0.8, own), rel=1e-5)
