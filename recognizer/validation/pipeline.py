"""From what a person asks to the finished folder: set, touches, results, report.

`validate` is `validate-set SPEC...`; `report_again` makes the results and the page again from
the touches that are there.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from encoded_objects.base.sensor_type import SensorType, choose_sensor_type, sensor_type_text
from recognizer.validation.campaign import (
    PRINTED,
    CampaignOptions,
    campaign_of,
    series_of,
    shards_of,
)
from recognizer.validation.errors import ValidationError
from recognizer.validation.files import done_shards, write_json
from recognizer.validation.provenance import circumstances
from recognizer.validation.report import require_report, write_results
from recognizer.validation.result import ValidationResult, result_from
from recognizer.validation.run import (
    RECORD,
    TouchProgress,
    lock_folder,
    prepare_run,
    read_record,
    touch_all,
)
from recognizer.validation.workers import workers_of

EXPORTS = ("npz", "lerobot")
PROVENANCE = "provenance.json"


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
        `touch`: another sensor for every touch; `run`: one sensor, whose errors stay.
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
    campaign = campaign_of(options, read_record(place).campaign if known else None)
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
        results = write_results(record, place)
        if export:
            from recognizer.validation.dataset import touch_dataset, write_lerobot, write_npz

            write = write_npz if export == "npz" else write_lerobot
            write(touch_dataset(record, place, steps), place)
        seconds = round(time.monotonic() - start, 3)
        write_json(place / PROVENANCE, circumstances(begun, seconds, jobs, cluster))
    return result_from(results, seconds, place)


def report_again(folder: Path) -> ValidationResult:
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
        results = write_results(record, folder)
    return result_from(results, round(time.monotonic() - start, 3), folder)
