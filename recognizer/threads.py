"""One thread for every matrix: those of a touch are small, and several would only wait."""

from __future__ import annotations

import os

LIBRARIES = ("OMP", "OPENBLAS", "MKL")


def one_thread() -> None:
    """Set it for this process and its children; call before numpy is imported. Users may differ."""
    for library in LIBRARIES:
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
