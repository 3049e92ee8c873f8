"""How bad sensors and prints are: a table of values, a level a line, none known to a reader.

`low`, `typical`, `hard` and `mismatch` are sensors as they are made and prints as they come, in
rising severity; `mismatch` is wrong in everything at once. The others are `TYPICAL` with one
fault more, but for the three that say otherwise: `sound` has none of the small errors,
`places-08` and `bleed-2` have the one that they name and no other.
`docs/validation/README.md` says where each number is from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Level:
    """A sensor and a print: film, tips, board, wiring, wrist. Spreads are standard deviations."""

    name: str
    gain: float = 0.0  #: film: spread of the logarithm of a tactel's gain
    exponent: float = 1.0  #: film: conductance ~ force^exponent
    hysteresis: float = 0.0  #: film: reading on the way back over that on the way up, less 1
    dead: float = 0.0  #: share of the tactels that feel nothing, unknown to the reader
    hot: float = 0.0  #: share of the tactels that show `hot_n`, whatever presses
    hot_n: float = 2.0
    length_mm: float = 0.0  #: tips: spread of their lengths
    shift_mm: float = 0.0  #: tips: spread of their places, each way
    dome_mm: float = 0.0  #: tips: how far the rim lies below the middle
    cross_talk: float = 0.0  #: tactels, width of the bell by which neighbours are pressed along
    load_ohm: float = 22.0  #: board: of the divider; 10 kOhm / N is the film's
    bleed: float = 0.0  #: board: share of the row above and of the row below in a row's reading
    floating: float = 0.0  #: board: share of the rows that nothing holds while another is read
    noise_n: float = 0.0  #: board: of a reading
    mounting: str = "as drawn"  #: wiring, one of `mounting.MOUNTINGS`
    slide_mm: float = 0.0  #: wrist: way that the pressed sensor slides within one reading
    tilt_rad: float | None = None  #: wrist: at most; None: as the campaign draws it
    force_n: tuple[float, float] | None = None  #: wrist: None: as the campaign draws it
    wider_mm: float = 0.0  #: print: strokes
    scale: float = 0.0  #: print: less 1, from the part's datum


SOUND = Level("sound")
LOW = Level("low", gain=0.05, exponent=0.95, length_mm=0.02, shift_mm=0.03, dome_mm=0.05,
            load_ohm=100.0, bleed=0.005, noise_n=0.01)  # fmt: skip
TYPICAL = Level("typical", gain=0.12, exponent=0.88, dead=1 / 256, length_mm=0.05, shift_mm=0.08,
                dome_mm=0.10, load_ohm=220.0, bleed=0.02, noise_n=0.02)  # fmt: skip
HARD = Level("hard", gain=0.15, exponent=0.85, dead=3 / 256, length_mm=0.06, shift_mm=0.10,
             dome_mm=0.15, load_ohm=330.0, bleed=0.03, noise_n=0.03)  # fmt: skip
MISMATCH = Level("mismatch", gain=0.12, exponent=0.80, length_mm=0.08, shift_mm=0.12,
                 dome_mm=0.15, cross_talk=0.45, load_ohm=330.0, bleed=0.03, noise_n=0.03,
                 wider_mm=0.2, scale=0.01)  # fmt: skip

LEVELS = {
    level.name: level
    for level in (
        LOW,
        TYPICAL,
        HARD,
        MISMATCH,
        SOUND,
        replace(SOUND, name="places-08", shift_mm=0.08),
        replace(SOUND, name="bleed-2", bleed=0.02),
        replace(TYPICAL, name="places-25", shift_mm=0.25),
        replace(TYPICAL, name="domed", dome_mm=0.3),
        replace(TYPICAL, name="dead-10", dead=0.10),
        replace(TYPICAL, name="dead-20", dead=0.20),
        replace(TYPICAL, name="dead-40", dead=0.40),
        replace(TYPICAL, name="hot-5", hot=0.05),
        replace(TYPICAL, name="gain-30", gain=0.30),
        replace(TYPICAL, name="hysteresis-15", hysteresis=0.15),
        replace(TYPICAL, name="hysteresis-40", hysteresis=0.40),
        replace(TYPICAL, name="saturated", load_ohm=2200.0),
        replace(TYPICAL, name="floating-10", floating=0.10),
        replace(TYPICAL, name="floating-30", floating=0.30),
        replace(TYPICAL, name="floating", floating=1.0),
        replace(TYPICAL, name="slide-2", slide_mm=2.0),
        replace(TYPICAL, name="slide-6", slide_mm=6.0),
        replace(TYPICAL, name="tilt-5", tilt_rad=math.radians(5)),
        replace(TYPICAL, name="light", force_n=(3.0, 20.0)),
        replace(TYPICAL, name="heavy", force_n=(120.0, 400.0)),
        replace(TYPICAL, name="quarter-turn", mounting="quarter turn"),
        replace(TYPICAL, name="mirrored", mounting="mirrored"),
        replace(TYPICAL, name="transposed", mounting="transposed"),
        replace(TYPICAL, name="halves-swapped", mounting="halves swapped"),
        replace(TYPICAL, name="rolled", mounting="rolled"),
    )
}
