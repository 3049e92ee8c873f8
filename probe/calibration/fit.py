"""Frames at rest and under known loads -> the calibration of a sensor.

Bias, noise, condition of every tactel, then its law by least squares (`law`). Loads that do
not determine the laws are refused, with the load that is missing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration.average import Average, average_frames
from probe.calibration.condition import (
    ConditionThresholds,
    check_loads,
    common_bias,
    demand_loads,
    judge_tactels,
    raised_tactels,
    tactel_words,
)
from probe.calibration.law import fit_laws
from probe.calibration.load import CalibrationLoad
from probe.calibration.pooled import shrink_laws
from probe.calibration.value import Calibration, Condition, Image
from probe.circuit import Electronics, invert_readings
from probe.errors import CalibrationError

_UPPER = np.triu_indices(3)


def calibration_from(
    rest_counts: ArrayLike,
    loads: Sequence[CalibrationLoad],
    *,
    sensor: str,
    made: str = "",
    board: Electronics | None = None,
    full: int = 1023,
    thresholds: ConditionThresholds | None = None,
) -> Calibration:
    """Calibrate a sensor.

    Parameters
    ----------
    rest_counts
        (N, rows, columns) counts, frames with nothing on the sensor.
    loads
        Known loads; on every tactel 3 or more of different force, over a ratio of 3.
    sensor
        Its name; a file is used only with the sensor that it names.
    made
        When, as text; goes into the file as it is.
    board
        The electronics, whose equations take counts to conductances; None takes counts above
        the bias for conductances, which is right where tactels do not disturb each other.
    full
        Highest count, where no board says it.
    thresholds
        When a tactel is unsound, and what a law needs.

    Raises
    ------
    CalibrationError
        If the loads do not tell, or do not determine, the law of a tactel that is alive.
    """
    t = thresholds or ConditionThresholds()
    rest = average_frames(rest_counts, "rest")
    for load in loads:
        if load.read.mean.shape != rest.mean.shape:
            raise CalibrationError(
                f"load {load.name} has frames of {load.read.mean.shape}, rest of {rest.mean.shape}",
                fix="calibrate one sensor at a time",
            )
    if not loads:
        raise CalibrationError(
            "no loads were given", fix=f"give {t.levels} or more, over a ratio of {t.ratio:g}"
        )
    top = board.full if board else full
    high = raised_tactels(rest, top, t)
    bias = np.where(high, common_bias(rest), rest.mean)
    reads = [rest, *(load.read for load in loads)]
    force = np.stack([np.zeros(rest.mean.shape), *(load.forces_n for load in loads)])
    saturated = np.stack([read.highest >= top for read in reads])
    read, sigma = _conductances(reads, bias, board)
    condition = judge_tactels(force, read, sigma, high, saturated, t)
    error = np.hypot(sigma, t.law * read)
    usable = np.isfinite(read) & np.isfinite(error) & ~saturated
    firm = usable & (read > t.told * error) & (force > 0)
    known = check_loads(force, firm)
    shorted = ((condition == Condition.STUCK) & saturated[0]).any(axis=0)
    able = np.isin(condition, (Condition.SOUND, Condition.PRELOADED))
    condition[able & shorted & (known.few(t) | known.near(t))] = Condition.HIDDEN
    live = able & (condition != Condition.HIDDEN)
    demand_loads(known, force, saturated, live, t)
    usable[0] &= condition == Condition.PRELOADED
    law = fit_laws(
        force[:, live],
        np.where(usable, read, 0.0)[:, live],
        np.where(usable, error, 1.0)[:, live],
        usable[:, live],
        (condition == Condition.PRELOADED)[live],
    )
    law = shrink_laws(law, (condition == Condition.SOUND)[live])
    if not np.isfinite(law.covariance).all():
        unknown = np.zeros_like(live)
        unknown[live] = ~np.isfinite(law.covariance).all(axis=(1, 2))
        raise CalibrationError(
            f"the loads do not determine the law of {tactel_words(unknown)}",
            fix="add lighter and heavier loads on them",
        )

    def spread(values: Image, shape: tuple[int, ...] = ()) -> Image:
        image = np.full((*live.shape, *shape), np.nan)
        image[live] = values
        return image

    return Calibration(
        sensor=sensor,
        made=made,
        board=board,
        full=top,
        loads=tuple(load.name for load in loads),
        condition=condition,
        bias_counts=bias,
        rest_counts=rest.mean,
        noise_counts=rest.noise,
        gain_s=spread(law.gain_s),
        exponent=spread(law.exponent),
        break_n=spread(law.break_n),
        covariance=spread(law.covariance[:, _UPPER[0], _UPPER[1]], (6,)),
        most_n=np.where(live, known.highest_n, np.nan),
        scatter=float(np.sqrt((law.scatter**2).mean())),
        repeat=t.repeat,
    )


def _conductances(
    reads: Sequence[Average], bias: Image, board: Electronics | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (L, rows, columns) conductances and their deviations."""
    mean = np.stack([read.mean for read in reads])
    sigma = np.stack([read.sigma for read in reads])
    if board is None:
        return mean - bias, sigma
    found = invert_readings(mean, board, bias_counts=bias, sigma_counts=sigma)
    return found.conductance_s, found.sigma_s
