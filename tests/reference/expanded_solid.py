"""A part with nothing instanced: all vertices and planar polygons, proven to be one solid."""

from itertools import pairwise

import numpy as np
import pytest

from generator.plane.polygon import face_vector, signed_volume
from generator.solid import volume
from generator.solid.closed import edges_once
from generator.solid.part import to_part, turn


def expand_part(part):
    """Return vertices (N, 3) mm, part frame, and the loops of every planar polygon.

    The body's facets with the feet cut out come first; then per symbol its islands (facet inside
    a hole of the foot), sides from the foot up, and the top.
    """
    points = [part.vertices]
    count = len(part.vertices)
    body = [list(facet.loops) for facet in part.facets]
    found = []
    for embossing in part.embossings:
        R = turn(embossing.rotation_rad)
        for centre, label in zip(embossing.centres_mm, embossing.labels.tolist(), strict=True):
            tiers = embossing.tiers[label]
            numbers = []
            for z, rings in zip(tiers.z_mm, tiers.rings, strict=True):
                numbers.append([])
                for ring in rings:
                    points.append(to_part(embossing, ring @ R.T + centre, z))
                    numbers[-1].append(tuple(range(count, count + len(ring))))
                    count += len(ring)
            body[embossing.facet].append(numbers[0][0][::-1])
            found += [[hole[::-1]] for hole in numbers[0][1:]]
            for lower, upper in pairwise(numbers):
                for a, b in zip(lower, upper, strict=True):
                    ahead = [*range(1, len(a)), 0]
                    found += [[(a[k], a[j], b[j], b[k])] for k, j in enumerate(ahead)]
            found.append(numbers[-1])
    return np.concatenate(points), body + found


def assert_expanded(part):
    """Check planarity to 1e-12, closure and volume of the expanded solid."""
    vertices, polygons = expand_part(part)
    size = float(np.ptp(vertices, axis=0).max())
    loops = [loop for polygon in polygons for loop in polygon]
    assert edges_once(
        np.concatenate([np.array(loop) for loop in loops]),
        np.concatenate([np.roll(loop, -1) for loop in loops]),
    )
    for polygon in polygons:
        corners = [vertices[list(loop)] for loop in polygon]
        normal = face_vector(corners)
        points = np.concatenate(corners)
        off = (points - points[0]) @ (normal / np.linalg.norm(normal))
        assert np.abs(off).max() <= 1e-12 * size
    assert signed_volume(vertices, polygons) == pytest.approx(volume(part), rel=1e-11)
