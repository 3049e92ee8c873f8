"""The array of a run: the lab's own of the profile, and for `auto` the one that the objects need.

Of arrays with the same symbols the smallest is taken in which the objects fit beside what the
database holds, an empty one with room for more of them: `large`, and its next sizes. Objects that
are registered keep the array they are on and their pitch, and a lab goes on with the arrays that
it has: what it made objects on under a profile's name is what that profile means. The finer
symbols are taken where the printer makes them and they show places on faces that would
stay blank. Objects that came from another lab, asked for again, keep that lab's array.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sqlalchemy import Connection

from generator.array.contract import SymbolArray
from generator.array.profiles import DEFAULT_PROFILE, PROFILES, Profile, next_larger
from generator.database.cells import occupancy
from generator.database.lab import MOST_FILLED, LabArrays
from generator.database.read import find_object, read_array
from generator.database.registered import RegisteredArray
from generator.errors import ArrayError, GeneratorError, LayoutError
from generator.layout.placement import Layout
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import ObjectPlan, plan_object
from generator.pipeline.settings import CHOICE
from generator.polyhedron import Polyhedron
from generator.spec import LocatedSpec, error_at
from generator.spec.profile import AUTO, SMALLEST
from generator.spec.script import with_profile


@dataclass(frozen=True, slots=True)
class Choice:
    """The specs with their array, and what the person should know about it."""

    specs: tuple[LocatedSpec, ...]
    notes: tuple[str, ...] = ()
    alone: tuple[Layout, ...] = ()  #: of each, on the empty array; () where none was needed


def choose_array(
    specs: Sequence[LocatedSpec],
    lab: LabArrays,
    connection: Connection | None,
    solid: Polyhedron | None = None,
    *,
    replace_changed: bool = False,
) -> Choice:
    """Return the specs on the array that they are made on, with a profile in place of `auto`.

    Parameters
    ----------
    specs
        Of one run; where one of them names its profile, those of `auto` follow it.
    lab
        Whose arrays they are.
    connection
        Of a `reading` transaction; None where there is no database yet.
    solid
        Shape of the one object, where it does not come from its spec.
    replace_changed
        Objects of another lab may be made anew, on an array of this one.

    Raises
    ------
    GeneratorError
        No array is large enough, or an object cannot be made at all.
    """
    other = None if replace_changed else _array_of_another_lab(specs, lab, connection)
    named = [one.spec for one in specs if one.spec.profile != AUTO]
    if named:  # on the same array, or the specs would have been refused
        profile = named[0].profile
        if profile not in PROFILES or not PROFILES[profile].keyed:
            published = named[0].encoding, ""
            return Choice(tuple(_follow(one, profile, *published) for one in specs))
        made = (other.definition, other.lab_key) if other else _made_on(PROFILES[profile], lab)
        return Choice(tuple(_follow(one, profile, *made) for one in specs))
    pitches = _registered_pitches(specs, connection)
    kept = other or _array_kept(specs, lab, connection)
    if kept is not None:
        made = kept.definition, kept.lab_key
        new = next(iter(pitches.values()), None)  # as those that stand beside it
        return Choice(
            tuple(
                _with_array(one, kept.profile, *made, pitches.get(one.spec.name, new))
                for one in specs
            )
        )
    short: list[str] = []  # why each smaller array does not do
    for candidate in _candidates():
        array = lab.of_profile(candidate)
        made = array.definition(), lab.key_of(candidate)
        tried = tuple(_with_array(one, candidate.name, *made) for one in specs)
        needed, blank, alone = _count_needs(tried, solid)
        room = _room(array, connection)
        size = f"{candidate.name} {array.rows}x{array.columns}"
        if needed is None:
            short.append(f"one object alone does not fit into {size}")
        elif needed > room:
            short.append(f"{needed} cells are needed, and {size} has room for {room}")
        else:
            notes = (_larger_note(candidate, array, short[-1]),) if short else ()
            found = Choice(tried, notes, alone)
            return _choose_finer(found, blank, room, solid) if blank else found
    raise LayoutError(
        f"the objects fit no array that is made here: {short[-1]}",
        fix="make them in several databases",
    )


def _larger_note(chosen: Profile, array: SymbolArray, why: str) -> str:
    """Return the note that a larger array was taken than the smallest one."""
    rows, columns = array.window
    of_smallest = "x".join(map(str, PROFILES[SMALLEST].window))
    window = f"window {rows}x{columns} in place of {of_smallest}"
    return f"profile {chosen.name} is taken ({window}): {why}"


def _choose_finer(coarse: Choice, blank: int, room: int, solid: Polyhedron | None) -> Choice:
    """Take finer symbols on the same array where they show faces that stay blank otherwise."""
    found, left = coarse, blank
    for share in CHOICE.finer_shares:
        pitch = _share_mm(share, coarse.specs[0])
        try:
            finer = tuple(_with_pitch(one, _share_mm(share, one)) for one in coarse.specs)
            needed, now, alone = _count_needs(finer, solid)
        except GeneratorError:  # the printer cannot make them
            break
        if needed is not None and now < left and needed <= room:
            faces = f"{blank - now} of the {blank} faces that coarser symbols leave blank"
            note = f"pitch {pitch:g} mm is taken: it shows places on {faces}"
            found, left = Choice(finer, (*coarse.notes, note), alone), now
    return found


def _candidates() -> Iterator[Profile]:
    """Yield the arrays from the smallest on."""
    larger = PROFILES[SMALLEST]
    yield larger
    for _ in range(CHOICE.larger):
        try:
            larger = next_larger(larger)
        except ArrayError:
            return
        rows, columns = larger.encoding["rows"], larger.encoding["columns"]
        yield replace(larger, name=f"large-{rows}x{columns}")


def _made_on(profile: Profile, lab: LabArrays) -> tuple[Mapping[str, Any], str]:
    """Return the definition of the lab's array of a profile, and the key it was made from."""
    return lab.of_profile(profile).definition(), lab.key_of(profile)


def _array_of_another_lab(
    specs: Sequence[LocatedSpec], lab: LabArrays, connection: Connection | None
) -> RegisteredArray | None:
    """Return the one array of another lab that all objects are registered on, with its profile."""
    numbers = set()
    for one in specs:
        known = None if connection is None else find_object(connection, one.spec.name)
        if known is None or one.spec.profile not in (AUTO, known.profile):
            return None
        numbers.add(known.array_id)
    if connection is None or len(numbers) != 1:
        return None
    array = read_array(connection, numbers.pop())
    keyed = _of_candidate(array.profile) or array.profile == "fine"
    return array if keyed and array.lab_key != lab.key else None


def _registered_pitches(
    specs: Sequence[LocatedSpec], connection: Connection | None
) -> dict[str, float]:
    """Return the pitch of each object that is registered already, mm."""
    if connection is None:
        return {}
    entries = (find_object(connection, one.spec.name) for one in specs)
    return {entry.name: entry.pitch_mm for entry in entries if entry is not None}


def _array_kept(
    specs: Sequence[LocatedSpec], lab: LabArrays, connection: Connection | None
) -> RegisteredArray | None:
    """Return the array of the lab's own that one of the objects is registered on."""
    if connection is None:
        return None
    for one in specs:
        known = find_object(connection, one.spec.name)
        kept = lab.made.get(known.profile) if known else None
        if kept is not None and _of_candidate(kept.profile):
            return kept
    return None


def _of_candidate(profile: str) -> bool:
    """Whether `auto` gave objects arrays under a profile's name, in this version or before it."""
    return profile in (DEFAULT_PROFILE, "fine") or profile.partition("-")[0] == SMALLEST


def _with_array(
    located: LocatedSpec,
    profile: str,
    encoding: Mapping[str, Any],
    array_key: str,
    pitch_mm: float | None = None,
) -> LocatedSpec:
    """Return a spec of `auto` on an array; at a pitch, if its own is to be chosen."""
    return with_profile(located, profile, AUTO, encoding, array_key, pitch_mm)


def _share_mm(share: float, located: LocatedSpec) -> float:
    """Return a share of the pitch that the sensor of an object proposes, mm."""
    return round(share * located.spec.sensor.symbol_pitch_mm, 2)


def _with_pitch(located: LocatedSpec, pitch_mm: float) -> LocatedSpec:
    spec = located.spec
    return _with_array(located, spec.profile, spec.encoding, spec.array_key, pitch_mm)


def _follow(
    located: LocatedSpec, profile: str, encoding: Mapping[str, Any], array_key: str
) -> LocatedSpec:
    """Return a spec on an array; with the profile of another one, if its own is to be chosen."""
    if located.spec.profile != AUTO:
        spec = replace(located.spec, encoding=encoding, array_key=array_key)
        return replace(located, spec=spec)
    defaults = profile if profile in PROFILES else AUTO
    return with_profile(located, profile, defaults, encoding, array_key)


def _count_needs(
    specs: Sequence[LocatedSpec], solid: Polyhedron | None
) -> tuple[int | None, int, tuple[Layout, ...]]:
    """Return how many cells the objects need, None if one does not fit, and their blank faces.

    With the layout of each, on the empty array.
    """
    known: dict[str, tuple[int, int, Layout]] = {}
    found = []
    for one in specs:
        key = repr(one.spec.meaning)
        if key not in known:
            plan = plan_object(one, solid)
            try:
                layout = lay_out_object(plan, NO_CELLS)
            except LayoutError as error:
                if "is full" not in error.cause:
                    raise error_at(one, error, "shape") from error
                return None, 0, ()
            known[key] = (*_counts(plan, layout), layout)
        found.append(known[key])
    cells, blank, layouts = zip(*found, strict=True)
    return sum(cells), sum(blank), layouts


def _counts(plan: ObjectPlan, layout: Layout) -> tuple[int, int]:
    cells = sum(len(face.labels) for face in layout.faces)
    return cells, len(set(layout.blank_faces) - plan.blank_faces)


def _room(array: SymbolArray, connection: Connection | None) -> int:
    """Return how many more cells of an array objects may have, faces of all shapes.

    The first ones leave room for more.
    """
    taken = 0 if connection is None else occupancy(connection, array).used
    room = max(0, int(MOST_FILLED * array.rows * array.columns) - taken)
    return room if taken else int(CHOICE.first * room)
