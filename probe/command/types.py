"""`probe-sensor types [NAME|FILE]`: the sensor types that are shipped, and what a file says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from encoded_objects.base.console import Action
from probe.command.options import Json

if TYPE_CHECKING:
    from encoded_objects.base.sensor_type import SensorType


def types(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", show_default=False,
                            help="A shipped type, or a file: checked, and shown as YAML."),
    ] = "",
    schema: Annotated[
        bool, typer.Option("--schema", help="The JSON schema of a file of a sensor type."),
    ] = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """List the sensor types, show one as YAML to start from, or check a file."""

    def action() -> int:
        from encoded_objects.base import output
        from encoded_objects.base.sensor_type import sensor_type_text
        from encoded_objects.base.sensor_type_file import (
            sensor_type_named,
            sensor_type_schema,
            shipped_names,
            shipped_text,
        )

        if schema:
            output.write_json(sensor_type_schema())
            return 0
        if name:
            sensor = sensor_type_named(name)
            if as_json:
                output.write_json(_entry(sensor))
            else:
                shipped = name in shipped_names()
                output.write((shipped_text(name) if shipped else sensor_type_text(sensor)).rstrip())
            return 0
        entries = [_entry(sensor_type_named(each)) for each in shipped_names()]
        if as_json:
            output.write_json({"types": entries})
            return 0
        table = output.table("type", "tactels", "pitch", "matrix", "overlay", "reads", "symbols")
        for entry in entries:
            wide, high = entry["size_mm"]
            missing = f", {entry['missing']} missing" if entry["missing"] else ""
            table.add_row(
                entry["name"], f"{entry['rows']} x {entry['columns']}{missing}",
                f"{entry['pitch_mm']:g}", f"{wide:g} x {high:g}", entry["overlay"],
                f"{entry['value']}, {entry['bits']} bits", f"{entry['proposed_pitch_mm']:g}",
            )  # fmt: skip
        output.show(table)
        output.write("lengths in mm; symbols: the pitch that a type reads best.  A type of your "
                     "own:  probe-sensor types fsr-16 > mine.yaml")  # fmt: skip
        return 0

    return action


def _entry(sensor: SensorType) -> dict[str, Any]:
    """Return what is said of a type."""
    wide, high = sensor.half_mm
    return {
        "name": sensor.name,
        "rows": sensor.rows,
        "columns": sensor.columns,
        "pitch_mm": sensor.pitch_mm,
        "size_mm": [round(2 * wide, 6), round(2 * high, 6)],
        "overlay": sensor.overlay.kind,
        "value": sensor.value,
        "unit": sensor.unit,
        "bits": sensor.bits,
        "exponent": sensor.exponent,
        "wiring": sensor.wiring,
        "noise": sensor.noise,
        "missing": len(sensor.missing),
        "proposed_pitch_mm": sensor.symbol_pitch_mm,
    }
