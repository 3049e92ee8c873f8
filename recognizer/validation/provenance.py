"""Where results come from: versions, seeds, hashes, distributions; no clock, no machine.

The one file with time and machine in it is `provenance.json`, next to the results.
"""

from __future__ import annotations

import math
import platform
import shlex
from dataclasses import asdict
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from probe.contact.engines import engine_named
from probe.contact.press import level_for
from probe.simulate.world.levels import LEVELS
from recognizer.validation.campaign import KINDS, LEVEL_SHARES, Campaign, Shares
from recognizer.validation.draw import INSIDE_MM
from recognizer.validation.encoded_set import members_of
from recognizer.validation.run import RunRecord
from recognizer.validation.touch_plan import WORN, TouchPlan, sensor_of
from recognizer.validation.trial import ENOUGH, NEAR_MM

LIBRARIES = ("numpy", "scipy", "pyarrow", "matplotlib")


def provenance(record: RunRecord, database: str) -> dict[str, Any]:
    """Return what a run was, so that it can be done again."""
    campaign = record.campaign
    plan = TouchPlan(database)
    return {
        "command": command_of(record),
        "versions": {
            "encoded-objects": version("encoded-objects"),
            "source, sha256": record.code_digest,
            "kernels": "compiled",
            "python": platform.python_version(),
            **{name: version(name) for name in LIBRARIES},
        },
        "campaign": asdict(campaign),
        "contact": _contact(campaign),
        "contact_level": contact_level(campaign),
        "force_n": list(plan.force_n),
        "tilt_deg": round(math.degrees(plan.tilt_rad), 6),
        "levels": [asdict(LEVELS[name]) for name, _ in campaign.levels],
        "set": record.set_digest,
        "members": [asdict(member) for member in members_of(database)],
    }


def _contact(campaign: Campaign) -> str:
    """Return which engine pressed, and how finely."""
    if campaign.overlay != "tab":
        return "layer" if campaign.overlay == "pad" else campaign.overlay
    points = engine_named(campaign.engine).points
    engine = "tabs" if campaign.engine == "own" else campaign.engine
    return f"{engine}, {points} points a tab"


def contact_level(campaign: Campaign) -> str:
    """Return the name of the contact model's level as the tables of its error have it."""
    if campaign.overlay != "tab":
        return level_for(sensor_of(campaign.sensor_type, campaign.overlay))
    name = "tabs" if campaign.engine == "own" else campaign.engine
    return f"{name}-{engine_named(campaign.engine).points}"


def judging_limits() -> dict[str, float]:
    """Return the limits by which touches are judged."""
    return {
        "enough": ENOUGH,
        "near_mm": NEAR_MM,
        "inside_mm": INSIDE_MM,
        "worn": WORN,
    }


def command_of(record: RunRecord) -> str:
    """Return the command that does a run again, in any folder."""
    campaign, plain = record.campaign, Campaign(record.campaign.touches)
    words = ["validate-set", *map(_bare_path, record.specs)]
    words += [] if record.specs else ["--database", _bare_path(record.database)]
    words += ["--touches", str(campaign.touches), "--seed", str(campaign.seed)]
    if campaign.kinds != KINDS:
        words += ["--kinds", _shares(campaign.kinds)]
    if campaign.levels != LEVEL_SHARES:
        words += ["--levels", _shares(campaign.levels)]
    sensor = sensor_of(campaign.sensor_type, "")
    if campaign.sensor_type:
        shipped = sensor.name in shipped_names() and sensor_type_named(sensor.name) == sensor
        words += ["--sensor-type", sensor.name if shipped else f"{sensor.name}.yaml"]
    if campaign.overlay != sensor.overlay.kind:
        words += ["--overlay", campaign.overlay]
    if campaign.engine != plain.engine:
        words += ["--engine", campaign.engine]
    if campaign.policy != plain.policy:
        words += ["--policy", campaign.policy]
    if campaign.sensor_per != plain.sensor_per:
        words += ["--sensor-per", campaign.sensor_per]
    if campaign.surfaces != plain.surfaces:
        words += ["--surfaces", campaign.surfaces]
    if campaign.print_profile:
        words += ["--print-profile", _bare_path(campaign.print_profile)]
    words += ["--faults", campaign.faults] if campaign.faults else []
    words += ["--study", str(campaign.study)]
    words += ["--shard", str(campaign.shard)] if campaign.shard != plain.shard else []
    return shlex.join(words)


def circumstances(begun: datetime, seconds: float, processes: int, cluster: str) -> dict[str, Any]:
    """Return when, where and how long: what no two runs share."""
    return {
        "utc": begun.isoformat(timespec="seconds"),
        "seconds": seconds,
        "workers": cluster or processes,
        "machine": platform.machine(),
        "system": platform.platform(),
    }


def _bare_path(path: str) -> str:
    """Return a path without the machine's folders."""
    return Path(path).name if Path(path).is_absolute() or "://" in path else path


def _shares(shares: Shares) -> str:
    return ",".join(f"{name}={share:g}" for name, share in shares)
