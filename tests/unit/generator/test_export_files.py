"""What files hold as numbers, packages, plates, triangles that cross; all files or none.

Pairs of triangles cut, touch or overlap, and do the same after turning and scaling.
"""

import hashlib
import io
import signal
import subprocess
import sys
import time
import zipfile
from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from generator.errors import GeneratorError, WriteError
from generator.export import threemf as package_module
from generator.export.atomic import Staging
from generator.export.bed import arrange_plates
from generator.export.check import cut_triangles, perhaps_folded, triangles_cross
from generator.export.fixed_text import decimal_numbers, decimal_width, number_lines
from generator.export.robot.crate import Attribute, Prim, crate_chunks
from generator.export.threemf import deflate_text, zip_package
from generator.polyhedron.shapes import dodecahedron

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


BASE = ((0, 0, 0), (8, 0, 0), (0, 8, 0))
APART = {
    "above": ((0, 0, 1), (8, 0, 1), (0, 8, 1)),
    "beside in the plane, boxes overlap": ((8, 8, 0), (8, 1, 0), (1, 8, 0)),
    "its plane is crossed outside": ((8, 8, -1), (8, 8, 1), (5, 5, 1)),
    "shares a vertex, rises": ((0, 0, 0), (3, 3, 4), (4, 2, 4)),
    "shares a vertex, in the plane": ((0, 0, 0), (-5, 0, 0), (0, -5, 0)),
    "shares a side, in the plane": ((0, 0, 0), (8, 0, 0), (4, -5, 0)),
    "shares a side, rises steeply": ((0, 0, 0), (8, 0, 0), (2, 2, 1)),
    "sliver beside the side it shares": ((0, 8, 0), (8, 0, 0), (500001, -499992, 0)),
    "without area on the side it shares": ((0, 0, 0), (8, 0, 0), (4, 0, 0)),
    "a segment in the air": ((0, 0, 1), (4, 4, 1), (2, 2, 1)),
}
TOGETHER = {
    "crosses": ((2, 2, -1), (2, 2, 1), (9, 9, 1)),
    "pierced by the base": ((-1, 1, -1), (-1, 1, 1), (5, 1, 0)),
    "a vertex inside the base": ((2, 2, 0), (2, 2, 5), (3, 3, 5)),
    "a vertex on a side": ((4, 0, 0), (4, -5, 0), (5, -5, 3)),
    "a vertex on a side, in the plane": ((4, 0, 0), (2, -5, 0), (6, -5, 0)),
    "a side touches a vertex": ((-3, 3, 0), (3, -3, 0), (-5, -5, 0)),
    "overlaps in the plane": ((1, 1, 0), (9, 1, 0), (1, 9, 0)),
    "lies inside": ((1, 1, 0), (2, 1, 0), (1, 2, 0)),
    "shares a vertex and crosses": ((0, 0, 0), (4, 4, 1), (4, 4, -1)),
    "shares a vertex and overlaps": ((0, 0, 0), (5, 1, 0), (1, 5, 0)),
    "shares a vertex and half a side": ((0, 0, 0), (4, 0, 0), (2, -3, 0)),
    "shares a side, folded over": ((0, 0, 0), (8, 0, 0), (2, 2, 0)),
    "shares a side, folded sliver": ((0, 8, 0), (8, 0, 0), (500000, -499993, 0)),
    "the same": BASE,
    "without area, across": ((1, 1, -1), (1, 1, 1), (1, 1, 0)),
    "a point inside": ((2, 2, 0), (2, 2, 0), (2, 2, 0)),
}


def turned(triangle):
    """Turn by a matrix of integers, which keeps every incidence."""
    M = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]])
    return tuple(tuple((M @ corner + [7, -3, 11]).tolist()) for corner in triangle)


@pytest.mark.parametrize(("cases", "cross"), [(APART, False), (TOGETHER, True)])
def test_more_than_what_is_shared(cases, cross):
    for name, triangle in cases.items():
        for corners in permutations(triangle):
            for one, other in ((BASE, corners), (corners, BASE), (turned(BASE), turned(corners))):
                assert bool(triangles_cross(one, other)) == cross, name


def test_segments_without_area():
    for p, q, r, s, cross in (
        ((0, 0, 0), (4, 4, 4), (0, 4, 2), (4, 0, 2), True),
        ((0, 0, 0), (4, 4, 4), (0, 4, 2), (4, 0, 3), False),
        ((0, 0, 0), (4, 0, 0), (4, 0, 0), (9, 0, 0), False),
        ((0, 0, 0), (4, 0, 0), (3, 0, 0), (9, 0, 0), True),
    ):
        assert bool(triangles_cross((p, q, p), (r, s, r))) == cross


def test_the_least_step_of_a_float_decides():
    base = [[0, 0, 0.1], [1, 0, 0.1], [0, 1, 0.1]]
    for z, cut in ((np.nextafter(0.1, 1), False), (0.1, True), (np.nextafter(0.1, 0), True)):
        other = [[0.25, 0.25, z], [0.25, 0.25, 1], [0.5, 0.25, 1]]
        assert cut_triangles(np.array([base, other]), np.array([0, 1])).tolist() == [cut, cut]


def test_a_slanted_surface_in_single_precision_does_not_cut_itself():
    shape = dodecahedron(40.0)
    points = shape.vertices.astype(np.float32).astype(np.float64)
    faces = np.array(
        [[loop[0], *loop[k : k + 2]] for f in shape.faces for loop in f.loops for k in (1, 2, 3)]
    )
    every = np.arange(len(faces))
    assert not cut_triangles(points[faces], every).any()
    assert len(perhaps_folded(points, faces)) == 0
    points[0] *= -2.0  # a corner pushed through the opposite side
    assert cut_triangles(points[faces], every).sum() >= 9


def test_folded_neighbours_are_found():
    points = np.array([[0, 0, 0], [8, 0, 0], [0, 8, 0], [2, 2, 0], [4, -5, 0], [4, 0, 0]], float)
    for corner, folded in ((3, [0, 1]), (4, []), (5, [0, 1])):
        found = perhaps_folded(points, np.array([[0, 1, 2], [1, 0, corner]]))
        assert found.tolist() == folded


def hidden(folder):
    return [path.name for path in folder.glob(".encode-object-*")]


def test_commit_moves_all_files_and_leaves_nothing_hidden(tmp_path):
    (tmp_path / "a.stl").write_bytes(b"old")
    with Staging(tmp_path) as staging:
        first = staging.write("a.stl", b"new")
        staging.write("b.step", (piece for piece in (b"one", memoryview(b"two"))), digest=True)
        assert (tmp_path / "a.stl").read_bytes() == b"old"
        assert not (tmp_path / "b.step").exists()
        committed = staging.commit()
    assert (tmp_path / "a.stl").read_bytes() == b"new"
    assert (tmp_path / "b.step").read_bytes() == b"onetwo"
    assert committed[0] == first
    assert [one.sha256 for one in committed] == ["", hashlib.sha256(b"onetwo").hexdigest()]
    assert committed[1].size == 6
    assert hidden(tmp_path) == []


def test_an_error_leaves_no_file_and_no_folder(tmp_path):
    def pieces():
        yield b"abc"
        raise KeyError

    with pytest.raises(KeyError), Staging(tmp_path / "out" / "cube") as staging:
        staging.write("a.stl", pieces())
    assert list(tmp_path.iterdir()) == []


_WRITER = """
import sys, time
from generator.export.atomic import Staging
with Staging(sys.argv[1]) as staging:
    staging.write("a.stl", b"x" * 100000)
    print("written", flush=True)
    time.sleep(60)
"""


def test_leftovers_of_a_killed_process_are_removed_and_those_of_a_living_one_kept(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", _WRITER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "written\n"
        left = hidden(tmp_path)
        assert len(left) == 1
        with Staging(tmp_path) as staging:
            assert left[0] in hidden(tmp_path)  # its owner is at work
            staging.write("b.stl", b"b")
            staging.commit()
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert hidden(tmp_path) == left
    assert not (tmp_path / "a.stl").exists()
    deadline = time.monotonic() + 10
    while hidden(tmp_path) and time.monotonic() < deadline:
        with Staging(tmp_path):
            pass
    assert [path.name for path in tmp_path.iterdir()] == ["b.stl"]


def test_names_that_cannot_be_written(tmp_path):
    (tmp_path / "a.stl").mkdir()
    for name, said, fix in (("a.stl", "Is a directory", ""), ("a" * 300, "too long", "shorter")):
        with pytest.raises(GeneratorError, match=said) as caught, Staging(tmp_path) as staging:
            staging.write(name, b"")
        assert caught.value.place == str(tmp_path / name)
        assert fix in caught.value.fix
        assert [path.name for path in tmp_path.iterdir()] == ["a.stl"]
    with pytest.raises(GeneratorError, match="too long") as caught, Staging(tmp_path / ("a" * 300)):
        pass
    assert caught.value.fix == "choose a folder of a shorter name with -o"


def test_no_room_for_the_file(tmp_path, room_for):
    refused = pytest.raises(GeneratorError, match="cannot write the file")
    with room_for(1000), refused as caught, Staging(tmp_path) as staging:
        staging.write("a.stl", (b"x" * 600 for _ in range(20)))
    assert caught.value.place.endswith("a.stl")
    assert "-o" in caught.value.fix
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_may_not_be_written(unprivileged):
    unprivileged.chmod(0o555)
    refused = pytest.raises(GeneratorError, match="Permission denied")
    with refused as caught, Staging(unprivileged):
        pass
    assert caught.value.place == str(unprivileged)
    assert "may write" in caught.value.fix
