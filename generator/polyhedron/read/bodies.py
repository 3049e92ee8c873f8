"""How many bodies a mesh holds: closed surfaces that share no edge. One file is one solid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.read.soup import Soup, cluster_labels

LISTED = 4  #: bodies that a message describes, the largest ones


def check_one_body(soup: Soup, twin: NDArray[np.intp]) -> None:
    """Refuse a mesh of several bodies, and say how large they are and where they lie.

    Parameters
    ----------
    soup
        Closed and oriented polygons, mm.
    twin
        (H,) the half-edge that runs the same edge backwards.

    Raises
    ------
    ShapeError
        The surface falls into several; one that runs the other way round than the largest, as
        the walls of a cavity do, is called a void.
    """
    count = int(soup.face.max()) + 1
    label = cluster_labels(np.arange(count), soup.face, soup.face[twin])
    bodies = np.unique(label)
    if len(bodies) == 1:
        return
    boxes, volumes = [], []
    for body in bodies:
        own = label[soup.face] == body
        points = soup.points[soup.origin[own]]
        boxes.append((points.min(axis=0), points.max(axis=0)))
        volumes.append(_signed_volume(soup, own))
    order = np.argsort(-np.abs(volumes), kind="stable")
    sign = np.sign(volumes[order[0]])
    words = []
    for k in order[:LISTED]:
        low, high = boxes[k]
        size = " x ".join(f"{x:.4g}" for x in high - low)
        middle = ", ".join(f"{x:.4g}" for x in (low + high) / 2)
        void = "a void of " if np.sign(volumes[k]) == -sign else ""
        words.append(f"{void}{size} mm about ({middle})")
    if len(bodies) > LISTED:
        words.append(f"{len(bodies) - LISTED} smaller")
    raise ShapeError(
        f"{len(bodies)} separate bodies: {', '.join(words)}; one solid has one",
        fix="join bodies that overlap (a boolean union), give the others files of their own, "
        "and fill inner voids",
    )


def _signed_volume(soup: Soup, own: NDArray[np.bool_]) -> float:
    """Return the volume inside some of the polygons, mm^3, below 0 if they face inward."""
    _, first = np.unique(soup.face, return_index=True)  # fans from a corner of each polygon
    apex = soup.points[soup.origin[first]][soup.face[own]]
    start = soup.points[soup.origin[own]]
    end = soup.points[soup.origin[soup.following[own]]]
    return float(np.einsum("ij,ij->", apex, np.cross(start, end)) / 6.0)
