"""From what a person asks to the finished folder: set, touches, results, report.

`validate` is `validate-set SPEC...`; `report_anew` makes the results and the page again from
the touches that are there.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from probe.contact.engines import ENGINES
from probe.sensor import SensorType
from probe.sensor_types import choose_sensor_type, sensor_type_text
from recognizer.validation.campaign import (
    FILES,
    PRINTED,
    SURFACES,
    Campaign,
    kinds_of,
    levels_of,
    series_of,
    shards_of,
    touchable,
)
from recognizer.validation.draw import TouchPlan, sensor_of
from recognizer.validation.errors import ValidationError
from recognizer.validation.extremes import extremes
from recognizer.validation.files import write_json, write_text
from recognizer.validation.flat_faces import flat_objects
from recognizer.validation.policy import POLICY_NAMES
from recognizer.validation.precision import contact_study, decoder_study, reader_study
from recognizer.validation.progress import TouchProgress
from recognizer.validation.provenance import circumstances, judging_limits, provenance
from recognizer.validation.record import RECORD, RunRecord, read_record
from recognizer.validation.report import page_of, require_report
from recognizer.validation.result import ValidationResult, result_from
from recognizer.validation.results import results_of
from recognizer.validation.run import (
    lock_folder,
    prepare_run,
    touch_all,
)
from recognizer.validation.savings import engine_lines, find_savings
from recognizer.validation.settings import STUDIES
from recognizer.validation.shards import (
    TIMES,
    columns_of,
    done_shards,
    read_series,
    write_table,
)
from recognizer.validation.work import prepare_reader
from recognizer.validation.workers import workers_of
from recognizer.validation.worlds import world_times

TRIALS, RESULTS, TIMES_FILE = "trials.parquet", "results.json", "times.json"
EXPORTS = ("npz", "lerobot")
REPORT, PROVENANCE = "report.html", "provenance.json"


@dataclass(frozen=True, slots=True)
class CampaignOptions:
    """Options as they were given; None or empty: as in the run that is resumed, or the default."""

    touches: int | None = None
    seed: int | None = None
    kinds: str = ""
    levels: str = ""
    sensor_type: str = ""
    overlay: str = ""
    surfaces: str = ""
    print_profile: str = ""
    faults: str = ""
    engine: str = ""
    sensor_per: str = ""
    policy: str = ""
    study: int | None = None
    shard: int | None = None


def validate(
    specs: str | Path | Sequence[str | Path] = (),
    *,
    folder: str | Path = "validation",
    touches: int | None = None,
    database: str = "",
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
    shard: int | None = None,
    seed: int | None = None,
    jobs: int = 1,
    cluster: str = "",
    export: str = "",
    resume: bool = False,
    progress: TouchProgress | None = None,
) -> ValidationResult:
    """Make a set, touch it in simulation, read every touch, and write the report.

    Parameters
    ----------
    specs
        YAML files of what is made; none: what `database` holds.
    folder
        Of the run; gets report.html, results.json and trials.parquet.
    touches
        How many; 1000 if not given.
    database
        Where the set is registered; `lab.db` in the folder if empty.
    kinds, levels
        Shares of the kinds of touches ("face=3,edge") and of the levels of noise.
    sensor_type
        What touches: a type, its name or file; `fsr-16` if not given.
    overlay
        `tab` or `pad` instead of the type's own overlay.
    surfaces
        `files`: the written STL files are touched; `printed`: what PrusaSlicer's G-code leaves of
        them; `database`: the registered faces.
    print_profile
        Of printed surfaces: a name such as `fdm-0.4-0.2`, or a file that PrusaSlicer exported.
    faults
        Of printed surfaces: none, usual, bad, or k=v,... of the machine's faults.
    prints
        Folder of printed surfaces that runs share; `printed` in the folder if empty.
    engine
        Of contact: `own`, or `mujoco` (extra `engines`), which knows tabs alone.
    sensor_per
        `touch`: every touch is felt by another sensor; `run`: all by one, whose errors stay.
    policy
        `one`: every touch by itself; `next`: where it is not answered, touches follow where the
        answer proposes, up to three, read as one belief.
    study
        Touches of each reader in the picture of error against run time; 0: none.
    shard
        Touches in a file, and lost at most when interrupted.
    seed
        Of all that is drawn.
    jobs, cluster
        Processes on this machine, or a dask scheduler (`tcp://host:8786`) whose workers do
        the work. Who does it changes no result.
    export
        `npz` or `lerobot`: write the touches with their truth too, for training (`dataset`).
    resume
        Go on with the run that the folder holds.
    progress
        Hears how far it is.

    Raises
    ------
    ValidationError, SetError, WorkersError
        See `run.prepare`, `workers`, `cluster`.
    PrintError
        Printed surfaces without PrusaSlicer, or an unknown profile or fault.
    MissingExtraError
        What writes tables and pictures is not installed.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> result = validate("fixtures/cube.yaml", touches=4, folder=mkdtemp())
    >>> print(result)  # doctest: +ELLIPSIS
    4 touches: ... right, 0 wrong, ... rejected; ...
    """
    require_report("validate-set")
    if export and export not in EXPORTS:
        raise ValidationError(
            f"'{export}' is not known", fix=f"give {' or '.join(EXPORTS)}", place="--export"
        )
    begun, start = datetime.now(UTC), time.monotonic()
    named = [Path(spec) for spec in ([specs] if isinstance(specs, str | Path) else specs)]
    place, steps = Path(folder), progress or TouchProgress()
    kind = choose_sensor_type(sensor_type, "", None, "--sensor-type")
    text = "" if sensor_type is None or kind == SensorType() else sensor_type_text(kind)
    options = CampaignOptions(touches, seed, kinds, levels, text, overlay, surfaces, print_profile,
                              faults, engine, sensor_per, policy, study, shard)  # fmt: skip
    known = resume and (place / RECORD).exists()
    campaign = _campaign(options, read_record(place).campaign if known else None)
    printed = campaign.surfaces == PRINTED
    if printed and not known:
        from recognizer.validation.printing import print_options

        print_options(campaign).plan()  # before anything is made: is all there that it needs?
    with lock_folder(place):
        record = prepare_run(place, campaign, named, database, resume=resume)
        if printed:
            from recognizer.validation.printing import print_set

            print_set(record, place, Path(prints) if prints else None, jobs, steps)
        touch_all(record, place, workers_of(jobs, cluster), steps)
        steps.begin("report", 0, 0)
        results = _finish(record, place)
        if export:
            _export(record, place, export, steps)
        seconds = round(time.monotonic() - start, 3)
        write_json(place / PROVENANCE, circumstances(begun, seconds, jobs, cluster))
    return result_from(results, seconds, place)


def report_anew(folder: Path) -> ValidationResult:
    """Write results and report of a run again.

    Raises
    ------
    ValidationError
        The run is not there, or not done.
    """
    require_report("validate-set report")
    record, start = read_record(folder), time.monotonic()
    for series in series_of(record.campaign):
        if len(done_shards(folder, series)) < shards_of(series):
            raise ValidationError(
                "the run is not done", fix="go on with it by --resume", place=str(folder)
            )
    with lock_folder(folder):
        results = _finish(record, folder)
    return result_from(results, round(time.monotonic() - start, 3), folder)


def _export(record: RunRecord, folder: Path, kind: str, progress: TouchProgress) -> None:
    """Write the touches of a run as a data set."""
    from recognizer.validation.dataset import touch_dataset, write_npz
    from recognizer.validation.lerobot import write_lerobot

    data = touch_dataset(record, folder, progress)
    if kind == "npz":
        write_npz(data, folder)
    else:
        write_lerobot(data, folder)


def _campaign(options: CampaignOptions, known: Campaign | None) -> Campaign:
    """Return what is record for, options over what was record before over defaults."""
    for given, allowed, option in (
        (options.overlay, ("tab", "pad"), "--overlay"),
        (options.surfaces, SURFACES, "--surfaces"),
        (options.engine, tuple(ENGINES), "--engine"),
        (options.sensor_per, ("touch", "run"), "--sensor-per"),
        (options.policy, POLICY_NAMES, "--policy"),
    ):
        if given and given not in allowed:
            raise ValidationError(
                f"'{given}' is not known", fix=f"give {' or '.join(allowed)}", place=option
            )
    base = known or Campaign()
    own = sensor_of(options.sensor_type, "").overlay.kind if options.sensor_type else ""
    touches = base.touches if options.touches is None else options.touches
    study = base.study if known else STUDIES.touches_of(touches)
    campaign = replace(
        base,
        touches=touches,
        seed=base.seed if options.seed is None else options.seed,
        kinds=kinds_of(options.kinds) if options.kinds else base.kinds,
        levels=levels_of(options.levels) if options.levels else base.levels,
        sensor_type=options.sensor_type or base.sensor_type,
        overlay=options.overlay or own or base.overlay,
        surfaces=options.surfaces or base.surfaces,
        print_profile=options.print_profile or base.print_profile,
        faults=options.faults or base.faults,
        engine=options.engine or base.engine,
        sensor_per=options.sensor_per or base.sensor_per,
        policy=options.policy or base.policy,
        study=study if options.study is None else options.study,
        shard=base.shard if options.shard is None else options.shard,
    )
    for given, option in (
        (campaign.print_profile, "--print-profile"),
        (campaign.faults, "--faults"),
    ):
        if given and campaign.surfaces != PRINTED:
            raise ValidationError(
                f"{campaign.surfaces} are touched, nothing is printed",
                fix="add --surfaces printed",
                place=option,
            )
    return touchable(campaign, bool(options.kinds))


def _finish(record: RunRecord, folder: Path) -> dict[str, Any]:
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


def _cpu_ms(seconds: Any) -> dict[str, float]:
    """Return quantiles of CPU times, ms."""
    at = {"median": 0.5, "p95": 0.95, "p99": 0.99}
    found = {name: float(np.quantile(seconds, q)) for name, q in at.items()}
    found["mean"] = float(np.mean(seconds))
    return {name: round(1e3 * value, 3) for name, value in found.items()}
