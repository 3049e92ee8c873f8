"""`recognize-object as-built RECORDING`: how a part came out of the printer, from touches of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from encoded_objects.base.errors import without_password
from encoded_objects.base.options import Application, Argument, Json, Option, command
from recognizer.command.options import Calibration, Database

if TYPE_CHECKING:
    from recognizer.as_built.estimate import MeasuredPrint
    from recognizer.touch.source import TouchImage

HELP = """Say how a part came out of the printer: its scale both ways, skew, and stroke width.

RECORDING holds 25-50 touches all over one part; x and y are the printer's axes, those of the \
part's file. With [bold]--store[/] the database keeps it, and every later pose on the part, and \
on parts of the same printer that nobody has touched so, is corrected by it.
"""

app = Application(named=True)


@command(app, "as-built", help=HELP)
def as_built(
    recording: Annotated[Path, Argument("Touches of one part.", "RECORDING")],
    database: Database = "lab.db",
    store: Annotated[bool, Option("Keep it in the database, for every later pose.")] = False,
    material: Annotated[str, Option("What the part is printed of, as PLA.", "NAME")] = "",
    sensor_type: Annotated[
        str,
        Option("Type of the sensor: a name that probe-sensor types lists, or a file; as the "
               "recording tells, fsr-16 by default.", "NAME|FILE"),
    ] = "",
    overlay: Annotated[
        str,
        Option("Elastic overlay; as the recording tells, tab by default.", choices=("tab", "pad")),
    ] = "",
    calibration: Calibration = None,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Estimate a print; `HELP` is what people see."""
    from encoded_objects.base.output import message, write, write_json
    from recognizer.as_built.estimate import estimate_parts
    from recognizer.as_built.verdict import (
        as_built_entry,
        as_built_numbers,
        as_built_sentences,
        as_built_sizes,
    )

    touched = _touched_prints(recording, database, sensor_type, overlay, calibration)
    prints, too_few = estimate_parts(touched, database, material)
    for words in too_few:
        message(words)
    printer = None
    if store:
        from recognizer.as_built.estimate import keep_prints

        printer = keep_prints(database, [found for found, _ in prints])
    if as_json:
        parts = [as_built_entry(found, verdict) for found, verdict in prints]
        numbers = None if printer is None else as_built_numbers(printer)
        write_json({"object": touched[0].object, "parts": parts, "stored": store,
                    "printer": numbers})  # fmt: skip
        return 0
    for found, verdict in prints:
        write(as_built_sentences(found, verdict))
    if printer is not None:
        name = " ".join(filter(None, (printer.printer or "its printer", printer.material)))
        message(f"kept in {without_password(database)}; parts of {name} that are not known by "
                f"touches of their own: {as_built_sizes(printer)}")  # fmt: skip
    return 0


def _touched_prints(
    recording: Path, database: str, sensor_type: str, overlay: str, calibration: Path | None
) -> tuple[MeasuredPrint, ...]:
    """Return what each touch of a recording says of the print."""
    from encoded_objects.base.output import progress_bar, warning
    from probe.recording.read import Recording
    from recognizer.as_built.touches import WIDE_SCALE, measure_prints
    from recognizer.touch.lab import open_lab
    from recognizer.touch.reader import Reader
    from recognizer.touch.source import source_of

    lab = open_lab(database)
    opened = Recording(recording)
    source = source_of(opened, sensor_type, overlay=overlay, calibration=calibration)
    if source.notice:
        warning(source.notice)
    reader = Reader(lab, source.sensor, WIDE_SCALE)
    with progress_bar("reading", source.frames) as bar:

        def counted() -> Iterator[TouchImage]:
            touches = source.touches(opened.frames(), reader.options)
            for number, touch in enumerate(touches, start=1):
                yield touch
                bar.show(touch.seq + touch.frames, f"{number:,} touches")

        return measure_prints(
            reader, counted(), calibration=source.calibration, place=str(recording)
        )
