"""The set that is validated: made from specs by `encode-object`, or what a database holds.

Specs -> parts and database -> URL and digest. The command runs as a process of its own:
nothing of the making is known here but its database and its files.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from generator.database import DatabaseError
from generator.database.open import database_exists, open_database
from generator.database.read import list_objects, read_parts
from generator.database.transaction import read_transaction
from recognizer.validation.errors import SetError

PARTS, LAB = "parts", "lab.db"
LAB_KEY = "VA11-DATE-0000-0002"  #: of the sets that are made here and say none


@dataclass(frozen=True, slots=True)
class Member:
    """An object of the set, as provenance names it."""

    name: str
    spec_sha256: str
    faces: int
    symbols: int
    array: str  #: profile and size
    pitch_mm: float


def make_parts(specs: list[Path], folder: Path, database: str, sensor_type: str = "") -> None:
    """Write the STL parts of specs, and register them.

    Parameters
    ----------
    specs
        Files for `encode-object`.
    folder
        Where the parts go.
    database
        Where they are registered; what is registered already is written again, the same. A new
        one has the key of the specs, or `LAB_KEY`: the same specs, the same touches.
    sensor_type
        File of the type that will touch them; empty: as the specs say.

    Raises
    ------
    SetError
        What `encode-object` says, with its exit code.
    """
    command = [sys.executable, "-c", "from generator.command import main; main()"]
    command += [*map(str, specs), "-o", str(folder), "--database", database]
    command += ["--format", "stl", "--json"]
    command += ["--sensor-type", sensor_type] if sensor_type else []
    if not (any(map(_says_lab_key, specs)) or database_exists(database)):
        command += ["--lab-key", LAB_KEY]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode:
        cause, fix, place = _first_problem(done.stdout, done.stderr)
        raise SetError(f"encode-object: {cause}", fix=fix, place=place, exit_code=done.returncode)


def _says_lab_key(spec: Path) -> bool:
    """Whether a spec, or an object written out in a set, names the key of its lab."""
    try:
        read = yaml.safe_load(spec.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError):
        return False  # encode-object says what is wrong with it
    blocks = [read, *(read.get("objects") or ())] if isinstance(read, dict) else []
    outputs = [block.get("output") for block in blocks if isinstance(block, dict)]
    return any(isinstance(output, dict) and "lab_key" in output for output in outputs)


def members_of(database: str) -> tuple[Member, ...]:
    """Return the objects of a database.

    Raises
    ------
    SetError
        It cannot be read.
    """
    try:
        with read_transaction(open_database(database, writable=False)) as connection:
            entries = list_objects(connection)
    except DatabaseError as error:
        raise SetError(error.cause, fix=error.fix, place=error.place or database) from error
    return tuple(
        Member(
            name=entry.name,
            spec_sha256=entry.spec_hash,
            faces=entry.faces,
            symbols=entry.symbols,
            array=f"{entry.profile} {entry.rows}x{entry.columns}",
            pitch_mm=entry.pitch_mm,
        )
        for entry in entries
    )


def set_digest(database: str) -> str:
    """Return a sha256 of what is touched and read: specs, arrays, styles and files.

    Raises
    ------
    SetError
        The database cannot be read.
    """
    try:
        with read_transaction(open_database(database, writable=False)) as connection:
            held: list[Any] = [
                [
                    entry.name,
                    entry.spec_hash,
                    entry.symbols,
                    [[part.name, part.sha256] for part in read_parts(connection, entry.object_id)],
                ]
                for entry in list_objects(connection)
            ]
    except DatabaseError as error:
        raise SetError(error.cause, fix=error.fix, place=error.place or database) from error
    return hashlib.sha256(json.dumps(held).encode()).hexdigest()


def _first_problem(stdout: str, stderr: str) -> tuple[str, str, str]:
    """Return cause, fix and place of the first problem that `encode-object` reports."""
    try:
        first = json.loads(stdout)["error"]
    except (ValueError, KeyError, IndexError):
        lines = (stderr or stdout).strip().splitlines()
        return (lines[-1] if lines else "it failed"), "", ""
    where = str(first.get("place") or "")
    return str(first.get("cause", "it failed")), str(first.get("fix") or ""), where
