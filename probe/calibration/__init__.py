"""Counts -> newtons: bias, condition and force law of every tactel. Thesis 4.2, appendix 4.

load       frames of known loads -> means, noise
condition  dead, stuck, hidden, preloaded; whether the loads suffice
fit        rest and loads -> the force law of every tactel
file       the calibration, and its file: JSON with a hash
apply      counts -> newtons, and back; drift
guide      which load to put on next, and when it was read enough
"""

from probe.calibration.apply import (
    CalibratedImage,
    Drift,
    calibrate_image,
    drift_of,
    expected_counts,
)
from probe.calibration.file import (
    Calibration,
    Condition,
    calibration_hash,
    read_calibration,
    write_calibration,
)
from probe.calibration.fit import calibration_from
from probe.calibration.load import CalibrationLoad, even_load, known_load

__all__ = [
    "CalibratedImage",
    "Calibration",
    "CalibrationLoad",
    "Condition",
    "Drift",
    "calibrate_image",
    "calibration_from",
    "calibration_hash",
    "drift_of",
    "even_load",
    "expected_counts",
    "known_load",
    "read_calibration",
    "write_calibration",
]
