"""What to tell a person whose faces show no identifiable place, and what would help.

Faces without a place -> one message that lists them, and remedies that were tried: a pitch at
which every one of them shows a place, and a size of the object that does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from generator.layout.footprint import Region
from generator.layout.lattice import choose_lattice
from generator.layout.places import Identifies
from generator.layout.settings import LAYOUT


@dataclass(frozen=True, slots=True)
class Request:
    """What the faces are to carry."""

    half_mm: float  #: half side of a symbol's footprint
    pitch_mm: float
    window: tuple[int, int]  #: rows, columns
    identifies: Identifies


def describe_blank(names: Mapping[str, Region], cells: Sequence[int], request: Request) -> str:
    """Return the list of faces without a place: names, sizes, cells they hold and need.

    Parameters
    ----------
    names
        Name and region of each face.
    cells
        Number of cells that each face holds.
    request
        Symbols and window.
    """
    alike: dict[str, list[str]] = {}
    for (name, region), held in zip(names.items(), cells, strict=True):
        low = np.minimum(region.start, region.end).min(axis=0)
        width, height = (np.maximum(region.start, region.end).max(axis=0) - low).tolist()
        size = f"{width:.1f} x {height:.1f} mm, {held} cell{'' if held == 1 else 's'}"
        alike.setdefault(size, []).append(name)
    rows, columns = request.window
    listed = "; ".join(
        f"{'faces' if len(same) > 1 else 'face'} {', '.join(same)} ({size})"
        for size, same in alike.items()
    )
    return (
        f"no place can be identified on {listed}: a window of {rows}x{columns} cells at "
        f"{request.pitch_mm:g} mm pitch, or cells that pass the rank test, must fit"
    )


def remedies(regions: Sequence[Region], request: Request) -> str:
    """Return what would give every face a place; each remedy with a number has been tried."""
    different = {_key(region): region for region in regions}
    ways = []
    pitch = min(_pitch(region, request) for region in different.values())
    if pitch > 0.0:
        ways.append(f"set pitch to {pitch:g} mm or less")
    rows, columns = request.window
    ways.append(f"take a profile with a smaller window than {rows}x{columns}")
    scale = max(_scale(region, request) for region in different.values())
    if np.isfinite(scale):
        ways.append(f"make the object {scale:g} times larger")
    return ", ".join(ways) + ", or leave the faces blank"


def _pitch(region: Region, request: Request) -> float:
    """Return a pitch (mm) at which the face shows a place, symbols in proportion; 0 if none."""

    def shows(share: float) -> bool:
        return _shows_place(region, request.half_mm * share, request.pitch_mm * share, request)

    share = _largest_share(shows, LAYOUT.least_pitch, 1.0)
    for step in (0.1, 0.05, 0.01):  # the roundest number that still works
        pitch = float(np.floor(share * request.pitch_mm / step + 1e-9)) * step
        if pitch > 0.0 and shows(pitch / request.pitch_mm):
            return round(pitch, 2)
    return 0.0


def _scale(region: Region, request: Request) -> float:
    """Return how many times larger the face must be to show a place; infinite if unknown."""

    def shows(inverse: float) -> bool:
        larger = Region(region.start / inverse, region.end / inverse, region.clearance)
        return _shows_place(larger, request.half_mm, request.pitch_mm, request)

    inverse = _largest_share(shows, 1.0 / LAYOUT.most_size, 1.0)
    if inverse == 0.0:
        return float(np.inf)
    for step in (0.1, 0.01):
        scale = float(np.ceil(1.0 / inverse / step - 1e-9)) * step
        if shows(1.0 / scale):
            return round(scale, 2)
    return float(np.inf)


def _largest_share(shows: Callable[[float], bool], low: float, high: float) -> float:
    """Return a share from low (works) to high (does not) that works, by bisection; 0 if none."""
    if not shows(low):
        return 0.0
    for _ in range(LAYOUT.hint_bisections):
        middle = float(np.sqrt(low * high))
        if shows(middle):
            low = middle
        else:
            high = middle
    return low


def _shows_place(region: Region, half: float, pitch: float, request: Request) -> bool:
    lattice = choose_lattice(
        [region], half, pitch, request.window, request.identifies, search=False
    )
    return any(lattice.places)


def _key(region: Region) -> bytes:
    return np.round(np.column_stack([region.start, region.end, region.clearance]), 6).tobytes()
