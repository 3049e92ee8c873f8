"""Recordings of every format that is read, and of every kind that is refused or repaired.

File -> frames as SHA-256 of each array, attributes, and what the commands say: `info`, a table
(CSV) and an array, `repair`, `import`, and the answers to its touches. The files of
`data/recordings` were written by the code of November 2026 (README.md there) and are never made
again.
"""

import gzip
import hashlib
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from corpora.commands import DATA, FIXTURES, Commands, normal_text, started_commands

NAME = "recordings"
TOUCHES = ("touch", "touches", "scan", "gel", "small", "plain", "all-attributes")
ARRAYS = ("array.npy", "arrays.npz", "matlab.mat", "table.csv", "short.csv", "scan.mcap")
PLAIN = (*ARRAYS, "damaged.mcap", "plain-negative.h5", "plain-flat.h5", "fractions.h5")
#: File: options of `probe-sensor import`.
IMPORTED = {
    "two.npz": ("--dataset", "right", "--rate", "50", "--sensor", "right"),
    "pictures": ("--sensor-type", "fsr-16"),
    "plain-12x32.h5": ("--sensor-type", "flexitac-12x32"),
} | dict.fromkeys(PLAIN, ())


def collect() -> Iterator[tuple[str, Any]]:
    """Yield the entries."""
    with started_commands() as commands:
        work = commands.folder
        shutil.copytree(DATA / "recordings", work, dirs_exist_ok=True)
        for packed in work.glob("*.gz"):
            (work / packed.stem).write_bytes(gzip.decompress(packed.read_bytes()))
            packed.unlink()
        for old in ("touch.h5", "scan.h5", "calibration.json"):
            shutil.copy(FIXTURES / "recordings" / old, work / f"old-{old}")
        shutil.copy(FIXTURES / "database/v2.db", work / "old.db")
        packed = DATA / "databases/v3.db.gz"
        (work / "lab.db").write_bytes(gzip.decompress(packed.read_bytes()))
        for entries in (_read, _recognised, _imported, _repaired):
            yield from entries(commands, work)


def _read(commands: Commands, work: Path) -> Iterator[tuple[str, Any]]:
    """Yield what is read of every file as it is, and how it is refused."""
    for path in [*sorted(work.glob("*.h5")), work / "series.h5"]:
        name = path.name
        yield f"frames/{name}", _frames(path, work)
        yield f"info/{name}", commands.entry("probe-sensor", "info", name, "--json")
        if name.endswith(".part.h5"):
            yield f"live/{name}", _frames(path, work, live=True)
        words = ("--csv", "out.csv", "--npy", "out.npy", "--replace", "--json")
        yield f"export/{name}", commands.entry("probe-sensor", "export", name, *words)
        yield from _written(work, f"export/{name}", "out.csv", "out.npy")
    yield "calibration", commands.entry("probe-sensor", "info", "old-calibration.json", "--json")
    for name in ("scan", "old-touch"):
        words = (f"{name}.h5", "--mcap", "out.mcap", "--replace")
        commands.entry("probe-sensor", "export", *words)
        back = ("import", "out.mcap", "-o", "back.h5", "--replace", "--json")
        yield f"mcap/{name}", commands.entry("probe-sensor", *back)
        yield f"mcap/{name}/frames", _frames(work / "back.h5", work)


def _recognised(commands: Commands, _: Path) -> Iterator[tuple[str, Any]]:
    for name in TOUCHES:
        words = (f"{name}.h5", "--json")
        yield f"recognised/{name}", commands.entry("recognize-object", *words)
    for name, more in (("old-touch", ()), ("old-scan", ("--scan",))):
        words = (f"{name}.h5", "--database", "old.db", *more, "--json")
        yield f"recognised/{name}", commands.entry("recognize-object", *words)


def _imported(commands: Commands, work: Path) -> Iterator[tuple[str, Any]]:
    for name, more in IMPORTED.items():
        words = ("import", name, "-o", "imported.h5", "--replace", *more, "--json")
        said = commands.entry("probe-sensor", *words)
        yield f"import/{name}", said
        if not said["code"]:
            yield f"import/{name}/frames", _frames(work / "imported.h5", work)


def _repaired(commands: Commands, work: Path) -> Iterator[tuple[str, Any]]:
    """Yield what repair says of every file, and what is there afterwards; changes the files."""
    for path in sorted(work.glob("*.h5")):
        before = {one.name for one in work.iterdir()}
        said = commands.entry("probe-sensor", "repair", path.name, "--json")
        new = sorted({one.name for one in work.iterdir()} - before)
        gone = sorted(before - {one.name for one in work.iterdir()})
        yield f"repair/{path.name}", said | {"new files": new, "files gone": gone}
        for name in [*([path.name] if path.exists() else []), *new]:
            yield f"repair/{path.name}/frames of {name}", _frames(work / name, work)


def _frames(path: Path, work: Path, *, live: bool = False) -> dict[str, Any]:
    """Return what `Recording` reads of a file, or why not."""
    from encoded_objects import EncodedObjectsError, Recording

    try:
        recording = Recording(path, live=live)
        frames = list(recording.frames())
    except EncodedObjectsError as error:
        return {"error": normal_text(str(error), work), "exit code": error.exit_code}
    arrays = {
        name: [np.asarray(getattr(frame, name), "<i8") for frame in frames]
        for name in ("counts", "t_ns", "seq", "wrist")
    } | {"pose": [np.asarray(frame.pose, "<f8") for frame in frames if frame.pose is not None]}
    origin = recording.origin
    try:
        sensor_type = repr(recording.sensor_type().shape)
    except EncodedObjectsError as error:
        sensor_type = normal_text(str(error), work)
    return {
        "says": str(recording),
        "frames": len(recording),
        "shape": list(recording.shape),
        "sha256": {name: _sha256(values) for name, values in arrays.items() if values},
        **{name: getattr(origin, name) for name in ("sensor", "calibration", "units")},
        "sensor type": origin.sensor_type,
        "sensor type read": sensor_type,
        "more": {name: normal_text(str(value), work) for name, value in origin.more.items()},
    }


def _written(work: Path, entry: str, *names: str) -> Iterator[tuple[str, Any]]:
    """Yield hashes of files that may have been written, and take them away."""
    for name in names:
        path = work / name
        if not path.exists():
            continue
        if path.suffix == ".npy":
            value = np.load(path)
            yield f"{entry}/npy", [str(value.dtype), list(value.shape), _sha256([value])]
        else:
            text = path.read_text()
            digest = hashlib.sha256(text.encode()).hexdigest()
            yield f"{entry}/csv", [text.partition("\n")[0][:80], text.count("\n"), digest]
        path.unlink()


def _sha256(arrays: list[Any]) -> str:
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()
