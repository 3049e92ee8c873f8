"""`probe-sensor list | types`: the ports that are there, and the sensor types."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from encoded_objects.base import output
from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from encoded_objects.base.sensor_type_file import (
    sensor_type_named,
    sensor_type_schema,
    shipped_names,
    shipped_text,
)
from probe.port.listing import list_ports as found_ports

ALWAYS = {
    "sim:": "a moving pattern, 100 frames a second",
    "sim:lab.db#Cube/F1": "touches of a registered face; also sim:part.stl",
    "file:touch.h5": "a recording, played",
}


def list_ports(*, as_json: bool) -> int:
    """Print the ports that are there, and URLs that always work; returns the exit code."""
    ports = found_ports()
    if as_json:
        always = [{"url": url, "description": text} for url, text in ALWAYS.items()]
        output.write_json({"ports": [asdict(port) for port in ports], "always": always})
        return 0
    if ports:
        table = output.table("port", "may be a probe", "board or adapter", "serial number")
        for port in ports:
            name = " ".join(part for part in (port.vendor, port.product) if part)
            likely = "yes" if port.likely else "no"
            table.add_row(port.url, likely, name or port.description, port.serial_number)
        output.show(table)
        output.write("what answers at a port:  probe-sensor info URL\n")
    else:
        output.write("no port on USB is there; plug the probe in\n")
    output.write("without a probe:")
    output.pairs({f"  {url}": text for url, text in ALWAYS.items()})
    return 0


def list_types(name: str, *, schema: bool, as_json: bool) -> int:
    """Print all sensor types, one as YAML, or their schema; returns the exit code."""
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
            f"{entry['value']}, {entry['bits']} bits", f"{entry['proposed_pitch_mm']:g}"
        )  # fmt: skip
    output.show(table)
    output.write("lengths in mm; symbols: the pitch that a type reads best.  A type of your "
                 "own:  probe-sensor types fsr-16 > mine.yaml")  # fmt: skip
    return 0


def _entry(sensor: SensorType) -> dict[str, Any]:
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
