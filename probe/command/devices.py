"""`describe_probe-sensor list | info`: which probes are there, what a probe or a file is."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from encoded_objects.base.console import Action
from probe.command.options import URLS, Json, SelectedSensor, Typed

ALWAYS = {
    "sim:": "a moving pattern, 100 frames a second",
    "sim:lab.db#Cube/F1": "touches of a registered face; also sim:part.stl",
    "sim:?firmware=avr": "the pattern through the firmware on an emulated AVR",
    "file:touch.h5": "a recording, played",
}


def list_(as_json: Json = False) -> Action:
    """Print the ports that are there, which of them may be a probe, and URLs that always work."""

    def action() -> int:
        from encoded_objects.base import output
        from probe.port.listing import list_ports

        ports = list_ports()
        if as_json:
            from dataclasses import asdict

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

    return action


def info(
    what: Annotated[
        str, typer.Argument(metavar="URL|FILE", show_default=False,
                            help=f"A port ({URLS}), a recording, or a calibration."),
    ],
    sensor: SelectedSensor = None,
    sensor_type: Typed = "",
    seconds: Annotated[float, typer.Option(min=0.1, help="How long to listen to a probe.")] = 1.0,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Say what a probe is and how well it comes through, or what a file holds."""

    def action() -> int:
        from encoded_objects.base import output
        from probe.command import described
        from probe.port.url import means_port

        values: dict[str, Any]
        if means_port(what):
            values, lines = described.describe_probe(what, sensor, seconds, sensor_type)
        elif what.endswith(".json"):
            values, lines = described.describe_calibration(what)
        else:
            values, lines = described.describe_recording(what, sensor_type)
        if as_json:
            output.write_json(values)
        else:
            output.pairs(lines)
        return 0

    return action
