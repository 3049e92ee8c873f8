"""What files hold as numbers, packages as zipfile reads them, and plates."""

from __future__ import annotations

import io
import zipfile
from itertools import combinations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from generator.errors import WriteError
from generator.export import threemf as package_module
from generator.export.bed import arrange_plates
from generator.export.fixed_text import (
    decimal_numbers,
    decimal_width,
    number_lines,
)
from generator.export.robot.crate import Attribute, Prim, crate_chunks
from generator.export.threemf import deflate_text, zip_package

lengths = st.floats(-1e6, 1e6, allow_nan=False)


@given(st.lists(lengths, min_size=1, max_size=20), st.integers(1, 10))
@example([0.0, -0.0, -0.04, 12.5, -12.5, 999.96, -0.5], 1)
def test_decimals_are_the_rounded_number(values, places):
    width = decimal_width(max(map(abs, values)), places)
    rows = decimal_numbers(np.array(values), width, places)
    assert rows.shape == (len(values), width)
    for row, value in zip(rows, values, strict=True):
        text = row.tobytes().decode("ascii")
        assert len(text.split(".")[1]) == places
        scaled = int(np.rint(value * 10.0**places))
        assert int(text.strip().replace(".", "")) == scaled
        assert "-0." not in text or scaled < 0


@given(st.lists(st.tuples(*[st.floats(-1e5, 1e5, allow_nan=False)] * 3), max_size=20))
def test_decimals_of_a_line_are_the_shortest(rows):
    text = number_lines(("<", ",", ";", ">\n"), np.array(rows).reshape(-1, 3), 3).decode()
    wanted = [[f"{value:.3f}" for value in np.round(row, 3) + 0.0] for row in rows]
    short = [[one.rstrip("0").rstrip(".") for one in row] for row in wanted]
    assert text == "".join(f"<{a},{b};{c}>\n" for a, b, c in short)


@given(st.lists(st.lists(st.binary(max_size=300), max_size=4), min_size=1, max_size=4))
@example([[b"head", bytes(range(256)) * 1000, b"tail"]])  # longer than its zeros are moved at once
def test_a_package_holds_its_pieces_in_order(entries):
    named = {f"e{number}": pieces for number, pieces in enumerate(entries)}
    content = zip_package({name: [deflate_text([p]) for p in ps] for name, ps in named.items()})
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        assert file.testzip() is None
        assert file.namelist() == list(named)
        for name, pieces in named.items():
            assert file.read(name) == b"".join(pieces)
            assert file.getinfo(name).date_time == (1980, 1, 1, 0, 0, 0)


def test_a_package_that_no_zip_can_hold(monkeypatch):
    monkeypatch.setattr(package_module, "_LARGEST", 5)
    zip_package({"a": [deflate_text([b"12345"])]})
    with pytest.raises(WriteError, match="exceeds 4 GiB"):
        zip_package({"a": [deflate_text([b"123"]), deflate_text([b"456"])]})


def test_whole_numbers_of_a_crate_file_as_openusd_reads_them(tmp_path):
    """Differences of 1, 2 and 4 bytes, both signs, and those that leave 32 bits."""
    from pxr import Usd

    arrays = [
        np.random.default_rng(size).integers(-largest, largest, size, endpoint=True)
        for size in (0, 1, 15, 16, 17, 5000)
        for largest in (1, 120, 130, 32_000, 33_000, 2**31 - 1)
    ]
    told = {f"a{k}": Attribute("int[]", values) for k, values in enumerate(arrays)}
    path = tmp_path / "stage.usdc"
    path.write_bytes(b"".join(crate_chunks(Prim("A", "Mesh", told))))
    stage = Usd.Stage.Open(str(path))  # it ends with its last name
    prim = stage.GetPrimAtPath("/A")
    for k, values in enumerate(arrays):
        assert list(prim.GetAttribute(f"a{k}").Get()) == list(values)


BED = (250.0, 210.0)


def boxes(plate, sizes):
    """Return x and y of the front left and of the back right corner of each part."""
    out = []
    for place in plate.places:
        width, depth = sizes[place.part][::-1] if place.turned else sizes[place.part]
        out.append((place.x_mm, place.y_mm, place.x_mm + width, place.y_mm + depth))
    return out


@given(
    st.lists(st.tuples(st.floats(1.0, 256.0), st.floats(1.0, 256.0)), max_size=20),
    st.sampled_from([(BED, (0.0, 0.0)), ((256.0, 256.0), (18.0, 28.0))]),
)
@example([(245.0, 201.0)], ((256.0, 256.0), (18.0, 28.0)))  # wider than what a rim leaves
@example([(210.0, 250.0)], (BED, (0.0, 0.0)))  # the exact size of the bed, turned
def test_parts_keep_their_distance_on_the_bed_and_off_its_blocked_corner(sizes, printer):
    (width, depth), corner = printer
    plates = arrange_plates(sizes, (width, depth), blocked_mm=corner)
    assert sorted(p.part for plate in plates for p in plate.places) == list(range(len(sizes)))
    for plate in plates:
        found = boxes(plate, sizes)
        if not plate.fits:
            ((left, front, right, back),) = found
            short, long = sorted((right - left, back - front))
            free = width - corner[0], depth - corner[1]
            assert long > max(width, depth) - 1e-6 or short > min(free) - 1e-6
            continue
        for left, front, right, back in found:
            assert left >= corner[0] - 1e-6 or front >= corner[1] - 1e-6
            assert min(left, front) >= -1e-6
            assert right <= width + 1e-6
            assert back <= depth + 1e-6
        for a, b in combinations(found, 2):
            apart = max(a[0] - b[2], b[0] - a[2], a[1] - b[3], b[1] - a[3])
            assert apart >= 5.0 - 1e-6


def test_a_brim_has_room_where_it_takes_no_more_plates():
    tight, wide = (arrange_plates([(60.0, 60.0)] * 9, (side, side)) for side in (195.0, 203.0))
    assert [len(tight), len(wide)] == [1, 1]
    assert np.array(boxes(wide[0], [(60.0, 60.0)] * 9)).min() == pytest.approx(6.5)
    assert np.array(boxes(tight[0], [(60.0, 60.0)] * 9)).min() == pytest.approx(2.5)


def test_a_part_larger_than_the_bed_lies_alone_and_says_so():
    plates = arrange_plates([(50.0, 50.0), (100.0, 260.0), (50.0, 50.0)], BED)
    assert [[p.part for p in plate.places] for plate in plates] == [[0, 2], [1]]
    assert plates[0].fits
    assert not plates[1].fits
    assert plates[1].overhang_mm == (10.0, 0.0)
    assert plates[1].places[0].turned


def test_a_group_lies_on_one_plate_where_one_can_hold_it():
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
