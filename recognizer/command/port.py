"""A port -> touches, with the sensor that feels them and its calibration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Event

from encoded_objects.base.output import message
from encoded_objects.base.sensor_type import SensorType
from probe.frame import Frame
from probe.port.url import address_of, typed_port
from probe.recording.read import Recording
from recognizer.touch.source import TouchSource, source_of

SLICE_S = 0.1  #: how long frames are waited for before an interruption is looked for


def source_at(
    url: str, *, sensor_type: str, overlay: str, calibration: Path | None, every: bool
) -> TouchSource:
    """Return the source of touches behind a port.

    Raises PortError, RecordingError, CalibrationError: the URL is none, or its recording or the
    calibration cannot be read.
    """
    address = address_of(url)
    if address.scheme == "file":
        recording = Recording(Path(address.target))
        source = source_of(
            recording, sensor_type, overlay=overlay, calibration=calibration, every=every
        )
        return replace(source, place=url, frames=None)
    from probe.calibration import read_calibration

    place, known = typed_port(url, sensor_type)
    sensor = known or SensorType()
    return TouchSource(
        place=place,
        sensor=sensor.with_overlay(overlay or address.options.get("overlay", "")),
        calibration=None if calibration is None else read_calibration(calibration),
        together=int(every),
        newest=every,
    )


@contextmanager
def listen(
    source: TouchSource, interrupted: Event, number: int | None, calibration: Path | None
) -> Iterator[Iterator[Frame]]:
    """Yield the frames of a port until it ends or `interrupted` is set; closes it afterwards.

    Raises PortError, CalibrationError: the probe is not there, or went away for good; the
    calibration is another sensor's.
    """
    from probe.calibration import read_calibration
    from probe.client.client import Client, name_of

    with Client(source.place, sensor=number) as client:
        if calibration is not None:
            read_calibration(
                calibration, sensor=name_of(client.wait_for_ident(), source.place) or None
            )

        def frames() -> Iterator[Frame]:
            while not (client.ended or interrupted.is_set()):
                waiting = client.take(SLICE_S)
                for notice in client.notices():
                    message(notice)
                yield from waiting[-1:] if source.newest else waiting

        yield frames()
