"""G-code of four slicers, coordinates of every kind, arcs, and what is wrong with a file."""

import io
import math
import zipfile
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from generator.errors import PrintError
from generator.printed.gcode import ROLES, ArcError, chords, read_gcode, role_of, toolpath_of

FILES = Path(__file__).parent / "gcode"
SECTION = 0.2 * (0.45 - 0.2 * (1 - math.pi / 4))  #: of the beads in gcode/README.md
FILAMENT = math.pi * 1.75**2 / 4


def widths(path):
    laid = path.of_part
    h = path.height_mm[laid]
    return path.volume_mm3[laid] / path.length_mm[laid] / h + h * (1 - math.pi / 4)


@pytest.mark.parametrize(("name", "over"), [("cura", "solid"), ("bambu", "top"), ("orca", "top")])
def test_every_dialect_gives_the_same_square_and_half_circle(name, over):
    path = read_gcode(FILES / f"{name}.gcode")
    laid = path.of_part
    assert path.dialect == name
    assert {ROLES[role] for role in path.role[laid]} == {"outer wall", over}
    assert path.height_mm[laid] == pytest.approx(0.2)
    square = laid & (path.end_mm[:, 2] < 0.3)
    half = laid & ~square
    corners = [[110, 100, 0.2], [110, 110, 0.2], [100, 110, 0.2], [100, 100, 0.2]]
    assert path.end_mm[square] == pytest.approx(np.array(corners))
    assert path.length_mm[half].sum() == pytest.approx(5 * math.pi, abs=0.02)
    assert np.hypot(*(path.end_mm[half, :2] - 105).T) == pytest.approx(5.0, abs=1e-3)
    assert path.volume_mm3[square].sum() == pytest.approx(40 * SECTION, rel=1e-3)
    assert path.volume_mm3[half].sum() == pytest.approx(5 * math.pi * SECTION, rel=1e-3)
    assert np.median(widths(path)) == pytest.approx(0.45, abs=0.002)
    assert path.strokes()[laid].tolist() == [0] * 4 + [1] * int(half.sum())


def test_prusaslicer_itself_says_the_widths_that_its_volumes_have():
    path = read_gcode(FILES / "prusaslicer.gcode")
    laid = path.of_part
    assert path.dialect == "prusaslicer"
    assert np.unique(path.end_mm[laid, 2]).tolist() == [0.2, 0.4, 0.6]
    assert widths(path) == pytest.approx(path.width_mm[laid], abs=0.006)
    # 2.94 mm of filament are used, as the file says of itself.
    assert path.volume_mm3[laid].sum() / FILAMENT == pytest.approx(2.94, abs=0.01)
    outer = path.role == ROLES.index("outer wall")
    low = (path.end_mm[outer, :2] - 0.225).min(axis=0)
    high = (path.end_mm[outer, :2] + 0.225).max(axis=0)
    assert (*low, *high) == pytest.approx((48, 48.5, 52, 51.5), abs=0.03)


@pytest.mark.parametrize(
    "text",
    [
        "G1 X1 Y2 Z.2\nG92 E5\nG1 X11 E5.5\nG1 Y12 E6",  # absolute E
        "M83\nG1 X1 Y2 Z.2\nG1 X11 E.5\nG1 Y12 E.5",
        "G1 X1 Y2 Z.2\nG91\nG1 X10 E.5\nG1 Y10 E.5",  # relative: E as well
        "G1 X0 Y0 Z.2\nG92 X-1 Y-2 E0\nG1 X-1 Y-2\nG1 X9 E.5\nG1 Y8 E1",  # another origin
        "g1 x1 y2 z.2 ; small letters\ng1x11e.5\nG1 Y12E1",  # no spaces
        "N1 G1 X1 Y2 Z.2*99\nN2 G1 X11 E.5*12\nN3 G1 Y12 E1 *4",  # numbers and checksums
        "G20\nG1 X.039370 Y.078740 Z.007874\nG1 X.433071 E.019685\nG1 Y.472441 E.03937",  # inches
        "G28\nM83\nG1 X1 Y2 Z5\nG1 E-2\nG1 Z.2\nG1 E2\nG1 X11 E.5\nG1 Y12 E.5\nG1 X3 E-.3",
    ],
)
def test_coordinates_of_every_kind(text):
    path = toolpath_of(text)
    laid = path.of_part
    shift = path.start_mm[laid][0] - [1, 2, 0.2]
    starts, ends = np.array([[1, 2, 0.2], [11, 2, 0.2]]), np.array([[11, 2, 0.2], [11, 12, 0.2]])
    assert path.start_mm[laid] - shift == pytest.approx(starts, abs=1e-4)
    assert path.end_mm[laid] - shift == pytest.approx(ends, abs=1e-4)
    assert path.volume_mm3[laid] == pytest.approx([0.5 * FILAMENT] * 2, rel=1e-4)


def test_filament_and_volumes():
    moves = "M83\nG1 X10 Z.2 E.5"
    assert toolpath_of(moves).volume_mm3[0] == pytest.approx(0.5 * FILAMENT)
    thick = toolpath_of(moves + "\n; filament_diameter = 2.85,1.75")
    assert thick.volume_mm3[0] == pytest.approx(0.5 * math.pi * 2.85**2 / 4)
    for volumetric in ("M200 D1.75\n", ";FLAVOR:Marlin(Volumetric)\n"):
        assert toolpath_of(volumetric + moves).volume_mm3[0] == pytest.approx(0.5)


def test_heights_are_those_of_the_layers_where_no_comment_says_them():
    path = toolpath_of("M83\nG1 Z.3\nG1 X10 E1\nG1 Z2\nG1 X0 Z.5\nG1 X10 E1\nG1 Z.7\nG1 X0 E1")
    assert path.height_mm[path.of_part] == pytest.approx([0.3, 0.2, 0.2])


def test_skirts_supports_and_the_machines_own_lines_are_no_part():
    text = "M83\nG1 Z.2\nG1 X60 E9\n;TYPE:{}\nG1 Y9 E1\n;TYPE:Perimeter\nG1 X5 E.4"
    for feature in ("Skirt/Brim", "Support material interface", "Wipe tower", "Custom"):
        path = toolpath_of(text.format(feature))
        assert path.of_part.tolist() == [False, False, False, True]


def test_features():
    for feature, role in (
        ("Overhang perimeter", "overhang"), ("Top solid infill", "top"), ("SKIN", "solid"),
        ("FILL", "infill"), ("Internal Bridge", "bridge"), ("Gap infill", "gap fill"),
        ("WALL-INNER", "inner wall"), ("PRIME-TOWER", "support"),
        ("Floating vertical shell", "unknown"),
    ):  # fmt: skip
        assert ROLES[role_of(feature)] == role


def test_arcs_stay_on_their_circle():
    for clockwise, sweep in ((False, math.pi / 2), (True, 3 * math.pi / 2)):
        points = [(1.0, 0.0), *chords((1, 0), (0, 1), {"I": -1.0}, clockwise=clockwise)]
        length = sum(math.dist(a, b) for a, b in pairwise(points))
        assert length == pytest.approx(sweep, rel=5e-3)
        assert [math.hypot(*p) for p in points] == pytest.approx([1.0] * len(points))
        assert math.copysign(1, points[1][1]) == (-1 if clockwise else 1)
    short = chords((1, 0), (0, 1), {"R": 1.0}, clockwise=False)
    assert [math.hypot(*p) for p in short] == pytest.approx([1.0] * len(short))
    long = chords((1, 0), (0, 1), {"R": -1.0}, clockwise=False)
    assert [math.dist(p, (1, 1)) for p in long] == pytest.approx([1.0] * len(long))
    assert len(long) > 2 * len(short)
    full = chords((1, 0), (1, 0), {"I": -1.0}, clockwise=True)
    twice = chords((1, 0), (1, 0), {"I": -1.0, "P": 2}, clockwise=True)
    assert len(twice) == pytest.approx(2 * len(full), abs=1)
    for words in ({}, {"R": 0.5}, {"I": 3.0}):
        with pytest.raises(ArcError):
            chords((1, 0), (0, 1), words, clockwise=False)


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("G1 X1\nG1 X1.2.3 E1", 2, "'X1.2.3' is no number"),
        ("G1 X\n", 1, "'X' is no number"),
        ("M83\nG2 X1 Y1 E1", 2, "centre"),
        ("G18", 1, "G18"),
        (";WIDTH:wide", 1, "'wide' is no number"),
    ],
)
def test_errors_say_file_and_line(text, line, says):
    with pytest.raises(PrintError, match=says) as caught:
        toolpath_of(text, "part.gcode")
    assert caught.value.place == f"part.gcode:{line}"
    assert caught.value.fix


def test_files_that_hold_nothing_and_a_plate_of_bambu_studio(tmp_path):
    def packed(member, text):
        stored = io.BytesIO()
        with zipfile.ZipFile(stored, "w") as archive:
            archive.writestr(member, text)
        return stored.getvalue()

    for name, content, says in (
        ("a.gcode", b"G28\nG1 X5", "nothing is printed in 2 lines"),
        ("none.gcode", None, "cannot be read: No such file"),
        ("b.bgcode", b"GCDE\x01\x00", "binary"),
        ("u.3mf", packed("3D/3dmodel.model", "<model/>"), "no plate"),
        ("broken.3mf", b"PK\x03\x04broken", "no plate"),
    ):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(PrintError, match=says):
            read_gcode(tmp_path / name)
    plate = packed("Metadata/plate_1.gcode", (FILES / "bambu.gcode").read_text())
    (tmp_path / "tile.gcode.3mf").write_bytes(plate)
    assert read_gcode(tmp_path / "tile.gcode.3mf").of_part.sum() > 10


def test_volumes_that_contradict_the_widths_are_refused():
    moves = "".join(f"G1 X{10 * (k % 2)} Y{k} E.35\n" for k in range(1, 13))
    text = "M83\nG1 Z.2\n;TYPE:Perimeter\n;WIDTH:0.45\n" + moves
    assert toolpath_of(text).of_part.sum() == 12
    with pytest.raises(PrintError, match=r"2\.\d+ times the widths announced") as caught:
        toolpath_of("; filament_diameter = 2.85\n" + text)
    assert "diameter" in caught.value.fix
