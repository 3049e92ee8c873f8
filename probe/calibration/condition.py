"""Which tactels are dead, stuck or preloaded: statistics of rest and loads.

A tactel is *preloaded* if it reads well above the common bias at rest, *stuck* if it does and
no load changes it, *dead* if it feels no load that a sound one feels, *hidden* if a stuck one
that is shorted takes its column's range, so that no load can tell its law. A tactel that no
load pressed hard enough cannot be judged, and is an error that names it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.calibration.file import Condition
from probe.calibration.load import Average
from probe.errors import CalibrationError

Array = NDArray[np.float64]
SHOWN = 6  # tactels that a message lists


LOADED_N = 0.2  # from here every sound tactel responds
SIGMAS = 5.0  # a change is one from so many standard deviations
CLEAR = 3.0  #: a conductance counts as read from so many standard deviations
WEAK = 0.02  # dead below this share of the median response to the same load
RAISED_COUNTS = 5.0  # above the common bias: preloaded or stuck
STILL = 0.1  # stuck if no load changes its conductance by this share
LEVELS = 3  #: loads of different force that a law needs
RATIO = 3.0  #: of the largest of them to the smallest
LAW = 0.02  #: share of a conductance by which loads may miss the law (1 sigma)
REPEAT = 0.05  #: share of a force that hysteresis and creep leave open (1 sigma)


def common_bias(rest: Average) -> float:
    """Return the median reading at rest, counts."""
    return float(np.median(rest.mean))


def raised_tactels(rest: Average, full: int) -> NDArray[np.bool_]:
    """Tell which tactels read more than the common bias at rest."""
    least = np.maximum(RAISED_COUNTS, SIGMAS * rest.sigma)
    high: NDArray[np.bool_] = (rest.mean - common_bias(rest) > least) | (rest.highest >= full)
    return high


def judge_tactels(
    force_n: Array,
    read_s: Array,
    sigma_s: Array,
    high: NDArray[np.bool_],
    saturated: NDArray[np.bool_],
) -> NDArray[np.uint8]:
    """Return the condition (rows, columns) of every tactel.

    The other arrays are (L + 1, rows, columns), the first at rest, conductances nan where
    contradictory; `high` is that of `raised_tactels`. Raises CalibrationError: tactels were not
    loaded enough to be judged, or none responds.
    """
    unloaded = force_n.max(axis=0) < LOADED_N
    if unloaded.any():
        raise CalibrationError(
            f"{tactel_words(unloaded)} carried less than {LOADED_N:g} N in every load, so that "
            "nothing tells a dead one from one that was not pressed",
            fix=f"add a load of {LOADED_N:g} N or more on each of them",
        )
    rise = read_s[1:] - read_s[0]
    doubt = np.hypot(sigma_s[1:], sigma_s[0])
    clear = (rise > SIGMAS * doubt) | saturated[1:]
    pressed = force_n[1:] >= LOADED_N
    moved = np.where(clear & pressed & ~saturated[1:], rise, np.nan)
    with np.errstate(invalid="ignore"):
        usual = np.array([np.median(m[np.isfinite(m)]) if np.isfinite(m).any() else 0.0
                          for m in moved])  # fmt: skip
        feels = pressed & clear & ((rise > WEAK * usual[:, None, None]) | saturated[1:])
        change = np.abs(rise) > STILL * np.abs(read_s[0])
    still = high & (saturated[0] | ~(change & clear & ~saturated[1:]).any(axis=0))
    dead = ~high & ~feels.any(axis=0)
    if (dead | still).all():
        raise CalibrationError(
            "no tactel responds to any load",
            fix="see that the sensor is connected and that the loads were on it",
        )
    condition = np.full(high.shape, Condition.SOUND, dtype=np.uint8)
    condition[high] = Condition.PRELOADED
    condition[still] = Condition.STUCK
    condition[dead] = Condition.DEAD
    return condition


@dataclass(frozen=True, slots=True, eq=False)
class ClearLoads:
    """Loads that each tactel read clearly."""

    levels: NDArray[np.int64]  #: (rows, columns) different forces
    lowest_n: Array  #: (rows, columns) inf if none
    highest_n: Array  #: (rows, columns) 0 if none

    @property
    def few(self) -> NDArray[np.bool_]:
        """Where they are too few for a law."""
        return self.levels < LEVELS

    @property
    def near(self) -> NDArray[np.bool_]:
        """Where they lie too near each other."""
        return ~(self.highest_n >= RATIO * self.lowest_n)


def check_loads(force_n: Array, firm: NDArray[np.bool_]) -> ClearLoads:
    """Sum up the loads (L, rows, columns) that are `firm`."""
    ordered = np.sort(np.where(firm, force_n, np.nan), axis=0)  # nan last
    steps = ordered[1:] > 1.05 * ordered[:-1]
    return ClearLoads(
        steps.sum(axis=0) + firm.any(axis=0),
        np.where(firm, force_n, np.inf).min(axis=0),
        np.where(firm, force_n, 0.0).max(axis=0),
    )


def demand_loads(
    known: ClearLoads, force_n: Array, saturated: NDArray[np.bool_], live: NDArray[np.bool_]
) -> None:
    """Refuse loads (CalibrationError) that leave the law of a live tactel open.

    The message names the tactels, their loads, and the load that is missing.
    """
    levels, lowest, highest = known.levels, known.lowest_n, known.highest_n
    full = live & saturated.any(axis=0) & (known.few | known.near)
    if full.any():
        least = np.where(saturated & (force_n > 0), force_n, np.inf)[:, full].min()
        raise CalibrationError(
            f"{tactel_words(full)} saturated, and too few loads are left",
            fix=f"add {max(1, LEVELS - int(levels[full].min()))} below {least:.3g} N on each of "
            "them, or lower the load or feedback resistance of the board",
        )
    few = live & known.few
    if few.any():
        most = int(levels[few].min())
        raise CalibrationError(
            f"{tactel_words(few)} felt {most} different load{'s' * (most != 1)} clearly, "
            f"a law needs {LEVELS}",
            fix=f"add {LEVELS - most} on them, {LOADED_N:g} N or more, over a ratio of "
            f"{RATIO:g}, or record more frames of each",
        )
    near = live & known.near
    if near.any():
        low, high = lowest[near].min(), highest[near].max()
        raise CalibrationError(
            f"{tactel_words(near)} felt loads of {low:.3g} ... {high:.3g} N only; they do not span "
            f"the law, the largest must be {RATIO:g} times the smallest",
            fix=f"add a load of {RATIO * low:.3g} N or more on each of them",
        )


def tactel_words(tactels: NDArray[np.bool_]) -> str:
    """Return tactels in words: how many, and the first few as (row, column)."""
    places = [f"({r}, {c})" for r, c in np.argwhere(tactels)[:SHOWN]]
    number = int(tactels.sum())
    more = ", ..." if number > SHOWN else ""
    return f"{number} tactel{'' if number == 1 else 's'} [{', '.join(places)}{more}]"
