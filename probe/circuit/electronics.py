"""What stands between the matrix and the counts: readout, multiplexer, ADC, noise.

Thesis 4.2 and figure 4.5. Readouts:

    floating   the row driven, the column loaded to ground, all others open (figure 4.5)
    grounded   the row driven, all other rows to ground, every column loaded to ground
    virtual    as before, but the columns held at 0 V by transimpedance amplifiers

The defaults are at least as bad as the public 16x16 sensor: idle noise 0.24-0.30 LSB, an
active tactel 6-9 LSB at best and 14-22 in the median, 451 spikes over 50 LSB in 10^6
samples, 0.86 LSB from the tactel scanned before, a column coupling of -1e-3. LSB are those
of 10 bits over the reference, whatever the ADC's bits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Literal

from probe.errors import CircuitError

Readout = Literal["floating", "grounded", "virtual"]


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of a sample, in LSB of 10 bits."""

    idle_lsb: float = 0.30  #: white, of every sample
    contact_lsb: float = 1.6  #: variance over signal: of a contact made of many small ones
    contact_s: float = 0.05  #: s, correlation time of the contact's noise
    spike_rate: float = 1e-3  #: share of the samples that a spike hits, up or down
    spike_lsb: float = 50.0  #: least height of a spike; mean height is twice that


QUIET = Noise(0.0, 0.0, 0.05, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Electronics:
    """One board. Resistances in ohm, voltages in V, times in s."""

    readout: Readout = "grounded"
    bits: int = 10
    supply_v: float = 5.0  #: on the driven row
    reference_v: float = 2.5  #: full scale of the ADC
    load_ohm: float = 2200.0  #: column to ground (floating, grounded)
    feedback_ohm: float = 2200.0  #: of the amplifiers (virtual)
    row_ohm: float = 0.0  #: on-resistance of a row's switch
    column_ohm: float = 0.0  #: on-resistance of a column's (floating, virtual)
    settling_s: float = 35e-6  #: from switching to sampling
    tau_s: float = 5e-6  #: time constant of what the ADC sees
    coupling: float = -1e-3  #: share of every other tactel of the column in a reading
    bias_lsb: float = 4.0  #: reading at 0 V, LSB of 10 bits
    frame_s: float = 1 / 220  #: from frame to frame
    noise: Noise = field(default_factory=Noise)

    def __post_init__(self) -> None:
        if self.readout not in ("floating", "grounded", "virtual"):
            raise CircuitError(
                f"readout {self.readout!r}", fix="give floating, grounded or virtual"
            )
        if not (isinstance(self.bits, int) and 1 <= self.bits <= 16):
            raise CircuitError(f"an ADC of {self.bits} bits", fix="give 1 to 16, say 8 or 10")
        for name in ("supply_v", "reference_v", "load_ohm", "feedback_ohm", "tau_s", "frame_s"):
            _check(name, getattr(self, name), "above 0", above=True)
        for name in ("row_ohm", "column_ohm", "settling_s", "bias_lsb"):
            _check(name, getattr(self, name), "0 or more")
        for item in fields(Noise):
            _check(f"noise.{item.name}", getattr(self.noise, item.name), "0 or more")
        if not -0.05 <= self.coupling <= 0.05:
            raise CircuitError(
                f"a column coupling of {self.coupling:g}", fix="give -0.05 ... 0.05, say -1e-3"
            )

    @property
    def full(self) -> int:
        """Highest count."""
        return (1 << self.bits) - 1

    @property
    def lsb(self) -> float:
        """Counts in one LSB of 10 bits."""
        return self.full / 1023

    @property
    def volts_ratio(self) -> float:
        """Supply over reference: the reading, as a share of full scale, of the full supply."""
        return self.supply_v / self.reference_v

    @property
    def residue(self) -> float:
        """Share of the tactel scanned before that is left when the ADC samples."""
        return math.exp(-self.settling_s / self.tau_s)


def _check(name: str, value: float, wanted: str, *, above: bool = False) -> None:
    if not math.isfinite(value) or value < 0 or (above and value == 0):
        raise CircuitError(f"{name} is {value:g}", fix=f"give {wanted}")
