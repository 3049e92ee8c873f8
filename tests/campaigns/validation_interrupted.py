"""`validate-set` interrupted and resumed, or by a cluster that loses a worker: the same bytes.

    python tests/campaigns/validation_interrupted.py fixtures/specs/thesis-four.yaml \
        --touches 2000 --shard 100 --times 10 -j 2
    python tests/campaigns/validation_interrupted.py docs/validation/forty.yaml --cluster \
        --touches 20000 --like DIR_OF_A_RUN

A run that is killed by signal 9 (with all its processes) or interrupted by Ctrl-C after a random
time, `--times` times, and resumed to its end; or, with `--cluster`, one on a dask scheduler and two
workers on loopback, one of them killed by signal 9 when half of the shards are written. Every shard
is compared, byte by byte, with that of a run without interruption: the run in `--like`, of the same
spec, seed and size of shards and at least as many touches, or one that is made first. Exit code 1
if one differs.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import runner

COMMAND = [sys.executable, "-m", "recognizer.validation.command"]
RATE = 25.0  #: touches a second, about, where no run is made first
SHARDS = "shards/touches/*.parquet"


def shards(folder: Path) -> list[Path]:
    """Return the shards of a run that are written, in order."""
    return sorted(folder.glob(SHARDS))


def differing(made: Path, like: Path, *also: str) -> list[str]:
    """Return the names of shards, and of other files, that another run has otherwise.

    Shards of a run of more touches may be compared; what stands for a whole run may not.
    """
    return [
        path.name
        for path in [*shards(made), *(made / name for name in also)]
        if path.read_bytes() != (like / path.relative_to(made)).read_bytes()
    ]


@contextmanager
def cluster(folder: Path):
    """Yield the scheduler's address and its two workers."""
    told = folder / "scheduler.json"
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    started: list[subprocess.Popen[bytes]] = []

    def start(what: str, *options: str) -> None:
        words = [sys.executable, "-m", f"distributed.cli.dask_{what}", *options, "--no-dashboard"]
        started.append(
            subprocess.Popen(words, env=environment, cwd=folder, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL)
        )  # fmt: skip

    try:
        start("scheduler", "--port", "0", "--host", "127.0.0.1", "--scheduler-file", str(told))
        address = ""
        while not address:
            time.sleep(0.1)
            with suppress(FileNotFoundError, ValueError):  # not there, or being written
                address = json.loads(told.read_text())["address"]
        for _ in range(2):
            start("worker", address, "--nthreads", "1", "--no-nanny")
        yield address, started[1:]
    finally:
        for process in started:
            process.kill()
            process.wait()


def main() -> int:
    """Run as the options say."""
    parser = runner.arguments(__doc__, "spec", touches=2000, seed=1, jobs=2)
    parser.add_argument("--shard", type=int, default=1000)
    parser.add_argument("--times", type=int, default=10)
    parser.add_argument("--cluster", action="store_true")
    parser.add_argument("--like", type=Path)
    options = runner.parse(parser)
    with tempfile.TemporaryDirectory() as temporary:
        mine, like = Path(temporary, "mine"), options.like or Path(temporary, "whole")
        work = [*COMMAND, options.spec, "--touches", str(options.touches), "--study", "0",
                "--seed", str(options.seed), "--shard", str(options.shard)]  # fmt: skip
        start, seconds = time.monotonic(), options.touches / RATE
        if options.like is None:
            subprocess.run([*work, "-j", str(options.jobs), "-o", str(like)], check=True)
            seconds = time.monotonic() - start
        start, wanted = time.monotonic(), -(-options.touches // options.shard)
        if options.cluster:
            by_cluster(work, mine, wanted)
        else:
            work += ["-j", str(options.jobs)]
            interrupt(work, mine, options.times, seconds, random.Random(options.seed))
        whole = () if options.like else ("trials.parquet", "results.json")
        made, differ = len(shards(mine)), differing(mine, like, *whole)
        print(f"{made} shards in {time.monotonic() - start:.0f} s, {len(differ)} files differ")
        return 0 if made == wanted and not differ else 1


def by_cluster(work: list[str], folder: Path, wanted: int) -> None:
    """Do a run by a cluster of two workers, and kill one half-way."""
    with cluster(folder.parent) as (address, workers):
        process = subprocess.Popen([*work, "-o", str(folder), "--cluster", address])
        while process.poll() is None and len(shards(folder)) < wanted / 2:
            time.sleep(0.2)
        workers[0].kill()
        print(f"one worker killed after {len(shards(folder))} of {wanted} shards", flush=True)
        print(f"exit code {process.wait()}", flush=True)


def interrupt(
    work: list[str], folder: Path, times: int, seconds: float, rng: random.Random
) -> None:
    """Interrupt a run at random, again and again, and let it end."""

    def resumed() -> list[str]:
        resume = ["--resume"] if (folder / "asked.json").exists() else []
        return [*work, "-o", str(folder), *resume]

    for number in range(times):
        process = subprocess.Popen(resumed(), start_new_session=True, stderr=subprocess.DEVNULL)
        wait = rng.uniform(0.1, 1.5) * seconds / times
        how = rng.choice((signal.SIGKILL, signal.SIGINT))
        try:
            process.wait(wait)
        except subprocess.TimeoutExpired:
            if how == signal.SIGKILL:
                os.killpg(process.pid, how)
            else:
                process.send_signal(how)
        code = process.wait()
        print(f"{number + 1:3d}  {how.name:8s} after {wait:6.1f} s: exit code {code:4d}, "
              f"{len(shards(folder))} shards", flush=True)  # fmt: skip
    subprocess.run(resumed(), check=True)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the shell ignores it
    sys.exit(main())
