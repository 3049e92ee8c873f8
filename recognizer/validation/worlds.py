"""Worlds: who computed the contact, what was touched, and which sensor felt it.

Rows + campaign -> a line for each world. Touches of registered faces are told apart by the
level of the sensor; touches of what no database knows, by their kind, where every answer is
wrong. Names are those of the campaign, in its order: a new level or kind is a new line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from recognizer.validation.bounds import state_of
from recognizer.validation.lines import Columns, Mask, line_of
from recognizer.validation.settings import LIMITS

SURFACES = {"files": "written files", "database": "registered faces"}
ALL = "all of them"  #: sensors


@dataclass(frozen=True, slots=True)
class World:
    """Where touches were made."""

    engine: str  #: of contact
    surface: str  #: what was touched, in words
    sensor: str  #: level, or `ALL`
    registered: bool  #: whether a database knows what was touched


def worlds_in(rows: Columns, campaign: Mapping[str, Any]) -> Iterator[tuple[World, Mask]]:
    """Yield the worlds of a run, and which rows are theirs.

    Parameters
    ----------
    rows
        Columns of `rows.COLUMNS`.
    campaign
        As `results.json` has it.
    """
    engine, surface = campaign["engine"], surface_name(campaign)
    registered = rows["object"] != ""
    for level in names_in(rows["level"][registered], campaign["levels"]):
        yield World(engine, surface, level, True), registered & (rows["level"] == level)
    for kind in names_in(rows["kind"][~registered], campaign["kinds"]):
        yield World(engine, kind, ALL, False), ~registered & (rows["kind"] == kind)


def worlds_of(rows: Columns, campaign: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a line for each world, with the states of its bounds."""
    found = []
    for world, where in worlds_in(rows, campaign):
        line = {"engine": world.engine, "surface": world.surface, "sensor": world.sensor,
                "registered": world.registered, **line_of(rows, where)}  # fmt: skip
        found.append(line | {"states": states_of(line)})
    return found


def states_of(line: dict[str, Any]) -> dict[str, str]:
    """Return the state of every bound of a world; empty where nothing can be judged."""
    sizes = {}
    for name, bound in (("mm", LIMITS.rms_mm), ("deg", LIMITS.rms_deg)):
        low, high = line[f"rms_{name}_95"]
        found = {"of": line["right"], "low": low, "high": high}
        sizes[f"rms_{name}"] = state_of(found, "<=", bound) if line["right"] else ""
    return {"expected": line["state"], **sizes, "inside_95": line["inside_state"]}


def world_times(
    rows: Columns, spent: Mapping[str, Any], campaign: Mapping[str, Any]
) -> list[dict[str, float]]:
    """Return CPU times of a touch, ms, means, in the order of `worlds_of`.

    Parameters
    ----------
    rows, campaign
        As `worlds_in` takes them.
    spent
        Columns of the times, in the order of the rows, s.
    """
    return [
        {
            name: round(1e3 * float(np.mean(spent[name][where])), 3)
            for name in ("drawing", "reading")
        }
        for _, where in worlds_in(rows, campaign)
    ]


def names_in(values: Any, order: Any) -> list[str]:
    """Return the names that occur, in the order of the campaign's shares, others after them."""
    there = set(values.tolist())
    known = [name for name, _ in order if name in there]
    return known + sorted(there.difference(known))


def surface_name(campaign: Mapping[str, Any]) -> str:
    """Return in words what was touched; of prints also how they were made."""
    surfaces = campaign.get("surfaces") or ("files" if campaign["files"] else "database")
    name = SURFACES.get(surfaces, surfaces)
    made = [
        f"{word} {campaign[key]}"
        for key, word in (("faults", "faults"), ("print_profile", "by"))
        if campaign.get(key)
    ]
    return ", ".join([name, *made])
