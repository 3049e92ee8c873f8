"""What a spec takes where it says nothing: symbols, walls and printer, by profile.

Array, alphabet and pitch of a profile stand in `generator.array.profiles`; here is what
embossing adds to them. Thesis 5.2, 5.5, 6.2.
"""

from __future__ import annotations

from dataclasses import dataclass

from generator.array.profiles import PROFILES

AUTO = "auto"  # the default: array and pitch are chosen when the objects are made
SMALLEST = "large"  # of the arrays that `auto` takes: room for some hundred objects
EXPLICIT = "explicit"  # stands for the profile's name where an encoding is written out
HEIGHT_MM = 1.0  # a multiple of common layer heights
DRAFTS_RAD = (0.174532925199, 0.130899693900, 0.087266462600, 0.043633231300)
"""10 degrees, and 7.5, 5, 2.5 where strokes leave no room for the ones before."""
WALL_MM = 3.0
GAP_MM = 0.14  # between assembled panels
FORMATS = ("step", "stl", "3mf")
DATABASE = "sqlite:///lab.db"


@dataclass(frozen=True, slots=True)
class SymbolDefaults:
    """Symbols and printer where a spec does not name them."""

    alphabet: str
    pitch_mm: float
    printer: str
    coarser_mm: tuple[float, ...] = ()  #: pitches for symbols that need more room, rising


PRINTER = "fdm-0.4"
COARSER_MM = (3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 7.0, 8.0, 10.0, 12.0)
"""`auto` takes the pitch that the sensor type proposes, for `fsr-16` the 5 mm that touches are read
best at, on nozzles of 0.4 and 0.6 mm and CAD surfaces alike (docs/pitches.md); and the first of
these beyond it that prints, where a spec or a printer asks for more room."""

_OF_ORDER = {
    2: SymbolDefaults("thesis-2", 12.0, PRINTER),
    4: SymbolDefaults("dense-4", 7.0, PRINTER),
    8: SymbolDefaults("dense-8", 8.0, PRINTER),
}


def defaults_of_profile(name: str) -> SymbolDefaults:
    """Return what a profile that is named gives; `fine` is meant for resin."""
    profile = PROFILES[name]
    printer = "resin" if name == "fine" else PRINTER
    return SymbolDefaults(profile.alphabet, profile.pitch_mm, printer)


def auto_defaults(pitch_mm: float) -> SymbolDefaults:
    """Return what `auto` gives where a sensor type proposes a pitch."""
    coarser = tuple(pitch for pitch in COARSER_MM if pitch > pitch_mm)
    return SymbolDefaults(PROFILES[SMALLEST].alphabet, pitch_mm, PRINTER, coarser)


def defaults_of_order(order: int) -> SymbolDefaults:
    """Return what an explicit array of `order` symbols takes: the smallest alphabet for it."""
    return _OF_ORDER[next((enough for enough in _OF_ORDER if enough >= order), max(_OF_ORDER))]
