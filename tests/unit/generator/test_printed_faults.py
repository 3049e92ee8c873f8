"""Each fault by itself, against what it does by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from generator.errors import PrintError
from generator.printed.deposit import deposit, seam_blobs, strings
from generator.printed.faults import NAMED, PrintFaults, faulty_path, print_faults
from generator.printed.gcode import Toolpath, toolpath_of
from generator.printed.slicer import SlicedPart

#: Two layers, each a square of 10 mm and a line of 5 mm in its middle.
TEXT = "M83\nF3000\n" + "".join(
    f"G1 Z{z}\nG1 X0 Y0 F3000\nG1 X10 E.33\nG1 Y10 E.33\nG1 X0 E.33\nG1 Y0.1 E.327\n"
    "G1 X2.5 Y5\nG1 X7.5 E.16\n"
    for z in (0.2, 0.4)
)


@pytest.fixture
def path() -> Toolpath:
    return toolpath_of(TEXT)


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def test_scale_and_skew_act_about_the_datum(path: Toolpath) -> None:
    faults = PrintFaults(scale_x=0.99, scale_y=1.01, skew_deg=math.degrees(math.atan(0.02)))
    moved = faulty_path(path, faults, rng(), datum_mm=(10.0, 0.0))
    corner = moved.end_mm[path.of_part][:3, :2]
    assert corner[0] == pytest.approx([10.0, 0.0])  # the datum itself stays
    assert corner[1] == pytest.approx([10 + 0.99 * 0.02 * 10, 10.1])
    assert corner[2] - corner[1] == pytest.approx([-9.9, 0.0])


def test_each_axis_follows_when_its_play_is_used_up() -> None:
    text = "M83\nG1 Z.2\nG1 X10 E1\nG1 X9.95 E1\nG1 X9 E1\nG1 X9 Y5 E1\nG1 X9.5 E1"
    moved = faulty_path(toolpath_of(text), PrintFaults(backlash_mm=0.2), rng())
    laid = moved.of_part
    assert moved.end_mm[laid, 0] == pytest.approx([9.9, 9.9, 9.1, 9.1, 9.4])
    assert moved.end_mm[laid, 1] == pytest.approx([0, 0, 0, 4.9, 4.9])
    assert moved.start_mm[1:] == pytest.approx(moved.end_mm[:-1])


def test_a_nozzle_swings_after_a_corner_along_the_change_of_its_direction(path: Toolpath) -> None:
    swung = faulty_path(path, PrintFaults(ringing_mm=0.1), rng())
    assert swung.volume_mm3.sum() == pytest.approx(path.volume_mm3.sum())
    laid = swung.of_part
    assert laid.sum() > 3 * path.of_part.sum()
    first = swung.end_mm[laid & (swung.end_mm[:, 2] < 0.3)]
    right = first[(np.abs(first[:, 0] - 10) < 0.2) & (first[:, 1] > 0.01)]  # from (10, 0) up
    off = right[:, 0] - 10
    assert right[-1, 1] == pytest.approx(10.0)
    assert off[-1] == 0
    # At 50 mm/s a wave is 1.25 mm: the first swing is over at .6 mm, back past the corner.
    early = off[(right[:, 1] > 0.1) & (right[:, 1] < 0.6)]
    assert 0.05 < np.abs(early).max() < 0.1
    assert (np.sign(early) == np.sign(early[0])).all()
    assert np.abs(off[right[:, 1] > 3.8]).max() == 0


def test_layers_are_shifted_each_as_a_whole(path: Toolpath) -> None:
    moved = faulty_path(path, PrintFaults(jitter_mm=0.1), rng())
    by = (moved.end_mm - path.end_mm)[path.of_part]
    layer = path.end_mm[path.of_part, 2] > 0.3
    for which in (layer, ~layer):
        assert by[which] == pytest.approx(np.tile(by[which][0], (int(which.sum()), 1)))
    assert np.linalg.norm(by[layer][0] - by[~layer][0]) > 0.01


def test_flow_has_the_mean_and_the_spread_that_are_asked() -> None:
    long = toolpath_of(
        "M83\nG1 Z.2\n" + "".join(f"G1 X{50 * (k % 2)} Y{k / 2} E1.6\n" for k in range(1, 2000))
    )
    flowing = faulty_path(long, PrintFaults(flow=1.1, flow_spread=0.05), rng())
    share = flowing.volume_mm3[long.of_part] / long.volume_mm3[long.of_part]
    assert share.mean() == pytest.approx(1.1, abs=0.01)
    assert share.std() == pytest.approx(0.055, abs=0.008)
    assert np.abs(np.diff(share)).mean() < 1.5 * share.std()  # it drifts, it does not jump


def test_blobs_stand_where_loops_begin(path: Toolpath) -> None:
    blobs = seam_blobs(path, 0.25)
    assert blobs.start_mm == pytest.approx(np.zeros((2, 2)))  # not on the two lines
    assert blobs.top_mm == pytest.approx([0.325, 0.525])
    assert blobs.width_mm == pytest.approx([0.25, 0.25])


def test_strings_hang_between_the_ends_of_travels(path: Toolpath) -> None:
    drawn = strings(path, 1.0, 0.15, rng())
    # From each square to its line; the way up to the second layer draws none.
    assert drawn.start_mm == pytest.approx(np.array([[0, 0.1], [0, 0.1]]))
    assert drawn.end_mm == pytest.approx(np.array([[2.5, 5], [2.5, 5]]))
    assert drawn.top_mm == pytest.approx([0.2, 0.4])
    assert len(strings(path, 0.0, 0.15, rng())) == 0


def test_a_deposit_is_in_the_parts_frame(path: Toolpath) -> None:
    T = np.eye(4)
    T[:3, 3] = [-5.0, -5.0, 1.0]
    sliced = SlicedPart(path, T, np.array([-5.0, -5, 1]), np.array([5.0, 5, 1.4]))
    perfect = deposit(sliced)
    assert perfect.beads.end_mm[0] == pytest.approx([5.0, -5.0])
    assert sorted(set(perfect.beads.top_mm.round(6))) == [1.2, 1.4]
    shrunk = deposit(sliced, PrintFaults(scale_x=0.9, bow_mm=0.2))
    assert shrunk.beads.end_mm[0] == pytest.approx([4.5, -5.0])  # about the middle of the box
    assert shrunk.bow_at(np.array([[0.0, 0.0], [5.0, 5.0], [5.0, 0.0]])) == pytest.approx(
        [0.0, 0.2, 0.1]
    )
    strung = deposit(sliced, PrintFaults(seam_mm=0.2, strings=1.0), rng())
    assert len(strung.beads) == len(perfect.beads) + 2 + 2


def test_names_and_numbers() -> None:
    assert print_faults("none") == PrintFaults() == print_faults("")
    assert print_faults("bad") == NAMED["bad"]
    assert print_faults("scale_x=.995, backlash_mm=0.1") == PrintFaults(
        scale_x=0.995, backlash_mm=0.1
    )
    assert print_faults("usual,flow=1.3") == replace(NAMED["usual"], flow=1.3)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("flow=1,bad", "unknown fault 'bad'"),
        ("backlash=0.1", "did you mean backlash_mm"),
        ("flow=much", "flow 'much'"),
        ("flow=3", "from 0.3 to 2"),
        ("scale_x=nan", "scale_x 'nan'"),
        ("seam_mm=-1", "from 0 to 1"),
    ],
)
def test_what_is_no_fault(text: str, says: str) -> None:
    with pytest.raises(PrintError, match=says):
        print_faults(text)
