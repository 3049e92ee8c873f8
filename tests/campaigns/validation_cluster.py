"""`validate-set` by a dask cluster of two workers, one of them killed half-way: the same shards.

    python tests/campaigns/validation_cluster.py docs/validation/forty.yaml --touches 20000 \
        --like DIR_OF_A_RUN

Starts a scheduler and two workers on loopback, kills one by signal 9 when half of the shards
are written, and compares every shard, byte by byte, with that of a run by processes: the run
in `--like`, of the same spec and seed and at least as many touches, or one that is made first.
Exit code 1 if one differs.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

from validation_shards import differing, shards

COMMAND = [sys.executable, "-m", "recognizer.validation.command"]


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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("spec")
    parser.add_argument("--touches", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--like", type=Path)
    options = parser.parse_args()
    wanted = -(-options.touches // 1000)
    with tempfile.TemporaryDirectory() as temporary:
        mine, like = Path(temporary, "cluster"), options.like or Path(temporary, "plain")
        work = [*COMMAND, options.spec, "--touches", str(options.touches), "--study", "0",
                "--seed", str(options.seed), "-o"]  # fmt: skip
        if options.like is None:
            subprocess.run([*work, str(like), "-j", "2"], check=True)
        with cluster(Path(temporary)) as (address, workers):
            start = time.monotonic()
            process = subprocess.Popen([*work, str(mine), "--cluster", address])
            while process.poll() is None and len(shards(mine)) < wanted / 2:
                time.sleep(0.2)
            workers[0].kill()
            done = len(shards(mine))
            print(f"one worker killed after {done} of {wanted} shards", flush=True)
            code = process.wait()
            seconds = time.monotonic() - start
        made, differ = shards(mine), differing(mine, like)
        whole = code == 0 and len(made) == wanted
        print(
            f"exit code {code}, {len(made)} shards in {seconds:.0f} s, {len(differ)} files differ"
        )
        return 0 if whole and not differ else 1


if __name__ == "__main__":
    sys.exit(main())
