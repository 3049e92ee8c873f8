"""`probe-sensor list | types | info`: ports, sensor types, a probe, a recording, a calibration."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base import output
from encoded_objects.base.errors import printable, without_password
from encoded_objects.base.output import count_of, pairs, write_json
from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from encoded_objects.base.sensor_type_file import (
    sensor_type_named,
    sensor_type_schema,
    shipped_names,
    shipped_text,
)
from probe.calibration import calibration_hash, read_calibration
from probe.client.client import Client, name_of
from probe.command.calibrated import describe_laws
from probe.port.listing import list_ports as found_ports
from probe.port.url import means_port, typed_port
from probe.recording.read import Recording

_ANSWER_S = 0.5  #: a probe answers with its statistics within that

Described = tuple[dict[str, Any], dict[str, str]]
"""Values for `--json`, and lines for people."""


def describe(
    what: str, sensor: int | None, seconds: float, sensor_type: str, *, as_json: bool
) -> int:
    """Print a description of a port, a recording or a calibration; returns the exit code.

    Raises PortError: the probe is not there, or it is no probe; RecordingError, CalibrationError:
    the file is none of these, damaged, changed, or not closed.
    """
    if means_port(what):
        values, lines = _describe_probe(what, sensor, seconds, sensor_type)
    elif what.endswith(".json"):
        found = read_calibration(what)
        values, lines = describe_laws(found, calibration_hash(found), what)
    else:
        values, lines = _describe_recording(what, sensor_type)
    if as_json:
        write_json(values)
    else:
        pairs(lines)
    return 0


def _describe_probe(url: str, sensor: int | None, seconds: float, sensor_type: str) -> Described:
    peak, heard = 0, False
    shape: tuple[int, ...] = ()
    port, kind = typed_port(url, sensor_type)
    with Client(port, sensor=sensor) as client:
        until_s = time.monotonic() + seconds
        while not client.ended:
            for frame in client.take(0.1):
                if not heard:
                    heard, until_s = True, time.monotonic() + seconds
                peak = max(peak, int(frame.counts.max()))
                shape = frame.counts.shape
            if heard and time.monotonic() > until_s:
                client.ask_device()
                client.take(_ANSWER_S)
                until_s = time.monotonic() + _ANSWER_S
                while client.device is None and time.monotonic() < until_s:
                    time.sleep(0.02)
                break
        ident, device = client.wait_for_ident(), client.device
        counts, notices = client.statistics(), client.notices()
    values = {
        "url": without_password(url),
        "sensor": name_of(ident, url),
        "shape": list(shape),
        "sensor_type": None if kind is None else kind.name,
        "ident": None if ident is None else asdict(ident),
        "client": asdict(counts),
        "device": None if device is None else asdict(device),
        "peak": peak,
        "notices": notices,
    }
    lines = {"port": without_password(url)}
    if ident is not None:
        major, minor = ident.firmware
        settling = f", settling {ident.settling_us:g} us" if ident.settling_us else ""
        speed = f", {ident.baud:,} baud" if ident.baud else ""
        lines["probe"] = f"{ident.name}, firmware {major}.{minor}{speed}, start {ident.boot}"
        lines["sensor"] = (
            f"{ident.sensor} of 0 ... {ident.sensors - 1}, {ident.rows}x{ident.columns}, "
            f"{ident.bits} bits{settling}"
        )
    if kind is not None:
        lines["sensor type"] = kind.name
    lines["rate"] = f"{counts.rate:.1f} frames a second"
    lines["heard"] = (
        f"{count_of(counts.frames, 'frame')}, lost {counts.lost}, failed checks {counts.failed}, "
        f"doubtful {counts.doubtful}, reboots {counts.reboots}"
    )
    lines["peak"] = f"{peak} counts"
    if device is not None:
        lines["device"] = (
            f"up {device.uptime_ms / 1000:.1f} s, sent {device.frames:,}, waited "
            f"{device.transmit_waits:,} times for the line, unknown commands "
            f"{device.receive_errors}"
        )
    return values, lines | ({"notice": notices[-1]} if notices else {})


def _describe_recording(name: str, sensor_type: str) -> Described:
    held = Recording(name)
    kind = _type_of(held, sensor_type)
    seq: list[NDArray[np.int64]] = [np.empty(0, np.int64)]
    t_ns: list[NDArray[np.int64]] = [np.empty(0, np.int64)]
    peak = poses = 0
    for block in held.blocks():
        seq.append(block.seq)
        t_ns.append(block.t_ns)
        peak = max(peak, int(block.counts.max(initial=0)))
        poses += 0 if block.pose is None else int((~np.isnan(block.pose[:, 0, 0])).sum())
    gaps = _gaps(np.concatenate(seq), np.concatenate(t_ns))
    origin = held.origin
    files = [file.path for file in held.files]
    values = {
        "file": name,
        "files": [str(path) for path in files],
        "frames": len(held),
        **gaps,
        "sensor": origin.sensor,
        "sensor_type": kind,
        "shape": list(held.shape),
        "calibration": origin.calibration,
        "units": origin.units,
        "peak": peak,
        "poses": poses,
        "tool_version": held.tool_version,
        "bytes": sum(path.stat().st_size for path in files),
        "attributes": dict(origin.more),
    }
    lines = {
        "recording": ", ".join(path.name for path in files[:4])
        + (f" ... ({len(files)} files)" if len(files) > 4 else ""),
        "frames": f"{len(held):,} in {gaps['seconds']:.2f} s, {gaps['rate']:.1f} a second",
        "gaps": f"{gaps['gaps']}, {gaps['lost']} frames lost; longest pause "
        f"{1000 * gaps['longest_pause_s']:.1f} ms; restarts {gaps['restarts']}",
        "sensor": origin.sensor or "not named",
        "sensor type": f"{kind or 'not told'}, {held.shape[0]}x{held.shape[1]}",
        "calibration": origin.calibration or "none",
        "peak": f"{peak} {origin.units}",
        "poses": f"of {count_of(poses, 'frame')}",
        "size": f"{values['bytes'] / 1000:,.0f} kB",
        "written by": held.tool_version or "another programme",
    }
    more = {str(key): _shorten(value) for key, value in origin.more.items()}
    return values, {printable(key): printable(text) for key, text in (lines | more).items()}


def _type_of(held: Recording, asked: str) -> str:
    """Return the name of a recording's sensor type; empty where nothing tells."""
    if asked or held.origin.sensor_type or held.shape == SensorType().shape:
        return held.sensor_type(asked).name
    return ""


def _gaps(seq: NDArray[np.int64], t_ns: NDArray[np.int64]) -> dict[str, Any]:
    steps, pauses = np.diff(seq), np.diff(t_ns) * 1e-9
    going = (steps > 0) & (pauses >= 0)
    seconds = float(pauses[going].sum())
    return {
        "seconds": seconds,
        "rate": float(going.sum()) / seconds if seconds > 0 else 0.0,
        "gaps": int((steps[going] > 1).sum()),
        "lost": int((steps[going] - 1).sum()),
        "longest_pause_s": float(pauses[going].max(initial=0.0)),
        "restarts": int((~going).sum()),
    }


def _shorten(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 90 else f"{text[:87]}..."


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
