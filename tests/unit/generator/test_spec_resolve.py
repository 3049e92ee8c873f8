"""What a spec means: defaults, units, sets, copies, places and the hash of the meaning."""

import json
import math
from pathlib import Path

import pytest
from pydantic_core import PydanticCustomError

from encoded_objects.base.settings import length_mm
from generator.alphabet.known import ALPHABETS
from generator.alphabet.outline import SymbolStyle
from generator.alphabet.printable import check_printable
from generator.array.profiles import PROFILES
from generator.errors import DatabaseError, LayoutError, ShapeError
from generator.polyhedron.shapes import SHAPES
from generator.spec import SpecError, read_specs
from generator.spec.problem import error_location, mark_of

FIXTURES = Path(__file__).parents[3] / "fixtures"
CUBE = "name: Cube\nshape: {cube: 60 mm}\n"
LARGE = json.dumps(dict(PROFILES["large"].encoding))


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def located(text, name="c.yaml"):
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(text)
    return read_specs([name])


def place_of(one, path):
    return str(mark_of(one.source, path))


def spec(text):
    (one,) = located(text)
    return one


def test_smallest_spec():
    (found,) = read_specs([FIXTURES / "cube.yaml"])
    cube = found
    assert (cube.name, cube.shape.kind, cube.shape.parameters) == ("Cube", "cube", {"side": 60.0})
    assert (cube.profile, cube.alphabet, cube.printer.name) == ("auto", "dense-4", "fdm-0.4")
    assert cube.style == SymbolStyle(5.0, 1.0, 1.0, pytest.approx(math.radians(7.5)), 0.0)
    assert (cube.layout, cube.parts, cube.wall_mm) == ("auto", "panels", 3.0)
    assert cube.formats == ("step", "stl", "3mf")
    assert (cube.folder, cube.database) == (Path("out/cube"), "sqlite:///lab.db")
    assert (cube.encoding["rows"], cube.encoding["columns"]) == (51, 1285)


@pytest.mark.parametrize("profile", PROFILES)
def test_defaults_of_every_profile_print(profile):
    made = spec(CUBE + f"profile: {profile}\n")
    assert made.encoding == PROFILES[profile].array().definition()
    assert made.alphabet == PROFILES[profile].alphabet
    assert made.style.pitch_mm == PROFILES[profile].pitch_mm
    check_printable(ALPHABETS[made.alphabet], made.style, made.printer)


def test_stroke_follows_the_pitch_and_the_alphabet():
    assert spec(CUBE + "symbols: {pitch: 10 mm}\n").style.stroke_mm == 2.0
    assert spec(CUBE + "symbols: {pitch: 1 cm, alphabet: letters-4}\n").style.stroke_mm == 1.4
    assert spec(CUBE + "symbols: {pitch: 1 cm, stroke: 1.4}\n").style.stroke_mm == 1.4


def test_draft_gives_way_where_strokes_need_the_room():
    def draft_deg(settings):
        return math.degrees(spec(CUBE + settings).style.draft_rad)

    assert draft_deg("profile: large\n") == pytest.approx(10)
    assert draft_deg("profile: large\nsymbols: {height: 1.2 mm}\n") == pytest.approx(7.5)
    assert draft_deg("") == pytest.approx(7.5)
    assert draft_deg("profile: fine\n") == pytest.approx(5)
    with pytest.raises(SpecError, match="draft"):
        spec(CUBE + "profile: large\nsymbols: {height: 1.2 mm, draft: 10 deg}\n")


@pytest.mark.parametrize(
    ("settings", "pitch_mm"),
    [
        ("", 5.0),
        ("print: {printer: fdm-0.6}\n", 5.0),
        ("print: {printer: resin}\n", 5.0),
        ("symbols: {alphabet: letters-4}\n", 6.0),  # strokes of .14 of the pitch: .8 mm wide
        ("symbols: {draft: 10 deg}\n", 7.0),
        ("symbols: {stroke: 1.4 mm}\n", 5.0),
        ("symbols: {pitch: 6 mm}\n", 6.0),
    ],
)
def test_auto_takes_the_pitch_that_reads_best_of_those_that_print(settings, pitch_mm):
    made = spec(CUBE + settings)
    assert made.profile == "auto"
    assert made.style.pitch_mm == pitch_mm
    check_printable(ALPHABETS[made.alphabet], made.style, made.printer)


def test_settings_that_print_at_no_pitch_are_refused_as_they_are():
    with pytest.raises(SpecError, match=r"stroke 0\.5 mm,"):
        spec(CUBE + "symbols: {stroke: 0.5 mm}\n")


@pytest.mark.parametrize(
    ("written", "length"),
    [("60", 60), ("60.0", 60), ("60 mm", 60), ("60mm", 60), ("6 cm", 60), ("0.06 m", 60),
     ("2.5 in", 63.5), ('"2.5\\""', 63.5), ("6e1 mm", 60), ("' 60 mm '", 60), ("60000 um", 60),
     ("+60", 60)],
)  # fmt: skip
def test_lengths(written, length):
    assert spec(f"name: C\nshape: {{cube: {written}}}\n").shape.parameters == {"side": length}


@pytest.mark.parametrize("written", ["10", "10 deg", "10 degrees", "0.174532925199 rad", "10°"])
def test_angles(written):
    assert spec(CUBE + f"symbols: {{draft: {written}}}\n").style.draft_rad == pytest.approx(
        math.pi / 18, abs=1e-11
    )


@pytest.mark.parametrize("written", ["[80, 8 cm, 120 mm]", "80 x 80 x 120 mm", "80x80x120",
                                     "8 cm by 80 mm by 12 cm", "8×8×12 cm"])  # fmt: skip
def test_boxes(written):
    assert spec(f"name: C\nshape: {{box: {written}}}\n").shape.parameters == {"size": [80, 80, 120]}


@pytest.mark.parametrize(
    ("shape", "faces"),
    [("{octahedron: 60}", 8), ("{dodecahedron: 4 cm}", 12), ("{tetrahedron: 80}", 4),
     ("{prism: {sides: 6, side: 40, height: 50}}", 8), ("{pyramid: {side: 60, height: 50}}", 5),
     ("{prism: {sides: 8, radius: 40, height: 50}}", 10),
     ("{triangular_prism: {side: 60, height: 50}}", 5)],
)  # fmt: skip
def test_shapes_are_those_of_the_polyhedron_package(shape, faces):
    made = spec(f"name: C\nshape: {shape}\n").shape
    assert len(SHAPES[made.kind](**made.parameters).faces) == faces


def test_polyhedron_with_a_hole_keeps_its_loops():
    made = spec(
        "name: C\nshape:\n  polyhedron:\n    vertices: [[0, 0, 0], [9, 0, 0], [0, 9, 0], "
        "[0, 0, 9 mm], [-1, 0, 0], [0, -1 cm, 0]]\n"
        "    faces: [[0, 2, 1], [[0, 1, 3], [4, 5, 2]], [0, 3, 2], [1, 2, 3]]\n"
    ).shape.parameters
    assert made["faces"] == [[[0, 2, 1]], [[0, 1, 3], [4, 5, 2]], [[0, 3, 2]], [[1, 2, 3]]]
    assert made["vertices"][3:] == [[0, 0, 9], [-1, 0, 0], [0, -10, 0]]


def test_files_are_relative_to_the_spec_and_count_by_content():
    Path("parts").mkdir()
    Path("parts/a.stl").write_bytes(b"one")
    Path("parts/b.stl").write_bytes(b"one")
    a, b = (
        located(f"name: {name}\nshape: {{file: {name}.stl}}\n", f"parts/{name}.yaml")[0]
        for name in "ab"
    )
    assert a.shape.file == Path("parts/a.stl")
    assert a.meaning == b.meaning
    Path("parts/b.stl").write_bytes(b"two")
    assert read_specs(["parts/b.yaml"])[0].meaning != a.meaning


def test_scale_of_a_file_counts_unless_it_is_one():
    Path("a.stl").write_bytes(b"one")
    plain, one, inches = (
        spec(f"name: A\nshape: {{file: a.stl{scale}}}\n").meaning
        for scale in ("", ", scale: 1", ", scale: 25.4")
    )
    assert plain == one
    assert inches["shape"] == {**plain["shape"], "scale": 25.4}


@pytest.mark.parametrize(
    "same",
    [
        "# a comment\nshape: {cube: 6 cm}\nname: Cube\n",
        CUBE + "profile: auto\nsymbols: {pitch: 5, draft: 7.5 deg}\nprint: {wall: 0.3 cm}\n",
        CUBE + "symbols:\nprint:\ncopies: 1\nlayout:\n",
        CUBE + "output: {folder: elsewhere, formats: [glb], database: other.db}\n",
        "name: Another\nshape: {cube: 60}\n",
        CUBE + f"encoding: {LARGE}\nsymbols: {{pitch: 5}}\n",
    ],
)
def test_same_meaning_same_hash(same):
    assert spec(same).meaning == spec(CUBE).meaning


@pytest.mark.parametrize(
    "other",
    [
        "name: Cube\nshape: {cube: 61 mm}\n",
        "name: Cube\nshape: {box: [60, 60, 60]}\n",
        CUBE + "profile: large\n",
        CUBE + "symbols: {height: 1.2 mm}\n",
        CUBE + "symbols: {alphabet: letters-4, stroke: 1.4}\n",
        CUBE + "layout: net\n",
        CUBE + "print: {parts: whole}\n",
        CUBE + "print: {wall: 4 mm}\n",
        CUBE + "print: {printer: fdm-0.25}\n",
    ],
)
def test_other_meaning_other_hash(other):
    assert spec(other).meaning != spec(CUBE).meaning


def test_copies_have_names_of_their_own():
    made = located(CUBE + "copies: 3\n")
    assert [one.name for one in made] == ["Cube-1", "Cube-2", "Cube-3"]
    assert [one.meaning for one in made] == [spec(CUBE).meaning] * len(made)


def test_set_shares_its_defaults():
    Path("ball.yaml").write_text(
        "name: Ball\nshape: {dodecahedron: 4 cm}\nsymbols: {height: 0.8 mm}\n"
    )
    made = located(
        "profile: large\nsymbols: {pitch: 8 mm, height: 1.2 mm}\nprint: {wall: 4 mm}\n"
        "output: {formats: stl, database: lab2.db}\n"
        "objects:\n"
        "  - {name: A, shape: {cube: 60}, copies: 2}\n"
        "  - {name: B, shape: {cube: 70}, symbols: {pitch: 9 mm}, print: {parts: whole}}\n"
        "  - ball.yaml\n"
    )
    specs = {one.name: one for one in made}
    assert list(specs) == ["A-1", "A-2", "B", "Ball"]
    styles = {name: (s.style.pitch_mm, s.style.height_mm) for name, s in specs.items()}
    assert styles == {"A-1": (8, 1.2), "A-2": (8, 1.2), "B": (9, 1.2), "Ball": (8, 0.8)}
    assert {s.wall_mm for s in specs.values()} == {4.0}
    assert [s.parts for s in specs.values()] == ["panels", "panels", "whole", "panels"]
    assert {(s.profile, s.database, s.formats) for s in specs.values()} == {
        ("large", "sqlite:///lab2.db", ("stl",))
    }
    by_name = {one.name: one for one in made}
    assert place_of(by_name["B"], "symbols.pitch") == "c.yaml:7:51"
    assert place_of(by_name["B"], "symbols.height") == "c.yaml:2:32"
    assert place_of(by_name["Ball"], "symbols.height") == "ball.yaml:3:19"
    assert place_of(by_name["Ball"], "print.wall") == "c.yaml:3:15"


def test_fixtures():
    files = sorted((FIXTURES / "specs").glob("*.yaml"))
    assert len(files) == 14
    for file in files:
        for one in read_specs([file]):
            SHAPES[one.shape.kind](**one.shape.parameters)
    names = [one.name for one in read_specs([FIXTURES / "specs/thesis-four.yaml"])]
    assert names == ["Cube", "Box", "Triangular prism", "Tetrahedron"]


def test_full_fixture_names_every_setting():
    from generator.spec.settings import ObjectSettings, Output, Print, Robot, Symbols

    text = (FIXTURES / "specs/full.yaml").read_text()
    blocks = (ObjectSettings, Symbols, Print, Robot, Output)
    missing = {name for block in blocks for name in block.model_fields if f"{name}:" not in text}
    assert missing == set()
    one_touch = PROFILES["one-touch"].array().definition()
    assert read_specs([FIXTURES / "specs/full.yaml"])[0].encoding == one_touch


def test_several_databases_are_fine_when_one_is_given():
    for name in "ab":
        Path(f"{name}.yaml").write_text(
            f"name: {name}\nshape: {{cube: 60}}\noutput: {{database: {name}.db}}\n"
        )
    with pytest.raises(SpecError, match="another database"):
        read_specs(["a.yaml", "b.yaml"])
    assert len(read_specs(["a.yaml", "b.yaml"], database="sqlite:///lab.db")) == 2


SEVERAL = "name: C\nshape:\n  cube: 60 mm\nprint: {wall: 4 mm}\n"


@pytest.mark.parametrize(
    ("path", "place"),
    [
        ("shape", "c.yaml:2:1"),
        ("shape.cube", "c.yaml:3:9"),
        ("print.wall", "c.yaml:4:15"),
        ("print.printer", "c.yaml:4:1"),
        ("symbols.pitch", "c.yaml:1:1"),
        ("symbols.pitch, profile, shape", "c.yaml:2:1"),
        ("", "c.yaml:1:1"),
    ],
)
def test_locate(path, place):
    (one,) = located(SEVERAL)
    assert place_of(one, path) == place


def error_at(one, error, path):
    """The error that leaves a stage in which `error` was raised."""
    with pytest.raises(type(error).__mro__[1]) as caught, error_location(one.source, path):
        raise error
    return caught.value


def test_errors_of_a_stage_get_the_place_of_a_setting():
    (one,) = located(SEVERAL)
    found = error_at(one, ShapeError("not closed", fix="close it", place="face F1"), "shape")
    assert str(found) == (
        "c.yaml:2:1: error: face F1: not closed\n    2 | shape:\n      | ^\n  fix: close it"
    )
    assert isinstance(found, SpecError)
    assert error_at(one, found, "print") is found
    database = DatabaseError("cannot be opened")
    assert error_at(one, database, "output.database") is database
    several = error_at(one, LayoutError("two faces:\n  face F1\n  face F2"), "print.wall")
    assert str(several).splitlines()[:3] == [
        "c.yaml:4:15: error: two faces:",
        "  face F1",
        "  face F2",
    ]


def test_a_set_has_a_name_and_folders_of_their_own(tmp_path):
    path = tmp_path / "c.yaml"
    one = "{name: Cube A, shape: {cube: 60 mm}}"
    path.write_text(f"name: Course\nobjects:\n- {one}\n")
    assert [one.origin for one in read_specs([path])] == ["Course"]
    path.write_text(f"objects:\n- {one}\n")
    assert [one.origin for one in read_specs([path])] == ["c"]
    for other in ("cube a", "Cube-a", "CUBE  A"):
        path.write_text(f"objects:\n- {one}\n- {one.replace('Cube A', other)}\n")
        with pytest.raises(SpecError, match="only by case, spaces or dashes"):
            read_specs([path])


def test_what_other_blocks_mean_wrongly_is_told_with_a_misread_shape(tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text("name: A\nshape: {sphere: 3}\nprint: {wall: 0.1 mm, gap: 9 mm}\n")
    with pytest.raises(SpecError) as caught:
        read_specs([path])
    places = [problem.place.partition(":")[2] for problem in caught.value.problems]
    assert places == ["2:9", "3:15", "3:28"]
    path.write_text("name: A\nshape: {sphere: 3}\nsymbols: {pitch: x}\nprint: {gap: 9 mm}\n")
    with pytest.raises(SpecError) as caught:
        read_specs([path])
    assert len(caught.value.problems) == 2  # nothing is concluded from a default pitch


@pytest.mark.parametrize(
    ("text", "length"),
    [('2 1/2"', 63.5), ("2-1/2 in", 63.5), ("3/4 in", 19.05), ("1 1/8 in", 28.575), ("1/2", 0.5)],
)
def test_fractions_are_lengths(text, length):
    assert length_mm(text) == pytest.approx(length, abs=1e-9)


@pytest.mark.parametrize("text", ["1/0 in", "1/2/3 in", "a 1/2 in", "1 /2 in x"])
def test_what_is_no_fraction_is_refused(text):
    with pytest.raises(PydanticCustomError):
        length_mm(text)
