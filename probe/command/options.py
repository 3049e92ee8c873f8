"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

URLS = (
    "serial:///dev/ttyACM0?baud=1000000, flexitac:///dev/ttyUSB0, sim:, sim:lab.db#Cube/F1, "
    "file:touch.h5"
)

Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, also for errors.")]
Replace = Annotated[bool, typer.Option("--replace", help="Replace files that are there.")]
Url = Annotated[
    str, typer.Argument(metavar="URL", help=f"A port: {URLS}.", show_default=False)
]  # fmt: skip
Recording = Annotated[Path, typer.Argument(metavar="FILE", help="A recording.", show_default=False)]
Output = Annotated[
    Path, typer.Option("-o", "--output", metavar="FILE", help="The file to write.",
                       show_default=False),
]  # fmt: skip
Calibrated = Annotated[
    Path | None,
    typer.Option("--calibration", metavar="FILE", show_default=False,
                 help="The sensor's calibration: readings in newtons."),
]  # fmt: skip
SelectedSensor = Annotated[
    int | None,
    typer.Option("--sensor", metavar="0...7", min=0, max=7, show_default=False,
                 help="Which of the probe's sensors; the one it has selected by default."),
]  # fmt: skip
Typed = Annotated[
    str,
    typer.Option("--sensor-type", metavar="NAME|FILE", show_default=False,
                 help="Type of the sensor: a name that probe-sensor types lists, or a file; as "
                      "recording or port tell, fsr-16 by default."),
]  # fmt: skip
Bits = Annotated[
    int | None,
    typer.Option(metavar="8|10", show_default=False, help="Width of a reading; 8 is faster."),
]  # fmt: skip
