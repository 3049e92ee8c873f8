"""`open-bench` ends soon whatever is asked of it, and leaves no process and no draft."""

import signal

import pytest
from bench_loads import held

SOON_S = 4.0  #: alone it takes half of that at most; other tests run beside it


@pytest.mark.parametrize(
    ("load", "number"),
    [
        ("dripping bodies", signal.SIGINT),
        ("promises", signal.SIGTERM), ("example", signal.SIGINT),
        ("making", signal.SIGTERM), ("loads", signal.SIGTERM),
        ("messages", signal.SIGINT),
        ("silent port", signal.SIGINT),
    ],
)  # fmt: skip
def test_it_ends_under_load(lab, load, number):
    seen = held(lab, load, number, seconds=1.0)
    assert seen["code"] == 0
    assert seen["ended_s"] < SOON_S
    assert (seen["processes"], seen["files"], seen["tracebacks"]) == (0, 0, 0)
    assert seen["answered_s"] >= 0  # it was not held
    assert seen["memory_mb"] < 600
