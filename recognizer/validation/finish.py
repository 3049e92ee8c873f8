"""From the touches of a run to its results, its report and its data set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from recognizer.validation.campaign import FILES, PRINTED, series_of
from recognizer.validation.extremes import extremes
from recognizer.validation.files import write_json, write_text
from recognizer.validation.flat_faces import flat_objects
from recognizer.validation.precision import contact_study, decoder_study, reader_study
from recognizer.validation.progress import TouchProgress
from recognizer.validation.provenance import judging_limits, provenance
from recognizer.validation.record import RunRecord
from recognizer.validation.report import page_of
from recognizer.validation.results import results_of
from recognizer.validation.savings import engine_lines, find_savings
from recognizer.validation.shards import TIMES, columns_of, read_series, write_table
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.work import prepare_reader
from recognizer.validation.worlds import world_times

TRIALS, RESULTS, TIMES_FILE = "trials.parquet", "results.json", "times.json"
REPORT = "report.html"


def write_results(record: RunRecord, folder: Path) -> dict[str, Any]:
    """Write everything that follows from the touches; returns the results."""
    campaign, work = record.campaign, record.work_now(folder)
    series = series_of(campaign)
    table = read_series(folder, series[0])
    rows = columns_of(table)
    spent = columns_of(read_series(folder, series[0], TIMES))
    reader = prepare_reader(work)
    asked = provenance(record, work.database)
    results = results_of(rows, asked["campaign"])
    times: dict[str, Any] = {name: _cpu_ms(spent[name]) for name in ("drawing", "reading")}
    times["worlds"] = world_times(rows, spent, asked["campaign"])
    results["rule"] = judging_limits()
    results["study"], results["left_out"], results["engines"] = {}, [], engine_lines()
    if campaign.study:
        studies = {
            "contact": contact_study(),
            "decoders": decoder_study(reader.lab.arrays[0], campaign.seed),
            "readers": reader_study(folder, campaign),
        }
        plan = TouchPlan(work.database, campaign.seed, kind="face",
                         files=campaign.surfaces == FILES, prints=work.prints,
                         engine=campaign.engine)  # fmt: skip
        saved = find_savings(reader, plan, studies["readers"])
        results["study"] = {name: study.counted for name, study in studies.items()}
        results["left_out"] = saved.counted
        times |= {name: study.spent for name, study in studies.items()}
        times["left_out"] = saved.spent
    if campaign.surfaces == PRINTED:
        from recognizer.validation.printing import prints_as_results

        results["printed"] = prints_as_results(folder, campaign)
    results["extremes"] = extremes(reader)
    results["provenance"] = asked
    write_table(table, folder / TRIALS)
    write_json(folder / RESULTS, results)
    write_json(folder / TIMES_FILE, times)
    flat = flat_objects(reader.lab, rows, results["objects"]["faces"])
    write_text(folder / REPORT, page_of(results, times, rows, flat))
    return results


def export_touches(record: RunRecord, folder: Path, kind: str, progress: TouchProgress) -> None:
    """Write the touches of a run as a data set."""
    from recognizer.validation.dataset import touch_dataset, write_npz
    from recognizer.validation.lerobot import write_lerobot

    data = touch_dataset(record, folder, progress)
    if kind == "npz":
        write_npz(data, folder)
    else:
        write_lerobot(data, folder)


def _cpu_ms(seconds: Any) -> dict[str, float]:
    """Return quantiles of CPU times, ms."""
    at = {"median": 0.5, "p95": 0.95, "p99": 0.99}
    found = {name: float(np.quantile(seconds, q)) for name, q in at.items()}
    found["mean"] = float(np.mean(seconds))
    return {name: round(1e3 * value, 3) for name, value in found.items()}
