"""What printing a plate takes, as PrusaSlicer says of its 3MF."""

from __future__ import annotations

import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from generator.errors import PrintError
from generator.printed.slicer import TIMEOUT_S, find_slicer

_TIME = re.compile(r"; estimated printing time \(normal mode\) = (.*)")
_GRAMS = re.compile(r"; total filament used \[g\] = ([0-9.]+)")
_MINUTES = {"d": 1440.0, "h": 60.0, "m": 1.0, "s": 1 / 60}


@dataclass(frozen=True, slots=True)
class PlateCost:
    """Time and filament of one plate."""

    minutes: int
    filament_g: float

    def __str__(self) -> str:
        hours, minutes = divmod(self.minutes, 60)
        return f"{hours} h {minutes} min, {self.filament_g:.0f} g"


def slice_plate(file: Path) -> PlateCost:
    """Slice a 3MF that holds its settings, and return what the slicer reckons.

    Parts stay where they lie: arranged anew with its own distances, six panels of 80 mm find no
    room on the bed that they fill.

    Raises
    ------
    PrintError
        PrusaSlicer is missing or refuses.
    """
    with tempfile.TemporaryDirectory() as folder:
        gcode = Path(folder) / "plate.gcode"
        command = [find_slicer(), "--export-gcode", "--dont-arrange", "-o", str(gcode), str(file)]
        done = subprocess.run(  # noqa: S603
            command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
        if done.returncode or not gcode.exists():
            lines = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()]
            raise PrintError(
                f"PrusaSlicer refuses: {lines[-1] if lines else f'exit code {done.returncode}'}",
                fix="open the plate in PrusaSlicer and look",
                place=str(file),
            )
        return read_cost(gcode.read_text(encoding="utf-8", errors="replace"))


def read_cost(gcode: str) -> PlateCost:
    """Return what the comments of G-code say of time and filament."""
    time, grams = _TIME.search(gcode), _GRAMS.search(gcode)
    if time is None or grams is None:
        raise PrintError("the G-code says no time", fix="update PrusaSlicer")
    parts = re.findall(r"([0-9]+)([dhms])", time[1])
    return PlateCost(
        round(sum(int(number) * _MINUTES[unit] for number, unit in parts)), float(grams[1])
    )
