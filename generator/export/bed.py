"""Arrange the footprints of parts on the printer's bed, several plates where needed.

Rectangles are placed on a skyline from the largest to the smallest, each as low as it
gets and then as far left, also turned by a quarter (bottom-left, Jylänki, A thousand ways
to pack the bin, 2010, section 2.4). Plate frame: mm, x right, y back, origin at the front left
corner of the bed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Size = tuple[float, float]

_GAP_MM = 5.0  # least distance between two parts


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
) -> tuple[Plate, ...]:
    """Arrange rectangles (width and depth, mm) on as many plates as needed, centred on the bed.

    A group lies on one plate if one can hold it, else on plates of its own; without groups, all
    parts are one. A part larger than the bed has a plate of its own with an `overhang_mm`.

    Examples
    --------
    >>> [len(plate.places) for plate in arrange_plates([(60, 60)] * 6, (250, 210))]
    [6]
    """
    room = (bed_mm[0] + _GAP_MM, bed_mm[1] + _GAP_MM)
    grown = [(width + _GAP_MM, depth + _GAP_MM) for width, depth in sizes]
    order = sorted(range(len(sizes)), key=lambda i: (-max(sizes[i]), -min(sizes[i]), i))
    kinds = [0] * len(sizes) if groups is None else list(groups)
    open_plates: list[_Skyline] = []
    oversize: list[Plate] = []
    for kind in dict.fromkeys(kinds):
        own = [part for part in order if kinds[part] == kind]
        small = [
            p for p in own if any(_fits(turned, room) for turned in (grown[p], grown[p][::-1]))
        ]
        oversize += [_oversize_plate(p, sizes[p], bed_mm) for p in own if p not in small]
        for number, plate in enumerate(open_plates):
            together = _add_parts(plate, small, grown, room)
            if together is not None:
                open_plates[number] = together
                break
        else:
            open_plates += _fill_plates(small, grown, room)
    return (*(_centre(plate, sizes, bed_mm) for plate in open_plates), *oversize)


def _add_parts(
    plate: _Skyline, parts: Sequence[int], grown: Sequence[Size], room: Size
) -> _Skyline | None:
    """Return the plate with all parts on it, or None where it cannot hold them."""
    more = _Skyline(list(plate.steps), list(plate.places))
    fit = all(_place_part(more, part, grown[part], room) for part in parts)
    return more if fit else None


def _fill_plates(parts: Sequence[int], grown: Sequence[Size], room: Size) -> list[_Skyline]:
    """Return new plates with parts that each fit a plate alone."""
    plates: list[_Skyline] = []
    for part in parts:
        if not any(_place_part(plate, part, grown[part], room) for plate in plates):
            plates.append(_Skyline([(0.0, 0.0)], []))
            _place_part(plates[-1], part, grown[part], room)
    return plates


def _fits(size: Size, room: Size) -> bool:
    slack = 1e-9 * max(room)
    return size[0] <= room[0] + slack and size[1] <= room[1] + slack


def _oversize_plate(part: int, size: Size, bed_mm: Size) -> Plate:
    """Place a part that is too large in the direction in which it exceeds the bed less."""
    beyond = [
        (max(0.0, width - bed_mm[0]), max(0.0, depth - bed_mm[1]))
        for width, depth in (size, size[::-1])
    ]
    turned = sum(beyond[1]) < sum(beyond[0])
    width, depth = size[::-1] if turned else size
    place = BedPlace(part, (bed_mm[0] - width) / 2, (bed_mm[1] - depth) / 2, turned)
    return Plate((place,), beyond[int(turned)])


def _place_part(plate: _Skyline, part: int, size: Size, room: Size) -> bool:
    """Add a part to the plate where it lies lowest; False when it finds no place."""
    best: tuple[float, float, bool] | None = None
    for turned in (False, True):
        width, depth = size[::-1] if turned else size
        for i, (x, _) in enumerate(plate.steps):
            if not _fits((x + width, 0.0), room):
                break
            y = _height(plate.steps, i, x + width)
            if _fits((0.0, y + depth), room) and (best is None or (y + depth, x) < best[:2]):
                best = (y + depth, x, turned)
    if best is None:
        return False
    top, x, turned = best
    width, depth = size[::-1] if turned else size
    plate.places.append(BedPlace(part, x, top - depth, turned))
    _raise(plate.steps, x, x + width, top)
    return True


def _height(steps: list[tuple[float, float]], first: int, end: float) -> float:
    """Return the greatest height from step `first` up to x = `end`."""
    tops = [steps[first][1]]
    tops += [height for x, height in steps[first + 1 :] if x < end - 1e-9 * abs(end)]
    return max(tops)


def _raise(steps: list[tuple[float, float]], start: float, end: float, height: float) -> None:
    """Set the contour between two x to `height`."""
    after = [h for x, h in steps if x <= end][-1]
    kept = [(x, h) for x, h in steps if x < start or x > end]
    steps[:] = sorted([*kept, (start, height), (end, after)])


def _centre(plate: _Skyline, sizes: Sequence[Size], bed_mm: Size) -> Plate:
    extents = []
    for place in plate.places:
        width, depth = sizes[place.part]
        if place.turned:
            width, depth = depth, width
        extents.append((place.x_mm + width, place.y_mm + depth))
    dx = (bed_mm[0] - max(x for x, _ in extents)) / 2
    dy = (bed_mm[1] - max(y for _, y in extents)) / 2
    places = sorted(plate.places, key=lambda place: place.part)
    return Plate(
        tuple(BedPlace(p.part, p.x_mm + dx, p.y_mm + dy, p.turned) for p in places),
    )
