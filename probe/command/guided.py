"""`probe-sensor calibrate port`: the guide at a terminal. Every load is recorded, then all fitted.

The recordings and their table stay, so that the fit can be repeated, or loads added, by
`probe-sensor calibrate loads DIR/loads.csv`.
"""

from __future__ import annotations

import math
import sys
import time
from contextlib import suppress
from typing import Final

from encoded_objects.base.files import refuse_taken
from encoded_objects.base.output import message
from encoded_objects.base.sensor_type import choose_sensor_type
from probe.calibration.guide import CalibrationGuide
from probe.client.client import Client, name_of
from probe.command.calibrated import LoadRecording, board_from, calibrate_loads, write_list
from probe.command.options import GuideOptions
from probe.errors import CalibrationError, PortError
from probe.port.url import typed_port
from probe.recording.record import Recorder

LIST: Final = "loads.csv"
_SILENT_S: Final = 5.0  #: without a frame for so long, a load is not read any further


def guide_loads(options: GuideOptions) -> int:
    """Lead through a calibration; returns the exit code.

    Raises PortError: the probe is not there, or goes away; CalibrationError: the loads do not
    determine the laws, and no more are given.
    """
    output, folder = options.output, options.folder or options.output.with_suffix("")
    board_from(options.board)  # refuses a wrong one before anything is read
    refuse_taken(output, ".json", replace=options.replace)
    folder.mkdir(parents=True, exist_ok=True)
    refuse_taken(folder / LIST, ".csv", replace=options.replace)
    port, kind = typed_port(options.url, options.sensor_type)
    guide = CalibrationGuide(options.forces_n, options.seconds)
    with Client(port, sensor=options.sensor) as client:
        sensor = name_of(client.wait_for_ident(), options.url)
        message(f"{sensor or options.url}; recordings go to {folder}")
        given: list[LoadRecording] = []
        while True:
            while not guide.done:
                path = folder / f"load-{guide.step}-{guide.newtons:g}N.h5"
                given.append(LoadRecording(path, guide.newtons))
                _lead_through_step(guide, client, options.url)
                kind = choose_sensor_type(kind, "", guide.taken[-1].shape[1:], options.url)
                with Recorder(path, sensor=sensor, sensor_type=kind, replace=True) as recorder:
                    for frame in guide.frames:
                        recorder.append(frame)
            write_list(folder / LIST, given)
            try:
                return calibrate_loads(given, options, sensor)
            except CalibrationError as error:
                message(f"not yet: {error.cause}\n  {error.fix}")
                more_n = _another_load()
                if more_n is None:
                    raise
                guide.forces_n.append(more_n)


def _lead_through_step(guide: CalibrationGuide, client: Client, url: str) -> None:
    """Have one load put on, read it, and describe it; again if the operator wants."""
    force, number = guide.newtons, f"{guide.step + 1}/{guide.steps}"
    what = f"put {force:g} N on the whole sensor, evenly" if force else "unload the sensor"
    while True:
        _ask(f"{number}  {what}, then press Enter: ")
        while client.take(0.0):
            pass  # what came while the load was put on
        guide.read()
        heard_s = time.monotonic()
        while guide.reading:
            frames = client.take(0.1)
            guide.take(frames)
            now_s = time.monotonic()
            heard_s = now_s if frames else heard_s
            for notice in client.notices():
                message(f"     {notice}")
            if guide.reading and (client.ended or now_s - heard_s > _SILENT_S):
                if not guide.frames:
                    raise PortError("no frame came", fix="see probe-sensor info", place=url)
                guide.end_step()
        message(f"     {guide.described[-1]}")
        if _ask("     Enter goes on, r reads it again: ") != "r":
            return
        guide.again()


def _ask(prompt: str) -> str:
    """Return a line of the operator's; CalibrationError when there is nobody to answer."""
    sys.stderr.write(prompt)
    sys.stderr.flush()
    line = sys.stdin.readline()
    if not line:
        raise CalibrationError("the input ended before the calibration did",
                               fix="answer every step, or use `calibrate loads`")  # fmt: skip
    return line.strip()


def _another_load() -> float | None:
    """Return the force of a load that the operator will add; None to give up."""
    while text := _ask("another load: its newtons, or Enter to give up: "):
        with suppress(ValueError):
            if 0 < float(text) < math.inf:
                return float(text)
        message(f"{text!r} is no force above 0")
    return None
