"""The page of a run: one HTML file that needs nothing else.

Results + times + rows -> report.html, in the order of the questions that are asked of it:
does it hold, who is taken for whom, how far off, when not, error against run time, extremes,
what was left out, the worst touches, where it comes from. Every picture is inline SVG.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from encoded_objects.base.errors import require
from recognizer.validation import pictures
from recognizer.validation.bounds import FAILS, HOLDS, UNTOLD
from recognizer.validation.precision_pictures import work_precision

if TYPE_CHECKING:
    from jinja2 import Environment

PAGE, PAIR = "report.html.j2", "compare.html.j2"


def require_report(command: str) -> None:
    """See to it that what writes tables, pictures and pages is installed."""
    require("pyarrow", "matplotlib", "jinja2", extra="report", purpose=command)


def page_of(
    results: dict[str, Any], times: dict[str, Any], rows: dict[str, Any], flat: list[dict[str, Any]]
) -> str:
    """Return the page of a run.

    Parameters
    ----------
    results, times
        As they are written to `results.json` and `times.json`.
    rows
        Columns of `trials.parquet`.
    flat
        The faces of every object drawn flat, as `flat_faces.flat_objects` returns them.
    """
    study, level = results["study"], results["provenance"]["contact_level"]
    drawn = {
        "confusion": pictures.confusion(results["objects"]),
        "pose": pictures.pose(rows),
        "against": pictures.accuracy(results),
        "margins": pictures.margins(rows),
        "work": work_precision(study, times, level) if study else "",
    }
    page = environment().get_template(PAGE)
    return page.render(r=results, times=times, pictures=drawn, flat=flat)


@lru_cache(maxsize=1)
def environment() -> Environment:
    """Return what renders the templates; numbers and shares as the pages write them."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters.update(
        size=_size, percent=_percent, share=_share, count=_count, interval=_interval, tint=_tint
    )
    return made


_TINTS = {HOLDS: "good", FAILS: "bad", UNTOLD: "untold"}


def _tint(state: str) -> str:
    """Return the class of a cell: red is what fails, grey what nobody can tell yet."""
    return _TINTS.get(state, "")


def _interval(ends: tuple[float, float | None], digits: int = 3) -> str:
    """Return an interval; an end that is not known is left open."""
    low, high = ends
    return f"{low:.{digits}f} … {'' if high is None else f'{high:.{digits}f}'}".strip()


def _size(value: float | None, digits: int = 3) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _percent(value: float | None, digits: int = 1) -> str:
    return "–" if value is None else f"{100 * value:.{digits}f} %"


def _share(share: dict[str, Any], digits: int = 2) -> str:
    """Return a share with its interval."""
    if share["share"] is None:
        return "–"
    low, high = (f"{100 * share[name]:.{digits}f}" for name in ("low", "high"))
    return f"{100 * share['share']:.{digits}f} % ({low} … {high})"


def _count(value: int | None) -> str:
    return "–" if value is None else f"{value:,}"
