"""What a person does about a print: nothing, let the reader correct it, or print it again."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from generator.database.as_built import AsBuilt
from recognizer.as_built.settings import VERDICT, VerdictSettings

AS_DESIGNED, CORRECTED, PRINT_AGAIN = "as designed", "corrected", "print again"


@dataclass(frozen=True, slots=True)
class PrintVerdict:
    """What is said of a print."""

    kind: str  #: AS_DESIGNED, CORRECTED or PRINT_AGAIN
    words: str


def judge_print(
    found: AsBuilt, stroke_mm: float, settings: VerdictSettings = VERDICT
) -> PrintVerdict:
    """Return what is to be done about a print.

    Parameters
    ----------
    stroke_mm
        That was asked for.

    Examples
    --------
    >>> import numpy as np
    >>> kept = {"object_id": 1, "part": "Cube-F1", "printer": "", "material": "",
    ...         "stroke_mm": 1.4, "covariance": np.zeros((4, 4)), "touches": 30}
    >>> judge_print(AsBuilt(scale_x=0.992, scale_y=0.992, skew_rad=0.0, **kept), 1.4).words
    '0.8 % small, within what the reader corrects'
    >>> judge_print(AsBuilt(scale_x=0.97, scale_y=1.0, skew_rad=0.0, **kept), 1.4).words
    'print again, X is 3.0 % short: belts?'
    """
    x, y = found.scale_x - 1, found.scale_y - 1
    unsure = settings.unsure * np.sqrt(np.diag(found.covariance))
    said, causes = [], []
    if max(abs(x) - unsure[0], abs(y) - unsure[1]) > settings.alike:
        if abs(x - y) <= settings.together:
            both = (x + y) / 2
            said.append(f"{_percent(both)} {'small' if both < 0 else 'large'}")
            causes.append("scale in the slicer, shrinkage?")
        else:
            for name, off, least in (("X", x, unsure[0]), ("Y", y, unsure[1])):
                if abs(off) - least > settings.alike:
                    said.append(f"{name} is {_percent(off)} {'short' if off < 0 else 'long'}")
            causes.append("belts?")
    if abs(found.skew_rad) - unsure[2] > settings.square_rad:
        said.append(f"{abs(math.degrees(found.skew_rad)):.1f} degrees askew")
        causes.append("a frame out of square?")
    wider = found.stroke_mm - stroke_mm
    strokes = ""
    if abs(wider) - unsure[3] > settings.stroke_mm:
        which = "wide" if wider > 0 else "narrow"
        strokes = f"strokes {abs(wider):.1f} mm too {which}: flow, first layer?"
    far = max(abs(x), abs(y)) > settings.corrected or abs(found.skew_rad) > settings.askew_rad
    if not said:
        return PrintVerdict(AS_DESIGNED, "; ".join(filter(None, ("as designed", strokes))))
    what = ", ".join(said)
    if far:
        words = f"print again, {what}: {' '.join(causes)}"
        return PrintVerdict(PRINT_AGAIN, "; ".join(filter(None, (words, strokes))))
    words = f"{what}, within what the reader corrects"
    return PrintVerdict(CORRECTED, "; ".join(filter(None, (words, strokes))))


def _percent(share: float) -> str:
    return f"{100 * abs(share):.1f} %"
