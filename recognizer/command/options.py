"""Options that the commands of reading share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from encoded_objects.base.options import Option

Database = Annotated[str, Option("The lab's database.", "URL")]
Calibration = Annotated[
    Path | None,
    Option("The sensor's calibration; the one that the recording names is found beside it.",
           "FILE"),
]  # fmt: skip
