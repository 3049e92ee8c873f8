"""Bounds of the design beside what was found: it holds, it fails, or nobody can tell yet.

A share or a size comes with its 95 % interval. It holds or fails when all of the interval does;
where the interval straddles the bound, the touches are too few to tell. A count that must be
zero fails by one touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

HOLDS, FAILS, UNTOLD = "holds", "fails", "too few touches to tell"


@dataclass(frozen=True, slots=True)
class Interval:
    """Between what and what something lies, 95 %; `high` None: no end is known."""

    low: float
    high: float | None


def state_within(found: Interval, least: float | None, most: float | None) -> str:
    """Return whether what was found lies within bounds; None: no bound on that side.

    Examples
    --------
    >>> state_within(Interval(0.90, 1.0), 0.95, None)
    'too few touches to tell'
    >>> state_within(Interval(0.2, 0.4), 0.95, None), state_within(Interval(0.2, 0.4), None, 0.5)
    ('fails', 'holds')
    """
    high = float("inf") if found.high is None else found.high
    if (least is not None and high < least) or (most is not None and found.low > most):
        return FAILS
    if (least is None or found.low >= least) and (most is None or high <= most):
        return HOLDS
    return UNTOLD


def state_of(found: dict[str, Any], sign: str, bound: float, upper: float | None = None) -> str:
    """Return whether a bound holds, fails, or the touches are too few to tell.

    Parameters
    ----------
    found
        A share or a size with its interval: `low`, `high`, and `count` of a share.
    sign
        `=` of a count, `>=`, `<=`, or `within`: from `bound` to `upper`.
    bound, upper
        In the unit of what was found.
    """
    if sign == "=":
        return HOLDS if found["count"] == bound else FAILS
    if found["of"] == 0:
        return UNTOLD
    least = bound if sign in (">=", "within") else None
    most = {"<=": bound, "within": upper}.get(sign)
    return state_within(Interval(found["low"], found["high"]), least, most)
