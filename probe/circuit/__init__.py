"""Force on a tactel -> conductance -> voltage -> ADC counts, and back. Thesis 3.3, 4.2.

fsr          the law of every tactel, with hysteresis and creep
network      resistances between terminals of the whole matrix, and back to conductances
electronics  readout, multiplexer, ADC, noise
reading      conductances -> voltages; forces -> counts
inverse      counts -> conductances, and the tactels that are lost
"""

from probe.circuit.electronics import QUIET, Electronics, Noise, Readout
from probe.circuit.fsr import FilmState, Fsr, conductances, fsr_of
from probe.circuit.inverse import ConductanceEstimate, invert_readings
from probe.circuit.network import effective_resistances, transconductances
from probe.circuit.reading import read_counts

__all__ = [
    "QUIET",
    "ConductanceEstimate",
    "Electronics",
    "FilmState",
    "Fsr",
    "Noise",
    "Readout",
    "conductances",
    "effective_resistances",
    "fsr_of",
    "invert_readings",
    "read_counts",
    "transconductances",
]
