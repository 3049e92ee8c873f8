"""Edge points -> line segments by an adaptive Hough transform, the longest first.

Every point votes for the lines n x = offset through it, those whose normal is about as its own
slope points. The accumulator is small: where it is fullest, it is laid out anew over fewer
degrees and millimetres, until its cells are as fine as the points are good. The points of the
longest unbroken run on that line become a segment, are taken away, and the rest votes again,
until no line holds three. Image frame, mm. Thesis 4.3, appendix 3.

Illingworth, Kittler, "The adaptive Hough transform", IEEE Trans. PAMI 9 (1987).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.thesis.edges.line import Edge, fit_line
from recognizer.thesis.edges.points import EdgePoints
from recognizer.thesis.settings import HoughSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Points on one line."""

    points: EdgePoints
    edge: Edge


def segments(points: EdgePoints, settings: HoughSettings | None = None) -> list[Segment]:
    """Return the line segments among edge points, the longest first."""
    chosen = settings or HoughSettings()
    found: list[Segment] = []
    left = points
    while len(left) >= chosen.least_points and len(found) < chosen.longest:
        best: Segment | None = None
        taken = np.zeros(len(left), np.bool_)
        for angle, offset in _peaks(left, chosen):
            run = _longest_run(left, angle, offset, chosen)
            if len(run) < chosen.least_points:
                continue
            members = left.chosen(run)
            edge = fit_line(members.at_mm, members.normals, chosen.spread_mm)
            run = _longest_run(left, edge.angle_rad, edge.offset_mm, chosen)
            if len(run) < chosen.least_points:
                continue
            members = left.chosen(run)
            edge = fit_line(members.at_mm, members.normals, chosen.spread_mm)
            if best is None or edge.length_mm > best.edge.length_mm:
                best = Segment(members, edge)
                taken = np.zeros(len(left), np.bool_)
                taken[run] = True
        if best is None or best.edge.length_mm < chosen.least_mm:
            break
        found.append(best)
        # what lies just as near without being of the run's points is of no other line
        left = left.chosen(~taken)
    return sorted(found, key=lambda segment: -segment.edge.length_mm)


def _peaks(points: EdgePoints, settings: HoughSettings) -> list[tuple[float, float]]:
    """Return angle and offset of the fullest lines, refined."""
    cell = settings.coarse_mm
    reach = float(np.abs(points.at_mm).max()) * math.sqrt(2) + cell
    angles = (np.arange(settings.directions) + 0.5) * math.tau / settings.directions
    offsets = np.arange(-reach, reach + cell, cell)
    votes = _votes(points, angles, offsets, cell, settings)
    order = np.argsort(-votes, axis=None, kind="stable")[: settings.starts]
    found = []
    for row, column in zip(*np.unravel_index(order, votes.shape), strict=True):
        found.append(_refine_line(points, float(angles[row]), float(offsets[column]), settings))
    return found


def _refine_line(
    points: EdgePoints, angle: float, offset: float, settings: HoughSettings
) -> tuple[float, float]:
    turn, cell = math.tau / settings.directions, settings.coarse_mm
    around = np.arange(-settings.around, settings.around + 1.0)
    while cell > settings.fine_mm:
        turn, cell = turn / 2, cell / 2
        angles = angle + around * turn
        offsets = offset + around * cell
        votes = _votes(points, angles, offsets, max(cell, settings.near_mm), settings)
        row, column = np.unravel_index(int(votes.argmax()), votes.shape)
        angle, offset = float(angles[row]), float(offsets[column])
    return angle, offset


def _votes(
    points: EdgePoints, angles: Array, offsets: Array, width_mm: float, settings: HoughSettings
) -> Array:
    """Return how many points (a, o) lie within half a width of each line, nearer ones more."""
    normals = np.stack([np.cos(angles), np.sin(angles)])
    alike = points.normals @ normals >= math.cos(settings.turn_rad)
    away = np.abs((points.at_mm @ normals)[..., None] - offsets) / width_mm
    return np.asarray((alike[..., None] * np.maximum(0.0, 1.0 - away)).sum(axis=0))


def _longest_run(
    points: EdgePoints, angle: float, offset: float, settings: HoughSettings
) -> NDArray[np.intp]:
    """Return the points of the longest unbroken run along a line, in order."""
    n = np.array([math.cos(angle), math.sin(angle)])
    near = np.abs(points.at_mm @ n - offset) <= settings.near_mm
    on = np.flatnonzero(near & (points.normals @ n >= math.cos(settings.turn_rad)))
    if len(on) == 0:
        return on
    places = points.at_mm[on] @ (n[1], -n[0])
    order = np.argsort(places, kind="stable")
    on, places = on[order], places[order]
    breaks = np.flatnonzero(np.diff(places) > settings.gap_mm) + 1
    runs = np.split(np.arange(len(on)), breaks)
    longest = max(runs, key=lambda run: float(places[run[-1]] - places[run[0]]))
    return np.asarray(on[longest])
