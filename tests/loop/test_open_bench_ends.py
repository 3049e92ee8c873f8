"""`open-bench` ends soon whatever is asked of it, and leaves no process and no draft."""

import signal

import pytest
from bench_loads import LONG, held
from hostile_recordings import write_zeros

SOON_S = 4.0  #: alone it takes half of that at most; other tests run beside it


@pytest.mark.parametrize(
    ("load", "number"),
    [
        ("dripping bodies", signal.SIGINT), ("promises", signal.SIGTERM),
        ("example", signal.SIGINT), ("making", signal.SIGTERM), ("messages", signal.SIGINT),
        ("silent port", signal.SIGINT), ("replays", signal.SIGINT), ("uploads", signal.SIGTERM),
    ],
)  # fmt: skip
def test_it_ends_under_load(lab, load, number):
    if load in ("replays", "uploads"):  # are read for long
        write_zeros(lab / "long.h5", LONG)
    seen = held(lab, load, number, seconds=1.0)
    assert seen["code"] == 0
    assert seen["ended_s"] < SOON_S
    assert (seen["processes"], seen["files"], seen["tracebacks"]) == (0, 0, 0)
    assert seen["answered_s"] >= 0  # it was not held
    assert seen["memory_mb"] < 600
