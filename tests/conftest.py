"""One thread for the linear algebra: tests run side by side, and times mean CPU."""

import os

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
