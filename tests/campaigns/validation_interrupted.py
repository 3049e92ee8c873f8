"""`validate-set` interrupted at random, again and again, and resumed: the same bytes.

    python tests/campaigns/validation_interrupted.py fixtures/specs/thesis-four.yaml \
        --touches 2000 --times 10 -j 2

A run without interruption first, then one that is killed by signal 9 (with all its processes)
or interrupted by Ctrl-C after a random time, `--times` times, and resumed to its end.
Compares trials.parquet and results.json byte by byte; exit code 1 if they differ.
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

COMMAND = [sys.executable, "-m", "recognizer.validation.command"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("spec")
    parser.add_argument("--touches", type=int, default=2000)
    parser.add_argument("--shard", type=int, default=100)
    parser.add_argument("--times", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", type=int, default=2)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as temporary:
        whole, broken = Path(temporary, "whole"), Path(temporary, "broken")
        work = [*COMMAND, options.spec, "--touches", str(options.touches), "--study", "0",
                "--shard", str(options.shard), "-j", str(options.j), "-o"]  # fmt: skip
        start = time.monotonic()
        subprocess.run([*work, str(whole)], check=True)
        seconds = time.monotonic() - start
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
            shards = len(list(broken.glob("shards/touches/*.parquet")))
            print(f"{number + 1:3d}  {how.name:8s} after {wait:6.1f} s: exit code {code:4d}, "
                  f"{shards} shards", flush=True)  # fmt: skip
        resume = ["--resume"] if (broken / "asked.json").exists() else []
        subprocess.run([*work, str(broken), *resume], check=True)
        same = all(
            (whole / name).read_bytes() == (broken / name).read_bytes()
            for name in ("trials.parquet", "results.json")
        )
        print("identical" if same else "DIFFERENT")
        return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
