"""The compiled loops over an image (`kernels`): refinement, scores of cells, last fit.

The numpy forms in `refine`, `fit`, `explained` and `posterior` are the reference.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import addresses
from recognizer.touch.settings import DEFAULTS, SpreadSettings
from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

UNKNOWNS = len(DEFAULTS.refine.least)  #: pose (7,) and gain (4,)
ALL = UNKNOWNS + len(DEFAULTS.posterior.least)  #: and offset, blur across rows and columns

_WHOLE = ("b", "n", "q", "size", "hardens", "falls", "high", "wide")
_REAL = (
    "symbol", "deepest", "pitch", "half", "step", "noise", "least_gain", "full_press",
    "least_press", "steepest", "quiet", "displaced", "loud", "most", "first", "far", "grazed",
    "tie", "damping", "easier", "harder", "settled", "shallower", "deepest_gain",
)  # fmt: skip
_ROWS = {
    "least": UNKNOWNS, "largest": UNKNOWNS, "limits": len(DEFAULTS.refine.limits),
    "precision": UNKNOWNS,
}  # fmt: skip
_ARRAYS = {
    "points": np.float64, "forces": np.float64, "trust": np.float64, "plane": np.float64,
    "loaded": np.bool_, "drop": np.float64, "rimmed": np.float32,
}  # fmt: skip


class _Scene(ctypes.Structure):
    """`Scene` of scene.h."""

    held: tuple[NDArray[Any], ...]  # what it points to

    _fields_ = [
        *((name, ctypes.c_int64) for name in _WHOLE),
        *((name, ctypes.c_double) for name in _REAL),
        *((name, ctypes.c_double * size) for name, size in _ROWS.items()),
        ("usual_scale", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
    ]


class _Steps(ctypes.Structure):
    """`Steps` of posterior.c."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("rows", "columns", "steps", "rounds")),
        *((name, ctypes.c_double) for name in ("freedom", "touches", "unseen")),
        ("usual", ctypes.c_double * 2),
        *((name, ctypes.c_double * ALL) for name in ("least", "most", "known")),
        ("aside", ctypes.c_void_p),
    ]


def refine_compiled(
    library: ctypes.CDLL,
    image: Image,
    template: ResponseTemplate,
    pose: Array,
    gain: Array,
    precision: Array,
    steps: int,
    shown: Callable[[Ints], Ints] | None,
    *,
    told: bool,
) -> tuple[Array, Array, Array, Array, Array]:
    """Return pose, gain, value, normal and right of `refine.Lattices` after damped steps.

    Parameters
    ----------
    pose, gain
        (b, 7) and (b, 4) of b candidates, to begin with.
    precision
        (11,) how well each unknown is known beforehand.
    steps
        How many, at most.
    shown
        (b, n, 2) cells -> (b, n) labels; None: each cell shows what fits best.
    told
        Whether normal and right are those of the end.
    """
    count = len(pose)
    pose, gain = np.array(pose, np.float64, order="C"), np.array(gain, np.float64, order="C")
    labels = corner = None
    if shown is not None:
        labels, corner = _label_tables(image, template, pose, steps, shown)
    scene = _scene_of(image, template).of_lattices(count, labels, precision)
    value, right = np.empty(count), np.zeros((count, UNKNOWNS))
    normal = np.zeros((count, UNKNOWNS, UNKNOWNS))
    library.refine(
        ctypes.addressof(scene), steps, int(told),
        *addresses(labels, corner, pose, gain, value, normal, right),
    )  # fmt: skip
    return pose, gain, value, normal, right


@dataclass(frozen=True, slots=True, eq=False)
class LastSteps:
    """What `posterior.fit_posterior` weighs and bounds; pose, gain and what a sensor adds (14,)."""

    steps: int
    spread: SpreadSettings
    least: Array  #: (14,) what the diagonal gains
    most: Array  #: (14,) the largest step
    known: Array  #: (14,) what is known of each unknown beforehand, one over its variance


def fit_posterior_compiled(
    library: ctypes.CDLL,
    image: Image,
    template: ResponseTemplate,
    pose: Array,
    gain: Array,
    shown: Callable[[Ints], Ints],
    how: LastSteps,
) -> tuple[Array, Array, Array, Array, Array] | None:
    """Return where a lattice of known symbols lies; None where the image shows too little.

    Pose (7,), gain (4,), offset and blurs (3,), variances (2,) of a covered tactel's psi and of a
    tip's place, and the normal matrix (14, 14).
    """
    labels, corner = _label_tables(image, template, pose[None], how.steps, shown)
    scene = _scene_of(image, template).of_lattices(1, labels)
    aside = np.ascontiguousarray(np.broadcast_to(image.aside, len(image.forces)), np.float64)
    spread, unknowns = how.spread, len(how.known)
    steps = _Steps(
        rows=image.shape[0], columns=image.shape[1], steps=how.steps, rounds=spread.rounds,
        freedom=spread.freedom, touches=spread.touches, unseen=spread.unseen,
        usual=(spread.felt**2, spread.aside_mm**2), least=tuple(how.least.tolist()),
        most=tuple(how.most.tolist()), known=tuple(how.known.tolist()), aside=aside.ctypes.data,
    )  # fmt: skip
    pose, gain = np.array(pose, np.float64), np.array(gain, np.float64)
    more, now, normal = np.empty(3), np.empty(2), np.empty((unknowns, unknowns))
    seen = library.fit_posterior(
        ctypes.addressof(scene), ctypes.addressof(steps),
        *addresses(labels, corner, pose, gain, more, now, normal),
    )  # fmt: skip
    return (pose, gain, more, now, normal) if seen else None


def explained_share_compiled(
    library: ctypes.CDLL,
    image: Image,
    template: ResponseTemplate,
    pose: Array,
    gain: Array,
    shown: Callable[[Ints], Ints],
) -> float:
    """Return what `explained.explained_share` says of a pose (7,) and a gain (4,)."""
    labels, corner = _label_tables(image, template, pose[None], 0, shown)
    scene, noise = _scene_of(image, template).of_lattices(1, labels), image.settings.noise
    pose, gain = np.array(pose, np.float64), np.array(gain, np.float64)
    share: float = library.explained_share(
        ctypes.addressof(scene), *addresses(labels, corner, pose, gain), noise.hidden, noise.above
    )
    return share


@dataclass(frozen=True, slots=True, eq=False)
class CellSums:
    """What `fit.score_cells` makes fits of."""

    noise: float
    count: Ints  #: (b,) of cells in view
    cells: Ints  #: (b, n, 2) their names, in the first `count` rows; rising
    scores: Array  #: (b, n, q + 1) log-likelihoods
    seen: Array  #: (b, n) tactels that look at them, by how hard they press
    level: Array  #: (b,) log-likelihood that no label changes
    left: Array  #: (b, n) residuals of the likeliest labels, on a covered tactel's scale


def sum_cells_compiled(
    library: ctypes.CDLL,
    image: Image,
    template: ResponseTemplate,
    pose: Array,
    gain: Array,
    best: int,
) -> CellSums:
    """Return the scores of all cells in view of lattices (b, 7) and (b, 4).

    Parameters
    ----------
    best
        The likeliest lattice: what it leaves of the image is the noise.
    """
    count, tactels, order = len(pose), len(image.forces), template.order
    scene = _scene_of(image, template).of_lattices(count)
    pose, gain = np.ascontiguousarray(pose), np.ascontiguousarray(gain)
    numbers, names = np.empty(count, np.int64), np.empty((count, tactels, 2), np.int64)
    scores, seen = np.empty((count, tactels, order + 1)), np.empty((count, tactels))
    level, left = np.empty(count), np.empty((count, tactels))
    noise = library.score_cells(
        ctypes.addressof(scene), best, image.settings.noise.least,
        *addresses(pose, gain, numbers, names, scores, seen, level, left),
    )  # fmt: skip
    return CellSums(noise, numbers, names, scores, seen, level, left)


def _label_tables(
    image: Image,
    template: ResponseTemplate,
    pose: Array,
    steps: int,
    shown: Callable[[Ints], Ints],
) -> tuple[NDArray[np.int8], Ints]:
    """Return labels (b, high, wide) of all cells that steps can reach, and the first (b, 2)."""
    refine, pitch = image.settings.refine, template.pitch_mm
    scale = 1 + max(refine.limits[3], float(np.abs(pose[:, 6]).max()))
    reach = scale * _scene_of(image, template).reach_mm
    reach += steps * max(refine.step[:2])
    corner = np.floor((pose[:, :2] - reach) / pitch).astype(np.int64)
    side = math.ceil(2 * reach / pitch) + 2
    labels = shown(corner[:, None] + _box(side))
    return labels.astype(np.int8).reshape(len(pose), side, side), corner


@lru_cache(maxsize=16)
def _box(side: int) -> Ints:
    """Return the cells (side^2, 2) of a square, its first one (0, 0)."""
    down, along = np.divmod(np.arange(side * side), side)
    return np.stack([along, down], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class _ImageScene:
    value: _Scene  # of no lattice yet
    held: tuple[NDArray[Any], ...]  # `_Scene.held`
    reach_mm: float  # of the tactel that lies farthest out

    def of_lattices(
        self,
        count: int,
        labels: NDArray[np.int8] | None = None,
        precision: Array | None = None,
    ) -> _Scene:
        """Return the scene of so many lattices, with tables (b, high, wide) of what cells show."""
        scene = _Scene.from_buffer_copy(self.value)
        scene.held = self.held
        scene.b = count
        if labels is not None:
            scene.high, scene.wide = labels.shape[1:]
        if precision is not None:
            scene.precision[:] = precision.tolist()
        return scene


@lru_cache(maxsize=4)
def _scene_of(image: Image, template: ResponseTemplate) -> _ImageScene:
    gain, noise, pressing = image.settings.gain, image.settings.noise, image.pressing
    refine = image.settings.refine
    given: dict[str, NDArray[Any] | None] = {
        "points": image.points_mm, "forces": image.forces, "trust": image.trust,
        "plane": image.plane, "loaded": image.loaded, "drop": image.falls,
        "rimmed": template.rimmed,
    }  # fmt: skip
    held: dict[str, NDArray[Any]] = {
        name: np.ascontiguousarray(given[name], kind)
        for name, kind in _ARRAYS.items()
        if given[name] is not None
    }
    scene = _Scene(
        n=len(image.forces), q=template.order, size=template.size, hardens=int(pressing.hardens),
        falls=0 if image.falls is None else len(image.falls), symbol=pressing.symbol,
        deepest=pressing.deepest, pitch=template.pitch_mm, half=template.half_mm,
        step=template.step_mm, noise=image.noise,
        least_gain=gain.least_gain, full_press=gain.full_press, least_press=gain.least_press,
        steepest=gain.steepest, quiet=noise.quiet, displaced=noise.displaced_mm, loud=noise.loud,
        most=noise.most, first=noise.first, far=noise.far, grazed=noise.grazed, tie=noise.tie,
        damping=refine.damping, easier=refine.easier, harder=refine.harder, settled=refine.settled,
        shallower=refine.shallower, deepest_gain=refine.deepest, least=refine.least,
        largest=refine.step, limits=refine.limits,
        usual_scale=math.log(pressing.scale) if image.newtons else 0.0,
        **dict(zip(held, addresses(*held.values()), strict=True)),
    )  # fmt: skip
    reach_mm = float(np.sqrt((image.points_mm**2).sum(axis=1).max()))
    return _ImageScene(scene, tuple(held.values()), reach_mm)
