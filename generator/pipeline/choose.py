"""`profile: auto`: the array that the objects need.

Of arrays with the same symbols the smallest is taken in which the objects fit beside what the
database holds: `one-touch`, `large`, and its next sizes. Objects that are registered keep the array
they are on, and a database goes on with the arrays that it has: where another one was registered
under a profile's name, that profile means that one. Faces that stay blank and would show a place
with the finer symbols of `fine` make it the choice where the spec names a printer for them, and a
note where it does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sqlalchemy import Connection

from generator.array.contract import SymbolArray
from generator.array.profiles import DEFAULT_PROFILE, PROFILES, Profile, next_larger
from generator.database.cells import array_of_profile, occupancy
from generator.database.entries import find_object
from generator.errors import ArrayError, GeneratorError, LayoutError
from generator.layout.placement import Layout
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import ObjectPlan, plan_object
from generator.pipeline.settings import CHOICE
from generator.polyhedron import Polyhedron
from generator.spec import LocatedSpec, error_at
from generator.spec.profile import AUTO
from generator.spec.script import with_profile


@dataclass(frozen=True, slots=True)
class Choice:
    """The specs with their array, and what the person should know about it."""

    specs: tuple[LocatedSpec, ...]
    notes: tuple[str, ...] = ()


def choose_array(
    specs: Sequence[LocatedSpec], connection: Connection | None, solid: Polyhedron | None = None
) -> Choice:
    """Return the specs on the database's arrays, with a profile in place of `auto`.

    Parameters
    ----------
    specs
        Of one run; where one of them names its profile, those of `auto` follow it.
    connection
        Of a `reading` transaction; None where there is no database yet.
    solid
        Shape of the one object, where it does not come from its spec.

    Raises
    ------
    GeneratorError
        No array is large enough, or an object cannot be made at all.
    """
    specs = tuple(_keep(one, connection) for one in specs)
    if not any(one.spec.profile == AUTO for one in specs):
        return Choice(specs)
    named = [one.spec for one in specs if one.spec.profile != AUTO]
    if named:  # on the same array, or the specs would have been refused
        profile, encoding = named[0].profile, named[0].encoding
        defaults = profile if profile in PROFILES else DEFAULT_PROFILE
        return Choice(tuple(_follow(one, profile, defaults, encoding) for one in specs))
    if connection is not None:
        for one in specs:
            known = find_object(connection, one.spec.name)
            kept = None if known is None else _profile_of_object(known.profile, connection)
            if kept is not None:
                array = kept.array()
                return Choice(tuple(_with_array(each, kept, array) for each in specs))
    short: list[str] = []  # why each smaller array does not do
    for candidate in _candidates(connection):
        array = candidate.array()
        tried = tuple(_with_array(one, candidate, array) for one in specs)
        needed, blank = _count_needs(tried, solid)
        room = _room(array, connection)
        size = f"{candidate.name} {array.rows}x{array.columns}"
        if needed is None:
            short.append(f"one object alone does not fit into {size}")
        elif needed > room:
            short.append(f"{needed} cells are needed, and {size} has room for {room}")
        else:
            notes = (_larger_note(candidate, array, short[-1]),) if short else ()
            found = Choice(tried, notes)
            return _choose_finer(found, blank, connection, solid) if blank else found
    raise LayoutError(
        f"the objects fit no array that is made here: {short[-1]}",
        fix="make them in several databases",
    )


def _larger_note(chosen: Profile, array: SymbolArray, why: str) -> str:
    """Return the note that a larger array was taken than the smallest one."""
    rows, columns = array.window
    of_smallest = "x".join(map(str, PROFILES[DEFAULT_PROFILE].window))
    window = f"window {rows}x{columns} in place of {of_smallest}"
    return f"profile {chosen.name} is taken ({window}): {why}"


def _choose_finer(
    coarse: Choice, blank: int, connection: Connection | None, solid: Polyhedron | None
) -> Choice:
    """Take the finer symbols where they show faces that stay blank otherwise."""
    fine = _stored_profile(PROFILES["fine"], connection)
    array = fine.array()
    try:
        finer = tuple(_with_array(one, fine, array) for one in coarse.specs)
        needed, left = _count_needs(finer, solid)
    except GeneratorError:  # the printer that the spec names cannot make them
        return coarse
    if needed is None or left >= blank or needed > _room(array, connection):
        return coarse
    if all(_names_printer(one) for one in coarse.specs):
        return Choice(finer)
    faces = f"{blank - left} of the {blank} blank faces"
    note = f"profile fine, for resin printers, would show places on {faces}"
    return Choice(coarse.specs, (*coarse.notes, note))


def _candidates(connection: Connection | None) -> Iterator[Profile]:
    """Yield the arrays from the smallest on."""
    yield _stored_profile(PROFILES["one-touch"], connection)
    larger = _stored_profile(PROFILES["large"], connection)
    yield larger
    for _ in range(CHOICE.larger):
        try:
            larger = next_larger(larger)
        except ArrayError:
            return
        rows, columns = larger.encoding["rows"], larger.encoding["columns"]
        yield replace(larger, name=f"large-{rows}x{columns}")


def _stored_profile(profile: Profile, connection: Connection | None) -> Profile:
    """Return a profile on the array that the database has under its name, if it has one."""
    if connection is None:
        return profile
    alike = [name for name, one in PROFILES.items() if one.encoding == profile.encoding]
    kept = array_of_profile(connection, alike or [profile.name])
    if kept is None:
        return profile
    return replace(profile, encoding=kept, window=tuple(kept["window"]))


def _profile_of_object(name: str, connection: Connection) -> Profile | None:
    """Return the profile of an object that got its array by `auto`, None for another one."""
    base = "large" if name.startswith("large-") else name
    kept = array_of_profile(connection, [name])
    if kept is None or base not in ("one-touch", "large"):
        return None
    return replace(PROFILES[base], name=name, encoding=kept, window=tuple(kept["window"]))


def _keep(located: LocatedSpec, connection: Connection | None) -> LocatedSpec:
    """Return a spec that names its profile, on the array of `_stored_profile`."""
    name = located.spec.profile
    if name not in PROFILES:
        return located
    kept = _stored_profile(PROFILES[name], connection)
    if kept is PROFILES[name]:
        return located
    return _with_array(located, kept, kept.array())


def _with_array(located: LocatedSpec, profile: Profile, array: SymbolArray) -> LocatedSpec:
    defaults = "large" if profile.name.startswith("large") else profile.name
    return with_profile(located, profile.name, defaults, array.definition())


def _follow(
    located: LocatedSpec, profile: str, defaults: str, encoding: Mapping[str, Any]
) -> LocatedSpec:
    """Return a spec with the array of another one, if its own is to be chosen."""
    if located.spec.profile != AUTO:
        return located
    return with_profile(located, profile, defaults, encoding)


def _count_needs(specs: Sequence[LocatedSpec], solid: Polyhedron | None) -> tuple[int | None, int]:
    """Return how many cells the objects need, None if one does not fit, and their blank faces."""
    known: dict[str, tuple[int, int]] = {}
    needed = blank = 0
    for one in specs:
        key = repr(one.spec.meaning)
        if key not in known:
            plan = plan_object(one, solid)
            try:
                layout = lay_out_object(plan, NO_CELLS)
            except LayoutError as error:
                if "is full" not in error.cause:
                    raise error_at(one, error, "shape") from error
                return None, 0
            known[key] = _counts(plan, layout)
        needed, blank = needed + known[key][0], blank + known[key][1]
    return needed, blank


def _counts(plan: ObjectPlan, layout: Layout) -> tuple[int, int]:
    cells = sum(len(face.labels) for face in layout.faces)
    return cells, len(set(layout.blank_faces) - plan.blank_faces)


def _room(array: SymbolArray, connection: Connection | None) -> int:
    """Return how many more cells of an array faces of all shapes can have."""
    taken = 0 if connection is None else occupancy(connection, array).used
    return max(0, int(CHOICE.full * array.rows * array.columns) - taken)


def _names_printer(located: LocatedSpec) -> bool:
    written = located.tree.value.get("print")
    return isinstance(written, dict) and written.get("printer") is not None
