"""Locking: a bonded disc of S = 1 by four elements towards nu = .5.

    PYTHONPATH=tests python tests/bench/contact_locking.py [--parts 8] [--fail-over]

Stiffness over that of Q2-Q1 with four times as many elements each way, the reference itself
beside the closed formula 1 + 2 S^2 (exact for neither: some per cent at S = 1), and processor
time. `--fail-over` ends with 1 where an element that must not lock does (Q1P0 3.5 %, Q2-Q1
0.5 %, spread from nu = .499 on 0.2 %, all at 8 elements).
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np
from reference.elements_axisymmetric import DEGREES, apparent_modulus

RATIOS = (0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.5)
ALLOWED = {"q1p0": 0.035, "q2q1": 0.005}
SPREAD = 0.002  #: of an element that does not lock, from nu = .499 on


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", type=int, default=8, help="elements through the height")
    parser.add_argument("--shape", type=float, default=1.0, help="shape factor S")
    parser.add_argument("--fail-over", action="store_true")
    options = parser.parse_args()
    print(f"{'nu':<11}" + "".join(f"{nu:>9g}" for nu in RATIOS) + f"{'ms':>8}")
    truth = [modulus(options.shape, nu, "q2q1", 4 * options.parts) for nu in RATIOS]
    print(f"{'reference':<11}" + "".join(f"{value:>9.4f}" for value in truth))
    print(f"{'1 + 2 S^2':<11}" + f"{1 + 2 * options.shape**2:>{9 * len(RATIOS)}.4f}")
    locks = False
    for kind, (_, pressure) in DEGREES.items():
        start, line = time.process_time(), []
        for nu, value in zip(RATIOS, truth, strict=True):
            able = pressure is not None or nu < 0.5
            line.append(modulus(options.shape, nu, kind, options.parts) / value if able else np.nan)
        ms = 1e3 * (time.process_time() - start) / np.count_nonzero(~np.isnan(line))
        print(f"{kind:<11}" + "".join(f"{ratio:>9.4g}" for ratio in line) + f"{ms:>8.1f}")
        if kind in ALLOWED:
            near = line[RATIOS.index(0.499) :]
            locks |= np.abs(np.array(line) - 1).max() > ALLOWED[kind] or np.ptp(near) > SPREAD
    return int(options.fail_over and locks)


def modulus(shape: float, poisson: float, kind: str, parts: int) -> float:
    across = max(4, round(2 * shape * parts))
    return apparent_modulus(2 * shape, 1.0, poisson, kind, parts=(across, parts))


if __name__ == "__main__":
    sys.exit(main())
