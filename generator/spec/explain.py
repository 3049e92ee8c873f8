"""Validation errors of the settings, in plain words and with their places."""

from __future__ import annotations

import re
import typing
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from generator.spec.document import Place, Tree
from generator.spec.problem import Problem, SourceMark, did_you_mean
from generator.spec.settings import Defaults, ObjectSettings
from generator.spec.shape import EXAMPLES, KINDS, OTHER_NAMES

Error = Mapping[str, Any]

_TEMPLATES = {
    "name": "name: Cube",
    "shape": f"shape: {EXAMPLES['cube']}",
    "sides": "sides: 6",
    "side": "side: 40 mm",
    "height": "height: 80 mm",
    "family": "family: prmva",
    "rows": "rows: {order: 2, degree: 4}",
    "columns": "columns: {order: 4, degree: 2}",
}


def explain_errors(error: ValidationError, tree: Tree, model: type[BaseModel]) -> list[Problem]:
    """Return the problems behind a validation error.

    Parameters
    ----------
    error
        What pydantic found in `tree.value`.
    tree
        The values with their places.
    model
        The model that was to be read.
    """
    items = error.errors(include_url=False)
    meant = {
        _likely_place(item["loc"], model) for item in items if item["type"] == "extra_forbidden"
    }
    unread = {problem.mark for problem in tree.problems}
    return [
        _problem(item, tree, model)
        for item in items
        if item["type"] != "missing"
        or not (item["loc"] in meant or tree.values.get(item["loc"]) in unread)
    ]


def _likely_place(place: Place, model: type[BaseModel]) -> Place:
    """Return the place of the setting that an unknown name was probably meant to be."""
    known = _model_at(model, place[:-1]).model_fields
    return (*place[:-1], did_you_mean(str(place[-1]), known))


def _problem(error: Error, tree: Tree, model: type[BaseModel]) -> Problem:
    place: Place = error["loc"]
    kind: str = error["type"]
    if kind == "refused":
        return Problem(error["ctx"]["cause"], error["ctx"]["fix"], tree.value_mark(place))
    if kind == "extra_forbidden":
        return _unknown_setting(place, tree.key_mark(place), model)
    if kind == "missing":
        return _missing_setting(place, tree)
    cause, fix = _wrong_value(error, place, model)
    return Problem(cause, fix, tree.value_mark(place))


def _unknown_setting(place: Place, mark: SourceMark, model: type[BaseModel]) -> Problem:
    """Explain a name that is not known where it stands."""
    word, block = str(place[-1]), place[:-1]
    known = list(_model_at(model, block).model_fields)
    inside = f" in '{block[-1]}'" if block else ""
    what = "shape" if block == ("shape",) else "setting"
    cause = f"unknown {what} '{word[:60]}'" + ("" if what == "shape" else inside)
    if block == ("shape",) and word.lower() in OTHER_NAMES:
        fix = f"write shape: {EXAMPLES[OTHER_NAMES[word.lower()]]}"
    elif elsewhere := _other_place(word, block):
        fix = elsewhere
    elif near := did_you_mean(word, known):
        fix = f"did you mean '{near}'?"
    else:
        listed = KINDS if what == "shape" else known
        fix = f"use {'one of ' if len(listed) > 1 else ''}{', '.join(listed)}"
    return Problem(cause, fix, mark)


def _other_place(word: str, block: Place) -> str:
    """Return where a setting of that name belongs, if there is such a place."""
    if not block and word in KINDS:
        return f"write shape: {EXAMPLES[word]}"
    if not block and word in ("name", "shape"):
        return f"write '{word}' in each of the objects"
    if block and word in ObjectSettings.model_fields:
        return f"'{word}' stands beside '{block[0]}', not in it"
    for name in Defaults.model_fields:
        if name in ("encoding", *block):
            continue
        inner = _model_at(Defaults, (name,))
        if inner is not Defaults and word in inner.model_fields:
            return f"'{word}' belongs in '{name}': {name}: {{{word}: ...}}"
    return ""


def _missing_setting(place: Place, tree: Tree) -> Problem:
    """Explain a setting that must be there."""
    key, block = str(place[-1]), place[:-1]
    inside = f" in '{block[-1]}'" if block else ""
    fix = "add " + _TEMPLATES.get(key, f"{key}: ...")
    if place in tree.keys:
        return Problem(
            f"'{key}'{inside} has no value", fix.replace("add ", "write ", 1), tree.key_mark(place)
        )
    return Problem(f"'{key}' is missing{inside}", fix, tree.key_mark(block))


def _wrong_value(error: Error, place: Place, model: type[BaseModel]) -> tuple[str, str]:
    """Return cause and fix for a value of the wrong kind."""
    key = next((part for part in reversed(place) if isinstance(part, str)), "the file")
    value, kind = error["input"], error["type"]
    if kind == "literal_error":
        known = re.findall(r"'([^']*)'", error["ctx"]["expected"])
        near = did_you_mean(value, known) if isinstance(value, str) else ""
        fix = f"did you mean '{near}'?" if near else f"choose one of {', '.join(known)}"
        single = key.removesuffix("s") if isinstance(place[-1], int) else key
        if not isinstance(value, str):
            return f"'{single}' cannot be {_value_text(value)}", fix
        return f"unknown {single} {_value_text(value)}", fix
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        known = list(_model_at(model, place).model_fields)
        example = (
            EXAMPLES[key].removeprefix("{").removesuffix("}")
            if key in EXAMPLES
            else (f"{key}: {{{known[0]}: ...}}")
        )
        if not place:
            return f"a spec is made of settings, not {_value_text(value)}", "start with: name: Cube"
        return f"'{key}' takes settings, not {_value_text(value)}", f"write {example}"
    if kind in ("list_type", "tuple_type"):
        return f"'{key}' takes a list, not {_value_text(value)}", "write it in brackets: [..., ...]"
    if kind in ("too_short", "too_long"):
        context = error["ctx"]
        limit = context.get("min_length", context.get("max_length"))
        few = kind == "too_short"
        cause = f"'{key}' has {context['actual_length']} values, {limit} or "
        cause += f"{'more' if few else 'fewer'} are needed"
        return cause, "add the others" if few else "leave the others out"
    if kind == "string_type":
        return f"'{key}' takes text, not {_value_text(value)}", "put it in quotes"
    return f"'{key}': {error['msg']}", "see encode-object schema"


def _value_text(value: Any) -> str:
    """Return a value as it may stand in a sentence."""
    if isinstance(value, str):
        return f"'{value if len(value) <= 40 else value[:37] + '...'}'"
    if isinstance(value, dict):
        return "a block of settings"
    if isinstance(value, list):
        return "a list"
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)[:40]


def _model_at(model: type[BaseModel], place: Place) -> type[BaseModel]:
    """Return the model of the block at `place`, or the nearest one around it."""
    for part in place:
        if isinstance(part, str) and part in model.model_fields:
            model = next(_models(model.model_fields[part].annotation), model)
    return model


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models that a type mentions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in typing.get_args(annotation):
        yield from _models(part)
