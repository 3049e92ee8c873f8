"""Arcs of G-code (G2 clockwise, G3 counter-clockwise, in the plane of the bed) as chords.

mm; a chord stays within `CHORD_MM` of its arc.
"""

from __future__ import annotations

import math

CHORD_MM = 0.005
_MOST = 100_000  # chords of one arc: a sound file has some hundreds
_ROUND = 0.05  # mm by which the two radii of an arc may differ: files round to 0.001

Point = tuple[float, float]


class ArcError(ValueError):
    """An arc that leads nowhere; says why."""


def chords(start: Point, end: Point, words: dict[str, float], *, clockwise: bool) -> list[Point]:
    """Return the points after `start` on an arc, `end` the last.

    Parameters
    ----------
    start, end
        mm; equal for a full circle.
    words
        I and J, from the start to the centre, or R, the radius, negative for the longer arc;
        P further full turns.

    Raises
    ------
    ArcError
        Without centre or radius, or where these do not lead from start to end.

    Examples
    --------
    >>> chords((1, 0), (0, 1), {"I": -1.0}, clockwise=False)[-1]
    (0, 1)
    """
    centre = _centre(start, end, words, clockwise)
    radius = math.dist(start, centre)
    if radius <= 0 or abs(math.dist(end, centre) - radius) > _ROUND:
        raise ArcError("the arc's centre is not as far from its end as from its start")
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    last = math.atan2(end[1] - centre[1], end[0] - centre[0])
    sweep = (first - last if clockwise else last - first) % (2 * math.pi)
    if math.dist(start, end) < 1e-6:
        sweep = 2 * math.pi
    sweep += 2 * math.pi * max(0, int(words.get("P", 1)) - 1)
    step = 2 * math.acos(max(0.0, 1 - CHORD_MM / radius))
    count = max(1, math.ceil(sweep / max(step, 1e-9)))
    if count > _MOST:
        raise ArcError(f"an arc of radius {radius:g} mm with {count} chords")
    sign = -1 if clockwise else 1
    angles = (first + sign * sweep * k / count for k in range(1, count))
    points = [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]
    return [*points, end]


def _centre(start: Point, end: Point, words: dict[str, float], clockwise: bool) -> Point:
    if "I" in words or "J" in words:
        return start[0] + words.get("I", 0.0), start[1] + words.get("J", 0.0)
    if "R" not in words:
        raise ArcError("an arc needs its centre (I, J) or its radius (R)")
    radius, chord = words["R"], math.dist(start, end)
    if not 0 < chord <= 2 * abs(radius) + _ROUND:
        raise ArcError(f"an arc of radius {abs(radius):g} mm does not reach {chord:g} mm")
    height = math.sqrt(max(0.0, radius * radius - chord * chord / 4))
    side = height if (radius > 0) != clockwise else -height
    x, y = (end[0] - start[0]) / chord, (end[1] - start[1]) / chord
    return (start[0] + end[0]) / 2 - side * y, (start[1] + end[1]) / 2 + side * x
