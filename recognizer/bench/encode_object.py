"""What the bench asks of `encode-object`: parts to make and to try, an example, what faces promise.

It runs as the command, since making and reading share the database alone: what a page sends is
checked, and what it gets is written, as for everybody. Each run is a process with limits, one at a
time, which ends when the page that waits for it leaves or the server ends.
"""

from __future__ import annotations

import json
import re
import tempfile
import threading
import zipfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from subprocess import Popen
from typing import IO, Any

from encoded_objects.base.foreign import run_limited, waiting_process
from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from generator.database.open import normal_url, open_database
from generator.database.transaction import read_transaction
from recognizer.bench.errors import BenchError, BusyError, RefusedError
from recognizer.bench.files import part_folder
from recognizer.bench.lab_json import object_json
from recognizer.bench.options import LAB

EXAMPLE = "name: Example\nshape: {cube: 60 mm}\n"
SHORT_S = 60.0  #: of processor time, to try a part and to show one; most take 1 to 3 s
MAKE_S = 300.0  #: to make a part; a cube takes 2 s
DRAWN = 100_000  #: symbols of a part that is drawn: a cube of 600 mm, 6 MB
MEMORY = 4 * 1024**3  #: bytes of addresses of the command; the example takes 0.6 GB
WRITTEN = 1024**3  #: bytes of a file that it writes
ZIPPED = 512 * 1024**2  #: bytes of all files of a zip; a cube takes 12 MB
LOADS = ("generator.pipeline", "generator.spec.option", "generator.command.made_report", "numpy.ma")
#: what trying a part needs: four fifths of its time, spent while nobody waits
LOOK_S = 0.05  #: between two looks at whether it is still waited for

_FILE = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,99}")  #: names of objects that can name a spec
_TURN = threading.Lock()  #: one command at a time
_ENDING = threading.Event()
_WAITING: list[Popen[bytes]] = []  #: a process that has loaded `LOADS`, for the next command


@lru_cache(maxsize=1)
def part_settings() -> dict[str, Any]:
    """Return what a page may ask for: the schema of specs.

    Raises BenchError: `encode-object` fails; says why.
    """
    return _ask("schema", longest_s=SHORT_S)


def try_part(text: str, name: str, database: str, gone: Callable[[], bool]) -> dict[str, Any]:
    """Return what `encode-object --dry-run` says of a spec, and its first object to be drawn.

    None in place of an object of more than `DRAWN` symbols.

    Parameters
    ----------
    text, name
        The spec, and what its object is called.
    database
        Of the lab in which it would be made; empty: one of its own.
    gone
        Says that nobody waits for it.

    Raises
    ------
    BenchError
        The spec is refused, or takes more than it may.
    BusyError
        The server ends, or nobody waits for it.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        spec, trial = _write_spec(folder, text, name), folder / "trial.db"
        try:
            made = _ask(
                spec.name, "--no-files", "--dry-run", "--trial", trial.name,
                "--database", _address(database), folder=folder, longest_s=SHORT_S, gone=gone,
            )  # fmt: skip
        finally:
            load_ahead()
        first = made["objects"][0]
        if first["symbols"] > DRAWN:
            return {"made": made, "shape": None}
        engine = open_database(str(trial), writable=False)
        with read_transaction(engine) as connection:
            shape = object_json(connection, first["name"])
        engine.dispose()
    return {"made": made, "shape": shape}


def make_part(
    text: str, name: str, database: str, gone: Callable[[], bool]
) -> tuple[str, str, IO[bytes]]:
    """Make what a spec says; return the name of a zip, that of its first object, and the zip.

    The files stand as the command writes them, `out/NAME/...`, with the spec beside them. With a
    `database` they are written and registered where it lies (a server's: in the current folder);
    without one the zip holds a lab of its own. Otherwise as `try_part`.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        spec = _write_spec(folder, text, name)
        home = (part_folder(database) or Path.cwd()) if database else folder
        made = _ask(
            str(spec), "--no-files", "--jobs", "1", "--database", _address(database),
            folder=home, longest_s=MAKE_S, gone=gone,
        )  # fmt: skip
        files = [file for one in made["objects"] for file in one["files"]] + made["set_files"]
        written = {spec.name: spec} | {file: home / file for file in files}
        if not database:
            written[LAB] = folder / LAB
        if sum(path.stat().st_size for path in written.values()) > ZIPPED:
            raise BenchError(f"the files take more than {ZIPPED / 2**20:g} MB",
                             fix="make it with encode-object, in fewer formats")  # fmt: skip
        return spec.stem, made["objects"][0]["name"], _zipped(written, gone)


def _zipped(files: dict[str, Path], gone: Callable[[], bool]) -> IO[bytes]:
    """Return a zip of files by their names in it; the same files, the same bytes."""
    packed = tempfile.TemporaryFile()  # noqa: SIM115 - the answer closes it
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in sorted(files.items()):
            if _ENDING.is_set() or gone():
                raise BusyError("it was given up", fix="make it again")
            entry = zipfile.ZipInfo(name)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED, compresslevel=1)
    packed.seek(0)
    return packed


def _write_spec(folder: Path, text: str, name: str) -> Path:
    """Write a spec into a folder, under its object's name where a file can be called so."""
    spec = folder / f"{name if _FILE.fullmatch(name) else 'spec'}.yaml"
    spec.write_text(text, encoding="utf-8", errors="replace")
    return spec


def _address(database: str) -> str:
    """Return a database as it is called in any folder; one of its own if none is given."""
    url = normal_url(database or LAB)
    file = database and url.get_backend_name() == "sqlite"
    return str(Path(url.database or "").absolute()) if file else database or LAB


@lru_cache(maxsize=512)
def face_promises(
    database: str,
    name: str,
    registered: str,  # noqa: ARG001 - a new object of this name is another one
    sensor: SensorType,
) -> dict[str, dict[str, Any]]:
    """Return the expected recognition rate of each face by its name, as `encode-object show`.

    Faces of which nothing is said are left out.

    Raises BenchError: `encode-object` fails; says why.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "sensor.yaml")
        file.write_text(sensor_type_text(sensor), encoding="utf-8")
        found = _ask(
            "show", name, "--database", database, "--sensor-type", str(file), longest_s=SHORT_S
        )
    return {face["name"]: face["promise"] for face in found["faces"] if face["promise"]}


def end_all() -> None:
    """End the command that runs, and begin no other: the server ends."""
    _ENDING.set()
    for process in _WAITING:
        process.kill()
        process.wait()


def load_ahead() -> None:
    """Begin a process for the next command, if none runs: somebody fills in the form."""
    if _TURN.acquire(blocking=False):
        if not _WAITING:
            _WAITING.append(waiting_process(*LOADS))
        _TURN.release()
    if _ENDING.is_set():
        end_all()


def _ask(
    *words: str,
    longest_s: float,
    folder: Path | None = None,
    gone: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Run the command in a folder; return what it prints as JSON.

    Raises BenchError: it refuses what it is given, or takes more than it may; BusyError: the server
    ends, or nobody waits any more.
    """

    def given_up() -> bool:
        return _ENDING.is_set() or gone()

    while not _TURN.acquire(timeout=LOOK_S):
        if given_up():
            raise BusyError("it was given up, or open-bench ends", fix="try again")
    try:
        code, printed = run_limited(
            "generator.command", [*words, "--json"], memory_bytes=MEMORY, cpu_s=longest_s,
            written_bytes=WRITTEN, folder=folder, ending=given_up,
            waiting=_WAITING.pop() if _WAITING else None,
        )  # fmt: skip
    except (OSError, TimeoutError) as error:
        raise BenchError(f"it could not be done: {error}", fix="try again") from error
    finally:
        _TURN.release()
    if given_up():
        raise BusyError("it was given up, or open-bench ends", fix="try again")
    try:
        found = json.loads(printed)
    except ValueError:
        raise BenchError(
            f"it takes more than {MEMORY / 1024**3:g} GB or {longest_s:g} s, or fails ({code})",
            fix="try something smaller, or encode-object, which has no limits",
        ) from None
    if "error" in found:
        raise RefusedError(found["error"])
    return dict(found)
