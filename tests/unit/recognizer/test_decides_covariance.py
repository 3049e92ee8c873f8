"""How sure a pose is, and what a tactel costs: by hand, and by loops over all neighbours."""

from types import SimpleNamespace

import numpy as np
import pytest

from recognizer.touch.options import ReaderOptions
from recognizer.touch.symbols.fit import covariances

SHAPE = (5, 6)
USUAL = 0.15  # standard deviation of psi with which normal matrices are made


def normals(count):
    """Well-conditioned normal matrices (count, 11, 11) of unlike scales."""
    rng = np.random.default_rng(3)
    scale = np.array([3.0, 2.0, 90.0, 1.0, 1.0, 1.0, 200.0, 4.0, 9.0, 9.0, 9.0])
    roots = rng.normal(size=(count, 30, 11)) * scale
    return np.einsum("bki,bkj->bij", roots, roots)


def asked(normal, *, hardens, form=(0.0, 0.0, 0.0, 0.0), away=None):
    """Covariances of lattices that all have one form."""
    count = len(normal)
    pose = np.zeros((count, 7))
    pose[:, :3] = 5.0, -9.0, 1.0  # of no importance
    pose[:, 3:] = form
    pressing = SimpleNamespace(hardens=hardens)
    image = SimpleNamespace(pressing=pressing, shape=SHAPE, options=ReaderOptions())
    left = np.zeros((count, SHAPE[0] * SHAPE[1])) if away is None else away
    return covariances(image, SimpleNamespace(pose=pose, normal=normal), left, USUAL)


def inverses(normal):
    """The first three unknowns of the inverse, by solving for each column."""
    return np.stack([np.linalg.solve(one, np.eye(11)[:, :3])[:3] for one in normal])


@pytest.mark.parametrize("away", [0, 1, 2])
def test_under_tabs_a_form_far_from_what_was_known_widens_it(away):
    usual = (0.6, 0.4, 0.2, 0.01)
    forms = [tuple(away * 2 * sd * (k == n) for k, sd in enumerate(usual)) for n in range(4)]
    for form, sds in ((usual, 2), *((form, 2 * away) for form in forms)):
        found = asked(normals(2), hardens=True, form=form)
        times = 0.6 + 0.025 * sds**4
        np.testing.assert_allclose(found, times * inverses(normals(2)), rtol=1e-6)


def alike(left):
    """One plus the sum over the eight neighbours of the autocorrelation, by loops."""
    left = np.clip(left, -0.6, 0.6)
    left = left - left.mean()
    total = 0.0
    for at in np.ndindex(left.shape):
        for step in np.ndindex(3, 3):
            near = at[0] + step[0] - 1, at[1] + step[1] - 1
            if near != at and 0 <= near[0] < SHAPE[0] and 0 <= near[1] < SHAPE[1]:
                total += left[at] * left[near]
    return 1.0 + total / (left**2).sum()


def smooth(seed):
    """A field whose neighbours are alike, with two tactels that are far off."""
    field = np.random.default_rng(seed).normal(size=(SHAPE[0] + 2, SHAPE[1] + 2))
    field = 0.1 * (field[1:, 1:] + field[:-1, 1:] + field[1:, :-1] + 2 * field[:-1, :-1])
    field = field[: SHAPE[0], : SHAPE[1]] + 0.3
    field[1, 2], field[3, 4] = 5.0, -7.0
    return field


def pair(down, right):
    """Two neighbours that err alike, alone."""
    field = np.zeros(SHAPE)
    field[2, 2] = field[2 + down, 2 + right] = 0.5
    return field


def test_under_a_pad_neighbours_that_err_alike_widen_it():
    fields = [smooth(seed) for seed in range(40)]
    fields = [field for field in fields if alike(field) > 1.2][:6]
    fields += [pair(1, 0), pair(0, 1), pair(1, 1), pair(1, -1)]
    normal = normals(len(fields))
    found = asked(normal, hardens=False, away=np.stack([f.ravel() for f in fields]))
    for one, inverse, field in zip(found, inverses(normal), fields, strict=True):
        np.testing.assert_allclose(one, 1.18 * alike(field) * inverse, rtol=1e-6)


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
