"""Read specs: one object a file, or a set of objects that share one array.

Files -> `ObjectSpec` values; all problems of all files are reported at once. Settings from a
Python script are written as YAML and read as a file is: equal words, equal messages, with the
place `encode():line:column`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from encoded_objects.base.document import Problem
from encoded_objects.base.settings import FILES_REFUSED, NO_FILES
from encoded_objects.base.yaml_tree import Place, Tree, read_tree, tree_of
from generator.array.profiles import PROFILES, family_of
from generator.spec.explain import explain_errors
from generator.spec.problem import SPEC, SpecError, mark_of
from generator.spec.resolve import folder_name, resolve
from generator.spec.resolved import AUTO, ObjectSpec, ShapeSpec
from generator.spec.settings import Defaults, NamedSettings, ObjectSettings, SharedSettings
from generator.spec.shape import is_model

OBJECTS_MAX = 10_000
PROBLEMS_SHOWN = 25
SOURCE = "encode()"  #: how messages call the values of a script
SHARED_BLOCKS = ("symbols", "print", "output")  # merged setting by setting


def read_specs(
    paths: Sequence[Path | str | Tree],
    *,
    database: str | None = None,
    sensor_type: str = "",
    files: bool = True,
) -> tuple[ObjectSpec, ...]:
    """Read all objects of one run: one ObjectSpec for each object and copy, in the order of files.

    Parameters
    ----------
    paths
        Spec files, or what was read of them; each holds one object or a set.
    database
        URL in place of those in the files, which may then name different ones.
    sensor_type
        Name or file in place of what the specs say; empty: as they say.
    files
        Whether specs may name files and folders; those of strangers may not.

    Raises
    ------
    SpecError
        Every problem of every file; also objects with one name, or on different arrays.

    Examples
    --------
    >>> read_specs(["fixtures/cube.yaml"])[0].style.pitch_mm
    5.0
    """
    problems: list[Problem] = []
    found: list[ObjectSpec] = []
    context = None if files else NO_FILES
    for path in paths:
        try:
            source = path if isinstance(path, Tree) else _tree_at(Path(path))
        except SpecError as error:
            problems += error.problems
            continue
        problems += source.problems
        origin = _origin(path, source)
        for written in list(_objects(source, problems, files)):
            tree = written
            if sensor_type and isinstance(tree.value, dict):
                tree = replace(tree, value={**tree.value, "sensor_type": sensor_type})
            try:
                settings = ObjectSettings.model_validate(tree.value, context=context)
                if len(found) + settings.copies <= OBJECTS_MAX:
                    found += [replace(spec, origin=origin) for spec in resolve(settings, tree)]
                else:
                    cause = f"more than {OBJECTS_MAX} objects in one run"
                    mark = mark_of(tree, "copies, name")
                    problems.append(Problem(cause, "make them in several runs", mark))
            except ValidationError as error:
                problems += explain_errors(error, tree, ObjectSettings)
                problems += _problems_of_read_blocks(error, tree)
            except SpecError as error:
                problems += error.problems
    if not problems:
        problems += _shared_problems(found, database)
    if problems:
        raise SpecError(_unique_problems(problems))
    return tuple(found)


def spec_of(settings: Mapping[str, Any], shape: ShapeSpec) -> ObjectSpec:
    """Return the spec of one object from settings as in a file and a shape; None means not given.

    Raises
    ------
    SpecError
        Every setting that is unknown, out of range or does not go with the others.
    """
    tree = tree_from(settings)
    if tree.problems:
        raise SpecError(tree.problems)
    try:
        read = NamedSettings.model_validate(tree.value)
    except ValidationError as error:
        raise SpecError(explain_errors(error, tree, NamedSettings)) from None
    if read.copies != 1:
        fix = "call encode once for each copy, with a name of its own"
        raise SpecError(
            [Problem("one solid is encoded at a time", fix, tree.key_mark(("copies",)))]
        )
    return resolve(read, tree, shape)[0]


def tree_from(settings: Mapping[str, Any]) -> Tree:
    """Return settings as the tree of a file that says them; None means not given.

    Raises
    ------
    SpecError
        A setting that no file can say.
    """
    try:
        text = yaml.safe_dump(_without_none(settings), sort_keys=False, allow_unicode=True)
    except yaml.YAMLError as error:
        fix = "give numbers, texts, lists and dicts of them, as in a spec file"
        cause = f"a setting is not a plain value: {error}"
        raise SpecError([Problem(cause, fix, file=SOURCE)]) from None
    return tree_of(text, SOURCE, Path(), SPEC)


def with_profile(
    spec: ObjectSpec,
    name: str,
    defaults: str,
    encoding: Mapping[str, Any],
    array_key: str,
    pitch_mm: float | None = None,
) -> ObjectSpec:
    """Return a spec on another array.

    Parameters
    ----------
    name
        Of the profile, as the database will name it.
    defaults
        Profile whose symbols and printer hold where the spec names none.
    encoding
        Complete definition of the array.
    array_key
        Lab key that it was made from; empty for a published one.
    pitch_mm
        Where the spec says none, in place of that of `defaults`. Letters of `auto` are those of
        the array's profile.

    Raises
    ------
    SpecError
        The spec's own settings do not go with those of the profile.
    """
    value = {key: inner for key, inner in spec.source.value.items() if key != "shape"}
    symbols: dict[str, Any] = {} if pitch_mm is None else {"pitch": pitch_mm}
    if defaults == AUTO and (family := PROFILES.get(family_of(name))):
        symbols["alphabet"] = family.alphabet
    given = {k: v for k, v in (value.get("symbols") or {}).items() if v is not None}
    if symbols:
        value["symbols"] = symbols | given
    read = NamedSettings.model_validate({**value, "profile": defaults, "copies": 1})
    (made,) = resolve(read, spec.source, spec.shape)
    return replace(
        made,
        name=spec.name,  # of a copy
        origin=spec.origin,
        profile=name,
        encoding=encoding,
        array_key=array_key,
    )


def _tree_at(path: Path) -> Tree:
    """Return what a spec file says; raises `SpecError`, also for a model in its place."""
    if is_model(path) and path.is_file():
        fix = f"encode-object init '{path}' -o '{path.stem}.yaml' writes one"
        raise SpecError([Problem("this is a model, not a spec", fix, file=str(path))])
    return read_tree(path, SPEC)


def _origin(path: Path | str | Tree, source: Tree) -> str:
    """Return the name of a set's files: its own, or that of its file."""
    value = source.value
    named = value.get("name") if isinstance(value, dict) and "objects" in value else None
    if isinstance(named, str):
        return named
    return "" if isinstance(path, Tree) else Path(path).stem


def _problems_of_read_blocks(error: ValidationError, tree: Tree) -> list[Problem]:
    """Return the problems of the blocks that validated, to report them together with the others.

    Where symbols or settings they depend on are misread, nothing is concluded from defaults.
    """
    misread = {item["loc"][0] if item["loc"] else "" for item in error.errors(include_url=False)}
    if not isinstance(tree.value, dict) or not misread <= {"shape", "name", "copies", "output"}:
        return []
    left = {key: value for key, value in tree.value.items() if key not in {*misread, "shape"}}
    try:
        resolve(NamedSettings.model_validate({**left, "name": "A"}), tree, ShapeSpec("solid", {}))
    except SpecError as found:
        return list(found.problems)
    except ValidationError:
        return []
    return []


def _objects(tree: Tree, problems: list[Problem], files: bool) -> Iterable[Tree]:
    """Yield the objects of a file; those of a set with the set's defaults merged in."""
    if not isinstance(tree.value, dict) or "objects" not in tree.value:
        yield tree
        return
    shared = tree.without("objects")
    try:
        SharedSettings.model_validate(shared.value)
    except ValidationError as error:
        problems += explain_errors(error, tree, SharedSettings)
    entries = tree.value["objects"]
    if not isinstance(entries, list) or not entries:
        fix = "write  objects:  and below it a list of  - name: ...  or  - file.yaml"
        problems.append(
            Problem("'objects' takes a list of objects", fix, tree.key_mark(("objects",)))
        )
        return
    for own in tree.parts()["objects"].parts().values():
        entry = own.value
        if isinstance(entry, str) and not files:
            problems.append(Problem(*FILES_REFUSED, own.value_mark(())))
        elif isinstance(entry, str):
            if file := _object_file(tree.folder / entry, own, problems):
                yield _merge(shared, file)
        elif not isinstance(entry, dict):
            fix = "write  - name: ...  or  - file.yaml"
            cause = "an object of a set is a block of settings or a file name"
            problems.append(Problem(cause, fix, own.value_mark(())))
        elif "objects" in entry:
            fix = "list all objects in one set"
            problems.append(Problem("a set inside a set", fix, own.key_mark(("objects",))))
        else:
            yield _merge(shared, own)


def _object_file(path: Path, entry: Tree, problems: list[Problem]) -> Tree | None:
    """Return the object in a file that a set names; problems with the file stand in the set."""
    try:
        tree = read_tree(path, SPEC)
    except SpecError as error:
        here = entry.value_mark(())
        problems += [
            Problem(f"{p.file}: {p.cause}", p.fix, here) if p.mark is None else p
            for p in error.problems
        ]
        return None
    problems += tree.problems
    if isinstance(tree.value, dict) and "objects" in tree.value:
        fix = "name files that hold one object each"
        problems.append(Problem(f"'{path}' is itself a set", fix, entry.value_mark(())))
        return None
    return tree


def _merge(shared: Tree, own: Tree) -> Tree:
    """Return an object with a set's defaults where it says nothing itself."""
    if not isinstance(own.value, dict):
        return own
    values, value_marks, key_marks = dict(own.value), dict(own.values), dict(own.keys)
    array = ("profile", "encoding")
    names_array = any(own.value.get(key) is not None for key in array)
    for key in Defaults.model_fields:
        default = shared.value.get(key)
        if default is None or (key in array and names_array):
            continue
        present = values.get(key)
        if key in SHARED_BLOCKS and isinstance(present, dict) and isinstance(default, dict):
            names = [name for name in default if present.get(name) is None]
            values[key] = present | {name: default[name] for name in names}
            taken: list[Place] = [(key, name) for name in names]
        elif present is None:
            taken = [(key,)]
            values[key] = default
        else:
            continue
        for marks, source in ((value_marks, shared.values), (key_marks, shared.keys)):
            marks |= {
                place: mark
                for place, mark in source.items()
                if any(place[: len(top)] == top for top in taken)
            }
    return Tree(values, value_marks, key_marks, own.folder)


def _shared_problems(found: Sequence[ObjectSpec], database: str | None) -> list[Problem]:
    """Return what keeps the objects from standing on one array, in one database."""
    problems: list[Problem] = []
    first = found[0]  # those of `auto` follow the ones that name an array
    on_array = next((one for one in found if one.profile != AUTO), first)
    names: dict[str, ObjectSpec] = {}
    for spec in found:
        other = names.setdefault(folder_name(spec.name).casefold(), spec)
        if other is not spec:
            where = mark_of(other.source, "name")
            problems.append(
                Problem(
                    f"two objects are called '{spec.name}', the first in {where}"
                    if other.name == spec.name
                    else f"'{spec.name}' differs from '{other.name}' in {where} only by "
                    "case, spaces or dashes",
                    "give it another name",
                    mark_of(spec.source, "name"),
                )
            )
        path, other_spec = "", first
        if spec.profile != AUTO and spec.encoding != on_array.encoding:
            path, what, other_spec = "profile, encoding", "array", on_array
            one, two = spec.profile, on_array.profile
        elif database is None and spec.database != first.database:
            path, what = "output.database", "database"
            one, two = spec.database, first.database
        elif spec.lab_key != first.lab_key:
            path, what = "output.lab_key", "lab key"
            one, two = spec.lab_key or "none", first.lab_key or "none"
        if path:
            cause = f"'{spec.name}' is on another {what} ({one}) than '{other_spec.name}' ({two})"
            fix = f"run encode-object once for each {what}"
            problems.append(Problem(cause, fix, mark_of(spec.source, path)))
    return problems


def _unique_problems(problems: Sequence[Problem]) -> list[Problem]:
    """Return each problem once, in the order of files and lines, at most `PROBLEMS_SHOWN`."""
    once: dict[tuple[str, str], Problem] = {}
    for problem in problems:
        once.setdefault((problem.place, problem.cause), problem)
    files: dict[str, int] = {}
    for problem in once.values():
        files.setdefault(_file(problem), len(files))
    ordered = sorted(
        once.values(),
        key=lambda p: (files[_file(p)], (p.mark.line, p.mark.column) if p.mark else (0, 0)),
    )
    if len(ordered) > PROBLEMS_SHOWN:
        more = len(ordered) - PROBLEMS_SHOWN
        rest = Problem(f"and {more} more problems", "correct these first", file=_file(ordered[-1]))
        return [*ordered[:PROBLEMS_SHOWN], rest]
    return ordered


def _file(problem: Problem) -> str:
    return problem.mark.source.name if problem.mark else problem.file


def _without_none(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_none(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_without_none(inner) for inner in value]
    if hasattr(value, "tolist"):  # of numpy
        return value.tolist()
    return str(value) if isinstance(value, Path) else value
