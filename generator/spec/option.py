"""Settings that are given as options of a command, read by the rules of the spec."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic_core import PydanticCustomError

from encoded_objects.base.document import Problem, suggest
from encoded_objects.base.sensor_type import SENSOR_FILES
from generator.export.formats import EXPORTERS
from generator.spec.problem import SpecError
from generator.spec.settings import database_url


def format_option(given: str | Sequence[str]) -> tuple[str, ...]:
    """Return the formats of `--format step,stl`, or of a list, which may be empty.

    Raises `SpecError`.
    """
    known = tuple(EXPORTERS)
    words = given.split(",") if isinstance(given, str) else given
    if not isinstance(words, Sequence):
        words = [words]
    names = [name for word in words if (name := str(word).strip().lower().lstrip("."))]
    fix = f"choose from {','.join(known)}"
    problems = []
    for name in names:
        if name not in known:
            near = suggest(name, known, fix)
            problems.append(Problem(f"unknown format '{name}'", near, file="--format"))
    if isinstance(given, str) and not names:
        problems.append(Problem("no format is named", fix, file="--format"))
    if problems:
        raise SpecError(problems)
    return tuple(dict.fromkeys(names))


def sensor_type_option(text: str) -> str:
    """Return `--sensor-type`, a file by its whole path; raises `SensorTypeError`."""
    from encoded_objects.base.sensor_type_file import sensor_type_named  # costs start-up

    sensor_type_named(text)
    return str(Path(text).absolute()) if Path(text).suffix in SENSOR_FILES else text


def database_option(given: str | Path) -> str:
    """Return the URL of `--database`; raises `SpecError`."""
    try:
        return database_url(str(given) if isinstance(given, Path) else given)
    except PydanticCustomError as error:
        context = error.context or {}
        problem = Problem(context["cause"], context["fix"], file="--database")
        raise SpecError([problem]) from None
