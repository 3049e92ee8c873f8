"""Numbers that decide in a calibration, one frozen value a stage."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class AverageSettings:
    """Frames -> one image."""

    bias_frames: int = 32  #: averaged for the bias of a live view
    frames: int = 20  #: least number of frames of a load
    spike: float = 8.0  #: robust deviations from the median, beyond it a sample is a spike
    spike_counts: float = 5.0  #: and at least so many counts
    shared: float = 0.98  #: largest correlation of neighbours that is believed


@dataclass(frozen=True, slots=True)
class LawFitSettings:
    """Loads -> law of one tactel."""

    exponents: tuple[float, float] = (0.3, 3.0)  #: least and largest that is believed
    steps: int = 40  #: of Gauss and Newton
    break_forces: int = 24  #: that are tried
    firm: float = 3.0  #: sigmas from which a reading takes part in the start
    tiny_n: float = 1e-9  #: so that logarithms stay finite


@dataclass(frozen=True, slots=True)
class PoolSettings:
    """Spread over the tactels of one sensor."""

    tactels: int = 24  #: least number that tells a spread
    floor: tuple[float, float, float] = (0.02, 0.005, 0.001)
    """Ln gain, exponent, N: no sensor is more even."""
    outlying: float = 4.0  #: robust deviations; what lies farther out is not pooled


@dataclass(frozen=True, slots=True)
class FeltSettings:
    """Counts -> forces."""

    sigmas: float = 3.0  #: of a conductance from which it is a force
    leak_s: float = 1e-9  #: joins the network of a board with floating rows


@dataclass(frozen=True, slots=True)
class DriftSettings:
    """When a calibration is told to be old."""

    bias_counts: float = 2.0  #: shift of the bias that warns, counts
    gain: float = 0.10  #: change of the gain that warns, share of 1
    sigmas: float = 5.0  #: and so many standard deviations of it


AVERAGE = AverageSettings()
LAW_FIT = LawFitSettings()
POOL = PoolSettings()
FELT = FeltSettings()
DRIFT = DriftSettings()
