"""How far a layout is searched: every number that decides which layout is found.

Another value gives another layout, so other cells for the same spec: objects that are
registered keep theirs.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LayoutSettings:
    """Limits of the search: larger ones look at more and take longer."""

    # lattice_search.py: shift and rotation of one face's lattice
    same_rad: float = 1e-9
    """Rotations nearer than this are the same."""
    centres: int = 1 << 17
    """Candidate centres looked at for one rotation."""
    search_rotations: int = 12
    """Rotations tried over a quarter turn beside the edges' directions: every 7.5 degrees."""
    edge_rotations: int = 12
    """Edge directions tried at most, for faces of many edges."""
    compared_sets: int = 8
    """Sets of cells with equal scores that are compared by their margin to the edges."""

    # unfold.py: the tree along which an object is unfolded
    faces_laid: int = 6000
    """Faces laid down at most over all trees: bounds the time for objects of many faces."""
    random_trees: int = 24
    """Trees in random order of edges, after the ones by breadth and by direction."""
    breadth_roots: int = 12
    """Faces from which a tree by breadth is begun."""

    # board.py: the part of an array in which objects are placed
    whole_cells: int = 1 << 17
    """An array with no more cells is looked at as a whole."""
    corner: int = 192
    """First extent of the corner of a larger array, rows and columns, cells."""
    corner_growth: int = 32
    """The corner's shorter side grows by this part of it, in whole tiles."""
    neighbours: int = 512
    """Of a piece with more cells around it only every second, third, ... counts."""

    # smallest.py, blank.py: what would help a face that shows nothing
    size_bisections: int = 8
    """Of the smallest size that shows a place: to 1.1 % of the size."""
    size_range: float = 16.0
    """How many times smaller and larger than the face is tried."""
    hint_bisections: int = 7
    """Of the pitch or size that a message proposes: to 1 % of the range."""
    least_pitch: float = 0.1
    """Finest pitch proposed, as a share of the one asked for."""
    most_size: float = 8.0
    """Largest object proposed, times its size."""


LAYOUT = LayoutSettings()
