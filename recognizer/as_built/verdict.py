"""What a person does about a print: nothing, let the reader correct it, or print it again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator.database.as_built import AsBuilt

AS_DESIGNED, CORRECTED, PRINT_AGAIN = "as designed", "corrected", "print again"

ALIKE = 0.001  #: scale - 1 that counts as designed: .03 mm at 30 mm
MOST_SCALE = 0.025  #: beyond it panels no longer meet: 1.5 mm of 60, though they are read
SQUARE_RAD = 0.001  #: skew that counts as square
MOST_SKEW_RAD = 0.015  #: beyond it panels no longer meet: .9 mm over 60
TOGETHER = 0.003  #: largest difference of the two scales that have one cause
STROKE_MM = 0.1  #: excess or lack of width that is not mentioned


@dataclass(frozen=True, slots=True)
class PrintVerdict:
    """The verdict on a print."""

    kind: str  #: AS_DESIGNED, CORRECTED or PRINT_AGAIN
    words: str


def judge_print(found: AsBuilt, stroke_mm: float) -> PrintVerdict:
    """Return the verdict on a print; deviations within one standard deviation do not count.

    `stroke_mm` is as designed.

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
    unsure = np.sqrt(np.diag(found.covariance))
    findings, causes, strokes = [], [], ""
    if max(abs(x) - unsure[0], abs(y) - unsure[1]) > ALIKE:
        if abs(x - y) <= TOGETHER:
            both = (x + y) / 2
            findings.append(f"{_percent(both)} {'small' if both < 0 else 'large'}")
            causes.append("scale in the slicer, shrinkage?")
        else:
            for name, off, least in (("X", x, unsure[0]), ("Y", y, unsure[1])):
                if abs(off) - least > ALIKE:
                    findings.append(f"{name} is {_percent(off)} {'short' if off < 0 else 'long'}")
            causes.append("belts?")
    if abs(found.skew_rad) - unsure[2] > SQUARE_RAD:
        findings.append(f"{abs(math.degrees(found.skew_rad)):.1f} degrees askew")
        causes.append("a frame out of square?")
    wider = found.stroke_mm - stroke_mm
    if abs(wider) - unsure[3] > STROKE_MM:
        which = "wide" if wider > 0 else "narrow"
        strokes = f"strokes {abs(wider):.1f} mm too {which}: flow, first layer?"
    kind, words = AS_DESIGNED, "as designed"
    if findings:
        kind, words = CORRECTED, f"{', '.join(findings)}, within what the reader corrects"
        if max(abs(x), abs(y)) > MOST_SCALE or abs(found.skew_rad) > MOST_SKEW_RAD:
            kind, words = PRINT_AGAIN, f"print again, {', '.join(findings)}: {' '.join(causes)}"
    return PrintVerdict(kind, "; ".join(filter(None, (words, strokes))))


def as_built_numbers(found: AsBuilt) -> dict[str, Any]:
    """Return the numbers of a print for JSON."""
    names = ("scale_x", "scale_y", "skew_deg", "stroke_mm")
    spread = np.sqrt(np.diag(found.covariance)).tolist()
    return {
        "printer": found.printer,
        "material": found.material,
        "touches": found.touches,
        "scale_x": found.scale_x,
        "scale_y": found.scale_y,
        "skew_deg": math.degrees(found.skew_rad),
        "stroke_mm": found.stroke_mm,
        "deviation": dict(
            zip(names, (*spread[:2], math.degrees(spread[2]), spread[3]), strict=True)
        ),
        "covariance": found.covariance,
    }


def as_built_entry(found: AsBuilt, verdict: PrintVerdict) -> dict[str, Any]:
    """Return a part with its verdict for JSON."""
    named = {"part": found.part, "verdict": verdict.kind, "words": verdict.words}
    return named | as_built_numbers(found)


def as_built_sentences(found: AsBuilt, verdict: PrintVerdict) -> str:
    """Return a part with its verdict in two lines."""
    return f"{found.part}: {verdict.words}\n  {as_built_sizes(found)}; {found.touches} touches"


def as_built_sizes(found: AsBuilt) -> str:
    """Return scales, skew and stroke with their standard deviations in a line."""
    numbers = as_built_numbers(found)
    by = numbers["deviation"]
    return (
        f"scale X {found.scale_x:.4f} +- {by['scale_x']:.4f}, "
        f"Y {found.scale_y:.4f} +- {by['scale_y']:.4f}, "
        f"skew {numbers['skew_deg']:.2f} +- {by['skew_deg']:.2f} degrees, "
        f"strokes {found.stroke_mm:.2f} +- {by['stroke_mm']:.2f} mm"
    )


def _percent(share: float) -> str:
    return f"{100 * abs(share):.1f} %"
