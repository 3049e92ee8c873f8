"""Settings that are given as options of a command, read by the rules of the spec."""

from __future__ import annotations

from pathlib import Path

from pydantic_core import PydanticCustomError

from encoded_objects.base.document import Problem, suggest
from encoded_objects.base.sensor_type import SENSOR_FILES
from generator.export.formats import EXPORTERS
from generator.spec.problem import SpecError
from generator.spec.settings import database_url


def format_option(text: str) -> tuple[str, ...]:
    """Return the formats of `--format step,stl`; raises `SpecError`."""
    known = tuple(EXPORTERS)
    names = [part.strip().lower().lstrip(".") for part in text.split(",") if part.strip()]
    fix = f"choose from {','.join(known)}"
    problems = []
    for name in names:
        if name not in known:
            near = suggest(name, known, fix)
            problems.append(Problem(f"unknown format '{name}'", near, file="--format"))
    if not names:
        problems.append(Problem("no format is named", fix, file="--format"))
    if problems:
        raise SpecError(problems)
    return tuple(dict.fromkeys(names))


def sensor_type_option(text: str) -> str:
    """Return `--sensor-type`, a file by its whole path; raises `SensorTypeError`."""
    from encoded_objects.base.sensor_type_file import sensor_type_named  # costs start-up

    sensor_type_named(text)
    return str(Path(text).absolute()) if Path(text).suffix in SENSOR_FILES else text


def database_option(text: str) -> str:
    """Return the URL of `--database`; raises `SpecError`."""
    try:
        return database_url(text)
    except PydanticCustomError as error:
        context = error.context or {}
        problem = Problem(context["cause"], context["fix"], file="--database")
        raise SpecError([problem]) from None
