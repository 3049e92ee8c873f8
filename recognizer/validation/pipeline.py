"""From what a person asks to the finished folder: set, touches, results, report.

`validate` is `validate-set SPEC...`; `report_again` makes the results and the page again from
the touches that are there. Both return a `ValidationResult`, which prints as the command does.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from encoded_objects.base.console import DONE, FAILED
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from recognizer.validation.campaign import PRINTED, campaign_of, series_of
from recognizer.validation.errors import ValidationError
from recognizer.validation.files import done_shards, write_json
from recognizer.validation.report import circumstances, require_report, write_results
from recognizer.validation.run import (
    RECORD,
    TouchProgress,
    lock_folder,
    prepare_run,
    read_record,
    touch_all,
)
from recognizer.validation.statistics import HOLDS
from recognizer.validation.workers import workers_of

EXPORTS = ("npz", "lerobot")
PROVENANCE = "provenance.json"


@dataclass(frozen=True, slots=True)
class ValidationBound:
    """A bound of the design and the value found; prints as a line."""

    name: str
    sign: str  #: of what must hold: =, <=, >=, or within two limits
    limit: float  #: a share, or in `unit`
    unit: str  #: empty: shares are bounded
    state: str  #: holds, fails, or too few touches to tell
    value: float | None  #: found: the share, or the size in `unit`; None: nothing to judge
    counted: tuple[int, int] | None = None  #: of a share: how many, of how many
    interval: tuple[float, float | None] | None = None  #: 95 %; None: no end is known
    upper: float | None = None  #: the other limit of `within`

    @property
    def holds(self) -> bool:
        """Whether the touches show that it holds."""
        return self.state == HOLDS

    def __str__(self) -> str:
        if self.value is None:
            return f"{self.name}: none was drawn"
        low, high = self.interval or (None, None)
        if self.counted is None:
            ends = [_size(end, "").strip() for end in (low, high)]
            said = f"{_size(self.value, self.unit)} ({' ... '.join(ends)})"
            return f"{self.name}: {said}, bound {self.sign} {self.limit:g} {self.unit}"
        said = f"{self.counted[0]:,} of {self.counted[1]:,}, {self.value:.3%}"
        if low is not None and high is not None:
            said += f" ({low:.3%} ... {high:.3%})"
        upper = "" if self.upper is None else f" ... {self.upper:.1%}"
        return f"{self.name}: {said}, bound {self.sign} {self.limit:.1%}{upper}"


@dataclass(frozen=True, slots=True)
class ValidationResult:
    """How a run ended."""

    touches: int
    right: int
    wrong: int
    rejected: int
    rms_mm: float | None  #: of the right answers; None without any
    rms_deg: float | None
    seconds: float  #: wall time of this run
    fair: int  #: touches that show enough symbols
    fair_right: int  #: of these, how many are answered right
    bounds: tuple[ValidationBound, ...]
    folder: Path  #: with report.html, results.json and trials.parquet
    faces: int = 0  #: touches of registered faces that were followed (policy `next`)
    normalised: tuple[float, float, float] | None = None
    """Squared error over variance of the right answers: mean (1 is honest), median, 95 % quantile;
    None without any."""
    within: tuple[int, ...] = ()  #: of these, right at once, within two touches, within three

    def __str__(self) -> str:
        head = (
            f"{self.touches:,} touches: {self.right:,} right, {self.wrong:,} wrong, "
            f"{self.rejected:,} refused; pose {_size(self.rms_mm, 'mm')}, "
            f"{_size(self.rms_deg, 'degrees')} rms ({self.seconds:.1f} s)"
        )
        if self.normalised is not None:
            mean, median, q95 = self.normalised
            head += (
                f"\n  squared error over variance: mean {mean:.2f}, median {median:.2f}, "
                f"95 % quantile {q95:.2f} (1, .79, 2.6 where the covariance is right)"
            )
        if self.within:
            shares = (f"{count:,} within {n}" for n, count in enumerate(self.within, start=1))
            head += f"\n  right of {self.faces:,} touches of registered faces: {', '.join(shares)}"
        return "\n".join([head, *(f"  {bound.state}: {bound}" for bound in self.bounds)])

    @property
    def holds(self) -> bool:
        """Whether every bound holds."""
        return all(bound.holds for bound in self.bounds)

    def as_json(self) -> dict[str, Any]:
        """Return what `validate-set --json` prints."""
        names = ("touches", "right", "wrong", "rejected", "rms_mm", "rms_deg", "seconds")
        values = {name: getattr(self, name) for name in names}
        values["normalised"] = None if self.normalised is None else list(self.normalised)
        within = {"faces": self.faces, "within": list(self.within)} if self.within else {}
        return values | within | {"folder": str(self.folder), "holds": self.holds}

    def exit_code(self, fail_under: float | None) -> int:
        """Return 1 if a touch was answered wrong or too few were answered right, in percent."""
        if fail_under is None:
            return DONE
        share = 100 * self.fair_right / self.fair if self.fair else 100.0
        return FAILED if self.wrong or share < fail_under else DONE


def validate(
    specs: str | Path | Sequence[str | Path] = (),
    *,
    folder: str | Path = "validation",
    touches: int | None = None,
    database: str | Path = "",
    kinds: str = "",
    levels: str = "",
    sensor_type: str | SensorType | None = None,
    overlay: str = "",
    surfaces: str = "",
    print_profile: str = "",
    faults: str = "",
    prints: str | Path = "",
    engine: str = "",
    sensor_per: str = "",
    policy: str = "",
    study: int | None = None,
    limits: int | None = None,
    shard: int | None = None,
    seed: int | None = None,
    jobs: int = 1,
    cluster: str = "",
    export: str = "",
    resume: bool = False,
    progress: TouchProgress | None = None,
) -> ValidationResult:
    """Make a set, touch it in simulation, read every touch, and write the report.

    `validate-set --help` describes the options. What is not given is as in the run that is
    resumed, or the default; who does the work (`jobs`, `cluster`) changes no result.

    Parameters
    ----------
    specs
        YAML files of what is made; none: what `database` holds.
    folder
        Of the run; gets report.html, results.json and trials.parquet.
    database
        Where the set is registered; `lab.db` in the folder if empty.
    kinds, levels
        Shares of the kinds of touches ("face=3,edge") and of the levels of noise.
    sensor_type
        What touches: a type, its name or file; `fsr-16` if not given.
    prints
        Folder of printed surfaces that runs share; `printed` in the folder if empty.
    progress
        Hears how far it is.

    Raises
    ------
    ValidationError, SetError, WorkersError
        See `recognizer.validation.errors`.
    PrintError
        Printed surfaces without PrusaSlicer, or an unknown profile or fault.
    MissingExtraError
        What writes tables and pictures is not installed.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> result = validate("fixtures/cube.yaml", touches=4, folder=mkdtemp())
    >>> print(result)  # doctest: +ELLIPSIS
    4 touches: ... right, 0 wrong, ... refused; ...
    """
    require_report("validate-set")
    if export and export not in EXPORTS:
        raise ValidationError(
            f"'{export}' is not known", fix=f"give {' or '.join(EXPORTS)}", place="--export"
        )
    begun, start = datetime.now(UTC), time.monotonic()
    given = [specs] if isinstance(specs, str | Path) else specs
    if not (isinstance(given, Sequence) and all(isinstance(one, str | Path) for one in given)):
        raise ValidationError(f"{specs!r} names no set", fix="give YAML files, or a database")
    if not isinstance(folder, str | Path):
        raise ValidationError(f"{folder!r} is no folder", fix="give a path", place="-o")
    named = [Path(spec) for spec in given]
    place, steps, workers = Path(folder), progress or TouchProgress(), workers_of(jobs, cluster)
    sensor = sensor_type and choose_sensor_type(sensor_type, "", None, "--sensor-type")
    options = {
        "touches": touches,
        "seed": seed,
        "kinds": kinds,
        "levels": levels,
        "sensor_type": sensor,
        "overlay": overlay,
        "surfaces": surfaces,
        "print_profile": print_profile,
        "faults": faults,
        "engine": engine,
        "sensor_per": sensor_per,
        "policy": policy,
        "study": study,
        "limits": limits,
        "shard": shard,
    }
    known = resume and (place / RECORD).exists()
    campaign = campaign_of(options, read_record(place).campaign if known else None)
    printed = campaign.surfaces == PRINTED
    if printed and not known:
        from recognizer.validation.printing import print_options

        print_options(campaign).plan()  # before anything is made: is all there that it needs?
    with lock_folder(place):
        work = prepare_run(place, campaign, named, str(database), resume=resume)
        if printed:
            from recognizer.validation.printing import print_set

            print_set(work, place, Path(prints) if prints else None, jobs, steps)
        touch_all(work, place, workers, steps)
        steps.begin("report", 0, 0)
        results = write_results(work, place)
        if export:
            from recognizer.validation.dataset import touch_dataset
            from recognizer.validation.dataset_formats import write_lerobot, write_npz

            write = write_npz if export == "npz" else write_lerobot
            write(touch_dataset(work, steps), place)
        seconds = round(time.monotonic() - start, 3)
        write_json(place / PROVENANCE, circumstances(begun, seconds, jobs, cluster))
    return result_from(results, seconds, place)


def report_again(folder: Path) -> ValidationResult:
    """Write results and report of a run again.

    Raises ValidationError: the run is not there, or not done.
    """
    require_report("validate-set report")
    work, start = read_record(folder), time.monotonic()
    if any(len(done_shards(folder, one)) < one.shards for one in series_of(work.campaign)):
        raise ValidationError(
            "the run is not done", fix="go on with it by --resume", place=str(folder)
        )
    with lock_folder(folder):
        results = write_results(work, folder)
    return result_from(results, round(time.monotonic() - start, 3), folder)


def result_from(results: dict[str, Any], seconds: float, folder: Path) -> ValidationResult:
    """Return what a run found, from its `results.json`."""
    totals, fair = results["totals"], results["enough"]
    followed = results.get("policy", [{"touches": 0, "within": []}])[0]
    return ValidationResult(
        **{name: totals[name] for name in ("touches", "right", "wrong", "rejected", "rms_mm",
                                           "rms_deg")},
        seconds=seconds,
        fair=fair["touches"],
        fair_right=fair["right"],
        bounds=tuple(map(bound_from, results["verdict"])),
        folder=folder,
        faces=followed["touches"],
        normalised=tuple(totals["normalised"][name] for name in ("mean", "median", "q95"))
        if totals["right"]
        else None,
        within=tuple(share["count"] for share in followed["within"]),
    )  # fmt: skip


def bound_from(line: dict[str, Any]) -> ValidationBound:
    """Return a bound from its line in `results.json`."""
    of_shares = "share" in line
    return ValidationBound(
        name=line["name"],
        sign=line["sign"],
        limit=line["bound"],
        unit=line["unit"],
        state=line["state"],
        value=line["share" if of_shares else "value"],
        counted=(line["count"], line["of"]) if of_shares else None,
        interval=(line["low"], line["high"]),
        upper=line["upper"],
    )


def _size(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.3f} {unit}"
