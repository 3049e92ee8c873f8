"""The lab that objects are made in, and the array of a run.

The array is the lab's own of the profile. `auto` takes the smallest array of its symbols in which
the objects fit together with what the database holds, an empty one with room for more: `tactel-8`
or `large`, by the sensor type, and the next sizes. Registered objects keep their array, and their
pitch unless they are made again from a changed spec; those that came from another lab keep that
lab's array, and a lab goes on with the arrays that it has. Finer symbols are taken where the
printer makes them and they show places on faces that would stay blank, if these are more than a
small part of an object's surface: a fillet does not set the pitch of the whole part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from sqlalchemy import Connection

from generator.array.contract import SymbolArray
from generator.array.lab_key import draw_lab_key, read_lab_key
from generator.array.profiles import (
    DEFAULT_PROFILE,
    PROFILES,
    SMALLEST,
    Profile,
    family_of,
    next_larger,
)
from generator.database.cells import occupancy
from generator.database.lab import MOST_FILLED, LabArrays, lab_arrays, require_lab_key
from generator.database.read import find_object, read_array
from generator.database.registered import ObjectEntry, RegisteredArray
from generator.errors import ArrayError, GeneratorError, LayoutError
from generator.layout.placement import Layout
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import ObjectPlan, plan_objects
from generator.polyhedron import Polyhedron, surface_areas
from generator.spec import ObjectSpec
from generator.spec.problem import error_location
from generator.spec.read import with_profile
from generator.spec.resolved import AUTO

LARGER = 4  # sizes tried beyond `large`
FINER_SHARES = (0.9, 0.8)
"""Pitches tried where faces stay blank, over the one the sensor proposes: 4.5 and 4 mm."""
LEAST_SHOWN = 0.05
"""Of an object's surface that finer symbols must show besides."""
FIRST = 0.5  # of an array's room that its first objects may fill


@dataclass(frozen=True, slots=True)
class ArrayChoice:
    """The objects on their array."""

    plans: tuple[ObjectPlan, ...]
    notes: tuple[str, ...] = ()  #: what the person should know about the choice
    alone: tuple[Layout, ...] = ()  #: of each, on the empty array; () where none was needed

    @property
    def noted_plans(self) -> tuple[ObjectPlan, ...]:
        """The plans, of which the first has the notes."""
        first, *others = self.plans
        return (replace(first, notes=(*first.notes, *self.notes)), *others)


def lab_of(
    specs: Sequence[ObjectSpec], connection: Connection | None, lab_key: str = ""
) -> LabArrays:
    """Return key and arrays of the lab in which specs are made.

    Parameters
    ----------
    specs
        Of one run; they agree on a key, or say none.
    connection
        Of a transaction on the lab's database; None where there is none yet, and a key that
        nobody asked for is drawn.
    lab_key
        In place of the specs' own.

    Raises
    ------
    GeneratorError
        The key is misspelt, or the database has another one.
    """
    wanted = read_lab_key(lab_key) if lab_key else specs[0].lab_key
    if connection is None:
        return LabArrays(wanted or draw_lab_key(), {}, {})
    if lab_key:
        require_lab_key(connection, wanted)
    elif wanted:
        with error_location(specs[0].source, "output.lab_key"):
            require_lab_key(connection, wanted)
    return lab_arrays(connection)


def choose_array(
    specs: Sequence[ObjectSpec],
    lab: LabArrays,
    connection: Connection | None,
    solid: Polyhedron | None = None,
    *,
    replace_changed: bool = False,
) -> ArrayChoice:
    """Return the plans of objects on the array that they are made on.

    Parameters
    ----------
    specs
        Of one run; where one of them names its profile, those of `auto` follow it.
    lab
        Whose arrays they are.
    connection
        Of a read transaction; None where there is no database yet.
    solid
        Shape of the one object, where it does not come from its spec.
    replace_changed
        Objects of another lab may be made again, on an array of this one.

    Raises
    ------
    GeneratorError
        No array is large enough, or an object cannot be made at all.
    """
    known = _registered(specs, connection)
    other = None if replace_changed else _array_of_another_lab(specs, lab, connection, known)
    named = [one for one in specs if one.profile != AUTO]
    if named:  # on the same array, or the specs would have been refused
        profile = named[0].profile
        if profile not in PROFILES or not PROFILES[profile].keyed:
            made: tuple[Mapping[str, Any], str] = named[0].encoding, ""
        elif other:
            made = other.definition, other.lab_key
        else:
            made = lab.of_profile(PROFILES[profile]).definition(), lab.key_of(PROFILES[profile])
        return ArrayChoice(plan_objects([_follow(one, profile, *made) for one in specs], solid))
    kept = other or _array_kept(lab, known)
    if kept is not None:
        made = kept.definition, kept.lab_key
        new = next((entry.pitch_mm for entry in known.values()), None)  # that of those registered

        def follow(one: ObjectSpec, pitch_mm: float | None = None) -> ObjectSpec:
            return with_profile(one, kept.profile, AUTO, *made, pitch_mm)

        def placed(one: ObjectSpec) -> ObjectSpec:
            entry = known.get(one.name)
            if entry is None or not replace_changed:
                return follow(one, new if entry is None else entry.pitch_mm)
            with suppress(GeneratorError):
                spec = follow(one, entry.pitch_mm)
                if entry.same_spec(plan_objects([spec], solid)[0].meaning):
                    return spec
            return follow(one)  # made again from a changed spec, it has the pitch of that

        return ArrayChoice(plan_objects([placed(one) for one in specs], solid))
    short: list[str] = []  # why each smaller array does not do
    smallest = _smallest(specs, lab)
    for candidate in _candidates(smallest):
        array = lab.of_profile(candidate)
        made = array.definition(), lab.key_of(candidate)
        plans = plan_objects(
            [with_profile(one, candidate.name, AUTO, *made) for one in specs], solid
        )
        room = _room(array, connection)
        try:
            alone = _layouts(plans)
        except GeneratorError:  # an object shows no place at all, unless its symbols are finer
            finer = _choose_finer(ArrayChoice(plans), room, solid)
            if finer.alone:
                return finer
            raise
        size = f"{candidate.name} {array.rows}x{array.columns}"
        if alone is None:
            short.append(f"one object alone does not fit into {size}")
        elif (needed := _cells(alone)) > room:
            short.append(f"{needed} cells are needed, and {size} has room for {room}")
        else:
            windows = ["x".join(map(str, w)) for w in (array.window, smallest.window)]
            window = f"window {windows[0]} in place of {windows[1]}"
            notes = tuple(
                f"profile {candidate.name} is taken ({window}): {why}" for why in short[-1:]
            )
            choice = ArrayChoice(plans, notes, alone)
            return _choose_finer(choice, room, solid) if any(_blank(plans, alone)) else choice
    raise LayoutError(
        f"the objects fit no array that is made here: {short[-1]}",
        fix="make them in several databases",
    )


def _choose_finer(coarse: ArrayChoice, room: int, solid: Polyhedron | None) -> ArrayChoice:
    """Take finer symbols on the same array where they show faces that stay blank otherwise."""
    blank = left = _blank(coarse.plans, coarse.alone)
    areas = [surface_areas(plan.polyhedron) for plan in coarse.plans]
    found, specs = coarse, [plan.spec for plan in coarse.plans]
    for share in FINER_SHARES:
        try:
            finer = [
                with_profile(
                    one, one.profile, AUTO, one.encoding, one.array_key, _share_mm(share, one)
                )
                for one in specs
            ]
            plans = plan_objects(finer, solid)
            alone = _layouts(plans)
        except GeneratorError:  # the printer cannot make them, or they show no place either
            continue
        if alone is None or _cells(alone) > room:
            continue
        now = _blank(plans, alone)
        shown = max(
            (sum(of[k] for k in before) - sum(of[k] for k in after)) / sum(of.values())
            for of, before, after in zip(areas, left, now, strict=True)
        )
        if shown >= LEAST_SHOWN:
            faces, coarser = (sum(map(len, one)) for one in (now, blank))
            note = (
                f"pitch {_share_mm(share, specs[0]):g} mm is taken: it shows places on "
                f"{coarser - faces} of the {coarser} faces that coarser symbols leave blank"
            )
            found, left = ArrayChoice(plans, (*coarse.notes, note), alone), now
    return found


def _smallest(specs: Sequence[ObjectSpec], lab: LabArrays) -> Profile:
    """Return the smallest array of the letters that all objects can bear, or that the lab has."""
    made = {family_of(name) for name in lab.made}.intersection(SMALLEST)
    letters, usual = (PROFILES[name] for name in SMALLEST)
    bear = all(one.encoding["order"] >= letters.encoding["order"] for one in specs)
    return letters if bear and (not made or letters.name in made) else usual


def _candidates(smallest: Profile) -> Iterator[Profile]:
    larger = smallest
    yield larger
    for _ in range(LARGER):
        try:
            larger = next_larger(larger)
        except ArrayError:
            return
        rows, columns = larger.encoding["rows"], larger.encoding["columns"]
        yield replace(larger, name=f"{smallest.name}-{rows}x{columns}")


def _registered(
    specs: Sequence[ObjectSpec], connection: Connection | None
) -> dict[str, ObjectEntry]:
    """Return the objects that are registered already, by their names, in the order of specs."""
    if connection is None:
        return {}
    found = (find_object(connection, one.name) for one in specs)
    return {entry.name: entry for entry in found if entry is not None}


def _array_of_another_lab(
    specs: Sequence[ObjectSpec],
    lab: LabArrays,
    connection: Connection | None,
    known: Mapping[str, ObjectEntry],
) -> RegisteredArray | None:
    """Return the one array of another lab that all objects are registered on, with its profile."""
    numbers = {entry.array_id for entry in known.values()}
    if connection is None or len(numbers) != 1:
        return None
    if any(
        one.name not in known or one.profile not in (AUTO, known[one.name].profile) for one in specs
    ):
        return None
    array = read_array(connection, numbers.pop())
    keyed = _of_candidate(array.profile) or array.profile == "fine"
    return array if keyed and array.lab_key != lab.key else None


def _array_kept(lab: LabArrays, known: Mapping[str, ObjectEntry]) -> RegisteredArray | None:
    """Return the array of the lab's own that one of the objects is registered on."""
    arrays = (lab.made.get(entry.profile) for entry in known.values())
    return next((one for one in arrays if one is not None and _of_candidate(one.profile)), None)


def _of_candidate(profile: str) -> bool:
    """Whether `auto` gave objects arrays under a profile's name, in this version or before it."""
    return profile in (DEFAULT_PROFILE, "fine") or family_of(profile) in SMALLEST


def _share_mm(share: float, spec: ObjectSpec) -> float:
    return round(share * spec.sensor.symbol_pitch_mm, 2)


def _follow(
    spec: ObjectSpec, profile: str, encoding: Mapping[str, Any], array_key: str
) -> ObjectSpec:
    """Return a spec on an array; with the profile of another one, if its own is to be chosen."""
    if spec.profile != AUTO:
        return replace(spec, encoding=encoding, array_key=array_key)
    defaults = profile if profile in PROFILES else AUTO
    return with_profile(spec, profile, defaults, encoding, array_key)


def _layouts(plans: Sequence[ObjectPlan]) -> tuple[Layout, ...] | None:
    """Return the layout of each object on the empty array; None if one does not fit."""
    known: dict[str, Layout] = {}
    for plan in plans:
        key = repr(plan.spec.meaning)
        if key not in known:
            try:
                known[key] = lay_out_object(plan, NO_CELLS)
            except LayoutError as error:
                if "is full" in error.cause:
                    return None
                with error_location(plan.spec.source, "shape"):
                    raise
    return tuple(known[repr(plan.spec.meaning)] for plan in plans)


def _cells(layouts: Sequence[Layout]) -> int:
    return sum(len(face.labels) for layout in layouts for face in layout.faces)


def _blank(plans: Sequence[ObjectPlan], layouts: Sequence[Layout]) -> list[set[int]]:
    """Return the faces that could carry symbols and show none, by object; all without layouts."""
    if not layouts:
        return [set(range(len(plan.polyhedron.faces))) - plan.blank_faces for plan in plans]
    pairs = zip(plans, layouts, strict=True)
    return [set(layout.blank_faces) - plan.blank_faces for plan, layout in pairs]


def _room(array: SymbolArray, connection: Connection | None) -> int:
    """Return how many more cells objects may take of an array; the first ones leave room."""
    taken = 0 if connection is None else occupancy(connection, array).used
    room = max(0, int(MOST_FILLED * array.rows * array.columns) - taken)
    return room if taken else int(FIRST * room)
