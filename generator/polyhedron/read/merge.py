"""Polygons of a file -> faces of a solid: coplanar neighbours become one face with holes.

Neighbours are coplanar if the smaller one lies in the larger one's plane by distance, and
their normals agree by angle; slivers, whose normal is noise, join their best neighbour.
Boundaries are walked around the vertices, so faces may be non-convex and have holes.
Vertices between two faces alone, on their common line, are dropped. A mesh is one body: closed
surfaces that share no edge are refused.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.plane.polygon import area_vector
from generator.polyhedron.read.soup import (
    MOST_FACETS,
    Soup,
    cluster_labels,
    middle_text,
    split_at_tees,
)

COPLANAR = 1e-5  #: coplanar points lie this near to a plane, as a share of the size
COPLANAR_RAD = 1e-3  #: coplanar polygons turn by no more than this, besides the noise
SLIVER = 8.0  #: a polygon thinner than this many times the noise has no direction

_REPAIR = "repair the mesh (PrusaSlicer, MeshLab or the program that made it) and export it again"
LISTED = 4  #: bodies that a message describes, the largest ones

Floats = NDArray[np.float64]
Integers = NDArray[np.intp]
Faces = list[tuple[tuple[int, ...], ...]]


def merge_triangles(soup: Soup) -> tuple[Floats, Faces]:
    """Return vertices (V, 3) mm and faces as loops, the outer loop first, for `polyhedron`.

    Raises `ShapeError` for an open, branching or inconsistently oriented mesh (with the first
    place), one of several bodies, a flat one, one of more than `MOST_FACETS` planar faces, or a
    bent face.
    """
    _check_flat(soup)
    soup = split_at_tees(soup)
    twin = _twins(soup)
    _check_one_body(soup, twin)
    group = _coplanar_groups(soup, twin)
    boundary = group[soup.face] != group[soup.face[twin]]
    loops = _boundary_loops(soup, twin, boundary)
    kept = _corners(soup, loops, boundary)

    faces: dict[int, list[tuple[int, ...]]] = {}
    for loop in loops:
        corners = [int(soup.origin[h]) for h in loop if kept[soup.origin[h]]]
        start = corners.index(min(corners)) if corners else 0
        faces.setdefault(int(group[soup.face[loop[0]]]), []).append(
            tuple(corners[start:] + corners[:start])
        )
    used = np.unique([v for loops in faces.values() for loop in loops for v in loop]).astype(int)
    return soup.points[used], [
        tuple(
            tuple(np.searchsorted(used, loop).tolist())
            for loop in _outer_first(soup.points, faces[face])
        )
        for face in sorted(faces)
    ]


def _check_flat(soup: Soup) -> None:
    points = soup.points[soup.origin]
    points = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(points.T @ points)  # the first one with the least spread
    thickness = float(np.ptp(points @ axes[:, 0]))
    if thickness <= 2.0 * _distance(soup):
        raise ShapeError(
            "it is flat: all its points lie in one plane",
            fix="give it a thickness in the program that made it, and export it again",
        )


def _twins(soup: Soup) -> Integers:
    """Return for each half-edge the one that runs the same edge backwards; refuse if not one."""
    target = soup.origin[soup.following]
    low, high = np.minimum(soup.origin, target), np.maximum(soup.origin, target)
    key = low * len(soup.points) + high
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    for bad, says in (
        (count == 1, "not closed: {} edges have one face only"),
        (count > 2, "not a solid: {} edges have more than two faces"),
    ):
        if bad.any():
            _refuse_edges(soup, order[first[bad]], says)
    a, b = order[0::2], order[1::2]
    same = soup.origin[a] == soup.origin[b]
    if same.any():
        says = "not oriented: {} edges have two faces that disagree about outside"
        _refuse_edges(soup, a[same], says)
    twin = np.empty(len(order), dtype=np.intp)
    twin[a], twin[b] = b, a
    return twin


def _refuse_edges(soup: Soup, edges: Integers, says: str) -> None:
    first = int(edges.min())
    a, b = soup.points[soup.origin[first]], soup.points[soup.origin[soup.following[first]]]
    ends = " to ".join("({:.6g}, {:.6g}, {:.6g})".format(*p) for p in (a, b))
    text = says.format(len(edges)).replace(" 1 edges have", " 1 edge has")
    raise ShapeError(f"the surface is {text}, the first from {ends}", fix=_REPAIR)


def _coplanar_groups(soup: Soup, twin: Integers) -> Integers:
    """Return for each polygon the number of its face: that of the face's first polygon."""
    start, end = soup.points[soup.origin], soup.points[soup.origin[soup.following]]
    count = int(soup.face.max()) + 1
    corner = np.zeros(count, dtype=np.intp)
    corner[soup.face[::-1]] = soup.origin[::-1]  # a point of each polygon, to stay near it
    near = soup.points[corner][soup.face]
    vector = np.zeros((count, 3))
    np.add.at(vector, soup.face, 0.5 * np.cross(start - near, end - near))
    area = np.linalg.norm(vector, axis=1)
    longest = np.zeros(count)
    np.maximum.at(longest, soup.face, np.linalg.norm(end - start, axis=1))
    width = area / longest
    sliver = width <= SLIVER * soup.noise
    normal = vector / np.where(area > 0.0, area, 1.0)[:, None]

    half = np.flatnonzero(np.arange(len(twin)) < twin)
    a, b = soup.face[half], soup.face[twin[half]]
    swap = np.where(sliver[a] == sliver[b], area[b] > area[a], sliver[a])
    large, small = np.where(swap, b, a), np.where(swap, a, b)
    tolerance = _distance(soup)
    off = _farthest_off_plane(soup, large, small, normal, corner)
    cross = np.linalg.norm(np.cross(normal[large], normal[small]), axis=1)
    turn = np.arctan2(cross, np.einsum("ij,ij->i", normal[large], normal[small]))
    allowed = np.maximum(COPLANAR_RAD, 4.0 * soup.noise / np.maximum(width[small], soup.noise))
    flat = (off <= tolerance) & (turn <= allowed) & ~sliver[large] & ~sliver[small]
    touching = np.flatnonzero((sliver[large] | sliver[small]) & (off <= tolerance))
    touching = touching[np.argsort(turn[touching], kind="stable")]
    pairs = np.stack([large, small], axis=1)[touching].tolist()

    def grouped(flat: NDArray[np.bool_]) -> Integers:
        group = cluster_labels(np.arange(count), large[flat], small[flat])
        _join_slivers(soup, group, sliver, pairs, normal, corner)
        return group

    group = grouped(flat)
    bent = _bends(soup, group, vector, corner) > 2.0 * tolerance
    if bent[group].any():  # of a curved surface: each of its polygons is a face
        group = grouped(flat & ~bent[group[large]])
    _check_groups(soup, group, vector, corner)
    return group


def _distance(soup: Soup) -> float:
    size = float(np.linalg.norm(np.ptp(soup.points[soup.origin], axis=0)))
    return COPLANAR * size + soup.noise


def _farthest_off_plane(
    soup: Soup, large: Integers, small: Integers, normal: Floats, corner: Integers
) -> Floats:
    """Return for each pair how far the smaller polygon reaches off the larger one's plane, mm."""
    by_face = np.argsort(soup.face, kind="stable")
    edges = np.bincount(soup.face)
    first = np.cumsum(edges) - edges
    pair = np.repeat(np.arange(len(small)), edges[small])
    within = np.arange(len(pair)) - np.repeat(np.cumsum(edges[small]) - edges[small], edges[small])
    point = soup.points[soup.origin[by_face[first[small][pair] + within]]]
    height = point - soup.points[corner[large]][pair]
    off = np.zeros(len(small))
    np.maximum.at(off, pair, np.abs(np.einsum("ij,ij->i", height, normal[large][pair])))
    return off


def _join_slivers(
    soup: Soup, group: Integers, sliver: NDArray[np.bool_], pairs: list[list[int]], normal: Floats,
    corner: Integers,
) -> None:  # fmt: skip
    """Join each sliver to the one neighbour that it fits best, its normal being noise.

    `pairs`: neighbours of which one is a sliver at least, the best first. Through another sliver it
    joins the face that this one lies in, if it lies in that plane too: slivers of an upright wall
    meet those of a top.
    """
    tolerance = _distance(soup)
    waiting = set(np.flatnonzero(sliver).tolist())
    host = np.arange(len(group))  # the polygon, no sliver, in whose plane a polygon lies
    while waiting:
        before = len(waiting)
        for f, g in pairs:
            if (f in waiting) == (g in waiting):
                continue
            thin, other = (f, g) if f in waiting else (g, f)
            if sliver[other]:
                own = soup.points[soup.origin[soup.face == thin]]
                height = (own - soup.points[corner[host[other]]]) @ normal[host[other]]
                if np.abs(height).max() > tolerance:
                    continue
            group[thin], host[thin] = group[other], host[other]
            waiting.discard(thin)
        if len(waiting) == before:
            break


def _bends(soup: Soup, group: Integers, vector: Floats, corner: Integers) -> Floats:
    """Return for each group, at its own number, how far its points leave its plane, mm."""
    total = np.zeros((len(group), 3))
    np.add.at(total, group, vector)
    area = np.linalg.norm(total, axis=1)
    face = group[soup.face]
    normal = total / np.where(area > 0.0, area, 1.0)[:, None]
    height = np.einsum(
        "ij,ij->i", soup.points[soup.origin] - soup.points[corner[face]], normal[face]
    )
    middle = np.bincount(face, height) / np.maximum(np.bincount(face), 1)
    bend = np.zeros(len(group))
    np.maximum.at(bend, face, np.abs(height - middle[face]))
    return bend


def _check_groups(soup: Soup, group: Integers, vector: Floats, corner: Integers) -> None:
    """Refuse too many faces, and faces that bend."""
    numbers, compact = np.unique(group, return_inverse=True)
    if len(numbers) > MOST_FACETS:
        total = np.zeros((len(numbers), 3))
        np.add.at(total, compact, vector)
        area = np.linalg.norm(total, axis=1)
        raise ShapeError(
            f"{len(numbers)} planar faces, the smallest of {area.min():.2g} mm^2; "
            f"{MOST_FACETS} are allowed",
            fix="export round parts more coarsely, or as STEP, where they count once",
        )
    bend = _bends(soup, group, vector, corner)
    worst = int(bend.argmax())
    if bend[worst] > 2.0 * _distance(soup):
        x, y, z = soup.points[corner[worst]]
        raise ShapeError(
            f"a face near ({x:.6g}, {y:.6g}, {z:.6g}) is curved: it bends by {bend[worst]:.2g} mm; "
            f"{2.0 * _distance(soup):.2g} mm are allowed",
            fix="encode a model whose faces are planar",
        )


def _boundary_loops(soup: Soup, twin: Integers, boundary: NDArray[np.bool_]) -> list[list[int]]:
    """Chain the half-edges between different faces; inside a face walk around its vertices."""
    following, twins = soup.following.tolist(), twin.tolist()
    is_boundary = boundary.tolist()
    seen = bytearray(len(twins))
    loops = []
    for start in np.flatnonzero(boundary).tolist():
        if seen[start]:
            continue
        loop, h = [], start
        while not seen[h]:
            seen[h] = 1
            loop.append(h)
            h = following[h]
            while not is_boundary[h]:
                h = following[twins[h]]
        loops.append(loop)
    if not loops:
        raise ShapeError("all faces lie in one plane: there is no solid", fix=_REPAIR)
    return loops


def _corners(soup: Soup, loops: list[list[int]], boundary: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which vertices (V,) stay: not those between two faces on a straight edge."""
    degree = np.bincount(soup.origin[boundary], minlength=len(soup.points))
    kept = degree > 0
    tolerance = _distance(soup)
    decided: set[int] = set()
    for loop in loops:
        ring = soup.origin[loop]
        corner = np.flatnonzero(degree[ring] != 2)
        if len(corner) == 0:
            continue
        for i, j in zip(corner, np.roll(corner, -1), strict=True):
            run = np.arange(i + 1, j if j > i else j + len(ring)) % len(ring)
            if len(run) == 0 or int(ring[run[0]]) in decided:
                continue
            decided.update(int(v) for v in ring[run])
            a, b = soup.points[ring[i]], soup.points[ring[j]]
            along = b - a
            length = float(np.linalg.norm(along))
            offset = np.linalg.norm(np.cross(soup.points[ring[run]] - a, along), axis=1)
            if length > 0.0 and offset.max() <= tolerance * length:
                kept[ring[run]] = False
    return kept


def _outer_first(points: Floats, loops: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Sort the loops of one face: the outer one encloses the largest area."""
    vectors = [area_vector(points[list(loop)]) if loop else np.zeros(3) for loop in loops]
    normal = sum(vectors, np.zeros(3))
    return [loops[k] for k in np.argsort([-(v @ normal) for v in vectors], kind="stable")]


def _check_one_body(soup: Soup, twin: NDArray[np.intp]) -> None:
    """Refuse a mesh of several bodies, and say how large they are and where they lie.

    One that runs the other way round than the largest, as walls of a cavity do, is called a void.
    """
    count = int(soup.face.max()) + 1
    label = cluster_labels(np.arange(count), soup.face, soup.face[twin])
    bodies = np.unique(label)
    if len(bodies) == 1:
        return
    owned = [label[soup.face] == body for body in bodies]
    volumes = [_signed_volume(soup, own) for own in owned]
    order = np.argsort(-np.abs(volumes), kind="stable")
    sign = np.sign(volumes[order[0]])
    words = []
    for k in order[:LISTED].tolist():
        points = soup.points[soup.origin[owned[k]]]
        size = " x ".join(f"{x:.4g}" for x in np.ptp(points, axis=0))
        void = "a void of " if np.sign(volumes[k]) == -sign else ""
        words.append(f"{void}{size} mm about {middle_text(points)}")
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
