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

import os
import random
import resource
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from contextlib import chdir, contextmanager, suppress
from pathlib import Path

from encoded_objects.base.errors import EncodedObjectsError
from foreign import databases, lines, models, page, recordings, texts
from foreign.case import READ, REFUSED, ROOM, SECRET, FaultError, HangError, Kind, Outcome, kept
from foreign.damage import no_file

KINDS: dict[str, Kind] = {
    name: kind
    for module in (recordings, texts, models, databases, lines, page)
    for name, kind in module.KINDS.items()
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
    for folder in (box / "in", box / "out", spare):
        if folder.name != "bench-tmp":
            shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
    secret = root / "secret.txt"
    secret.write_bytes(SECRET)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the libraries that write
        given = kind.write(rng, box / "in")
    path = given[0] if isinstance(given, tuple) else given
    if kind.file and rng.random() < 0.02:
        no_file(rng, path)
    before, start = _names(root), time.monotonic()
    tempfile.tempdir = str(spare)
    what, detail = READ, ""
    try:
        with chdir(box), _watched(kind.longest_s) as took, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind.read(given, box / "out")
    except EncodedObjectsError as error:
        what, detail = _refusal(error, kind, path)
    except FaultError as error:
        what, detail = error.args
    except HangError as error:
        what, detail = "hang", _where(error)
    except MemoryError as error:
        what, detail = "memory", _where(error)
    except Exception as error:  # noqa: BLE001  (which is what is looked for)
        what, detail = "traceback", _where(error)
    finally:
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


def _refusal(error, kind, path):
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


def _where(error):
    """Return the error and the last places of our packages that it went through."""
    ours = [f"{Path(frame.filename).name}:{frame.lineno}"
            for frame in traceback.extract_tb(error.__traceback__)
            if "/tests/" not in frame.filename and "/site-packages/" not in frame.filename
            and "/lib/python" not in frame.filename]  # fmt: skip
    return f"{type(error).__name__}: {str(error)[:60]!r} at {' < '.join(ours[:-4:-1])}"


def _names(root):
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
def _watched(longest_s):
    """Bound time and memory; yields a list of the megabytes that were taken at most."""
    took = [0.0]

    def late(*_):
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


def _status(name):
    status = Path("/proc/self/status").read_text()
    return int(status.partition(f"{name}:")[2].split()[0]) << 10
