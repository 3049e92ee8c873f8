"""Counts -> newtons: bias, condition and force law of every tactel. Thesis 4.2, appendix 4.

average    frames of one load -> means, noise
load       known loads
condition  dead, stuck, hidden, preloaded; whether the loads suffice
law        the force law and its least squares
fit        rest and loads -> calibration
value      the calibration
file       JSON with a hash
apply      counts -> newtons, and back
drift      whether a calibration still holds
"""

from probe.calibration.apply import CalibratedImage, calibrate_image, expected_counts
from probe.calibration.condition import ConditionThresholds
from probe.calibration.drift import Drift, drift_of
from probe.calibration.file import calibration_hash, read_calibration, write_calibration
from probe.calibration.fit import calibration_from
from probe.calibration.load import CalibrationLoad, even_load, known_load
from probe.calibration.value import Calibration, Condition

__all__ = [
    "CalibratedImage",
    "Calibration",
    "CalibrationLoad",
    "Condition",
    "ConditionThresholds",
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
