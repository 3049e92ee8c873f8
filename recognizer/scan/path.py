"""Where touches stand whose motion nobody measured: a path through registered places. Thesis 6.3.

Views of touches + what is known of each step -> the path that explains all touches best, in array
axes (cell (0, 0) of the array has its lower left corner at the origin, y against rows; mm, rad).
What one touch leaves open (symbols look alike a pitch away) its neighbours and the database decide:
each touch is at one of the places that it may be by itself, and a step from place to place costs
what its length says. A. J. Viterbi, IEEE Trans. Inf. Theory 13 (1967) 260.

A path that the touches themselves would not have shown, had the database not asked for it, is worth
little: `log_freedom` says how many other paths they allow as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.planar import (
    PlanarBelief,
    wrap_angle,
)
from recognizer.scan.settings import PATHS, ScanSettings
from recognizer.scan.steps import log_freedom, step_between
from recognizer.scan.views import LatticeView, TouchPoses
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import find_hypotheses
from recognizer.touch.settings import HypothesisSettings
from recognizer.touch.symbols.fit import Fit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class RegisteredPath:
    """Where touches stand as their images and the database have it."""

    poses: Array  #: (n, 3) in array axes; of a touch that is left out, that of one beside it
    placed: NDArray[np.bool_]  #: (n,)
    margin: float  #: nats over the best path that ends elsewhere
    log_freedom: float  #: log of the number of paths that the touches allow, by their weights


def follow_path(
    encoding: EmbossedArray,
    views: Sequence[Sequence[LatticeView]],
    steps: Sequence[PlanarBelief],
    hypotheses: HypothesisSettings,
    settings: ScanSettings,
) -> RegisteredPath:
    """Return the likeliest path; where no touch may be anywhere, one without places.

    Parameters
    ----------
    views
        Of each touch.
    steps
        To each touch from the one before, `steps_of`.
    """
    places = [_places_of_touch(encoding, each, hypotheses) for each in views]
    trellis = _Trellis([], [])
    for t in range(len(places)):
        _reach_touch(encoding, places, steps, t, trellis, settings)
    ends = [float(each.max(initial=-math.inf)) for each in trellis.scores]
    ends = [end - settings.left_out * (len(ends) - 1 - t) for t, end in enumerate(ends)]
    last = int(np.argmax(ends))
    if not math.isfinite(ends[last]):
        return RegisteredPath(np.zeros((len(views), 3)), np.zeros(len(views), np.bool_), 0.0, 0.0)
    scores = trellis.scores[last]
    end = int(scores.argmax())
    elsewhere = _lie_elsewhere(encoding, places[last], end)
    margin = float(scores[end] - scores[elsewhere].max(initial=-math.inf))
    chosen: dict[int, int] = {}
    t, n = last, end
    while t >= 0:
        chosen[t] = n
        t, n = trellis.came[t][n]
    poses, before = np.zeros((len(places), 3)), min(chosen)
    for t in range(len(places)):
        before = t if t in chosen else before
        poses[t] = places[before].poses[chosen[before]]
    poses = poses[0] + _on_torus(encoding, poses - poses[0])
    placed = np.array([t in chosen for t in range(len(places))])
    fits = {t: places[t].fits[n] for t, n in sorted(chosen.items())}
    freedom = log_freedom(
        fits, poses, steps, encoding.style.pitch_mm, encoding.array.order, settings
    )
    return RegisteredPath(poses, placed, margin, freedom)


def path_touch_poses(path: RegisteredPath, steps: Sequence[PlanarBelief]) -> TouchPoses:
    """Return where the touches of a path stand, in array axes."""
    sure = np.diag(np.square(PATHS.sure))
    spread = np.where(path.placed[:, None, None], sure, steps[0].covariance)
    return TouchPoses(path.poses, spread, None)


@dataclass(frozen=True, slots=True, eq=False)
class _TouchPlaces:
    """Where one touch may be by itself."""

    fits: tuple[Fit, ...]  #: under which it is there, one of each place
    poses: Array  #: (k, 3) in array axes
    faces: Ints  #: (k,)
    losses: Array  #: (k,) nats below what any symbols could reach, 0 or less


@dataclass(frozen=True, slots=True, eq=False)
class _Trellis:
    """Of each touch so far, how likely its places are and from where the best path comes."""

    scores: list[Array]  # (k,) nats
    came: list[list[tuple[int, int]]]  # touch and place; (-1, -1): a path begins there


def _reach_touch(
    encoding: EmbossedArray,
    places: Sequence[_TouchPlaces],
    steps: Sequence[PlanarBelief],
    t: int,
    trellis: _Trellis,
    settings: ScanSettings,
) -> None:
    """Add a touch to a trellis: its places are reached from those of a touch before, or begin."""
    at = places[t]
    best = np.full(len(at.poses), -settings.left_out * t)  # all before are left out
    fro = [(-1, -1)] * len(best)
    for k in range(t - 1, max(t - 1 - PATHS.skipped, 0) - 1, -1):
        if not len(trellis.scores[k]):
            continue
        step = step_between(steps, k, t)
        reached = trellis.scores[k][:, None] - _step_costs(encoding, places[k], at, step)
        reached -= settings.left_out * (t - 1 - k)
        nearest = reached.argmax(axis=0)
        value = reached[nearest, np.arange(len(best))]
        for n in np.flatnonzero(value > best).tolist():
            best[n], fro[n] = value[n], (k, int(nearest[n]))
    trellis.scores.append(best + at.losses)
    trellis.came.append(fro)


def _places_of_touch(
    encoding: EmbossedArray, views: Sequence[LatticeView], settings: HypothesisSettings
) -> _TouchPlaces:
    """Return the places that a touch may be at."""
    fits = tuple(view.fit for view in views if not view.led)
    wide = replace(settings, kept=PATHS.places)
    found = find_hypotheses(encoding, fits, wide)[: PATHS.places]
    most = max((fit.value for fit in fits), default=0.0)
    return _TouchPlaces(
        fits=tuple(fits[one.fit] for one in found),
        poses=np.array([_pose_in_array(encoding, fits[one.fit], one) for one in found]).reshape(
            -1, 3
        ),
        faces=np.array([one.face for one in found], np.int64),
        losses=np.array([one.score - most for one in found]),
    )


def _pose_in_array(encoding: EmbossedArray, fit: Fit, place: Hypothesis) -> Array:
    pitch = encoding.style.pitch_mm
    return np.array([fit.x_mm + place.column * pitch, fit.y_mm - place.row * pitch, fit.theta_rad])


def _lie_elsewhere(encoding: EmbossedArray, places: _TouchPlaces, at: int) -> NDArray[np.bool_]:
    """Whether places (k,) are others than one of them: half a pitch or an eighth turn away."""
    away = np.abs(_on_torus(encoding, places.poses - places.poses[at]))
    near = (away[:, :2].max(axis=1) < encoding.style.pitch_mm / 2) & (away[:, 2] < math.pi / 4)
    return np.asarray(~(near & (places.faces == places.faces[at])))


def _on_torus(encoding: EmbossedArray, away: Array) -> Array:
    """Return differences (..., 3) of poses the short way round."""
    array, pitch = encoding.array, encoding.style.pitch_mm
    size = np.array([array.columns * pitch, array.rows * pitch, math.tau])
    return np.asarray(away - size * np.rint(away / size))


def _step_costs(
    encoding: EmbossedArray, a: _TouchPlaces, b: _TouchPlaces, step: PlanarBelief
) -> Array:
    """Return what steps from places to places (k, m) cost, nats; infinite from face to face."""
    away = _on_torus(encoding, b.poses[None] - a.poses[:, None])
    c, s = np.cos(a.poses[:, 2, None]), np.sin(a.poses[:, 2, None])
    along = np.stack(
        [
            c * away[..., 0] + s * away[..., 1] - step.pose[0],
            c * away[..., 1] - s * away[..., 0] - step.pose[1],
            wrap_angle(away[..., 2] - step.pose[2]),
        ],
        axis=-1,
    )
    cost = 0.5 * np.einsum("kmi,ij,kmj->km", along, np.linalg.inv(step.covariance), along)
    return np.where(a.faces[:, None] == b.faces[None], cost, np.inf)
