"""Whether a sensor still reads as on the day of its calibration.

Frames at rest show a shift of the bias, a known load shows a change of the gain. What is
beyond the thresholds is said in `Drift.warning`, for the operator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from probe.calibration.apply import calibrate_image
from probe.calibration.average import average_frames
from probe.calibration.condition import tactel_words
from probe.calibration.load import CalibrationLoad
from probe.calibration.settings import DRIFT
from probe.calibration.value import Calibration, Image
from probe.errors import CalibrationError


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """What changed since the calibration."""

    bias_counts: Image  #: (rows, columns) reading at rest now, less then
    gain: float  #: median of measured over known force, less 1; nan without a load
    warning: str  #: empty while the calibration holds


def drift_of(
    calibration: Calibration, rest_counts: ArrayLike, loads: Sequence[CalibrationLoad] = ()
) -> Drift:
    """Compare a sensor with its calibration.

    Parameters
    ----------
    calibration
        Of this sensor.
    rest_counts
        (N, rows, columns) counts, frames with nothing on the sensor, now.
    loads
        Known loads, now.

    Raises
    ------
    CalibrationError
        If the frames are of another shape, or too few.
    """
    rest = average_frames(rest_counts, "rest")
    if rest.mean.shape != calibration.shape:
        raise CalibrationError(
            f"frames of {rest.mean.shape}, the calibration is for {calibration.shape}",
            fix="use the calibration of the sensor that read them",
        )
    shift = rest.mean - calibration.rest_counts
    moved = ~calibration.bad & (
        np.abs(shift) > np.maximum(DRIFT.bias_counts, DRIFT.sigmas * rest.sigma)
    )
    said = []
    if moved.any():
        worst = float(np.abs(shift[moved]).max())
        said.append(f"the bias of {tactel_words(moved)} moved by up to {worst:.3g} counts")
    ratios = [_ratios(calibration, load) for load in loads]
    felt = np.concatenate(ratios) if ratios else np.zeros(0)
    gain = float(np.median(felt)) - 1.0 if felt.size else float("nan")
    if felt.size and abs(gain) > DRIFT.gain:
        said.append(f"the gain changed by {100 * gain:+.0f} %")
    return Drift(shift, gain, "; ".join([*said, "calibrate again"]) if said else "")


def _ratios(calibration: Calibration, load: CalibrationLoad) -> Image:
    """Return measured over known force, of the tactels that tell it well."""
    read = calibrate_image(load.read.mean, calibration)
    well = ~read.bad & (load.forces_n > 0) & (read.values > 5.0 * read.sigma)
    ratios: Image = read.values[well] / load.forces_n[well]
    return ratios
