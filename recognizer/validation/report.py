"""The page of a run: one HTML file that needs nothing else.

Results + times + rows -> report.html, in the order of its questions:
does it hold, who is taken for whom, how far off, when not, error against run time, extremes,
what was left out, the worst touches, where it comes from. Every picture is inline SVG.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from encoded_objects.base.errors import require
from encoded_objects.base.pages import page_environment
from recognizer.validation import pictures
from recognizer.validation.campaign import FILES, PRINTED, Work, series_of
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
from recognizer.validation.provenance import RULE, provenance
from recognizer.validation.results import results_of, world_times
from recognizer.validation.statistics import FAILS, HOLDS, UNTOLD
from recognizer.validation.studies import (
    contact_study,
    decoder_study,
    engine_lines,
    reader_study,
    work_avoided,
)
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.workers import reader_now

if TYPE_CHECKING:
    from jinja2 import Environment

PAGE, REPORT = "report.html.j2", "report.html"
TRIALS, RESULTS, TIMES_FILE = "trials.parquet", "results.json", "times.json"
NONE = "–"  #: for what is not known


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
    """Return a share with its interval."""
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
    """Return median, 95 %, 99 % and mean of CPU times, ms."""
    at = {"median": 0.5, "p95": 0.95, "p99": 0.99}
    found = {name: float(np.quantile(seconds, q)) for name, q in at.items()}
    found["mean"] = float(np.mean(seconds))
    return {name: round(1e3 * value, 3) for name, value in found.items()}
