"""`probe-kit TYPE -o DIR`: parts, parts list, wiring and sheet of a probe.

Exit codes: 0 done, 1 could not be written, 2 bad input. Nothing heavy is imported before it is
needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

from encoded_objects.base import console, output
from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Application, Argument, Json, Option, command
from encoded_objects.base.output import progress_bar

if TYPE_CHECKING:
    from probe.kit.make import Kit

NAME = "probe-kit"
HELP = """Make what a probe is built of: a mould that casts its overlay, housing, calibration cap, \
an encoded plate for the first touch; with parts list, wiring picture and a sheet that says how.

probe-sensor types lists the types; a file of yours is one too.
"""
EPILOG = "Exit codes: 0 done, 1 could not be written, 2 bad input, 130 interrupted."

app = Application()


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `probe-kit` and leave with its exit code."""
    console.one_thread()
    console.main(NAME, lambda _arguments: app, arguments)


def run(arguments: list[str]) -> int:
    """Run the command; returns its exit code. Errors are reported, not raised."""
    return console.run(NAME, lambda _arguments: app, arguments)


@command(app, help=HELP, epilog=EPILOG, version_of=NAME)
def kit(
    sensor_type: Annotated[
        str, Argument("A name that probe-sensor types lists, or a file.", "TYPE")
    ] = "",
    folder: Annotated[
        Path, Option("Folder for the files.", "DIR", names=("-o", "--output"))
    ] = Path("kit"),
    verify: Annotated[
        bool, Option("Read every part back and prove it (needs the mesh extra too).")
    ] = False,
    as_json: Json = False,
) -> int:
    """Make the kit."""
    if not sensor_type:
        raise UsageError("no sensor type is named: probe-sensor types lists them")
    from encoded_objects.base.sensor_type_file import sensor_type_named
    from probe.kit.make import make_kit

    with progress_bar("reading", 1) as bar:
        made = make_kit(sensor_type_named(sensor_type), folder, verify=verify,
                        progress=lambda what, share: bar.show(share, label=what))  # fmt: skip
    if as_json:
        output.write_json(_json(made))
    else:
        output.write(_text(made))
    return console.DONE


def _text(made: Kit) -> str:
    lines = [f"{len(made.files)} files in {made.folder}"]
    for part in made.parts:
        x, y, z = part.size_mm
        lines.append(f"  {part.name:16} {x:.1f} x {y:.1f} x {z:.1f} mm, {part.what}")
        if part.bed_hint:
            lines.append(f"  {'':16} {part.bed_hint}")
    side, symbols = made.coupon.side_mm, made.coupon.part.symbols
    lines.append(f"  {'coupon':16} {side:g} x {side:g} mm, {symbols} symbols, for the first touch")
    if made.verified:
        lines.append(f"  verified: {made.verified} parts, each one valid closed solid")
    return "\n".join([*lines, f"next: open {made.folder / 'sheet.html'}"])


def _json(made: Kit) -> dict[str, Any]:
    return {
        "folder": str(made.folder),
        "files": [str(file) for file in made.files],
        "parts": [{"name": part.name, "size_mm": part.size_mm, "volume_mm3": part.volume_mm3}
                  for part in made.parts],
        "coupon": {"face": made.coupon.part.name, "side_mm": made.coupon.side_mm,
                   "symbols": made.coupon.part.symbols, "pitch_mm": made.coupon.pitch_mm},
        "verified": made.verified,
    }  # fmt: skip


if __name__ == "__main__":
    main()
