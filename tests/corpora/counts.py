"""What every way to simulate a touch gives by seed: frames as SHA-256, truth as numbers.

The parts that are touched are made here with a fixed lab key, once for all ways. An entry of
frames tells their shape, their largest count and their sum, too, so that a difference says more
than that there is one. Reports of runs are not drawn: they follow from the rows.
"""

import atexit
import hashlib
import math
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pyarrow.parquet as pq
from corpora.commands import Commands, started_commands

from encoded_objects import Recording, encode, simulate, validate

NAME = "counts"
KEY = "VA11-DATE-0000-0002"
SHAPES: dict[str, dict[str, Any]] = {
    "Block": {"box": ["45 mm", "35 mm", "28 mm"]},
    "Can": {"cylinder": {"diameter": "30 mm", "height": "32 mm"}},
    "Cone": {"cone": {"diameter": "40 mm", "top_diameter": "24 mm", "height": "32 mm"}},
}
TETRA = "{name: Tetra, shape: {tetrahedron: 45 mm}, output: {lab_key: " + KEY + "}}\n"

FACE, STL = "lab.db#Block/F2", "parts/Block-F2.stl"
TARGETS = {
    "registered": FACE,
    "object": "lab.db#Block",
    "written": STL,
    "written-in-face": f"{STL}@lab.db",
    "washer": "washer",
    "cylinder": "lab.db#Can/F2",
    "cone": "lab.db#Cone/F2",
}
#: Of `simulate` and of the command; the command takes them as options of the same names.
OPTIONS: dict[str, dict[str, Any]] = {
    "one": {},
    "place": {"x": 14.5, "y": 12.25, "theta": 33.0, "force": 55.0},
    "tilted": {"tilt_x": 1.5, "tilt_y": -0.7, "force": 120.0},
    "random": {"touches": 4, "seed": 11},
    "frames": {"frames": 5, "seed": 3},
    "several-frames": {"touches": 2, "frames": 3, "seed": 5},
    "quiet": {"noise": "quiet", "touches": 2, "seed": 4},
    "pad": {"overlay": "pad", "seed": 6},
    "pad-random": {"overlay": "pad", "touches": 2, "seed": 6},
    "footprint": {"accuracy": "footprint", "touches": 2, "seed": 7},
    "tabs": {"accuracy": "tabs", "seed": 8},
    "layer": {"accuracy": "layer", "overlay": "pad", "seed": 9},
    "error": {"accuracy": "0.05", "seed": 10},
    "raster": {"scan": "raster", "touches": 4, "seed": 12},
    "kinesthetic": {"scan": "kinesthetic", "touches": 4, "seed": 13},
}
TYPES = ("flexitac-12x32", "flexitac-16x32", "fsr-8x8", "gel-24x32", "mat-32x32")
PORTS = {
    "pattern": "sim:?rate=500",
    "pattern-gel": "sim:?rate=500&sensor_type=gel-24x32",
    "wandering": f"sim:{FACE}?rate=500&period=0.2&seed=2",
    "stays": f"sim:{FACE}?rate=500&period=0.3&x=20&y=15&theta=20&force=60&seed=3",
    "tilted": f"sim:{STL}@lab.db?rate=500&period=0.3&tilt=2&step=3&seed=4",
    "pad": f"sim:{FACE}?rate=500&period=0.3&overlay=pad&noise=quiet",
    "mat": f"sim:{FACE}?rate=300&period=0.3&sensor_type=fsr-8x8&seed=5",
    "washer": "sim:washer?rate=500&period=0.3&accuracy=footprint",
    "round": "sim:lab.db#Can/F2?rate=500&period=0.3&seed=6",
}
FRAMES = 150  #: that are recorded of a port
PARTS = ("simulate", "command", "ports", "bench", "validate", "printed")


def collect(part: str) -> Iterator[tuple[str, Any]]:
    """Yield what a way to simulate gives."""
    ways = (_by_function, _by_command, _by_port, _by_bench, _by_validation, _by_prints)
    with started_commands() as commands:
        if part not in ("validate", "printed"):
            shutil.copytree(_lab(), commands.folder, dirs_exist_ok=True)
        for entry, value in ways[PARTS.index(part)](commands):
            yield f"{part}/{entry}", value


@cache
def _lab() -> Path:
    """Return a folder with the parts that are touched and their database."""
    place = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, place)
    for name, shape in SHAPES.items():
        spec = {"name": name, "shape": shape, "output": {"lab_key": KEY}}
        encode(spec, database=str(place / "lab.db"), folder=place / "parts", formats=("stl",))
    return place


def frames_told(counts: np.ndarray) -> dict[str, Any]:
    """Return what is kept of frames (N, rows, columns)."""
    values = np.ascontiguousarray(counts, "<u2")
    return {
        "shape": list(values.shape),
        "sum": int(values.sum(dtype=np.int64)),
        "largest": int(values.max()),
        "sha256": hashlib.sha256(values.tobytes()).hexdigest(),
    }


def _by_function(commands: Commands) -> Iterator[tuple[str, Any]]:
    """Yield what `encoded_objects.simulate` gives."""

    def told(target: str, **options: Any) -> dict[str, Any]:
        found = simulate(_inside(commands.folder, target), **options)
        frames = list(found.frames())
        truth = found.truth()
        kept = {"level": truth["level"], "overlay": truth["overlay"], "truth": truth["touches"]}
        times = [[frame.seq, frame.t_ns, frame.wrist.tolist()] for frame in frames]
        poses = [None if frame.pose is None else frame.pose.tolist() for frame in frames]
        counts = np.array([frame.counts for frame in frames])
        return frames_told(counts) | kept | {"seq_t_ns_wrist": times, "poses": poses}

    for name, target in TARGETS.items():
        yield f"target {name}", told(target, touches=2, seed=1)
    for name, options in OPTIONS.items():
        yield f"options {name}", told(FACE, **options)
    for name in TYPES:
        yield f"type {name}", told(FACE, sensor_type=name, touches=2, seed=2)


def _by_command(commands: Commands) -> Iterator[tuple[str, Any]]:
    """Yield what `probe-sensor simulate` writes."""
    cases = {f"target {n}": (target, {"touches": 2, "seed": 1}) for n, target in TARGETS.items()}
    cases |= {
        "many": (FACE, {"touches": 8, "seed": 21}),
        "type gel-24x32": (FACE, {"sensor_type": "gel-24x32", "seed": 2}),
        "kinesthetic": (FACE, {"scan": "kinesthetic", "touches": 5, "seed": 13}),
    }
    for name, (target, options) in cases.items():
        words = [word for key, value in options.items() for word in (_option(key), value)]
        commands.answer("probe-sensor", "simulate", target, *words, "-o", "out.h5", "--replace")
        yield name, _recorded(commands.folder / "out.h5")


def _by_port(commands: Commands) -> Iterator[tuple[str, Any]]:
    """Yield what `probe-sensor record` reads of ports in software."""
    for name, url in PORTS.items():
        out = commands.folder / f"{name}.h5"
        commands.answer("probe-sensor", "record", url, "-o", out, "--frames", FRAMES)
        yield name, _recorded(out)


def _by_bench(commands: Commands) -> Iterator[tuple[str, Any]]:
    """Yield what the bench's own probe feels of a click.

    No public door leads there: the frame at which a click arrives is left to the clock.
    """
    from encoded_objects.base.sensor_type import SensorType
    from probe.contact.contract import Touch
    from probe.simulate.target import surface_of
    from recognizer.bench.simulated import PressSequence, SimulationSettings

    scene = surface_of(_inside(commands.folder, FACE))
    for noise in ("typical", "quiet"):
        manner = SimulationSettings(rate=100.0, noise=noise, hold_s=0.2, seed=5)
        sequence = PressSequence(SensorType(), manner)
        frames = sequence.frames()
        found = [next(frames).counts for _ in range(5)]
        sequence.touch(scene, Touch(20.0, 15.0, 0.4, 60.0))
        found += [next(frames).counts for _ in range(40)]
        sequence.touch(scene, Touch(16.0, 18.0, -1.0, 90.0, 0.01, -0.02))
        found += [next(frames).counts for _ in range(12)]
        sequence.lift()
        found += [next(frames).counts for _ in range(5)]
        yield f"click {noise}", frames_told(np.array(found))


def _by_validation(commands: Commands) -> Iterator[tuple[str, Any]]:
    """Yield the touches that `validate-set` draws, and their rows."""
    place = commands.folder
    spec = place / "block.yaml"
    spec.write_text(
        "objects:\n  - {name: Block, shape: {box: [45 mm, 35 mm, 28 mm]}}\n"
        f"  - {{name: Bar, shape: {{box: [40 mm, 30 mm, 30 mm]}}}}\noutput: {{lab_key: {KEY}}}\n"
    )
    yield from _validated("own", place, spec, touches=24, seed=31)
    made = str(place / "own" / "lab.db")
    known = "face=.5,edge=.2,corner=.1,worn=.2"
    for name, options in {
        "registered": {"surfaces": "database", "touches": 8},
        "pad": {"overlay": "pad", "touches": 6},
        "one-sensor": {"sensor_per": "run", "levels": "hard", "touches": 6},
        "next": {"policy": "next", "kinds": "edge,corner", "touches": 4},
        "side": {"kinds": "side", "touches": 4},
        "faulty": {"levels": "dead-20,hot-5,floating-30,hysteresis-40,slide-2", "touches": 10},
        "mujoco": {"engine": "mujoco", "kinds": known, "touches": 2},
    }.items():
        yield from _validated(name, place, (), database=made, seed=32, **options)


def _by_prints(commands: Commands) -> Iterator[tuple[str, Any]]:
    """Yield touches of what PrusaSlicer's G-code leaves of a part."""
    place = commands.folder
    spec = place / "tetra.yaml"
    spec.write_text(TETRA)
    prints = place / "prints"
    printed = {"surfaces": "printed", "prints": prints, "touches": 4, "seed": 33}
    yield from _validated("usual", place, spec, faults="usual", **printed)
    made = str(place / "usual" / "lab.db")
    yield from _validated("bad", place, (), database=made, faults="bad", **printed)


def _validated(
    name: str, place: Path, spec: Path | tuple[()], **options: Any
) -> Iterator[tuple[str, Any]]:
    folder = place / name
    with patch("recognizer.validation.report.page_of", return_value=""):
        validate(spec, folder=folder, study=0, export="npz", **options)
    with np.load(folder / "dataset.npz") as arrays:
        yield f"{name} frames", frames_told(arrays["counts"])
    for row in pq.read_table(folder / "trials.parquet").to_pylist():
        told = {key: str(one) if _is_odd(one) else one for key, one in row.items()}
        yield f"{name} touch {row['number']:03d}", told


def _is_odd(value: Any) -> bool:
    """Return whether a value is a number that JSON has not: NaN or infinite."""
    return isinstance(value, float) and not math.isfinite(value)


def _recorded(file: Path) -> dict[str, Any]:
    blocks = list(Recording(file).frames())
    poses = [None if frame.pose is None else frame.pose.tolist() for frame in blocks]
    times = [[frame.seq, frame.t_ns] for frame in blocks]
    more = {"first": times[0], "last": times[-1], "poses": poses if any(poses) else None}
    return frames_told(np.array([frame.counts for frame in blocks])) | more


def _inside(place: Path, target: str) -> str:
    """Return a target whose files lie in a folder."""
    if target == "washer":
        return target
    return "@".join(str(place / one) for one in target.split("@"))


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")
