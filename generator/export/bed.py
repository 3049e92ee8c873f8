"""Arrange the footprints of parts on the printer's bed, several plates where needed.

Rectangles are placed on a skyline from the largest to the smallest, each as low as it
gets and then as far left, also turned by a quarter (bottom-left, Jylänki, A thousand ways
to pack the bin, 2010, section 2.4). A rim of the bed stays free for a brim where that takes no
more plates. Plate frame: mm, x right, y back, origin at the front left corner of the bed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

Size = tuple[float, float]

_GAP_MM = 5.0  # least distance between two parts
_RIM_MM = 6.0  # of the bed: slicers lay brims of 5 mm, .1 mm from the part


@dataclass(frozen=True, slots=True)
class BedPlace:
    """Where one part lies."""

    part: int  #: number of the part
    x_mm: float  #: lower left corner of the footprint, as it lies
    y_mm: float
    turned: bool  #: by a quarter, counter-clockwise


@dataclass(frozen=True, slots=True)
class Plate:
    """The parts of one print."""

    places: tuple[BedPlace, ...]
    overhang_mm: Size = (0.0, 0.0)  #: by how much the parts exceed the bed in x and y

    @property
    def fits(self) -> bool:
        """Whether the plate can be printed on this bed."""
        return self.overhang_mm == (0.0, 0.0)


@dataclass(slots=True)
class _Skyline:
    """The upper contour of what lies on one plate: steps from left to right."""

    steps: list[tuple[float, float]]  # (x where the step begins, height), x rising
    places: list[BedPlace]


def arrange_plates(
    sizes: Sequence[Size],
    bed_mm: Size,
    groups: Sequence[int] | None = None,
    blocked_mm: Size = (0.0, 0.0),
) -> tuple[Plate, ...]:
    """Arrange rectangles (width and depth, mm) on as many plates as needed, centred on the bed.

    A group lies on one plate if one can hold it, else on plates of its own; without groups, all
    parts are one. A part larger than the bed has a plate of its own with an `overhang_mm`.
    `blocked_mm`: width and depth of the corner at the origin where nothing may lie.

    Examples
    --------
    >>> [len(plate.places) for plate in arrange_plates([(60, 60)] * 6, (250, 210))]
    [6]
    """
    tight, rimmed = (_arrange(sizes, bed_mm, groups, blocked_mm, rim) for rim in (0.0, _RIM_MM))
    fit = sum(plate.fits for plate in rimmed) == sum(plate.fits for plate in tight)
    return rimmed if fit and len(rimmed) == len(tight) else tight


def _arrange(
    sizes: Sequence[Size],
    bed_mm: Size,
    groups: Sequence[int] | None,
    blocked_mm: Size,
    rim_mm: float,
) -> tuple[Plate, ...]:
    """Arrange rectangles no nearer to the edges of the bed than its rim."""
    room = (bed_mm[0] - 2 * rim_mm + _GAP_MM, bed_mm[1] - 2 * rim_mm + _GAP_MM)
    corner = (blocked_mm[0] - rim_mm, blocked_mm[1] - rim_mm)
    floor = [(0.0, corner[1]), (corner[0], 0.0)] if min(corner) > 0 else [(0.0, 0.0)]
    grown = [(width + _GAP_MM, depth + _GAP_MM) for width, depth in sizes]
    order = sorted(range(len(sizes)), key=lambda i: (-max(sizes[i]), -min(sizes[i]), i))
    kinds = [0] * len(sizes) if groups is None else list(groups)
    open_plates: list[_Skyline] = []
    oversize: list[Plate] = []
    for kind in dict.fromkeys(kinds):
        own = [part for part in order if kinds[part] == kind]
        small = [p for p in own if _place_part(_Skyline(list(floor), []), p, grown[p], room)]
        for part in own:
            if part not in small and rim_mm:  # it lies on the rim, too
                (lone,) = _arrange([sizes[part]], bed_mm, None, blocked_mm, 0.0)
                oversize.append(replace(lone, places=(replace(lone.places[0], part=part),)))
            elif part not in small:
                oversize.append(_oversize_plate(part, sizes[part], bed_mm, blocked_mm))
        for number, plate in enumerate(open_plates):
            together = _Skyline(list(plate.steps), list(plate.places))
            if all(_place_part(together, part, grown[part], room) for part in small):
                open_plates[number] = together
                break
        else:
            own_plates: list[_Skyline] = []
            for part in small:
                if not any(_place_part(plate, part, grown[part], room) for plate in own_plates):
                    own_plates.append(_Skyline(list(floor), []))
                    _place_part(own_plates[-1], part, grown[part], room)
            open_plates += own_plates
    plates = [_centre(plate, sizes, bed_mm, blocked_mm, rim_mm) for plate in open_plates]
    return (*plates, *oversize)


def _oversize_plate(part: int, size: Size, bed_mm: Size, blocked_mm: Size) -> Plate:
    """Place a part that is too large as it exceeds least what is free of the bed."""
    width, depth = bed_mm
    free = [(width - blocked_mm[0], depth), (width, depth - blocked_mm[1])]
    ways = [
        ((max(0.0, side[0] - room[0]), max(0.0, side[1] - room[1])), turned, side)
        for turned, side in enumerate((size, size[::-1]))
        for room in (free if min(blocked_mm) > 0 else [bed_mm])
    ]
    beyond, turned, side = min(ways, key=lambda way: sum(way[0]))
    place = BedPlace(part, (width - side[0]) / 2, (depth - side[1]) / 2, bool(turned))
    return Plate((place,), beyond)


def _place_part(plate: _Skyline, part: int, size: Size, room: Size) -> bool:
    """Add a part to the plate where it lies lowest; False when it finds no place."""
    slack = 1e-9 * max(room)
    ways: list[tuple[float, float, bool]] = []
    for turned in (False, True):
        width, depth = size[::-1] if turned else size
        for i, (x, height) in enumerate(plate.steps):
            end = x + width
            if end > room[0] + slack:
                break
            over = (h for x, h in plate.steps[i + 1 :] if x < end - 1e-9 * abs(end))
            top = max([height, *over]) + depth
            if top <= room[1] + slack:
                ways.append((top, x, turned))
    if not ways:
        return False
    top, x, turned = min(ways)
    width, depth = size[::-1] if turned else size
    plate.places.append(BedPlace(part, x, top - depth, turned))
    _raise(plate.steps, x, x + width, top)
    return True


def _raise(steps: list[tuple[float, float]], start: float, end: float, height: float) -> None:
    after = [h for x, h in steps if x <= end][-1]
    kept = [(x, h) for x, h in steps if x < start or x > end]
    steps[:] = sorted([*kept, (start, height), (end, after)])


def _centre(
    plate: _Skyline, sizes: Sequence[Size], bed_mm: Size, blocked_mm: Size, rim_mm: float
) -> Plate:
    """Return a plate with its parts in the middle of the bed, or as near as its corner allows."""
    low, high = [], []
    for place in plate.places:
        width, depth = sizes[place.part]
        if place.turned:
            width, depth = depth, width
        low.append((place.x_mm, place.y_mm))
        high.append((place.x_mm + width, place.y_mm + depth))
    left, front, right, back = *map(min, zip(*low, strict=True)), *map(max, zip(*high, strict=True))
    dx, dy = (bed_mm[0] - left - right) / 2, (bed_mm[1] - front - back) / 2
    if any(x + dx < blocked_mm[0] and y + dy < blocked_mm[1] for x, y in low):
        dx, dy = max(dx, rim_mm), max(dy, rim_mm)
    places = sorted(plate.places, key=lambda place: place.part)
    return Plate(
        tuple(BedPlace(p.part, p.x_mm + dx, p.y_mm + dy, p.turned) for p in places),
    )
