"""What would help faces that show no identifiable place, and how small a face could be.

Faces without a place -> a message that lists them, and remedies that were tried: a pitch at
which every one of them shows a place, and a size of the object that does. Region -> the least
size, in the face's own proportions, at which it shows one; symbols and clearances are kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from encoded_objects.base.output import some_of
from generator.layout.footprint import Region
from generator.layout.lattice import LatticeRequest

HINT_BISECTIONS = 7  #: of the pitch or size that a message proposes: to 1 % of the range
LEAST_PITCH = 0.1  #: finest pitch proposed, as a share of the one asked for
MOST_SIZE = 8.0  #: largest object proposed, times its size
SIZE_BISECTIONS = 8  #: of the smallest size that shows a place: to 1.1 % of the size
SIZE_RANGE = 16.0  #: how many times smaller and larger than the face is tried


def describe_blank(
    names: Mapping[str, Region], cells: Sequence[int], request: LatticeRequest
) -> str:
    """Return the list of faces without a place: names, sizes, cells that each holds."""
    alike: dict[str, list[str]] = {}
    for (name, region), held in zip(names.items(), cells, strict=True):
        width, height = extent_mm(region)
        size = f"{width:.1f} x {height:.1f} mm, {held} cell{'' if held == 1 else 's'}"
        alike.setdefault(size, []).append(name)
    rows, columns = request.window
    listed = "; ".join(
        f"{'faces' if len(same) > 1 else 'face'} {some_of(same)} ({size})"
        for size, same in alike.items()
    )
    return (
        f"no place can be identified on {listed}: a window of {rows}x{columns} cells at "
        f"{request.pitch_mm:g} mm pitch, or cells that pass the rank test, must fit"
    )


def remedies(
    regions: Sequence[Region], request: LatticeRequest, prints: Callable[[float], bool]
) -> str:
    """Return what would give every face a place; each remedy with a number has been tried.

    `prints`: whether symbols of a pitch (mm) can be made.
    """
    different = {_key(region): region for region in regions}
    ways = []
    pitch = min(_pitch(region, request) for region in different.values())
    if pitch > 0.0 and prints(pitch):
        ways.append(f"set pitch to {pitch:g} mm or less")
    rows, columns = request.window
    ways.append(f"take a profile with a smaller window than {rows}x{columns}")
    scale = max(_scale(region, request) for region in different.values())
    if math.isfinite(scale):
        ways.append(f"make the object {scale:g} times larger")
    return ", ".join(ways) + ", or leave the faces blank"


def extent_mm(region: Region) -> tuple[float, float]:
    """Return width and height of a face in its own frame, mm."""
    low = np.minimum(region.start, region.end).min(axis=0)
    width, height = (np.maximum(region.start, region.end).max(axis=0) - low).tolist()
    return width, height


def smallest_mm(region: Region, request: LatticeRequest) -> tuple[float, float]:
    """Return width and height at which the face still shows a place; infinite if never, mm."""

    def shows(scale: float) -> bool:
        scaled = Region(region.start * scale, region.end * scale, region.clearance)
        return _shows_place(scaled, request)

    works, fails = (1.0, 1.0 / SIZE_RANGE) if shows(1.0) else (SIZE_RANGE, 1.0)
    if works == SIZE_RANGE and not shows(SIZE_RANGE):
        return math.inf, math.inf
    scale = _bisect(shows, works, fails, SIZE_BISECTIONS)
    width, height = extent_mm(region)
    return width * scale, height * scale


def _pitch(region: Region, request: LatticeRequest) -> float:
    """Return a pitch (mm) at which the face shows a place, symbols in proportion; 0 if none."""

    def shows(share: float) -> bool:
        half, pitch = request.half_mm * share, request.pitch_mm * share
        return _shows_place(region, replace(request, half_mm=half, pitch_mm=pitch))

    if not shows(LEAST_PITCH):
        return 0.0
    share = _bisect(shows, LEAST_PITCH, 1.0, HINT_BISECTIONS)
    for step in (0.1, 0.05, 0.01):  # the roundest number that still works
        pitch = math.floor(share * request.pitch_mm / step + 1e-9) * step
        if pitch > 0.0 and shows(pitch / request.pitch_mm):
            return round(pitch, 2)
    return 0.0


def _scale(region: Region, request: LatticeRequest) -> float:
    """Return how many times larger the face must be to show a place; infinite if unknown."""

    def shows(inverse: float) -> bool:
        larger = Region(region.start / inverse, region.end / inverse, region.clearance)
        return _shows_place(larger, request)

    if not shows(1.0 / MOST_SIZE):
        return math.inf
    inverse = _bisect(shows, 1.0 / MOST_SIZE, 1.0, HINT_BISECTIONS)
    for step in (0.1, 0.01):
        scale = math.ceil(1.0 / inverse / step - 1e-9) * step
        if shows(1.0 / scale):
            return round(scale, 2)
    return math.inf


def _bisect(shows: Callable[[float], bool], works: float, fails: float, steps: int) -> float:
    """Return the share next to one that fails, of those that are tried in so many steps."""
    for _ in range(steps):
        middle = math.sqrt(works * fails)
        works, fails = (middle, fails) if shows(middle) else (works, middle)
    return works


def _shows_place(region: Region, request: LatticeRequest) -> bool:
    return any(request.choose([region], search=False).places)


def _key(region: Region) -> bytes:
    return np.round(np.column_stack([region.start, region.end, region.clearance]), 6).tobytes()
