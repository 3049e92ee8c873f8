"""How many touches of a sensor name a place on an array. Thesis 4.3, 6.3.

An answer needs ln N nats to name one of N cells, and `CERTAINTY` more by which no other place
may come near. A cell that is seen says up to ln(q + 1) nats: one of q symbols, or none. A scan
of n touches in a line sees (w + (n - 1) s) w of the surface, w the sensor's width, s its step.
"""

from __future__ import annotations

import math

SENSOR_MM = 25.4  #: width of 16 tactels of 1.5875 mm
STEP_SHARE = 0.2656  #: of the width, from touch to touch: 4.25 of 16 tactels, as scans are laid
CERTAINTY = 13.0  #: nats: the reader's margin and its surprise
#: Of what cells could say, that scans need to have seen: symbols cut by a face's or a sensor's
#: edge say less, but neighbouring cells of a window exclude each other. Simulated scans answered
#: first after 3-6 touches as a median and 3-12 at 95 % (`thesis`, 8 by this), 2 and 4
#: (`product` at 15 mm, 5 by this).
SEEN = 0.65
FELT_MM = 0.6  #: by which a symbol's centre lies inside the sensor to say what it is, about
REGISTERED = 1 << 16  #: cells that a lab's objects hold at most; arrays may be far larger


def touches_needed(order: int, cells: int, pitch_mm: float, *, sensor_mm: float = SENSOR_MM) -> int:
    """Return about how many overlapping touches an answer needs; 1: no scan.

    Parameters
    ----------
    order
        Number of symbols, q.
    cells
        Of the array.
    pitch_mm
        Of the symbols.
    sensor_mm
        Width of the sensor.

    Examples
    --------
    >>> touches_needed(2, 63 * 65, 12.0), touches_needed(4, 63 * 65, 7.0)
    (8, 1)
    """
    nats = math.log(max(min(cells, REGISTERED), 2)) + CERTAINTY
    seen = SEEN * nats / math.log(order + 1)
    length_mm = seen * pitch_mm**2 / sensor_mm
    return 1 + max(0, math.ceil((length_mm / sensor_mm - 1) / STEP_SHARE - 0.25))


def symbols_seen(pitch_mm: float, *, sensor_mm: float = SENSOR_MM) -> float:
    """Return how many symbols a touch inside a face tells, as a mean over its places.

    Those whose centre is under the sensor: 12 at 7 mm, 29 at 4.5 mm.
    """
    return float(((sensor_mm - 2 * FELT_MM) / pitch_mm) ** 2)
