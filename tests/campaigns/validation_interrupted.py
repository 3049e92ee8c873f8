"""`validate-set` killed and interrupted at random, and resumed to its end: the same bytes.

    python tests/campaigns/validation_interrupted.py fixtures/specs/thesis-four.yaml \
        --touches 2000 --shard 100 --times 10 -j 2

A run that is killed by signal 9 (with all its processes) or interrupted by Ctrl-C after a random
time, `--times` times, and resumed. Its shards, trials and results are compared, byte by byte, with
those of a run without interruption. Exit code 1 if one differs. `tests/loop/test_validate_set.py`
does it in small, and on a cluster that loses a worker.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import runner

COMPARED = ("shards/touches/*.parquet", "trials.parquet", "results.json")


def main() -> int:
    """Run as the options say."""
    parser = runner.arguments(__doc__, "spec", touches=2000, seed=1, jobs=2)
    parser.add_argument("--shard", type=int, default=1000)
    parser.add_argument("--times", type=int, default=10)
    asked = runner.parse(parser)
    with tempfile.TemporaryDirectory() as temporary:
        mine, like = Path(temporary, "mine"), Path(temporary, "whole")
        work = runner.command(
            "recognizer.validation", asked.spec, "--touches", asked.touches, "--study", 0,
            "--seed", asked.seed, "--shard", asked.shard, "-j", asked.jobs, "-o",
        )  # fmt: skip
        start = time.monotonic()
        subprocess.run([*work, str(like)], check=True)
        seconds = time.monotonic() - start
        interrupt([*work, str(mine)], mine, asked.times, asked.seed, seconds)
        whole = [path for pattern in COMPARED for path in sorted(like.glob(pattern))]
        differ = [
            path.name
            for path in whole
            if not (made := mine / path.relative_to(like)).exists()
            or made.read_bytes() != path.read_bytes()
        ]
        print(f"{len(differ)} of {len(whole)} files differ {differ or ''}")
        return 1 if differ else 0


def interrupt(work: list[str], folder: Path, times: int, seed: int, seconds: float) -> None:
    """Interrupt a run at random, again and again, and let it end."""
    rng = random.Random(seed)
    for number in range(times):
        process = subprocess.Popen(
            [*work, *resuming(folder)], start_new_session=True, stderr=subprocess.DEVNULL
        )
        wait = rng.uniform(0.1, 1.5) * seconds / times
        how = rng.choice((signal.SIGKILL, signal.SIGINT))
        try:
            process.wait(wait)
        except subprocess.TimeoutExpired:
            if how == signal.SIGKILL:
                os.killpg(process.pid, how)
            else:
                process.send_signal(how)
        made = len(list(folder.glob(COMPARED[0])))
        print(f"{number + 1:3d}  {how.name:8s} after {wait:6.1f} s: exit code {process.wait():4d}, "
              f"{made} shards", flush=True)  # fmt: skip
    subprocess.run([*work, *resuming(folder)], check=True)


def resuming(folder: Path) -> list[str]:
    """Return the option that goes on with a run that has begun."""
    return ["--resume"] if (folder / "asked.json").exists() else []


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the shell ignores it
    sys.exit(main())
