"""`probe-sensor info`: a probe, a recording, or a calibration, as values and as lines to read."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.output import count_of, pairs, write_json
from encoded_objects.base.sensor_type import SensorType
from probe.calibration import calibration_hash, read_calibration
from probe.client.client import Client, name_of
from probe.command.calibrated import describe_laws
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
        "url": url,
        "sensor": name_of(ident, url),
        "shape": list(shape),
        "sensor_type": None if kind is None else kind.name,
        "ident": None if ident is None else asdict(ident),
        "client": asdict(counts),
        "device": None if device is None else asdict(device),
        "peak": peak,
        "notices": notices,
    }
    lines = {"port": url}
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
    return values, lines | more


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
