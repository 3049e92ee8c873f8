"""Name or file -> SensorType.

A name without a folder or a suffix is that of a shipped type; everything else is a YAML file.
What is wrong is told as `file:line:column: error:`, the line, a caret and a fix.
"""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from encoded_objects.base.document import DocumentKind, Problem, did_you_mean
from encoded_objects.base.settings import SettingWords, explain_settings
from encoded_objects.base.yaml_tree import Tree, read_tree, tree_of
from probe.sensor import SensorType
from probe.sensor_types.errors import SensorTypeError
from probe.sensor_types.settings import SensorTypeSettings

_KIND = DocumentKind(
    error=SensorTypeError,
    name="a sensor type",
    empty="write name:, rows:, columns: and pitch:, as probe-sensor types fsr-16 shows",
    example="probe-sensor types fsr-16",
    first="see those that are shipped with: probe-sensor types",
)
_WORDS = SettingWords(
    whole="a sensor type is made of settings",
    start="name: my-sensor",
    see="probe-sensor types --schema",
    missing={
        "name": "name: my-sensor",
        "rows": "rows: 16",
        "columns": "columns: 16",
        "pitch": "pitch: 1.5875 mm",
    },
    blocks={"overlay": "overlay: {kind: tab, height: 2 mm}", "missing": "missing: [...]"},
)
_FOLDER = resources.files("probe.sensor_types").joinpath("shipped")


@lru_cache(maxsize=1)
def shipped_names() -> tuple[str, ...]:
    """Return the names of the shipped types, the usual one first."""
    names = (item.name.removesuffix(".yaml") for item in _FOLDER.iterdir())
    usual = SensorType().name
    return (usual, *sorted(name for name in names if name != usual))


@lru_cache(maxsize=64)
def sensor_type_named(name: str) -> SensorType:
    """Return a shipped type by its name, or that of a YAML file.

    Raises
    ------
    SensorTypeError
        No such type or file, or one that cannot be used.

    Examples
    --------
    >>> sensor_type_named("flexitac-12x32").shape
    (12, 32)
    """
    if name in shipped_names():
        return parse_sensor_type(shipped_text(name), f"{name}.yaml")
    path = Path(name)
    if path.suffix in (".yaml", ".yml") or path.parent != Path() or path.exists():
        return _sensor_type(read_tree(path, _KIND))
    near = did_you_mean(name, shipped_names())
    fix = f"did you mean '{near}'?" if near else f"take {', '.join(shipped_names())}, or a file"
    raise SensorTypeError([Problem(f"there is no sensor type '{name}'", fix, file="--sensor-type")])


def shipped_text(name: str) -> str:
    """Return the file of a shipped type."""
    return _FOLDER.joinpath(f"{name}.yaml").read_text("utf-8")


def parse_sensor_type(text: str, place: str) -> SensorType:
    """Return the type that a text describes; `place` stands in messages.

    Raises
    ------
    SensorTypeError
        With the line and the column of what is wrong.
    """
    return _sensor_type(tree_of(text, place, Path(), _KIND))


def _sensor_type(tree: Tree) -> SensorType:
    problems = list(tree.problems)
    try:
        settings = SensorTypeSettings.model_validate(tree.value)
    except ValidationError as error:
        problems += explain_settings(error, tree, SensorTypeSettings, _WORDS)
    else:
        problems += [
            Problem(cause, fix, tree.value_mark(place)) for place, cause, fix in settings.faults()
        ]
    if problems:
        raise SensorTypeError(problems)
    return settings.sensor_type()
