"""What to give in place of a value that is no number of the kind that is needed."""

from __future__ import annotations

import math
from numbers import Integral, Real

LENGTH_MAX_MM = 10_000.0  #: longer is a wrong unit


def needed_number(
    value: object,
    *,
    whole: bool = False,
    least: float = -math.inf,
    above: bool = False,
    most: float = math.inf,
) -> str:
    """Return what to give in place of `value`; empty where it is such a number.

    Parameters
    ----------
    whole
        Whole numbers alone, of Python or NumPy.
    least, most
        Limits, which are allowed; with `above` the lower one is not.

    Examples
    --------
    >>> needed_number(80.0, least=0)
    ''
    >>> needed_number("80 N", least=0)
    'give a finite number of 0 or more'
    >>> needed_number(1, whole=True, least=2, most=255)
    'give a whole number from 2 to 255'
    """
    number = isinstance(value, Integral if whole else Real) and not isinstance(value, bool)
    if (
        number
        and math.isfinite(value)  # type: ignore[arg-type]
        and least <= value <= most  # type: ignore[operator]
        and not (above and value == least)
    ):
        return ""
    kind = "a whole number" if whole else "a finite number"
    if not math.isfinite(least):
        return f"give {kind}"
    if math.isfinite(most):
        between = f"above {least:g}, at most {most:g}" if above else f"from {least:g} to {most:g}"
        return f"give {kind} {between}"
    return f"give {kind} above {least:g}" if above else f"give {kind} of {least:g} or more"
