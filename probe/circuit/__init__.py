"""Force on a tactel -> conductance -> voltage -> ADC counts, and back. Thesis 3.3, 4.2.

fsr          the law of every tactel, with hysteresis and creep
spread       how tactels differ; sensors drawn
network      what a pair of terminals sees of the whole matrix; loaded_column  the
             same of a column under load, while some rows float
electronics  readout, multiplexer, ADC, noise
readout      conductances -> voltages
reading      forces -> counts
floating     resistances between terminals -> conductances
inverse      counts -> conductances, and what is lost
"""

from probe.circuit.electronics import QUIET, Electronics, Noise, Readout
from probe.circuit.fsr import FilmState, Fsr, conductances, fsr_of
from probe.circuit.inverse import ConductanceEstimate, invert_readings
from probe.circuit.network import effective_resistances, transconductances
from probe.circuit.reading import read_counts, read_sequence
from probe.circuit.spread import DATASHEET, MEASURED, Spread, draw_fsr

__all__ = [
    "DATASHEET",
    "MEASURED",
    "QUIET",
    "ConductanceEstimate",
    "Electronics",
    "FilmState",
    "Fsr",
    "Noise",
    "Readout",
    "Spread",
    "conductances",
    "draw_fsr",
    "effective_resistances",
    "fsr_of",
    "invert_readings",
    "read_counts",
    "read_sequence",
    "transconductances",
]
