"""A strip of facets: from the plane in which symbols are laid out to the solid.

A point is (x, y) in the plane and z above it, mm. Facet i lies between line i and line i + 1.
At height z over a facet the strip is the facet's plane moved outward by z; over a line it is
where the moved planes of both neighbours meet. In between a point is carried along by the share
at which it lies between the two lines, so that what meets on a line in the plane meets there on
the solid, and what is level in the plane is level over its facet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.polyhedron.development import Development

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Strip:
    """A development with what is asked of it again and again."""

    development: Development
    right: Points  #: (n + 1, 2) unit normals of the lines, to the right

    @property
    def facets(self) -> int:
        """Number of facets."""
        return len(self.development.T_object_flat)

    def beside(self, line: int, points: Points) -> Points:
        """Return how far points (k, 2) lie to the right of a line, mm."""
        distance: Points = (points - self.development.low[line]) @ self.right[line]
        return distance

    def along(self, line: int, points: Points) -> Points:
        """Return how far up a line points (k, 2) lie, from its lower end, mm."""
        up = self.development.high[line] - self.development.low[line]
        height: Points = (points - self.development.low[line]) @ (up / np.hypot(*up))
        return height

    def facet_of(self, point: Points) -> int:
        """Return the facet that holds a point (2,) of the plane; -1 where none does."""
        d = self.development
        offset = point - d.low
        side = (offset * self.right).sum(axis=1)
        up = d.high - d.low
        length = np.hypot(up[:, 0], up[:, 1])
        height = (offset * up).sum(axis=1) / length
        # Beyond the tip of a cone there is a mirror image of every facet; ends are not square.
        slack = np.abs(np.diff(d.low, axis=0)).max() + np.abs(np.diff(d.high, axis=0)).max()
        near = (height > -slack) & (height < length + slack)
        held = (side[:-1] >= 0.0) & (side[1:] < 0.0) & near[:-1]
        return int(np.argmax(held)) if held.any() else -1

    def lifted(self, facet: int, points: Points, z_mm: Points) -> Points:
        """Return points (k, 2) of a facet at heights (k,) on the solid, (k, 3) object frame."""
        d = self.development
        left, right = self.beside(facet, points), -self.beside(facet + 1, points)
        share = (left / (left + right))[:, None]
        bend = (1.0 - share) * d.bends[facet] + share * d.bends[facet + 1]
        T = d.T_object_flat[facet]
        lifted: Points = points @ T[:3, :2].T + T[:3, 3] + z_mm[:, None] * bend
        return lifted

    def lifted_line(self, line: int, points: Points, z_mm: Points) -> Points:
        """Return points (k, 2) on a line at heights (k,) on the solid, (k, 3) object frame."""
        d = self.development
        T = d.T_object_flat[min(line, self.facets - 1)]
        lifted: Points = points @ T[:3, :2].T + T[:3, 3] + z_mm[:, None] * d.bends[line]
        return lifted


def strip_of(development: Development) -> Strip:
    """Return the strip of a development."""
    up = development.high - development.low
    up = up / np.hypot(up[:, 0], up[:, 1])[:, None]
    return Strip(development, np.column_stack([up[:, 1], -up[:, 0]]))
