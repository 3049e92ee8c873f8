"""`recognize-object check`: how the sensor is mounted, from a touch placed by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated

from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Application, Argument, Json, Option, command
from recognizer.command.options import Database

if TYPE_CHECKING:
    from recognizer.touch.lab import Lab
    from recognizer.touch.reader import Reader
    from recognizer.touch.source import TouchImage, TouchSource

HELP = """Say how the sensor is mounted: as drawn, turned by quarters, mirrored.

No touch by itself tells a quarter turn, so one is placed by hand: on the face that --at names, \
near its middle, the sensor's x axis (from column 0 to the last one) along the face's first edge. \
RECORDING holds such touches; with --port the next touch is taken.
"""
EPILOG = "Exit codes: 0 as drawn, 1 otherwise or not recognised, 2 bad input, 3 device, 4 database."

SHOWN = 12  #: names of objects or faces in a message

app = Application(named=True)


@command(app, "check", help=HELP, epilog=EPILOG)
def check(
    at: Annotated[str, Option("Face that is touched, as Cube/F1.", "OBJECT/FACE")],
    recording: Annotated[
        Path | None, Argument("Touches placed so; or give --port.", "RECORDING")
    ] = None,
    port: Annotated[str, Option("Read a port.", "URL")] = "",
    database: Database = "lab.db",
    sensor_type: Annotated[
        str, Option("Type of the sensor; as the recording tells, fsr-16 by default.", "NAME|FILE")
    ] = "",
    every: Annotated[bool, Option("Every frame is a touch.")] = False,
    state: Annotated[
        Path | None,
        Option(
            "Keep the verdict in FILE, with what was learned of the sensor: recognize-object "
            "--sensor-state FILE then reads images as the sensor is mounted.",
            "FILE",
            names=("--sensor-state",),
        ),
    ] = None,
    as_json: Json = False,
) -> int:
    """Check the mounting; `HELP` is what people see."""
    if (recording is None) == (not port):
        raise UsageError("give a recording or --port URL")
    object_name, slash, face = at.rpartition("/")
    if not slash or not object_name or not face:
        raise UsageError(f"--at {at}: give object and face, as Cube/F1")
    from recognizer.touch.lab import open_lab
    from recognizer.touch.reader import Reader

    lab = open_lab(database)
    _require_face(lab, object_name, face)
    source, touches = _placed_touches(recording, port, sensor_type, at, every)
    reader = Reader(lab, source.sensor)
    agreed = _report(reader, source, touches, (object_name, face), as_json)
    if state is not None and agreed is not None:
        _keep(state, reader, source, agreed)
    return 0 if agreed == () else 1


def _require_face(lab: Lab, object_name: str, face: str) -> None:
    """Refuse an object or a face that no touch can show."""
    from encoded_objects.base.output import some_of
    from recognizer.errors import LabError

    faces = [each.face(number).face for each in lab.arrays for number in each.faces_of(object_name)]
    if not faces:
        known = {each.names[one] for each in lab.arrays for one in each.faces[:, 0].tolist()}
        raise LabError(
            f"no object with symbols is called '{object_name}'",
            fix=f"objects: {some_of(sorted(known), SHOWN)}",
            place=lab.url,
        )
    if face not in faces:
        raise LabError(
            f"no face with symbols of {object_name} is called '{face}'",
            fix=f"faces: {some_of(faces, SHOWN)}",
            place=lab.url,
        )


def _keep(path: Path, reader: Reader, source: TouchSource, changes: tuple[str, ...]) -> None:
    """Keep how the sensor is mounted, with what was learned of it if that is there."""
    from encoded_objects.base.output import message
    from recognizer.command.learning import learning_for
    from recognizer.sensor.file import write_state
    from recognizer.touch.sensor_state import unknown_state

    known = learning_for(reader, source, path, None).reader.state
    if known is None:
        known = unknown_state(source.sensor, name=source.name)
    write_state(replace(known, mounting=changes), path)
    message(f"kept in {path}; read with --sensor-state {path}, or go on learning with --learn")


def _placed_touches(
    recording: Path | None, port: str, sensor_type: str, at: str, every: bool
) -> tuple[TouchSource, list[TouchImage]]:
    """Return the touches of a recording, or the next one at a port."""
    from encoded_objects.base.output import message
    from probe.recording.read import Recording
    from recognizer.command.port import listen, source_at
    from recognizer.touch.source import source_of

    if recording is not None:
        opened = Recording(recording)
        source = source_of(opened, sensor_type or None, every=every)
        return source, list(source.touches(opened.frames()))
    source = source_at(port, sensor_type=sensor_type, overlay="", calibration=None, every=every)
    message(f"touch {at} near its middle, the sensor's columns along the face's first edge")
    with listen(source, Event(), None, None) as frames:
        for touch in source.touches(frames):
            return source, [touch]
    return source, []


def _report(
    reader: Reader, source: TouchSource, touches: list[TouchImage], face: tuple[str, str],
    as_json: bool,
) -> tuple[str, ...] | None:  # fmt: skip
    """Say how the sensor is mounted; returns the changes that undo it, None if it is not known."""
    from encoded_objects.base.output import write, write_json
    from recognizer.sensor.wiring import WORDS, FoundMounting, find_mounting

    found = [
        find_mounting(reader, touch.counts, face, calibration=source.calibration)
        for touch in touches
    ]
    known = [one for one in found if isinstance(one, FoundMounting)]
    ways = {one.wiring.changes for one in known}
    agreed = next(iter(ways)) if len(ways) == 1 else None
    if as_json:
        write_json({
            "mounting": None if agreed is None else WORDS[agreed],
            "flip": None if agreed is None else list(agreed),
            "touches": len(found), "agree": len(known) if agreed is not None else 0,
        })  # fmt: skip
    elif not found:
        write("no touch")
    else:
        for one in found:
            write(str(one) if isinstance(one, FoundMounting) else f"not told: {one}")
        if len(ways) > 1:
            write("the touches disagree: place each as --at says, within 40 degrees")
    return agreed
