"""T-vertices: corners that lie on another polygon's edge, which is divided there.

Programs that cut faces one by one leave an edge whole where its neighbour has two; the surface
is closed, but its edges do not meet one by one. Only edges without a partner are looked at.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.polyhedron.read.settings import MODEL
from generator.polyhedron.read.soup import Soup

Integers = NDArray[np.intp]


def split_at_tees(soup: Soup) -> Soup:
    """Return the soup with open edges divided at the open corners that lie on them."""
    target = soup.origin[soup.following]
    count = len(soup.points)
    ahead, back = soup.origin * count + target, target * count + soup.origin
    lonely = np.flatnonzero(~np.isin(ahead, back))
    if len(lonely) == 0:
        return soup
    corners = np.unique(np.concatenate([soup.origin[lonely], target[lonely]]))
    tolerance = MODEL.tee_noise * soup.noise
    inserted: dict[int, list[int]] = {}
    for edge in lonely.tolist():
        on_edge = _corners_on(soup, int(soup.origin[edge]), int(target[edge]), corners, tolerance)
        if on_edge:
            inserted[edge] = on_edge
    return _divided(soup, inserted) if inserted else soup


def _corners_on(soup: Soup, start: int, end: int, corners: Integers, tolerance: float) -> list[int]:
    """Return the corners inside an edge, from its start on."""
    a, b = soup.points[start], soup.points[end]
    along = b - a
    length = float(np.linalg.norm(along))
    from_a = soup.points[corners] - a
    at = from_a @ along / length
    beside = np.linalg.norm(from_a - np.outer(at / length, along), axis=1)
    inside = (at > tolerance) & (at < length - tolerance) & (beside <= tolerance)
    return [int(corners[k]) for k in np.flatnonzero(inside)[np.argsort(at[inside], kind="stable")]]


def _divided(soup: Soup, inserted: dict[int, list[int]]) -> Soup:
    """Return the soup with points put into edges: the new half-edges stand behind the old ones."""
    origin, following, face = (list(a.tolist()) for a in (soup.origin, soup.following, soup.face))
    for edge, points in inserted.items():
        after = following[edge]
        last = edge
        for point in points:
            following[last] = len(origin)
            last = len(origin)
            origin.append(point)
            following.append(after)
            face.append(face[edge])
    return Soup(
        soup.points,
        np.array(origin, np.intp),
        np.array(following, np.intp),
        np.array(face, np.intp),
        soup.noise,
    )
