"""`probe-sensor replay FILE`: a recording as it came, to look at or for another programme."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from encoded_objects.base.console import Action
from probe.command.options import Calibrated, Recording, Typed

if TYPE_CHECKING:
    from probe.frame import Frame


def replay(
    recording: Recording,
    speed: Annotated[
        float, typer.Option(min=0.0, help="1: as it came; 0: as fast as it is read."),
    ] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Again and again, until Ctrl-C.")] = False,
    sensor_type: Typed = "",
    calibration: Calibrated = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON object a frame, each on a line."),
    ] = False,
) -> Action:  # fmt: skip
    """Play a recording: on a terminal as `live`, into a pipe as lines of CSV or JSON."""

    def action() -> int:
        import sys

        from probe.recording.read import Recording

        Recording(recording).sensor_type(sensor_type)  # a wrong file is told as such
        url = f"file:{recording}?speed={speed:g}" + ("&loop=1" if loop else "")
        if sys.stdout.isatty() and not as_json:
            from probe.command.live_loop import watch

            return watch(url, sensor=None, sensor_type=sensor_type, calibration=calibration,
                         folder=Path(), seconds=None, as_json=False)  # fmt: skip
        if calibration is not None:
            raise typer.BadParameter("frames are piped as counts; --calibration is for a terminal")
        return _pipe(url, as_json=as_json)

    return action


def _pipe(url: str, *, as_json: bool) -> int:
    """Write every frame when its time has come."""
    import sys

    from encoded_objects.base.console import INTERRUPTED, interruption
    from probe.client.stream import Stream

    with interruption() as interrupted, Stream(url) as stream:
        first = True
        while not stream.ended and not interrupted.is_set():
            frames = stream.take(0.1)
            if frames and first and not as_json:
                sys.stdout.write(_head(frames[0]))
            first = first and not frames
            sys.stdout.write("".join(_line(frame, as_json=as_json) for frame in frames))
            sys.stdout.flush()
        return INTERRUPTED if interrupted.is_set() else 0


def _head(frame: Frame) -> str:
    from probe.recording.table import table_header

    rows, columns = frame.counts.shape
    return ",".join(table_header((rows, columns))) + "\n"


def _line(frame: Frame, *, as_json: bool) -> str:
    if as_json:
        import json

        values = {
            "seq": frame.seq,
            "t_ns": frame.t_ns,
            "counts": frame.counts.tolist(),
            "wrist": frame.wrist.tolist(),
        }
        return json.dumps(values, separators=(",", ":")) + "\n"
    numbers = [frame.seq, frame.t_ns, *frame.counts.ravel().tolist(), *frame.wrist.tolist()]
    return ",".join(map(str, numbers)) + "\n"
