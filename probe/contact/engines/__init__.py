"""Contact engines: the same touch by programs that share no model.

An engine takes a surface, a sensor, a touch and what is known of the tips, and gives the force
on every tactel and the plate at rest. `own` is the ladder of `probe.contact`; `mujoco` asks
MuJoCo's tactile sensor how deep each point of each tip stands in the written mesh.

A third one is a file beside these with a value `ENGINE`, and a line in `ENGINES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from probe.contact.contract import Contact, Touch
from probe.contact.tips import Tips
from probe.errors import ContactError
from probe.sensor import SensorType
from probe.surface.contract import HeightMap

Press = Callable[[HeightMap, SensorType, Touch, Tips], Contact]

ENGINES = {
    "own": "probe.contact.engines.own",
    "mujoco": "probe.contact.engines.mujoco",
}


@dataclass(frozen=True, slots=True)
class Engine:
    """How a touch is computed."""

    press: Press
    points: int  #: on each tip, enough for it
    bodies: bool  #: whether it touches closed bodies alone, not height maps
    left_out: str  #: of what happens between a tip and a surface


def engine_named(name: str) -> Engine:
    """Return an engine; what it needs is loaded now.

    Raises
    ------
    ContactError
        There is no engine of this name.
    MissingExtraError
        What it needs is not installed.
    """
    if name not in ENGINES:
        raise ContactError(f"no contact engine '{name}'", fix=f"take {', '.join(ENGINES)}")
    engine: Engine = import_module(ENGINES[name]).ENGINE
    return engine
