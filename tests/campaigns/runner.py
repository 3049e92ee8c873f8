"""What every campaign and benchmark does: options, processes, rows that resume, tables.

    asked = runner.asked(__doc__, "database", seed=7, touches=400, jobs=2)
    rows = runner.resume(file, jobs, work, asked.jobs)
    runner.table(("level", "right"), lines)

A script imports it by `import runner`, one of `tests/bench` after
`sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))`.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

sys.path.insert(0, str(Path(__file__).parents[1]))
import postgres
from programs import command

Job = TypeVar("Job")
Result = TypeVar("Result")
Row = dict[str, Any]

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
INSIDE_CHI2 = 7.814727903251179  #: 95 % quantile of chi2 with 3 degrees of freedom: x, y, turn


def asked(doc: str | None, *names: str, output: bool = False, **options: Any) -> argparse.Namespace:
    """Return the options of a script; it starts again with one BLAS thread if it has more.

    `names` are positional; `output`: a folder or file is needed, `-o`. Each of `options` is
    `--NAME` with its default: False a switch, a list several values, a type no default.
    """
    shown = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=doc, formatter_class=shown)
    for name in names:
        parser.add_argument(name)
    if output:
        parser.add_argument("-o", "--output", type=Path, required=True)
    for name, default in options.items():
        flags = ("-j", "--jobs") if name == "jobs" else (f"--{name.replace('_', '-')}",)
        if default is False:
            parser.add_argument(*flags, action="store_true")
        elif isinstance(default, list):
            parser.add_argument(*flags, type=type(default[0]), nargs="*", default=default)
        elif isinstance(default, type):
            parser.add_argument(*flags, type=default)
        else:
            parser.add_argument(*flags, type=type(default), default=default)
    given = parser.parse_args()
    if any(name not in os.environ for name in ONE_THREAD):
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | ONE_THREAD)
    return given


def clocked(work: Callable[..., Result], *values: Any) -> tuple[Result, float]:
    """Return what `work` makes of the values, and its processor time (ms)."""
    start = time.process_time()
    made = work(*values)
    return made, 1e3 * (time.process_time() - start)


@contextmanager
def databases(engine: str, *options: str) -> Iterator[dict[str, str]]:
    """Give new databases by name: `sqlite`, `postgresql` or `both`; options of `postgres.py`."""
    with ExitStack() as stack:
        urls = {}
        if engine != "postgresql":
            urls["sqlite"] = stack.enter_context(tempfile.TemporaryDirectory()) + "/lab.db"
        if engine != "sqlite":
            urls["postgresql"] = stack.enter_context(postgres.running(*options))
        yield urls


def in_processes(
    work: Callable[[Job], Result], jobs: Iterable[Job], processes: int = 1
) -> Iterator[Result]:
    """Yield `work(job)` for each job, in order; in this process if there is only one."""
    if processes == 1:
        yield from map(work, jobs)
        return
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        yield from pool.map(work, jobs)


def resume(
    file: Path, jobs: Sequence[Job], work: Callable[[Job], Row], processes: int = 1
) -> list[Row]:
    """Return a row for each job, in order; those that a JSON lines file holds are not done again.

    Each row is written as soon as it is done, so an interrupted script goes on where it was. The
    file belongs to one list of jobs, which may become longer.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    file.touch()
    kept = [json.loads(line) for line in file.read_text("utf-8").splitlines()]
    with file.open("a", encoding="utf-8") as out:
        for done in in_processes(work, jobs[len(kept) :], processes):
            out.write(json.dumps(done) + "\n")
            out.flush()
            kept.append(done)
    return kept


def table(heads: Sequence[str], lines: Iterable[Sequence[object]] = ()) -> None:
    """Print a Markdown table, each line as soon as it comes."""
    print(f"| {' | '.join(heads)} |")
    print("| --- " * len(heads) + "|", flush=True)
    for line in lines:
        row(*line)


def row(*cells: object) -> None:
    """Print a line of a Markdown table; numbers that are not whole to three digits."""
    shown = (f"{cell:.3g}" if isinstance(cell, float) else str(cell) for cell in cells)
    print(f"| {' | '.join(shown)} |", flush=True)


def run(package: str, *words: object) -> None:
    """Run a command of a package, results not shown; ends the script with its code if it fails."""
    with subprocess.Popen(command(package, *words), stdout=subprocess.DEVNULL) as process:
        try:
            code = process.wait()
        except KeyboardInterrupt:  # it writes what it has
            process.wait()
            raise
    if code:
        raise SystemExit(code)


def rows_of(folder: Path, what: str = "shards") -> list[Row]:
    """Return the rows of a run of `validate-set` that are written so far."""
    import pyarrow.parquet as pq

    files = sorted(folder.glob(f"{what}/touches/*.parquet"))
    return [row for file in files for row in pq.read_table(file).to_pylist()]


def trial_of(answer: Any, touch: Any, scene: Any) -> Row:
    """Return what became of a touch of a scene, as `outcome` takes it: right within 2 mm."""
    import numpy as np

    if not answer:
        return {"verdict": "rejected", "reason": answer.reason}
    turn = math.remainder(math.radians(answer.theta_deg) - touch.theta_rad, math.tau)
    off = np.array([answer.x_mm - touch.x_mm, answer.y_mm - touch.y_mm, turn])
    mm, same = math.hypot(*off[:2]), (answer.object, answer.face)
    right = same == (scene.object_name, scene.face) and mm <= 2
    return {"verdict": "right" if right else "wrong", "reason": "", "error_mm": mm,
            "error_deg": math.degrees(turn),
            "chi2": float(off @ np.linalg.solve(answer.covariance, off))}  # fmt: skip


def outcome(trials: Iterable[Any]) -> Row:
    """Return what became of touches: rows of `trials.parquet`, or `recognizer.validation` trials.

    `touches`, `right`, `wrong`, `rejected`; of the right ones root mean squares `rms_mm` and
    `rms_deg`, `worst_mm`, the share `inside` the 95 % ellipsoid of the covariance, and the mean
    squared error over variance, `normalised`, 1 where the covariance is true (nan of none);
    `reasons` of the rejected ones.
    """
    import numpy as np

    def value(trial: Any, name: str) -> Any:
        return trial[name] if isinstance(trial, Mapping) else getattr(trial, name)

    found = list(trials)
    count = Counter(value(one, "verdict") for one in found)
    right = [one for one in found if value(one, "verdict") == "right"]
    mm, deg, chi2 = (
        np.array([value(one, name) for one in right]) for name in ("error_mm", "error_deg", "chi2")
    )
    none = not right
    return {
        "touches": len(found),
        **{name: count[name] for name in ("right", "wrong", "rejected")},
        "rms_mm": np.nan if none else float(np.sqrt(np.mean(mm**2))),
        "rms_deg": np.nan if none else float(np.sqrt(np.mean(deg**2))),
        "worst_mm": np.nan if none else float(mm.max()),
        "inside": np.nan if none else float(np.mean(chi2 < INSIDE_CHI2)),
        "normalised": np.nan if none else float(np.mean(chi2) / 3),
        "reasons": dict(Counter(filter(None, (value(one, "reason") for one in found)))),
    }
