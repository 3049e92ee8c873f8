"""Contact engines: programs that share no model press the same touch.

An engine takes a surface, a sensor, a touch and the tips' defects, and gives the force on every
tactel and the plate at rest. Another one is a module with a value `ENGINE`, and a line in
`ENGINES`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module, resources
from typing import TYPE_CHECKING

from probe.errors import ContactError

if TYPE_CHECKING:  # a command's help names the engines and needs nothing of these
    from encoded_objects.base.sensor_type import SensorType
    from probe.contact.contract import Contact, Touch
    from probe.contact.tips import Tips
    from probe.surface.contract import HeightMap

    Press = Callable[[HeightMap, SensorType, Touch, Tips], Contact]
    Triangles = Callable[[HeightMap, SensorType, Touch], tuple[int, int] | None]


@dataclass(frozen=True, slots=True)
class EngineEntry:
    """Module of an engine, and a description that needs no loading."""

    module: str
    left_out: str  #: of what happens between a tip and a surface, in plain words


ENGINES = {
    "own": EngineEntry(
        "probe.contact.press",
        "every tab of the overlay is a column that is pressed straight down: it does not bulge, "
        "does not slide, and does not touch the tabs beside it",
    ),
    "mujoco": EngineEntry(
        "probe.contact.mujoco",
        "friction; a tip that sinks deeper into a stroke than half the stroke's width is felt as "
        "if it had slid off to the side; and what is finer than 0.1 mm on a print",
    ),
    "drake": EngineEntry(
        "probe.contact.drake",
        "friction; domes of tips, which are square; forces beyond a box's own, for which all are "
        "stiffer; and what is finer than 0.1 mm on a print",
    ),
}


@dataclass(frozen=True, slots=True)
class Engine:
    """How a touch is computed."""

    press: Press
    points: int  #: on each tip, enough for it
    overlays: tuple[str, ...]  #: that it knows: tab, pad, gel
    triangles: Triangles | None = None  #: of the part that a touch needs, and all; None: no meshes


@dataclass(frozen=True, slots=True)
class MeasuredEngine:
    """What an engine errs by and costs; `tests/bench/contact_precision.py`."""

    engine: str
    level: str  #: the engine and its points on a tip
    error: float  #: largest over the indenters, against the same engine with 217 points
    from_own: float  #: how far its image is from our own engine's, largest over the indenters
    ms: float  #: CPU time of a touch, median over the indenters


@lru_cache(maxsize=1)
def engine_table() -> tuple[MeasuredEngine, ...]:
    """Return the measured errors and times of engines that are not ours."""
    text = resources.files("probe.contact").joinpath("precision.json").read_text("utf-8")
    return tuple(
        MeasuredEngine(line["engine"], line["level"], line["error"], line["from_own"], line["ms"])
        for line in json.loads(text)["engines"]
    )


def engine_named(name: str) -> Engine:
    """Return an engine; what it needs is loaded now.

    Raises `ContactError` if there is no engine of this name; `MissingExtraError` if what it needs
    is not installed.
    """
    if name not in ENGINES:
        raise ContactError(f"no contact engine '{name}'", fix=f"take {', '.join(ENGINES)}")
    engine: Engine = import_module(ENGINES[name].module).ENGINE
    return engine
