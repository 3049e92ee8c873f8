"""`probe-sensor record URL -o FILE.h5`."""

from __future__ import annotations

from typing import Annotated

import typer

from encoded_objects.base.console import Action
from probe.command.options import (
    Bits,
    Calibrated,
    Json,
    Output,
    Replace,
    SelectedSensor,
    Typed,
    Url,
)


def record(
    url: Url,
    output: Output,
    seconds: Annotated[
        float | None, typer.Option(min=0.0, help="End after so long; Ctrl-C by default.",
                                   show_default=False),
    ] = None,
    frames: Annotated[
        int | None, typer.Option(min=1, help="End after so many frames.", show_default=False),
    ] = None,
    sensor: SelectedSensor = None,
    bits: Bits = None,
    sensor_type: Typed = "",
    calibration: Calibrated = None,
    replace: Replace = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Record a probe until Ctrl-C, or as long as asked; the file is complete however it ends."""

    def action() -> int:
        from probe.command.recorded import RecordingLimits, record_port

        limits = RecordingLimits(seconds, frames)
        return record_port(
            url, output, limits, sensor=sensor, bits=bits, sensor_type=sensor_type,
            calibration=calibration, replace=replace, as_json=as_json,
        )  # fmt: skip

    return action
