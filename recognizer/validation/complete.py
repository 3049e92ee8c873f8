"""From what a person asks to the finished folder: set, touches, results, report.

`validate_set` is `validate-set SPEC...`; `report_anew` makes the results and the page again
from the touches that are there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from recognizer.validation.campaign import (
    KINDS,
    LEVEL_SHARES,
    Campaign,
    kinds_of,
    levels_of,
    series_of,
    shards_of,
)
from recognizer.validation.errors import FAILED, ValidationError
from recognizer.validation.extremes import extremes
from recognizer.validation.left_out import left_out
from recognizer.validation.precision import contact_study, decoder_study, reader_study
from recognizer.validation.provenance import circumstances, provenance, rule
from recognizer.validation.report import page_of
from recognizer.validation.results import results_of
from recognizer.validation.run import (
    ASKED,
    Asked,
    Told,
    alone,
    prepare,
    read_asked,
    touch_all,
    write_json,
    write_text,
)
from recognizer.validation.shards import (
    TIMES,
    columns_of,
    done_shards,
    read_series,
    write_table,
)
from recognizer.validation.trial import Plan
from recognizer.validation.work import prepared
from recognizer.validation.workers import workers_of

TRIALS, RESULTS, TIMES_FILE = "trials.parquet", "results.json", "times.json"
REPORT, PROVENANCE = "report.html", "provenance.json"
DEFAULT_TOUCHES = 1000
STUDY_SHARE, STUDY = 0.05, (10, 200)  #: touches of a reader of the study: share, least and most


@dataclass(frozen=True, slots=True)
class Wishes:
    """Options as they were given; None or empty: not given."""

    touches: int | None = None
    seed: int | None = None
    kinds: str = ""
    levels: str = ""
    overlay: str = ""
    surfaces: str = ""
    study: int | None = None
    shard: int | None = None


@dataclass(frozen=True, slots=True)
class Summary:
    """How a run ended."""

    touches: int
    right: int
    wrong: int
    rejected: int
    rms_mm: float | None
    rms_deg: float | None
    seconds: float  #: wall time of this run
    fair: int  #: touches that show enough symbols
    fair_right: int  #: of these, how many are answered right
    checks: list[dict[str, Any]]

    @property
    def holds(self) -> bool:
        """Whether every bound holds."""
        return all(check["holds"] for check in self.checks)

    def as_json(self) -> dict[str, Any]:
        """Return what `--json` prints."""
        names = ("touches", "right", "wrong", "rejected", "rms_mm", "rms_deg", "seconds")
        return {name: getattr(self, name) for name in names}

    def exit_code(self, fail_under: float | None) -> int:
        """Return 1 if a touch was answered wrong or too few were answered right."""
        if fail_under is None:
            return 0
        share = 100 * self.fair_right / self.fair if self.fair else 100.0
        return FAILED if self.wrong or share < fail_under else 0


def validate_set(
    folder: Path,
    wishes: Wishes,
    specs: list[Path],
    database: str,
    *,
    processes: int,
    cluster: str,
    resume: bool,
    told: Told,
) -> Summary:
    """Make a set, touch it, and write the report.

    Parameters
    ----------
    folder
        Of the run.
    wishes
        Options; what is not given is as it was in a run that is resumed, or the default.
    specs, database
        What is made, and where it is registered.
    processes, cluster
        Who does the work.
    resume
        Go on with the run that the folder holds.
    told
        Hears how far it is.

    Raises
    ------
    ValidationError, SetError, WorkersError
        See `run.prepare`, `workers`, `cluster`.
    """
    begun, start = datetime.now(UTC), time.monotonic()
    known = resume and (folder / ASKED).exists()
    campaign = _campaign(wishes, read_asked(folder).campaign if known else None)
    with alone(folder):
        asked = prepare(folder, campaign, specs, database, resume=resume)
        touch_all(asked, folder, workers_of(processes, cluster), told)
        told.stage("report", 0, 0)
        results = _finished(asked, folder)
        seconds = round(time.monotonic() - start, 3)
        write_json(folder / PROVENANCE, circumstances(begun, seconds, processes, cluster))
    return _summary(results, seconds)


def report_anew(folder: Path) -> Summary:
    """Write results and report of a run again.

    Raises
    ------
    ValidationError
        The run is not there, or not done.
    """
    asked, start = read_asked(folder), time.monotonic()
    for series in series_of(asked.campaign):
        if len(done_shards(folder, series)) < shards_of(series):
            raise ValidationError(
                "the run is not done", fix="go on with it by --resume", place=str(folder)
            )
    with alone(folder):
        results = _finished(asked, folder)
    return _summary(results, round(time.monotonic() - start, 3))


def _campaign(wishes: Wishes, known: Campaign | None) -> Campaign:
    """Return what is asked for, options over what was asked before over defaults."""
    for given, allowed, option in (
        (wishes.overlay, ("tab", "pad"), "--overlay"),
        (wishes.surfaces, ("files", "database"), "--surfaces"),
    ):
        if given and given not in allowed:
            raise ValidationError(
                f"'{given}' is not known", fix=f"give {' or '.join(allowed)}", place=option
            )
    base = known or Campaign(DEFAULT_TOUCHES, kinds=KINDS, levels=LEVEL_SHARES)
    touches = base.touches if wishes.touches is None else wishes.touches
    study = base.study if known else _study(touches)
    return replace(
        base,
        touches=touches,
        seed=base.seed if wishes.seed is None else wishes.seed,
        kinds=kinds_of(wishes.kinds) if wishes.kinds else base.kinds,
        levels=levels_of(wishes.levels) if wishes.levels else base.levels,
        overlay=wishes.overlay or base.overlay,
        files=wishes.surfaces == "files" if wishes.surfaces else base.files,
        study=study if wishes.study is None else wishes.study,
        shard=base.shard if wishes.shard is None else wishes.shard,
    )


def _study(touches: int) -> int:
    return int(min(max(STUDY_SHARE * touches, STUDY[0]), STUDY[1]))


def _finished(asked: Asked, folder: Path) -> dict[str, Any]:
    """Write everything that follows from the touches; returns the results."""
    campaign, work = asked.campaign, asked.work_now(folder)
    series = series_of(campaign)
    table = read_series(folder, series[0])
    rows = columns_of(table)
    spent = columns_of(read_series(folder, series[0], TIMES))
    reader = prepared(work)
    results = results_of(rows)
    times: dict[str, Any] = {name: _spent(spent[name]) for name in ("drawing", "reading")}
    results["rule"] = rule()
    results["study"], results["left_out"] = {}, []
    if campaign.study:
        studies = {
            "contact": contact_study(),
            "decoders": decoder_study(reader.lab.arrays[0], campaign.seed),
            "readers": reader_study(folder, campaign),
        }
        plan = Plan(work.database, campaign.seed, kind="face", files=campaign.files)
        saved = left_out(reader, plan, studies["readers"])
        results["study"] = {name: study.counted for name, study in studies.items()}
        results["left_out"] = saved.counted
        times |= {name: study.spent for name, study in studies.items()}
        times["left_out"] = saved.spent
    results["extremes"] = extremes(reader)
    results["provenance"] = provenance(asked, work.database)
    write_table(table, folder / TRIALS)
    write_json(folder / RESULTS, results)
    write_json(folder / TIMES_FILE, times)
    write_text(folder / REPORT, page_of(results, times, rows))
    return results


def _spent(seconds: Any) -> dict[str, float]:
    """Return quantiles of CPU times, ms."""
    at = {"median": 0.5, "p95": 0.95, "p99": 0.99}
    found = {name: float(np.quantile(seconds, q)) for name, q in at.items()}
    found["mean"] = float(np.mean(seconds))
    return {name: round(1e3 * value, 3) for name, value in found.items()}


def _summary(results: dict[str, Any], seconds: float) -> Summary:
    totals, fair = results["totals"], results["enough"]
    return Summary(
        touches=totals["touches"],
        right=totals["right"],
        wrong=totals["wrong"],
        rejected=totals["rejected"],
        rms_mm=totals["rms_mm"],
        rms_deg=totals["rms_deg"],
        seconds=seconds,
        fair=fair["touches"],
        fair_right=fair["right"],
        checks=results["verdict"],
    )
