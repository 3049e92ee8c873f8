"""Validation errors of the settings of a spec, in plain words and with their places."""

from __future__ import annotations

import re

from pydantic import BaseModel, ValidationError

from encoded_objects.base.document import Problem, SourceMark, suggest
from encoded_objects.base.settings import SettingWords, explain_settings, model_at
from encoded_objects.base.yaml_tree import Place, Tree
from generator.spec.settings import Defaults, ObjectSettings
from generator.spec.shape import EXAMPLES, KINDS, OTHER_NAMES

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


_AFTER_COMMA = re.compile(r"[0-9]+ ?(mm|cm|m|um|in|deg)?")  # what a decimal comma leaves as a key


def explain_errors(error: ValidationError, tree: Tree, model: type[BaseModel]) -> list[Problem]:
    """Return the problems behind a validation error (`explain_settings`)."""
    return explain_settings(error, tree, model, _WORDS)


def _unknown_setting(place: Place, mark: SourceMark, model: type[BaseModel]) -> Problem:
    word, block = str(place[-1]), place[:-1]
    known = list(model_at(model, block).model_fields)
    inside = f" in '{block[-1]}'" if block else ""
    what = "shape" if block == ("shape",) else "setting"
    cause = f"unknown {what} '{word[:60]}'" + ("" if what == "shape" else inside)
    if _AFTER_COMMA.fullmatch(word):
        cause = f"the comma before '{word}' ends the value"
        fix = "write a point for decimals: 60.5 mm"
    elif block == ("shape",) and word.lower() in OTHER_NAMES:
        fix = f"write shape: {EXAMPLES[OTHER_NAMES[word.lower()]]}"
    elif elsewhere := _other_place(word, block):
        fix = elsewhere
    else:
        listed = KINDS if what == "shape" else known
        fix = f"use {'one of ' if len(listed) > 1 else ''}{', '.join(listed)}"
        fix = suggest(word, known, fix)
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
        inner = model_at(Defaults, (name,))
        if inner is not Defaults and word in inner.model_fields:
            return f"'{word}' belongs in '{name}': {name}: {{{word}: ...}}"
    return ""


_WORDS = SettingWords(
    whole="a spec is made of settings",
    start="name: Cube",
    see="encode-object schema",
    missing=_TEMPLATES,
    blocks=EXAMPLES,
    unknown=_unknown_setting,
)
