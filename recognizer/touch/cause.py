"""Why a touch is not answered: a code for programs, the numbers behind it, words for people.

`Recognition.reason` says which test an answer failed; its cause says what of the touch made it
fail, and what a person does about it. Lengths in mm, angles in degrees, shares 0 ... 1; readings
in newtons where the sensor is calibrated, otherwise in counts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

NO_LOAD = "no_contact"
SOFT = "soft"
TILTED = "tilted"
MOVING = "moving"
EDGE = "edge"
ONE_ROW = "one_row"
DEAD_TACTELS = "dead_tactels"
EXCHANGED = "halves_exchanged"
NOT_REGISTERED = "not_registered"
OTHER_PATTERN = "other_pattern"
PLAIN = "not_encoded"
UNCLEAR = "unclear"

Numbers = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Cause:
    """What made a touch fail.

    Examples
    --------
    >>> print(Cause(EDGE, {"loaded": 0.531, "symbols": 4.0}))
    at an edge: 53 % of the sensor is loaded, 4 symbols are read
    >>> Cause(EDGE, {"loaded": 0.531, "symbols": 4.0}).way_out
    'move towards the loaded part'
    """

    code: str  #: one of this module's
    evidence: Numbers  #: the numbers behind it, exact

    def __str__(self) -> str:
        return _WORDS[self.code](self.evidence)

    @property
    def way_out(self) -> str:
        """What a person does about it."""
        return _WAYS_OUT[self.code]


def _percent(share: float) -> str:
    return f"{100 * max(share, 0.0):.0f} %"


def _symbols_read(count: float) -> str:
    return "1 symbol is read" if round(count) == 1 else f"{count:.0f} symbols are read"


def _soft(n: Numbers) -> str:
    reach = f"{n['plateau']:.2g} N" if n["newtons"] else f"{n['plateau']:.0f} counts"
    return (
        f"pressed too softly: readings reach {reach}, {n['signal_to_noise']:.0f} times their noise"
    )


def _edge(n: Numbers) -> str:
    return (
        f"at an edge: {_percent(n['loaded'])} of the sensor is loaded, "
        f"{_symbols_read(n['symbols'])}"
    )


def _moving(n: Numbers) -> str:
    return (
        f"the sensor moved while it was read: along {n['direction_deg']:.0f} degrees contours "
        f"are {_percent(n['sharpness'])} as sharp as across"
    )


def _dead(n: Numbers) -> str:
    return f"dead tactels: {_percent(n['silent'])} of those that symbols should press read nothing"


def _not_registered(n: Numbers) -> str:
    return (
        f"{_symbols_read(n['symbols_anywhere'])} and explain "
        f"{_percent(n['explained_anywhere'])} of the image, but stand so nowhere in this database"
    )


def _other_pattern(n: Numbers) -> str:
    return (
        "raised, but not by symbols of this database: they explain "
        f"{_percent(n['explained_anywhere'])} of the image"
    )


_WORDS: dict[str, Callable[[Numbers], str]] = {
    NO_LOAD: lambda _: "no contact",
    SOFT: _soft,
    TILTED: lambda n: f"tilted: the load falls by {_percent(n['slope'])} across the sensor",
    MOVING: _moving,
    EDGE: _edge,
    ONE_ROW: lambda n: f"one row of symbols: what is loaded is {n['width_mm']:.0f} mm wide",
    DEAD_TACTELS: _dead,
    EXCHANGED: lambda n: (
        "all of the touch lies on one face if the halves of the sensor's "
        f"{'columns' if n['columns'] else 'rows'} are exchanged"
    ),
    NOT_REGISTERED: _not_registered,
    OTHER_PATTERN: _other_pattern,
    PLAIN: lambda n: (
        f"not an encoded surface: no strokes are felt, readings vary by {_percent(n['variation'])}"
    ),
    UNCLEAR: lambda n: (
        f"symbols are read poorly: {n['symbols']:.0f} of them, which explain "
        f"{_percent(n['explained'])} of the image"
    ),
}

_WAYS_OUT = {
    NO_LOAD: "press the probe onto the object",
    SOFT: "press harder",
    TILTED: "hold the probe flat on the face",
    MOVING: "hold the probe still",
    EDGE: "move towards the loaded part",
    ONE_ROW: "one row tells no place: touch another face, or several places as one (--scan)",
    DEAD_TACTELS: "learn the sensor: recognize-object --learn FILE, from 25 touches or more",
    EXCHANGED: "is the sensor wired as drawn? recognize-object check tells",
    NOT_REGISTERED: "is the object in this database, or of another lab?",
    OTHER_PATTERN: "another profile, another overlay (--overlay), or an object of no lab?",
    PLAIN: "is the object in this database?",
    UNCLEAR: "touch again more evenly, a few mm beside",
}
