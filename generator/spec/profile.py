"""What a spec takes where it says nothing: symbols, walls and printer, by profile.

Array, alphabet and pitch of a profile stand in `generator.array.profiles`; here is what
embossing adds to them. Thesis 5.2, 5.5, 6.2.
"""

from __future__ import annotations

from dataclasses import dataclass

from generator.array.profiles import PROFILES

DEFAULT_PROFILE = "one-touch"
AUTO = "auto"  # the smallest array that the objects fit, chosen when they are made
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
    printer: str = "fdm-0.4"


_OF_ORDER = {
    2: SymbolDefaults("thesis-2", 12.0),
    4: SymbolDefaults("dense-4", 7.0),
    8: SymbolDefaults("dense-8", 8.0),
}


def defaults_of_profile(name: str) -> SymbolDefaults:
    """Return what a profile gives; the strokes of `fine` need a finer printer."""
    profile = PROFILES[name]
    printer = "resin" if name == "fine" else "fdm-0.4"
    return SymbolDefaults(profile.alphabet, profile.pitch_mm, printer)


def defaults_of_order(order: int) -> SymbolDefaults:
    """Return what an explicit array of `order` symbols takes: the smallest alphabet for it."""
    return _OF_ORDER[next((enough for enough in _OF_ORDER if enough >= order), max(_OF_ORDER))]
