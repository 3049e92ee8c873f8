"""The closed loop: touches of written parts, simulated, read, and compared with the truth.

::

    campaign  how many touches, of which kinds and levels;  encoded_set  what is touched
    made_kinds  what kinds need beside the set: copies, small objects, other labs
    draw      number -> touch and counts (surfaces, written)
    trial     touch -> answer -> verdict;  rows  a touch as a row
    run       who does which touches (work, workers, cluster), and where they go (shards)
    results   rows -> shares and errors (lines, worlds, bounds, statistics, precision, extremes,
              savings)
    report    results -> page (pictures, precision_pictures, labels, flat_faces)
    compare   two runs;  join  runs of different worlds (world_pictures);  finished  reads them
    repeat    one touch again
    pipeline  all of it in order: `validate`;  result  what it returns;  command  validate-set
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from recognizer.validation.pipeline import validate
    from recognizer.validation.result import ValidationResult

__all__ = ["ValidationResult", "validate"]


def __getattr__(name: str) -> Any:
    if name == "validate":  # numpy and the simulation load when they are asked for
        from recognizer.validation.pipeline import validate

        return validate
    if name == "ValidationResult":
        from recognizer.validation.result import ValidationResult

        return ValidationResult
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
