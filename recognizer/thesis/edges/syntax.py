"""Segments -> edges, edges -> corners, by production rules. Thesis 4.3.

    EDGE   := EDGE1 or EDGE2     if they run on into each other
    EDGE   := EDGE1 or BREAK     a short piece that runs on, too
    VERTEX := EDGE1 and EDGE2    if they turn

Angles are those between the two ways: straight on is 180 degrees, as the thesis has it. A
BREAK that continues no EDGE is dropped.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from recognizer.thesis.edges.hough import Segment
from recognizer.thesis.edges.line import Corner, Edge, corner_between, fit_line
from recognizer.thesis.edges.points import EdgePoints
from recognizer.thesis.settings import SyntaxRules


def fuse_segments(segments: list[Segment], rules: SyntaxRules | None = None) -> tuple[Edge, ...]:
    """Return the edges that segments are parts of, the longest first."""
    chosen = rules or SyntaxRules()
    parts = sorted(segments, key=lambda segment: -segment.edge.length_mm)
    edges: list[Segment] = []
    for part in parts:
        k = next((k for k, e in enumerate(edges) if _is_one_edge(e.edge, part.edge, chosen)), None)
        if k is not None:
            edges[k] = _union(edges[k], part, chosen)
        elif part.edge.length_mm >= chosen.break_mm:
            edges.append(part)
    edges.sort(key=lambda segment: -segment.edge.length_mm)
    return tuple(segment.edge for segment in edges)


def vertices(edges: tuple[Edge, ...], rules: SyntaxRules | None = None) -> tuple[Corner, ...]:
    """Return the corners where edges that are seen up to there meet."""
    chosen = rules or SyntaxRules()
    found = []
    for first, second in itertools.combinations(edges, 2):
        between = math.pi - abs(math.remainder(second.angle_rad - first.angle_rad, math.tau))
        corner = corner_between(first, second) if between < chosen.straight_rad else None
        if corner is not None and all(_reaches_corner(e, corner, chosen) for e in (first, second)):
            found.append(corner)
    return tuple(found)


def _is_one_edge(edge: Edge, part: Edge, rules: SyntaxRules) -> bool:
    between = math.pi - abs(math.remainder(part.angle_rad - edge.angle_rad, math.tau))
    if between < rules.straight_rad:
        return False
    ends = np.stack([part.start_mm, part.end_mm])
    if np.abs(edge.inside_mm(ends)).max() > rules.across_mm:
        return False
    way = np.array([edge.normal[1], -edge.normal[0]])
    own = sorted([float(edge.start_mm @ way), float(edge.end_mm @ way)])
    others: list[float] = sorted((ends @ way).tolist())
    return max(others[0] - own[1], own[0] - others[1]) <= rules.apart_mm


def _union(a: Segment, b: Segment, rules: SyntaxRules) -> Segment:
    points = EdgePoints(
        np.concatenate([a.points.at_mm, b.points.at_mm]),
        np.concatenate([a.points.normals, b.points.normals]),
        np.concatenate([a.points.slopes, b.points.slopes]),
    )
    return Segment(points, fit_line(points.at_mm, points.normals, rules.spread_mm))


def _reaches_corner(edge: Edge, corner: Corner, rules: SyntaxRules) -> bool:
    way = edge.end_mm - edge.start_mm
    length = max(float(np.linalg.norm(way)), 1e-9)
    along = float((corner.at_mm - edge.start_mm) @ way) / length
    return -rules.beyond_mm <= along <= length + rules.beyond_mm
