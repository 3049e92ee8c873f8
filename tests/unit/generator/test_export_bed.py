"""Parts on the bed: nothing overlaps, nothing is lost, nothing hangs over unsaid."""

from __future__ import annotations

from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.export.bed import Plate, Size, arrange_plates

BED = (250.0, 210.0)
sides = st.floats(1.0, 205.0)


def boxes(plate: Plate, sizes: list[Size]) -> list[tuple[float, float, float, float]]:
    out = []
    for place in plate.places:
        width, depth = sizes[place.part][::-1] if place.turned else sizes[place.part]
        out.append((place.x_mm, place.y_mm, place.x_mm + width, place.y_mm + depth))
    return out


@given(st.lists(st.tuples(sides, sides), max_size=25))
def test_parts_keep_their_distance_and_stay_on_the_bed(sizes: list[Size]) -> None:
    plates = arrange_plates(sizes, BED)
    assert sorted(p.part for plate in plates for p in plate.places) == list(range(len(sizes)))
    for plate in plates:
        assert plate.fits
        found = boxes(plate, sizes)
        for left, front, right, back in found:
            assert left >= -1e-6
            assert front >= -1e-6
            assert right <= BED[0] + 1e-6
            assert back <= BED[1] + 1e-6
        for a, b in combinations(found, 2):
            apart = max(a[0] - b[2], b[0] - a[2], a[1] - b[3], b[1] - a[3])
            assert apart >= 5.0 - 1e-6


def test_the_exact_size_of_the_bed_fits_also_turned() -> None:
    (plate,) = arrange_plates([(210.0, 250.0)], BED)
    assert plate.fits
    assert plate.places[0].turned
    assert (plate.places[0].x_mm, plate.places[0].y_mm) == pytest.approx((0.0, 0.0))


def test_a_part_larger_than_the_bed_lies_alone_and_says_so() -> None:
    plates = arrange_plates([(50.0, 50.0), (100.0, 260.0), (50.0, 50.0)], BED)
    assert [[p.part for p in plate.places] for plate in plates] == [[0, 2], [1]]
    assert plates[0].fits
    assert not plates[1].fits
    assert plates[1].overhang_mm == (10.0, 0.0)
    assert plates[1].places[0].turned


def test_a_group_lies_on_one_plate_where_one_can_hold_it() -> None:
    sizes = [(60.0, 60.0)] * 18  # six to a cube; nine fit a bed
    plates = arrange_plates(sizes, (205, 205), groups=[k // 6 for k in range(18)])
    assert [sorted(p.part for p in plate.places) for plate in plates] == [
        list(range(6)), list(range(6, 12)), list(range(12, 18)),
    ]  # fmt: skip
    assert len(arrange_plates(sizes, (205, 205))) == 2
    mixed = arrange_plates([*sizes[:6], *[(60.0, 60.0)] * 3], (205, 205), groups=[0] * 6 + [1] * 3)
    assert [len(plate.places) for plate in mixed] == [9]
    split = arrange_plates(sizes[:10], (205, 205), groups=[0] * 10)
    assert [len(plate.places) for plate in split] == [9, 1]
