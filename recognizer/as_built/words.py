"""How a part was printed, in words and as JSON has it."""

from __future__ import annotations

from math import degrees, sqrt
from typing import Any

from generator.database.as_built import AsBuilt
from recognizer.as_built.verdict import PrintVerdict


def as_built_numbers(found: AsBuilt) -> dict[str, Any]:
    """Return the numbers of a print as JSON has them."""
    spread = [sqrt(float(found.covariance[k, k])) for k in range(4)]
    return {
        "printer": found.printer,
        "material": found.material,
        "touches": found.touches,
        "scale_x": found.scale_x,
        "scale_y": found.scale_y,
        "skew_deg": degrees(found.skew_rad),
        "stroke_mm": found.stroke_mm,
        "deviation": {
            "scale_x": spread[0], "scale_y": spread[1], "skew_deg": degrees(spread[2]),
            "stroke_mm": spread[3],
        },
        "covariance": found.covariance,
    }  # fmt: skip


def as_built_entry(found: AsBuilt, verdict: PrintVerdict) -> dict[str, Any]:
    """Return what is told of a part, as JSON has it."""
    told = {"part": found.part, "verdict": verdict.kind, "words": verdict.words}
    return told | as_built_numbers(found)


def as_built_sentences(found: AsBuilt, verdict: PrintVerdict) -> str:
    """Return what is told of a part, in two lines."""
    return f"{found.part}: {verdict.words}\n  {as_built_sizes(found)}; {found.touches} touches"


def as_built_sizes(found: AsBuilt) -> str:
    """Return scales, skew and stroke with their standard deviations in a line."""
    told = as_built_numbers(found)
    by = told["deviation"]
    return (
        f"scale X {found.scale_x:.4f} +- {by['scale_x']:.4f}, "
        f"Y {found.scale_y:.4f} +- {by['scale_y']:.4f}, "
        f"skew {told['skew_deg']:.2f} +- {by['skew_deg']:.2f} degrees, "
        f"strokes {found.stroke_mm:.2f} +- {by['stroke_mm']:.2f} mm"
    )
