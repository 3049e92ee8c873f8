"""A spec from a Python script: the settings of a YAML file as plain values, without a shape.

The values are written as YAML and read as a file is, so that a script and a file understand
the same words and get the same messages; the place is `encode():line:column`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from encoded_objects.base.document import Problem
from encoded_objects.base.yaml_tree import Tree, tree_of
from generator.spec.explain import explain_errors
from generator.spec.located import LocatedSpec
from generator.spec.problem import SPEC, SpecError
from generator.spec.resolve import resolve
from generator.spec.resolved import ShapeSpec
from generator.spec.settings import NamedSettings

SOURCE = "encode()"  #: how messages call the script's values


def spec_of(settings: Mapping[str, Any], shape: ShapeSpec) -> LocatedSpec:
    """Return the spec of one object.

    Parameters
    ----------
    settings
        As in a spec file: name, profile, symbols, print, output, ...; None means not given.
    shape
        What the object is.

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
    return LocatedSpec(resolve(read, tree, shape)[0], tree)


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
    located: LocatedSpec,
    name: str,
    defaults: str,
    encoding: Mapping[str, Any],
    array_key: str,
    pitch_mm: float | None = None,
) -> LocatedSpec:
    """Return a spec on another array.

    Parameters
    ----------
    located
        The spec.
    name
        Of the profile, as the database will name it.
    defaults
        Profile whose symbols and printer hold where the spec names none.
    encoding
        Complete definition of the array.
    array_key
        Lab key that it was made from; empty for a published one.
    pitch_mm
        Where the spec says none, in place of that of `defaults`.

    Raises
    ------
    SpecError
        The spec's own settings do not go with those of the profile.
    """
    value = {key: inner for key, inner in located.tree.value.items() if key != "shape"}
    if pitch_mm is not None:
        given = {k: v for k, v in (value.get("symbols") or {}).items() if v is not None}
        value["symbols"] = {"pitch": pitch_mm, **given}
    read = NamedSettings.model_validate({**value, "profile": defaults, "copies": 1})
    (spec,) = resolve(read, located.tree, located.spec.shape)
    name_of_copy = located.spec.name
    own = replace(spec, name=name_of_copy, profile=name, encoding=encoding, array_key=array_key)
    return replace(located, spec=own)


def _without_none(value: Any) -> Any:
    """Return settings without those that are None; paths as text, tuples as lists."""
    if isinstance(value, Mapping):
        return {key: _without_none(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_without_none(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value
