"""Every window of every profile decodes to itself, by every method: about two minutes.

    OPENBLAS_NUM_THREADS=1 python tests/bench/decoder_windows.py --seed 1

`large` and `fine` have the same array; the default tests leave out its serial conversion and
its likelihood. The seed orders the windows; it changes no result.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from decoder import Likelihood, decode_exact
from decoder.exact import METHODS
from generator.array import PROFILES

CHUNK = 4096


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for name, profile in PROFILES.items():
        array = profile.array()
        places = np.indices((array.rows, array.columns)).reshape(2, -1).T
        places = np.random.default_rng(options.seed).permutation(places)
        a, b = np.indices(array.window)
        likelihood = Likelihood(array, error=1e-6, blank=0)
        for method in (*METHODS, "likelihood"):
            start, right = time.process_time(), 0
            for first in range(0, len(places), CHUNK):
                part = places[first : first + CHUNK]
                windows = array.symbols(part[:, :1, None] + a, part[:, 1:, None] + b)
                if method == "likelihood":
                    found = likelihood.decode(windows)
                else:
                    found = decode_exact(array, windows, method)
                hit = (found.rows == part[:, 0]) & (found.columns == part[:, 1])
                right += int((hit & found.answered).sum())
            spent = time.process_time() - start
            print(
                f"{name:<10} {method:<11} {right} of {len(places)} right, {spent:.1f} s", flush=True
            )
            if right != len(places):
                raise SystemExit(1)


if __name__ == "__main__":
    main()
