"""`validate-set` interrupted at random, again and again, and resumed: the same bytes.

    python tests/campaigns/validation_interrupted.py fixtures/specs/thesis-four.yaml \
        --touches 2000 --shard 100 --times 10 -j 2

A run that is killed by signal 9 (with all its processes) or interrupted by Ctrl-C after a random
time, `--times` times, and resumed to its end. Compares every shard, byte by byte, with that of a
run without interruption: the run in `--like`, of the same spec, seed and size of shards and at
least as many touches, or one that is made first. Exit code 1 if one differs.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from validation_shards import differing, shards

COMMAND = [sys.executable, "-m", "recognizer.validation.command"]
RATE = 25.0  #: touches a second, about, where no run is made first


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("spec")
    parser.add_argument("--touches", type=int, default=2000)
    parser.add_argument("--shard", type=int, default=1000)
    parser.add_argument("--times", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1, help="of the touches, and of the times")
    parser.add_argument("-j", type=int, default=2)
    parser.add_argument("--like", type=Path)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as temporary:
        broken, like = Path(temporary, "broken"), options.like or Path(temporary, "whole")
        work = [*COMMAND, options.spec, "--touches", str(options.touches), "--study", "0",
                "--seed", str(options.seed), "--shard", str(options.shard), "-j", str(options.j),
                "-o"]  # fmt: skip
        start, seconds = time.monotonic(), options.touches / RATE
        if options.like is None:
            subprocess.run([*work, str(like)], check=True)
            seconds = time.monotonic() - start
        start = time.monotonic()
        for number in range(options.times):
            resume = ["--resume"] if (broken / "asked.json").exists() else []
            process = subprocess.Popen(
                [*work, str(broken), *resume], start_new_session=True, stderr=subprocess.DEVNULL
            )
            wait = rng.uniform(0.1, 1.5) * seconds / options.times
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
                  f"{len(shards(broken))} shards", flush=True)  # fmt: skip
        resume = ["--resume"] if (broken / "asked.json").exists() else []
        subprocess.run([*work, str(broken), *resume], check=True)
        whole = () if options.like else ("trials.parquet", "results.json")
        made, differ = len(shards(broken)), differing(broken, like, *whole)
        print(f"{made} shards in {time.monotonic() - start:.0f} s, {len(differ)} files differ")
        return 0 if made == -(-options.touches // options.shard) and not differ else 1


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the shell ignores it
    sys.exit(main())
