"""Where a lattice of known symbols lies, how sure that is, and how much of the image it explains.

Image + a lattice near the truth + the labels of its cells -> pose, gain and their covariance. The
scatter of readings and that of the tips' places (`TactelScatter`) weigh the tactels, and are fitted
to each touch; so are an offset of all readings, and the share of neighbouring readings in each
(blur), which makes slopes less steep than the template's. Damped least squares; lattice and sensor
frame, mm.

The compiled loop does all of it where normal matrices are well conditioned; about one touch in a
hundred is fitted here, with an inverse that stays wide in what the image does not show.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import addresses
from recognizer.touch.symbols.fit import UNSEEN, Fit, invert_normal, label_tables
from recognizer.touch.symbols.image import Image, bounded_gain
from recognizer.touch.symbols.kernels import (
    ABOVE,
    DAMPING,
    DEEPEST_GAIN,
    EASIER,
    FORM_SD,
    HARDER,
    HIDDEN,
    LARGEST_STEP,
    LEAST_DIAGONAL,
    POSE,
    QUIET,
    SHALLOWER,
    UNKNOWNS,
    Steps,
    kernels,
)
from recognizer.touch.symbols.linearize import (
    LabelsAt,
    force_jacobian,
    prior_departure,
    prior_precision,
    project_symbols,
    response_by_psi,
    response_of,
)
from recognizer.touch.symbols.template import CROSS_TALK

Array = NDArray[np.float64]

STEPS = 2  #: of damped least squares
OFFSET_SD = 0.05  #: of the largest reading: deviation of an offset of all readings
BLUR_SD = 0.05  #: of the share of each neighbour in a reading
LARGEST_MORE = (0.1, 0.05, 0.05)  #: steps of offset (of the largest reading) and blur both ways
LEAST_MORE = (0.01, 1.0, 1.0)  #: is added to the diagonal of the normal matrix for these

# How far readings of a sensor scatter, until a touch shows it.
USUAL_SCATTER = 0.08  #: deviation of psi on a covered tactel
USUAL_ASIDE_MM = 0.08  #: of a tip's place, each way
USUAL_WEIGHT = 4.0  #: tactels that these two weigh as much as
FREEDOM = 8.0  #: of Student's distribution of errors: a dead tactel or a spike weighs little
ROUNDS = 6  #: of expectation and maximisation, at each step

# Times the variance of least squares: measured as `fit.TAB_SIZE` was.
SIZE = 0.95
#: More by this over the number of tactels that press on symbols: residuals of few say less of what
#: is wrong with the template there. 2,000 touches of large and small faces, seed 5353.
FEW_TACTELS = 40.0
BLURRED_SIZE = 2.5  #: more by this, for the share that tabs' readings hold of their neighbours ...
USUAL_BLUR = 0.12  #: ... beyond this
#: More for each unit by which the squared distance of the form (stroke excess, cross-talk,
#: exponent) from what was known beforehand, in deviations, exceeds the usual ...
FORM_SIZE = 0.25
USUAL_FORM = 5.0  #: ... 4.7 in own simulation, 8.8 in MuJoCo (medians)


@dataclass(frozen=True, slots=True, eq=False)
class TactelScatter:
    """Standard deviations of psi on a covered tactel, and of the place of a tip."""

    psi: float
    aside_mm: float

    def variances(self, parts: Array) -> Array:
        """Return (n,) of forces; `parts` (2, n) are those of a scatter of 1 and 1."""
        return np.asarray(self.psi**2 * parts[0] + self.aside_mm**2 * parts[1])

    def log_likelihood(self, left: Array, parts: Array, trust: Array) -> float:
        """Return that of residuals (n,), nats, up to a constant."""
        variance = self.variances(parts)
        loss = (FREEDOM + 1) * np.log1p(left * left / (FREEDOM * variance)) + np.log(variance)
        return -0.5 * float((trust * loss).sum())

    def weights(self, left: Array, parts: Array, trust: Array) -> Array:
        """Return one over the variance (n,), less for outliers."""
        variance = self.variances(parts)
        return np.asarray(trust * (FREEDOM + 1) / (FREEDOM * variance + left * left))


@dataclass(frozen=True, slots=True, eq=False)
class PosePosterior:
    """The pose of a lattice by one touch."""

    pose: Array  #: (7,) of `fit.Lattices`
    gain: Array  #: (4,)
    covariance: Array  #: (4, 4) of x, y (mm), theta (rad) and scale - 1
    scatter: TactelScatter
    blur: tuple[float, float]  #: shares of each neighbour in a row's, in a column's reading


def refit_pose(image: Image, fit: Fit, labels_at: LabelsAt) -> Fit:
    """Return a fit with pose, gain and covariance by its symbols."""
    found = fit_posterior(image, fit.pose, fit.gain, labels_at)
    tactels = float(fit.seen[labels_at(fit.cells) >= 0].sum())
    covariance = found.covariance * (1.0 + FEW_TACTELS / max(tactels, 1.0))
    return replace(
        fit,
        x_mm=float(found.pose[0]),
        y_mm=float(found.pose[1]),
        theta_rad=math.remainder(float(found.pose[2]), math.tau),
        nuisance=found.pose[3:],
        gain=found.gain,
        covariance=covariance[:3, :3],
        with_scale=covariance[3],
    )


def fit_posterior(image: Image, pose: Array, gain: Array, labels_at: LabelsAt) -> PosePosterior:
    """Return the pose of a lattice whose symbols are known, from `pose` (7,) and `gain` (4,)."""
    found = _fit_compiled(image, pose, gain, labels_at)
    pose, gain, more, now, normal = found or fit_steps(image, pose, gain, labels_at)
    inverse = invert_normal(normal)
    rows = [0, 1, 2, POSE - 1]
    covariance = _size(image, pose, more) * inverse[rows][:, rows]
    scatter = TactelScatter(math.sqrt(now[0]), math.sqrt(now[1]))
    return PosePosterior(pose, gain, covariance, scatter, (float(more[1]), float(more[2])))


#: Pose (7,), gain (4,), offset and blurs (3,), variances (2,) of a covered tactel's psi and of a
#: tip's place, and the normal matrix (14, 14).
_Fitted = tuple[Array, Array, Array, Array, Array]


def _fit_compiled(image: Image, pose: Array, gain: Array, labels_at: LabelsAt) -> _Fitted | None:
    labels, corner = label_tables(image, pose[None], STEPS, labels_at)
    data = image.data.of_lattices(1, labels)
    aside = np.ascontiguousarray(np.broadcast_to(image.aside, len(image.forces)), np.float64)
    least, most = step_bounds(image)
    known = precision_of(image)
    steps = Steps(
        rows=image.shape[0], columns=image.shape[1], steps=STEPS, rounds=ROUNDS, freedom=FREEDOM,
        touches=USUAL_WEIGHT, unseen=UNSEEN, usual=(USUAL_SCATTER**2, USUAL_ASIDE_MM**2),
        least=tuple(least.tolist()), most=tuple(most.tolist()), known=tuple(known.tolist()),
        aside=aside.ctypes.data,
    )  # fmt: skip
    pose, gain = np.array(pose, np.float64), np.array(gain, np.float64)
    more, now, normal = np.empty(3), np.empty(2), np.empty((len(known), len(known)))
    seen = kernels().fit_posterior(
        ctypes.addressof(data), ctypes.addressof(steps),
        *addresses(labels, corner, pose, gain, more, now, normal),
    )  # fmt: skip
    return (pose, gain, more, now, normal) if seen else None


@dataclass(frozen=True, slots=True, eq=False)
class _Linearized:
    """An image about one lattice."""

    pose: Array
    gain: Array
    more: Array  # (3,) offset, blur across rows and across columns
    left: Array  # (n,) forces that are left over
    parts: Array  # (2, n) of `TactelScatter`
    jacobian: Array  # (n, 14) forces by pose, gain and these three
    departure: Array  # (14,) how far each unknown lies from what is known beforehand


def fit_steps(image: Image, pose: Array, gain: Array, labels_at: LabelsAt) -> _Fitted:
    """Return the fit, however well the image determines it."""
    precision, trust = precision_of(image), image.trust
    known = np.diag(precision)
    at = _linearize(image, pose, gain, np.zeros(3), labels_at)
    scatter, damping = TactelScatter(USUAL_SCATTER, USUAL_ASIDE_MM), DAMPING
    for step in range(STEPS + 1):
        scatter = fit_scatter(scatter, at.left, at.parts, at.jacobian, known, trust)
        weights = scatter.weights(at.left, at.parts, trust)
        weighted = (at.jacobian * weights[:, None]).T
        normal = weighted @ at.jacobian + known
        if step == STEPS:
            break
        right = weighted @ at.left - known @ at.departure
        tried = _linearize(image, *_move(image, at, normal, right, damping), labels_at)
        before, after = (
            scatter.log_likelihood(one.left, one.parts, trust)
            - 0.5 * float(one.departure @ known @ one.departure)
            for one in (at, tried)
        )
        if after > before:
            at, damping = tried, damping / EASIER
        else:
            damping *= HARDER
    return at.pose, at.gain, at.more, np.square([scatter.psi, scatter.aside_mm]), normal


def _linearize(
    image: Image, pose: Array, gain: Array, more: Array, labels_at: LabelsAt
) -> _Linearized:
    measured, _, values = project_symbols(image, pose[None], gain[None], labels_at)
    jacobian, force = (
        one[0] for one in force_jacobian(image, pose[None], gain[None], values, measured)
    )
    value, plateau, press = values[0], measured.plateau[0], measured.press[0]
    unit = response_by_psi(response_of(value[:, 0])) * plateau / press
    columns = np.ones((len(force), 3))
    columns[:, 1:2], columns[:, 2:] = second_differences(force[:, None], image.shape)
    rows, across = second_differences(jacobian, image.shape)
    jacobian = jacobian + (more[1] * rows + more[2] * across)
    parts = np.empty((2, len(force)))
    parts[0] = QUIET**2 + value[:, 0] ** 2
    parts[1] = image.aside * (value[:, 1] ** 2 + value[:, 2] ** 2)
    parts *= unit**2
    left = image.forces - force - columns @ more
    departure = np.concatenate([prior_departure(image, pose[None], gain[None])[0], more])
    jacobian = np.concatenate([jacobian, columns], axis=1)
    return _Linearized(pose, gain, more, left, parts, jacobian, departure)


def _move(
    image: Image, at: _Linearized, normal: Array, right: Array, damping: float
) -> tuple[Array, Array, Array]:
    """Return pose, gain and the sensor's unknowns a damped step further."""
    least, most = step_bounds(image)
    system = normal.copy()
    system.flat[:: len(system) + 1] += np.diagonal(normal) * damping + least
    step = _clip(np.asarray(np.linalg.solve(system, right)), most)
    pose, gain = at.pose + step[:POSE], at.gain + step[POSE:UNKNOWNS]
    pose[3:] = _clip(pose[3:], np.array(image.limits))
    gain[1] = min(max(gain[1], SHALLOWER * at.gain[1]), DEEPEST_GAIN)
    gain = bounded_gain(gain[None])[0]
    return pose, gain, at.more + step[UNKNOWNS:]


def step_bounds(image: Image) -> tuple[Array, Array]:
    """Return the least diagonal (14,), and the largest step (14,)."""
    most = np.array([*LARGEST_STEP, *LARGEST_MORE])
    most[UNKNOWNS] *= float(image.forces.max())
    return np.array([*LEAST_DIAGONAL, *LEAST_MORE]), most


def _clip(values: Array, most: Array) -> Array:
    return np.asarray(np.minimum(np.maximum(values, -most), most))


def precision_of(image: Image) -> Array:
    """Return the prior of each unknown, one over its variance (14,)."""
    offset = OFFSET_SD * max(float(image.forces.max()), 1e-12)
    more = 1.0 / np.square([offset, BLUR_SD, BLUR_SD])
    return np.concatenate([prior_precision(image), more])


def _size(image: Image, pose: Array, more: Array) -> float:
    """Return by how much the covariance is wider than least squares give.

    Readings with a large share of each other share it in a way that no second difference describes;
    under a pad or a gel, which smears, that is the usual share of its template and no error. And
    where strokes are far from their prior form, more of the template is wrong than the fitted
    part of it: the rest moves all symbols alike and leaves no residual (`docs/recognizer.md`, "How
    sure it is").
    """
    cross_talk = CROSS_TALK * (1 + float(pose[4]))
    cross_talk += 2 * float(more[1:].sum())
    blurred = BLURRED_SIZE * max(0.0, cross_talk - USUAL_BLUR) if image.pressing.hardens else 0.0
    away = pose[3 : POSE - 1] / np.array(FORM_SD)
    strange = max(0.0, float(away @ away) - USUAL_FORM)
    return (SIZE + blurred) * (1 + FORM_SIZE * strange)


def fit_scatter(
    before: TactelScatter, left: Array, parts: Array, jacobian: Array, known: Array, trust: Array
) -> TactelScatter:
    """Return the scatter under which residuals are likeliest, drawn towards the usual one.

    One part goes with the reading (gains, lengths of tips, noise), the other with the image's slope
    (tips that stand aside): a sensor with even gains and uneven tips would otherwise pass for a
    better one than it is. Restricted maximum likelihood by expectation and maximisation: K. L.
    Lange, R. J. A. Little, J. M. G. Taylor, J. Am. Stat. Assoc. 84 (1989) 881; D. A. Harville, same
    journal, 72 (1977) 320.

    `left` (n,) are residuals, `parts` (2, n) variances of a scatter of 1 and 1, `jacobian` (n, k)
    by what was fitted, `known` (k, k) the prior precision of that.
    """
    usual = np.square([USUAL_SCATTER, USUAL_ASIDE_MM])
    now = np.square([before.psi, before.aside_mm])
    for _ in range(ROUNDS):
        scatter = TactelScatter(math.sqrt(now[0]), math.sqrt(now[1]))
        weights = scatter.weights(left, parts, trust)
        normal = (jacobian * weights[:, None]).T @ jacobian + known
        inverse = invert_normal(normal)
        taken = ((jacobian @ inverse) * jacobian).sum(axis=1) * weights
        share = trust * now[:, None] * parts / scatter.variances(parts)
        asked = share @ (weights * left * left + taken) + USUAL_WEIGHT * usual / now
        now = now * np.sqrt(asked / (share.sum(axis=1) + USUAL_WEIGHT))
    return TactelScatter(math.sqrt(now[0]), math.sqrt(now[1]))


def second_differences(images: Array, shape: tuple[int, int]) -> tuple[Array, Array]:
    """Return second differences across rows (n, k), and across columns, of images (n, k).

    A reading that holds the share b of both its neighbours is the image plus b times its second
    difference. Beyond the rim readings are 0.
    """
    square = images.reshape(*shape, -1)
    rows, columns = -2.0 * square, -2.0 * square
    rows[1:] += square[:-1]
    rows[:-1] += square[1:]
    columns[:, 1:] += square[:, :-1]
    columns[:, :-1] += square[:, 1:]
    return rows.reshape(images.shape), columns.reshape(images.shape)


def explained_share(image: Image, pose: Array, gain: Array, labels_at: LabelsAt) -> float:
    """Return the share of the variance of psi that given symbols explain; it may be below 0.

    The part that the noise of readings alone would leave is taken off first. `pose` (7,), `gain`
    (4,) are those of one lattice.
    """
    labels, corner = label_tables(image, pose[None], 0, labels_at)
    data = image.data.of_lattices(1, labels)
    pose, gain = np.array(pose, np.float64), np.array(gain, np.float64)
    share: float = kernels().explained_share(
        ctypes.addressof(data), *addresses(labels, corner, pose, gain), HIDDEN, ABOVE
    )
    return share
