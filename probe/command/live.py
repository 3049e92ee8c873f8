"""`probe-sensor live URL`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from encoded_objects.base.console import Action
from probe.command.options import Calibrated, SelectedSensor, Typed, Url

EPILOG = """Keys: q quit, space pause, 0 ... 7 sensor, b bias on and off, m median filter, s save \
the image, r start and stop a recording. Without a terminal: a line a second.
"""


def live(
    url: Url,
    sensor: SelectedSensor = None,
    sensor_type: Typed = "",
    calibration: Calibrated = None,
    folder: Annotated[
        Path, typer.Option(metavar="DIR", help="Where images and recordings are saved."),
    ] = Path(),
    seconds: Annotated[
        float | None, typer.Option(min=0.1, show_default=False, help="End after so long."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON object a second, each on a line."),
    ] = False,
) -> Action:  # fmt: skip
    """Watch a probe: heat map, rate, losses; save images, record."""

    def action() -> int:
        from probe.command.live_loop import watch

        return watch(url, sensor=sensor, sensor_type=sensor_type, calibration=calibration,
                     folder=folder, seconds=seconds, as_json=as_json)  # fmt: skip

    return action
