"""The results of a run and its page: one HTML file that needs nothing else.

Touches -> results.json, times.json, and report.html in the order of its questions: does it hold,
who is taken for whom, how far off, when not, error against run time, extremes, what was left out,
the worst touches, where it comes from (versions, seeds, hashes, distributions; the clock and the
machine are in `provenance.json` alone). Every picture is inline SVG.
"""

from __future__ import annotations

import math
import platform
import shlex
from dataclasses import asdict
from datetime import datetime
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from encoded_objects.base.errors import require
from encoded_objects.base.pages import page_environment
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from probe.contact.engines import engine_named
from probe.contact.press import level_for
from probe.simulate.world.levels import LEVELS
from recognizer.validation import pictures
from recognizer.validation.campaign import FILES, PRINTED, Campaign, Shares, Work, series_of
from recognizer.validation.draw import INSIDE_MM
from recognizer.validation.encoded_set import members_of
from recognizer.validation.extremes import extremes
from recognizer.validation.files import (
    TIMES,
    columns_of,
    read_series,
    write_json,
    write_table,
    write_text,
)
from recognizer.validation.flat_faces import flat_objects
from recognizer.validation.results import results_of, world_times
from recognizer.validation.run import relative_database
from recognizer.validation.statistics import FAILS, HOLDS, UNTOLD
from recognizer.validation.studies import (
    contact_study,
    decoder_study,
    engine_lines,
    limit_study,
    reader_study,
    work_avoided,
)
from recognizer.validation.touch_plan import FORCE_N, TILT_RAD, WORN, TouchPlan
from recognizer.validation.trial import ENOUGH, NEAR_MM
from recognizer.validation.workers import reader_now

if TYPE_CHECKING:
    from jinja2 import Environment

PAGE, REPORT = "report.html.j2", "report.html"
TRIALS, RESULTS, TIMES_FILE = "trials.parquet", "results.json", "times.json"
NONE = "–"  #: for what is not known
LIBRARIES = ("numpy", "scipy", "pyarrow", "matplotlib")
#: Limits by which touches are judged.
RULE = {"enough": ENOUGH, "near_mm": NEAR_MM, "inside_mm": INSIDE_MM, "worn": WORN}


def require_report(command: str) -> None:
    """Raise `MissingExtraError` unless the libraries of tables and pages are installed."""
    require("pyarrow", "matplotlib", "jinja2", extra="report", purpose=command)


def page_of(
    results: dict[str, Any], times: dict[str, Any], rows: dict[str, Any], flat: list[dict[str, Any]]
) -> str:
    """Return the page of a run.

    Results and times are those of `results.json` and `times.json`; `rows` are columns of
    `trials.parquet`; `flat` is what `flat_faces.flat_objects` returns.
    """
    study, level = results["study"], results["provenance"]["contact_level"]
    drawn = {
        "confusion": pictures.confusion(results["objects"]),
        "pose": pictures.pose(rows),
        "against": pictures.accuracy(results),
        "margins": pictures.margins(rows),
        "limits": pictures.limits(results["limits"]) if "limits" in results else "",
        "work": pictures.work_precision(study, times, level) if study else "",
    }
    page = environment().get_template(PAGE)
    return page.render(r=results, times=times, pictures=drawn, flat=flat)


@lru_cache(maxsize=1)
def environment() -> Environment:
    """Return what renders the templates; numbers and shares as the pages write them."""
    made = page_environment(Path(__file__).parent)
    tints = {HOLDS: "good", FAILS: "bad", UNTOLD: "untold"}  # classes of cells
    made.filters.update(size=_size, percent=_percent, share=_share, count=_count,
                        interval=_interval, tint=lambda state: tints.get(state, ""))  # fmt: skip
    return made


def _interval(ends: tuple[float, float | None], digits: int = 3) -> str:
    """Return an interval; an end that is not known is left open."""
    low, high = ends
    return f"{low:.{digits}f} … {'' if high is None else f'{high:.{digits}f}'}".strip()


def _size(value: float | None, digits: int = 3) -> str:
    return NONE if value is None else f"{value:.{digits}f}"


def _percent(value: float | None, digits: int = 1) -> str:
    return NONE if value is None else f"{100 * value:.{digits}f} %"


def _share(share: dict[str, Any]) -> str:
    if share["share"] is None:
        return NONE
    return f"{_percent(share['share'], 2)} ({100 * share['low']:.2f} … {100 * share['high']:.2f})"


def _count(value: int | None) -> str:
    return NONE if value is None else f"{value:,}"


def write_results(work: Work, folder: Path) -> dict[str, Any]:
    """Write everything that follows from the touches; returns the results."""
    campaign, reader = work.campaign, reader_now(work)
    series = series_of(campaign)[0]
    table = read_series(folder, series)
    rows, spent = columns_of(table), columns_of(read_series(folder, series, TIMES))
    origin = provenance(work, folder)
    results = results_of(rows, origin["campaign"])
    times: dict[str, Any] = {name: _cpu_ms(spent[name]) for name in ("drawing", "reading")}
    times["worlds"] = world_times(rows, spent, origin["campaign"])
    results["rule"] = RULE
    results["study"], results["left_out"], results["engines"] = {}, [], engine_lines()
    if campaign.study:
        studies = {
            "contact": contact_study(),
            "decoders": decoder_study(reader.lab.arrays[0], campaign.seed),
            "readers": reader_study(folder, campaign),
        }
        plan = TouchPlan(work.database, campaign.seed, files=campaign.surfaces == FILES,
                         prints=work.prints, engine=campaign.engine)  # fmt: skip
        avoided = work_avoided(reader, plan, studies["readers"])
        results["study"] = {name: study.counted for name, study in studies.items()}
        results["left_out"] = avoided.counted
        times |= {name: study.spent for name, study in studies.items()}
        times["left_out"] = avoided.spent
    if campaign.limits:
        results["limits"] = limit_study(folder, campaign, reader)
    if campaign.surfaces == PRINTED:
        from recognizer.validation.printing import prints_as_results

        results["printed"] = prints_as_results(folder, campaign)
    results["extremes"] = extremes(reader)
    results["provenance"] = origin
    write_table(table, folder / TRIALS)
    write_json(folder / RESULTS, results)
    write_json(folder / TIMES_FILE, times)
    flat = flat_objects(reader.lab, rows, results["objects"]["faces"])
    write_text(folder / REPORT, page_of(results, times, rows, flat))
    return results


def _cpu_ms(seconds: Any) -> dict[str, float]:
    at = {"median": 0.5, "p95": 0.95, "p99": 0.99}
    found = {name: float(np.quantile(seconds, q)) for name, q in at.items()}
    found["mean"] = float(np.mean(seconds))
    return {name: round(1e3 * value, 3) for name, value in found.items()}


def provenance(work: Work, folder: Path) -> dict[str, Any]:
    """Return what a run was, so that it can be done again."""
    campaign = work.campaign
    engine = "tabs" if campaign.engine == "own" else campaign.engine
    points = engine_named(campaign.engine).points
    contact, level = f"{engine}, {points} point{'s' * (points > 1)} a tab", f"{engine}-{points}"
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
    words += ["--limits", str(campaign.limits)] if campaign.limits else []
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
