"""The set that is validated: made from specs by `encode-object`, or what a database holds.

Specs -> parts and database -> URL and digest. The command runs as a process of its own: only its
database and its files are used. Some kinds of touches need more: members of their own, in the
profile and at the pitch of the set's first object, so that they are rivals of all others; and
databases of other labs, which made their parts with the same profile and keys of their own.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from generator.array.lab_key import lab_key_of
from generator.database import DatabaseError
from generator.database.open import database_exists, open_database
from generator.database.read import list_objects, read_object, read_parts
from generator.database.transaction import read_transaction
from recognizer.validation.errors import SetError, ValidationError

COPY, NEAR, SMALL, SIDE = "copy", "near", "small", "side"
SAME_PROFILE = "same_profile"
DECOY = "decoy"
SAME_SIZES, TURNED, SWAPPED = "same sizes", "turned panel", "swapped panel"
#: Faces of the set with so many of the symbols under the sensor exchanged for others.
EXCHANGED = {"one symbol": 1, "two symbols": 2, "three symbols": 3}
#: What `decoy` touches, each as often: parts made to be mistaken for registered ones (`draw`).
DECOYS = (*EXCHANGED, SAME_SIZES, SIDE, TURNED, SWAPPED)
#: Kinds that are touches of members of their own, and how the names of these begin.
EXTRA = {COPY: "Extra copy", NEAR: "Extra near", SMALL: "Extra small"}
BLOCK_MM = (45.0, 35.0, 28.0)  #: of copies and near ones
COPIES = 12  #: of one block; as many near ones
NEAR_MM = 0.5  #: from one near block to the next
#: Sides of small cubes over the pitch: 22 ... 25.2 mm at 7 mm, less than the sensor's 25.4 mm, with
#: room for nine symbols; smaller ones have no place that can be recognised, and are refused.
SMALL_PITCHES = (3.15, 3.3, 3.45, 3.6)
OTHER_LABS, LAB_OBJECTS = 2, 8  #: that made parts with the same profile; objects of each
LAB_MM = (35.0, 75.0)  #: their sizes

PARTS, LAB, LABS = "parts", "lab.db", "labs"
SAME_LAB = "lab-same-sizes"
LAB_KEY = "VA11-DATE-0000-0002"  #: of the sets that are made here and say none


def make_parts(specs: list[Path], folder: Path, database: str, sensor_type: str = "") -> None:
    """Write the STL parts of specs to a folder, and register them.

    A new database has the key of the specs, or `LAB_KEY`, so that a set made again gives the same
    touches. `sensor_type` is the file of the type that will touch the parts; empty: as the specs
    say.

    Raises SetError: what `encode-object` says, with its exit code.
    """
    command = [sys.executable, "-c", "from generator.command import main; main()"]
    command += [*map(str, specs), "-o", str(folder), "--database", database]
    command += ["--format", "stl", "--json"]
    command += ["--sensor-type", sensor_type] if sensor_type else []
    if not (any(map(_says_lab_key, specs)) or database_exists(database)):
        command += ["--lab-key", LAB_KEY]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode == 0:
        return
    try:
        first = json.loads(done.stdout)["error"]
    except (ValueError, KeyError, IndexError):
        lines = (done.stderr or done.stdout).strip().splitlines() or ["it failed"]
        first = {"cause": lines[-1]}
    raise SetError(
        f"encode-object: {first.get('cause', 'it failed')}",
        fix=str(first.get("fix") or ""),
        place=str(first.get("place") or ""),
        exit_code=done.returncode,
    )


def _says_lab_key(spec: Path) -> bool:
    """Whether a spec, or an object written out in a set, names the key of its lab."""
    try:
        read = yaml.safe_load(spec.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError):
        return False  # encode-object says what is wrong with it
    blocks = [read, *(read.get("objects") or ())] if isinstance(read, dict) else []
    outputs = [block.get("output") for block in blocks if isinstance(block, dict)]
    return any(isinstance(output, dict) and "lab_key" in output for output in outputs)


def members_of(database: str) -> list[dict[str, Any]]:
    """Return the objects of a database as provenance names them: `array` is profile and size.

    Raises SetError: the database cannot be read.
    """
    return [
        {
            "name": entry.name,
            "spec_sha256": entry.spec_hash,
            "faces": entry.faces,
            "symbols": entry.symbols,
            "array": f"{entry.profile} {entry.rows}x{entry.columns}",
            "pitch_mm": entry.pitch_mm,
        }
        for entry, _ in _entries(database)
    ]


def set_digest(database: str) -> str:
    """Return a sha256 of specs, arrays, styles and files; raises `SetError` if it cannot."""
    held = [
        [entry.name, entry.spec_hash, entry.symbols, [[part.name, part.sha256] for part in parts]]
        for entry, parts in _entries(database)
    ]
    return hashlib.sha256(json.dumps(held).encode()).hexdigest()


def _entries(database: str) -> list[tuple[Any, Any]]:
    """Return the objects of a database with their parts; raises `SetError` if it cannot."""
    try:
        with read_transaction(open_database(database, writable=False)) as connection:
            return [
                (entry, read_parts(connection, entry.object_id))
                for entry in list_objects(connection)
            ]
    except DatabaseError as error:
        raise SetError(error.cause, fix=error.fix, place=error.place or database) from error


def make_for_kinds(folder: Path, database: str, kinds: Collection[str], seed: int) -> None:
    """Make what kinds need besides the set, which is made, in the folder of the run.

    `seed` draws the objects of other labs.

    Raises ValidationError: two objects are to lie side by side and there is one; SetError: they
    cannot be made.
    """
    members = members_of(database)
    if {SIDE, DECOY} & set(kinds) and len(members) < 2:
        raise ValidationError(
            "two objects side by side need two, the set has one",
            fix="name a set of two objects or more, or leave out side and decoy",
            place="--kinds",
        )
    with read_transaction(open_database(database, writable=False)) as connection:
        spec = read_object(connection, members[0]["name"]).spec
    first = members[0] | {"printer": spec.get("printer", "") if isinstance(spec, dict) else ""}
    for kind in EXTRA:  # one after the other: they may be on different arrays
        if kind in kinds:
            specs = list(_extra_specs(kind, first["pitch_mm"]))
            _make(specs, first, folder / f"extra-{kind}.yaml", folder / PARTS, database)
    for number, name in enumerate(_lab_names(kinds)):
        lab = folder / LABS / name
        lab.mkdir(parents=True, exist_ok=True)
        specs = list(
            _specs_of_same_sizes(database, members)
            if name == SAME_LAB
            else _random_specs(number, np.random.default_rng([seed, number, 5]))
        )
        key = lab_key_of(np.random.default_rng([seed, number, 6]).bytes(16))
        _make(specs, first, lab / "set.yaml", lab / PARTS, str(lab / LAB), {"lab_key": key})


def labs_of(folder: Path, kinds: Collection[str]) -> tuple[str, ...]:
    """Return the databases of the other labs that a run touches; that of `SAME_SIZES` is last."""
    return tuple(str((folder / LABS / name / LAB).absolute()) for name in _lab_names(kinds))


def _lab_names(kinds: Collection[str]) -> list[str]:
    others = range(1, OTHER_LABS + 1) if SAME_PROFILE in kinds else ()
    return [f"lab-{number}" for number in others] + [SAME_LAB] * (DECOY in kinds)


def refuse_without_specs(kinds: Collection[str]) -> None:
    """Refuse kinds that need members of their own: a database that is named is only read."""
    made = [kind for kind in EXTRA if kind in kinds]
    if made:
        raise ValidationError(
            f"{', '.join(made)} need objects of their own, which would be registered in a database "
            "that is only named",
            fix="give the SPEC.yaml files of the set, whose database the run makes",
            place="--kinds",
        )


def is_extra(name: str, kind: str) -> bool:
    """Whether an object is one of those that touches of a kind are drawn from."""
    if kind in EXTRA:
        return name.startswith(EXTRA[kind])
    return not name.startswith(tuple(EXTRA.values()))


def _extra_specs(kind: str, pitch_mm: float) -> Iterator[dict[str, Any]]:
    name, (x, y, z) = EXTRA[kind], BLOCK_MM
    if kind == COPY:
        yield {"name": name, "shape": {"box": _lengths(x, y, z)}, "copies": COPIES}
    elif kind == NEAR:
        for k in range(COPIES):
            longer = x + k * NEAR_MM
            yield {"name": f"{name} {longer:g}", "shape": {"box": _lengths(longer, y, z)}}
    else:
        for pitches in SMALL_PITCHES:  # of the array that holds so little: auto
            side = round(pitches * pitch_mm, 1)
            shape = {"cube": f"{side:g} mm"}
            yield {"name": f"{name} {side:g}", "shape": shape, "profile": "auto"}


def _random_specs(lab: int, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    for k in range(LAB_OBJECTS):
        x, y, z = (float(round(size, 1)) for size in rng.uniform(*LAB_MM, 3))
        shapes: tuple[dict[str, Any], ...] = (
            {"box": _lengths(x, y, z)},
            {"triangular_prism": {"side": f"{x:g} mm", "height": f"{y:g} mm"}},
            {"cube": f"{x:g} mm"},
        )
        yield {"name": f"Other {lab + 1}-{k + 1}", "shape": shapes[k % 3]}


def _specs_of_same_sizes(database: str, members: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield boxes as large as the first objects of a set."""
    with read_transaction(open_database(database, writable=False)) as connection:
        for member in members[:LAB_OBJECTS]:
            corners = read_object(connection, member["name"]).polyhedron.vertices
            size = (float(round(side, 3)) for side in np.ptp(corners, axis=0))
            yield {"name": f"Same {member['name']}", "shape": {"box": _lengths(*size)}}


def _make(
    specs: list[dict[str, Any]],
    like: dict[str, Any],
    file: Path,
    folder: Path,
    database: str,
    output: dict[str, str] | None = None,
) -> None:
    """Make objects in the profile, at the pitch and for the printer of a member of the set."""
    style: dict[str, Any] = {
        "profile": like["array"].rpartition(" ")[0],
        "symbols": {"pitch": f"{like['pitch_mm']:g} mm"},
    }
    if like["printer"]:
        style["print"] = {"printer": like["printer"]}
    whole: dict[str, Any] = {"version": 1, "objects": [style | spec for spec in specs]}
    text = json.dumps(whole | ({"output": output} if output else {}), indent=1)
    file.write_text(text + "\n", "utf-8")
    make_parts([file], folder, database)


def _lengths(*sizes: float) -> list[str]:
    return [f"{size:g} mm" for size in sizes]
