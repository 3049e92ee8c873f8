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
from recognizer.validation.campaign import Campaign, Shares, Work
from recognizer.validation.draw import INSIDE_MM
from recognizer.validation.encoded_set import members_of
from recognizer.validation.run import relative_database
from recognizer.validation.touch_plan import FORCE_N, TILT_RAD, WORN
from recognizer.validation.trial import ENOUGH, NEAR_MM

LIBRARIES = ("numpy", "scipy", "pyarrow", "matplotlib")
#: Limits by which touches are judged.
RULE = {"enough": ENOUGH, "near_mm": NEAR_MM, "inside_mm": INSIDE_MM, "worn": WORN}


def provenance(work: Work, folder: Path) -> dict[str, Any]:
    """Return what a run was, so that it can be done again."""
    campaign = work.campaign
    engine = "tabs" if campaign.engine == "own" else campaign.engine
    points = engine_named(campaign.engine).points
    contact, level = f"{engine}, {points} points a tab", f"{engine}-{points}"
    if campaign.overlay != "tab":
        contact = "layer" if campaign.overlay == "pad" else campaign.overlay
        level = level_for(campaign.sensor)
    return {
        "command": _command_of(work, folder),
        "versions": {
            "encoded-objects": version("encoded-objects"),
            "source, sha256": work.code_digest,
            "kernels": "compiled",
            "python": platform.python_version(),
            **{name: version(name) for name in LIBRARIES},
        },
        "campaign": campaign.as_json(),
        "contact": contact,
        "contact_level": level,  # of the contact model, as the tables of its error have it
        "force_n": list(FORCE_N),
        "tilt_deg": round(math.degrees(TILT_RAD), 6),
        "levels": [asdict(LEVELS[name]) for name, _ in campaign.levels],
        "set": work.set_digest,
        "members": members_of(work.database),
    }


def _command_of(work: Work, folder: Path) -> str:
    """Return the command that does a run again, in any folder."""
    campaign, usual = work.campaign, Campaign()
    words = ["validate-set", *map(_bare_path, work.specs)]
    if not work.specs:
        words += ["--database", _bare_path(relative_database(work.database, folder))]
    words += ["--touches", str(campaign.touches), "--seed", str(campaign.seed)]
    sensor = campaign.sensor_type
    shipped = sensor.name in shipped_names() and sensor_type_named(sensor.name) == sensor
    typed = {
        "kinds": _shares(campaign.kinds),
        "levels": _shares(campaign.levels),
        "sensor_type": sensor.name if shipped else f"{sensor.name}.yaml",
        "print_profile": _bare_path(campaign.print_profile),
    }
    for name in ("kinds", "levels", "sensor_type", "overlay", "engine", "policy", "sensor_per",
                 "surfaces", "print_profile", "faults"):  # fmt: skip
        value = getattr(campaign, name)
        if value != (sensor.overlay.kind if name == "overlay" else getattr(usual, name)):
            words += [f"--{name.replace('_', '-')}", typed.get(name, value)]
    words += ["--study", str(campaign.study)]
    words += ["--shard", str(campaign.shard)] if campaign.shard != usual.shard else []
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
