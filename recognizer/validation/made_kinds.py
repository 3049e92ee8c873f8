"""What some kinds of touches need beside the set: copies, near ones, small ones, other labs.

Kinds + the set that is made -> more members in its database, and databases of other labs in a
folder beside it. Members are made from specs in the profile and at the pitch of the set's first
object, so that they are rivals of all others; another lab has made its parts with the same
profile and a key of its own, and knows nothing of this one.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from generator.array.lab_key import lab_key_of
from recognizer.validation.encoded_set import LAB, PARTS, Member, make_parts, members_of
from recognizer.validation.errors import ValidationError
from recognizer.validation.settings import MAKING

COPY, NEAR, SMALL, SIDE = "copy", "near", "small", "side"
SAME_PROFILE = "same_profile"
EXTRA = {COPY: "Extra copy", NEAR: "Extra near", SMALL: "Extra small"}
"""Kinds that are touches of members of their own, and how the names of these begin."""
LABS = "labs"


def make_for_kinds(folder: Path, database: str, kinds: Collection[str], seed: int) -> None:
    """Make what kinds need beside the set.

    Parameters
    ----------
    folder
        Of the run.
    database
        Of the set, which is made.
    kinds
        Of the campaign.
    seed
        Of the campaign; draws the objects of other labs.

    Raises
    ------
    ValidationError
        Two objects are to lie side by side and there is one.
    SetError
        They cannot be made.
    """
    members = members_of(database)
    if SIDE in kinds and len(members) < 2:
        raise ValidationError(
            "two objects side by side need two, the set has one",
            fix="name a set of two objects or more, or leave out side",
            place="--kinds",
        )
    first = members[0]
    for kind in EXTRA:  # one after the other: they may be on different arrays
        if kind in kinds:
            specs = list(_extra_specs(kind, first.pitch_mm))
            _make(specs, first, folder / f"extra-{kind}.yaml", folder / PARTS, database)
    if SAME_PROFILE in kinds:
        for number in range(MAKING.labs):
            lab = folder / LABS / f"lab-{number + 1}"
            lab.mkdir(parents=True, exist_ok=True)
            rng = np.random.default_rng([seed, number, 5])
            specs = list(_random_specs(number, rng))
            key = lab_key_of(np.random.default_rng([seed, number, 6]).bytes(16))
            _make(specs, first, lab / "set.yaml", lab / PARTS, str(lab / LAB), lab_key=key)


def labs_of(folder: Path, kinds: Collection[str]) -> tuple[str, ...]:
    """Return the databases of the other labs that a run touches."""
    if SAME_PROFILE not in kinds:
        return ()
    found = range(1, MAKING.labs + 1)
    return tuple(str((folder / LABS / f"lab-{number}" / LAB).absolute()) for number in found)


def refuse_without_specs(kinds: Collection[str]) -> None:
    """See to it that no object is registered in a database that is only to be read.

    Raises
    ------
    ValidationError
        A kind needs members of its own.
    """
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
    name, (x, y, z) = EXTRA[kind], MAKING.block_mm
    if kind == COPY:
        yield {"name": name, "shape": {"box": _lengths(x, y, z)}, "copies": MAKING.copies}
    elif kind == NEAR:
        for k in range(MAKING.copies):
            longer = x + k * MAKING.near_mm
            yield {"name": f"{name} {longer:g}", "shape": {"box": _lengths(longer, y, z)}}
    else:
        for pitches in MAKING.small_pitches:  # of the array that holds so little: auto
            side = round(pitches * pitch_mm, 1)
            shape = {"cube": f"{side:g} mm"}
            yield {"name": f"{name} {side:g}", "shape": shape, "profile": "auto"}


def _random_specs(lab: int, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    """Yield the objects of another lab, of any size."""
    for k in range(MAKING.lab_objects):
        x, y, z = (float(round(size, 1)) for size in rng.uniform(*MAKING.lab_mm, 3))
        shape: dict[str, Any] = {"box": _lengths(x, y, z)}
        if k % 3 == 1:
            shape = {"triangular_prism": {"side": f"{x:g} mm", "height": f"{y:g} mm"}}
        if k % 3 == 2:
            shape = {"cube": f"{x:g} mm"}
        yield {"name": f"Other {lab + 1}-{k + 1}", "shape": shape}


def _make(
    specs: list[dict[str, Any]],
    like: Member,
    file: Path,
    folder: Path,
    database: str,
    lab_key: str = "",
) -> None:
    style = {
        "profile": like.array.rpartition(" ")[0],
        "symbols": {"pitch": f"{like.pitch_mm:g} mm"},
    }
    whole: dict[str, Any] = {"version": 1, "objects": [style | spec for spec in specs]}
    if lab_key:
        whole["output"] = {"lab_key": lab_key}
    text = json.dumps(whole, indent=1)
    file.write_text(text + "\n", "utf-8")
    make_parts([file], folder, database)


def _lengths(*sizes: float) -> list[str]:
    return [f"{size:g} mm" for size in sizes]
