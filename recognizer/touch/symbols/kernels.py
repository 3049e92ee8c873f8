"""The compiled loops of reading: their library, their arguments, and the numbers they use.

An evaluation and the last fit have forms in numpy, `linearize` and `posterior`.

Noise: psi of a reading (`template.psi`) spreads in proportion to its value (gain, height and force
law differ from tactel to tactel), to the slope of the template (tips stand aside), and little where
nothing presses. Losses are bounded per tactel: a dead one or a spike costs a known amount.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import POINTER, REAL, WHOLE, addresses, load_library
from recognizer.touch.options import TIE_NATS

FOLDER = Path(__file__).parent.parent

# Noise of psi.
FIRST_NOISE = 0.15  #: standard deviation on a covered tactel, until it is known better
LEAST_NOISE = 0.05  #: below it a fit is not believed
QUIET = 0.8  #: deviation where nothing is felt, against a covered tactel
DISPLACED_MM = 1.0  #: slopes of the template count by this much, in the same measure
MOST_NATS = 8.0  #: that one tactel can cost: a dead one or a spike
LOUD = 0.03  #: noise of readings over the force on a plateau, from which it counts
HIDDEN = 0.5  #: largest share of an image's variance that is taken for that noise
ABOVE = 0.5  #: share of it that is seen where nothing is felt: no force is negative
FAR = 4.0  #: deviations beyond which a tactel neither pulls nor counts as noise
GRAZED = 1e-6  #: psi up to which nothing is felt: the rounding error of none

# Gain: a plane of depths under a force scale (`image`).
DEEPEST = 0.8  #: heights of the overlay beyond which its law goes on straight
STEEPEST = 1.7  #: slope over depth; over 1 a part of the sensor hangs in the air
LEAST_PRESS = 0.2  #: weight of a tactel where the plane presses little or not at all
FULL_PRESS = 0.5  #: of the mean depth, from which a tactel counts whole
LEAST_GAIN = 0.12  #: of the largest: below it a tactel says nothing of symbols

# Damped least squares (K. Levenberg, Quart. Appl. Math. 2 (1944) 164; D. W. Marquardt, J. SIAM 11
# (1963) 431) over x, y (mm), theta (rad); stroke excess (tenths of a mm), cross-talk,
# exponent - 1, scale - 1; logarithm of the force scale, depth and its slopes (heights).
POSE, GAIN = 7, 4  #: unknowns of a lattice, and of its gain
UNKNOWNS = POSE + GAIN
DAMPING = 0.01  #: of the first step
EASIER = 3.0  #: divides it after a step that helps
HARDER = 8.0  #: multiplies it after one that does not
SETTLED = 0.5  #: nats by which a step may change a lattice that counts as found
LARGEST_STEP = (1.0, 1.0, 0.08, 0.5, 0.5, 0.15, 0.01, 0.3, 0.1, 0.1, 0.1)
LEAST_DIAGONAL = (1.0, 1.0, 100.0, 0.1, 0.1, 0.1, 10.0, 1.0, 10.0, 10.0, 10.0)  #: is added
FORM_SD = (0.6, 0.4, 0.2)  #: known beforehand of stroke excess, cross-talk and exponent
FORM_MOST = (1.2, 0.7, 0.4)  #: their limits
FORCE_SCALE_SD = 0.3  #: of the logarithm of the force scale, where forces are newtons
SHALLOWER = 0.3  #: least share of the depth that a step leaves
DEEPEST_GAIN = 0.9  #: heights, the largest depth

ALL = UNKNOWNS + 3  #: and offset, blur across rows and across columns (`posterior`)


class TouchData(ctypes.Structure):
    """`TouchData` of touch_data.h."""

    held: tuple[NDArray[Any], ...]  # arrays that it points to

    _fields_ = [
        *((name, WHOLE) for name in ("b", "n", "q", "size", "hardens", "falls", "high", "wide")),
        *((name, REAL) for name in (
            "symbol", "deepest", "pitch", "half", "step", "noise", "least_gain", "full_press",
            "least_press", "steepest", "quiet", "displaced", "loud", "most", "first", "far",
            "grazed", "tie", "damping", "easier", "harder", "settled", "shallower", "deepest_gain",
        )),
        ("least", REAL * UNKNOWNS),
        ("largest", REAL * UNKNOWNS),
        ("limits", REAL * GAIN),
        ("precision", REAL * UNKNOWNS),
        ("usual_scale", REAL),
        *((name, POINTER) for name in (
            "points", "forces", "trust", "plane", "loaded", "drop", "rimmed",
        )),
    ]  # fmt: skip

    @classmethod
    def of_image(
        cls, arrays: Mapping[str, tuple[NDArray[Any] | None, type]], **given: Any
    ) -> TouchData:
        """Return the data of an image: its arrays with their kinds, and its own numbers."""
        held: dict[str, NDArray[Any]] = {
            name: np.ascontiguousarray(array, kind)
            for name, (array, kind) in arrays.items()
            if array is not None
        }
        data = cls(
            least_gain=LEAST_GAIN, full_press=FULL_PRESS, least_press=LEAST_PRESS,
            steepest=STEEPEST, quiet=QUIET, displaced=DISPLACED_MM, loud=LOUD, most=MOST_NATS,
            first=FIRST_NOISE, far=FAR, grazed=GRAZED, tie=TIE_NATS, damping=DAMPING,
            easier=EASIER, harder=HARDER, settled=SETTLED, shallower=SHALLOWER,
            deepest_gain=DEEPEST_GAIN, least=LEAST_DIAGONAL, largest=LARGEST_STEP, **given,
            **dict(zip(held, addresses(*held.values()), strict=True)),
        )  # fmt: skip
        data.held = tuple(held.values())
        return data

    def of_lattices(
        self,
        count: int,
        labels: NDArray[np.int8] | None = None,
        precision: NDArray[np.float64] | None = None,
    ) -> TouchData:
        """Return the data of so many lattices, with tables (b, high, wide) of their labels."""
        data = TouchData.from_buffer_copy(self)
        data.held = self.held
        data.b = count
        if labels is not None:
            data.high, data.wide = labels.shape[1:]
        if precision is not None:
            data.precision[:] = precision.tolist()
        return data


class Steps(ctypes.Structure):
    """`Steps` of posterior.c."""

    _fields_ = [
        *((name, WHOLE) for name in ("rows", "columns", "steps", "rounds")),
        *((name, REAL) for name in ("freedom", "touches", "unseen")),
        ("usual", REAL * 2),
        *((name, REAL * ALL) for name in ("least", "most", "known")),
        ("aside", POINTER),
    ]


class Held(ctypes.Structure):
    """`Held` of places.c."""

    _fields_ = [
        *((name, WHOLE) for name in ("registered", "rows", "columns", "order")),
        *((name, POINTER) for name in ("keys", "owners", "labels", "dense")),
    ]


_P = POINTER
SIGNATURES = {
    "refine": (None, (_P, WHOLE, WHOLE, *[_P] * 7)),
    "fit_posterior": (ctypes.c_int, [_P] * 9),
    "explained_share": (REAL, (*[_P] * 5, REAL, REAL)),
    "score_cells": (REAL, (_P, WHOLE, REAL, *[_P] * 8)),
    "sum_lattices": (None, (*[WHOLE] * 7, *[_P] * 4)),
    "look_around": (None, (WHOLE, WHOLE, _P, _P)),
    "add_scores": (None, (_P, WHOLE, _P, _P, _P, WHOLE, _P, _P, _P)),
    "name_places": (None, (_P, WHOLE, _P, _P, WHOLE, _P)),
    "count_names": (WHOLE, (WHOLE, _P, _P, _P)),
    "count_places": (WHOLE, (_P, WHOLE, _P, _P, REAL)),
}


@cache
def kernels() -> ctypes.CDLL:
    """Return the compiled loops.

    Raises
    ------
    KernelsError
        They are missing, or older than their source.
    """
    return load_library(FOLDER, SIGNATURES)
