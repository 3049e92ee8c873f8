"""Damaged files, packets and requests of every kind that is read, and what reading them must do.

    outcome = attempt(kind, number, folder)    the same number gives the same bytes

A `Kind` writes a thing that a number determines into a folder and reads it with the project's own
reader, in this process. Fine is what is read, or refused by an error of the project with a place,
a way out and the documented exit code. Everything else is a fault: `FAULTS`.

Damage is done to bytes (bits, blocks, numbers, the end) and to what they mean (types, shapes,
counts, links, names, keys, SQL, fields of packets and requests); a few of every kind of file are
no file at all (a folder, a fifo, a device, a link to itself).

    case         what a kind is, and what may become of a case
    damage       to bytes, and to what they mean
    recordings, texts, models, databases, lines, page    the kinds
"""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from encoded_objects.base.errors import EncodedObjectsError
from foreign.case import (
    MOST_BYTES,
    READ,
    REFUSED,
    ROOM,
    SECRET,
    HangError,
    Kind,
    LeakError,
    LeftError,
    Outcome,
    WrongValueError,
    kept,
)
from foreign.damage import no_file
from foreign.databases import labs, read_database, read_exchange, write_database
from foreign.lines import read_line, read_packets, read_url, write_line, write_packets, write_url
from foreign.models import (
    _shape_writer,
    load_kernel,
    read_3mf,
    read_model,
    read_model_in_fork,
    write_3mf,
)
from foreign.page import read_request, write_request
from foreign.recordings import (
    arrays,
    mcap_file,
    read_array,
    read_mcap,
    read_recording,
    recorded_files,
    write_array,
    write_mcap,
    write_recording,
)
from foreign.texts import (
    read_by_command,
    read_calibration,
    read_printer,
    read_sensor_type,
    read_spec,
    read_state,
    state_text,
    write_calibration,
    write_printer,
    write_sensor_type,
    write_spec,
    write_state,
)

KINDS: dict[str, Kind] = {
    "recording": Kind(write_recording, read_recording, sound=(recorded_files,)),
    "array": Kind(write_array, read_array, most_bytes=2 * MOST_BYTES, sound=(arrays,)),
    "mcap": Kind(write_mcap, read_mcap, sound=(mcap_file,)),
    "calibration": Kind(write_calibration, read_calibration),
    "state": Kind(write_state, read_state, sound=(state_text,)),
    "sensor type": Kind(write_sensor_type, read_sensor_type),
    "printer": Kind(write_printer, read_printer),
    "spec": Kind(write_spec, read_spec),
    "command": Kind(write_spec, read_by_command, (1, 2, 4), longest_s=30.0),
    "stl": Kind(_shape_writer(".stl"), read_model),
    "obj": Kind(_shape_writer(".obj"), read_model),
    "step": Kind(_shape_writer(".step"), read_model_in_fork, sound=(load_kernel,)),
    "3mf": Kind(write_3mf, read_3mf),
    "database": Kind(write_database, read_database, (4, 2), sound=(labs,)),
    "import": Kind(write_database, read_exchange, (4,), sound=(labs,)),
    "packets": Kind(write_packets, read_packets, file=False),
    "line": Kind(write_line, read_line, file=False),
    "port": Kind(write_url, read_url, (2, 3, 4), file=False, placed=False, sound=(recorded_files,)),
    "page": Kind(write_request, read_request, file=False, sound=(labs, recorded_files, state_text)),
}


def prepare(name: str, root: Path) -> None:
    """Make what is damaged and load what reads it, once in a process and for its children."""
    for sound in KINDS[name].sound:
        sound()
    kept()
    if name != "page":  # which has threads
        for number in range(-9, 0):
            attempt(name, number, root)


def attempt(name: str, number: int, root: Path) -> Outcome:
    """Make the case of a number, read it in this process, and return what became of it.

    `root` is a folder for cases alone: the secret stands in it, and a folder `box` is given.
    """
    kind, rng = KINDS[name], random.Random(f"{name} {number}")
    box, spare = root / "box", root / ("bench-tmp" if name == "page" else "tmp")
    given_folder, out = box / "in", box / "out"
    for folder in (given_folder, out, spare):
        folder.mkdir(parents=True, exist_ok=True)
        if name != "page" or folder != spare:
            _clear(folder)
    secret = root / "secret.txt"
    secret.write_bytes(SECRET)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the libraries that write
        given = kind.write(rng, given_folder)
    path = given[0] if isinstance(given, tuple) else given
    if kind.file and rng.random() < 0.02:
        no_file(rng, path)
    before = _names(root)
    tempfile.tempdir = str(spare)
    here = Path.cwd()
    os.chdir(box)
    start, megabytes = time.monotonic(), 0.0
    try:
        with _watched(kind.longest_s) as took, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind.read(given, out)
        what, detail = READ, ""
    except EncodedObjectsError as error:
        what, detail = _refusal(error, kind, path)
    except HangError as error:
        what, detail = "hang", _where(error)
    except MemoryError as error:
        what, detail = "memory", _where(error)
    except LeakError as error:
        what, detail = "leak", str(error)
    except LeftError as error:
        what, detail = "left outside", f"of what was refused: {error}"
    except WrongValueError as error:
        what, detail = "wrong value", str(error)
    except Exception as error:  # noqa: BLE001  (which is what is looked for)
        what, detail = "traceback", _where(error)
    finally:
        os.chdir(here)
        tempfile.tempdir = None
    seconds, megabytes = time.monotonic() - start, took[0]
    if what in (READ, REFUSED):
        new = sorted(_names(root) - before)
        if new:
            what, detail = "left outside", ", ".join(new)[:80]
        elif secret.read_bytes() != SECRET:
            what, detail = "left outside", "the secret was changed"
        elif megabytes * 2**20 > kind.most_bytes:
            what, detail = "memory", f"{megabytes:.0f} MB"
        elif seconds > kind.longest_s:
            what, detail = "hang", f"{seconds:.0f} s"
    return Outcome(what, detail, seconds, megabytes)


def _refusal(error: EncodedObjectsError, kind: Kind, path: Any) -> tuple[str, str]:
    """Return what a refusal is worth: its place, way out and exit code."""
    said = f"{type(error).__name__}: {error.cause[:60]}"
    if error.exit_code not in kind.codes:
        return "wrong code", f"{error.exit_code} {said}"
    text = "".join(error.as_text().splitlines()) if error.place == "c.yaml" else error.as_text()
    text += " lab.db" if "home.db" in text else ""  # the two of an import
    named = not isinstance(path, Path) or not kind.placed or path.name in text
    if kind.file and path.name in ("c.yaml", "printer.yaml"):  # which name other files
        named = bool(error.place)
    if not named or not error.fix:
        return "no place", said
    if any(c != "\n" and not c.isprintable() for c in text):
        return "no place", f"not printable: {said!r}"
    return REFUSED, said


def _where(error: BaseException) -> str:
    """Return the error and the last places of our packages that it went through."""
    ours = [f"{Path(frame.filename).name}:{frame.lineno}"
            for frame in traceback.extract_tb(error.__traceback__)
            if "/tests/" not in frame.filename and "/site-packages/" not in frame.filename
            and "/lib/python" not in frame.filename]  # fmt: skip
    return f"{type(error).__name__}: {str(error)[:60]!r} at {' < '.join(ours[:-4:-1])}"


def _clear(folder: Path) -> None:
    """Empty a folder."""
    for entry in os.scandir(folder):
        if entry.is_dir(follow_symlinks=False):
            shutil.rmtree(entry.path)
        else:
            os.unlink(entry.path)


def _names(root: Path) -> set[str]:
    """Return all names below the root but what a reader may make: its output, its session."""
    found = set()
    for folder, folders, files in os.walk(root):
        shown = os.path.relpath(folder, root)
        if shown in ("box/out", "bench", "bench-tmp"):
            folders.clear()
            continue
        found |= {os.path.join(shown, one) for one in (*folders, *files)}
    # what SQLite and the schema's update keep next to a database is theirs
    return {one for one in found if not one.startswith("box/in/lab.") and one != "./bench"}


@contextmanager
def _watched(longest_s: float) -> Iterator[list[float]]:
    """Bound time and memory; yields a list of the megabytes that were taken at most."""
    took = [0.0]

    def late(*_: object) -> None:
        raise HangError(f"longer than {longest_s:g} s")

    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    size, base = _status("VmSize"), _status("VmRSS")
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (size + ROOM, limits[1]))
    handler = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, longest_s)
    try:
        yield took
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        took[0] = max(0.0, (_status("VmHWM") - base) / 2**20)


def _status(name: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) << 10
    return 0
