"""What a spec means: values, defaults, units, sets, places and the hash of the meaning."""

import json
import math
import re
from pathlib import Path

import pytest
from pydantic_core import PydanticCustomError

from encoded_objects.base.settings import length_mm
from encoded_objects.base.yaml_tree import read_tree
from generator.alphabet.known import ALPHABETS
from generator.alphabet.printable import check_printable
from generator.array.profiles import PROFILES
from generator.errors import DatabaseError, LayoutError, ShapeError
from generator.spec import SpecError, read_specs
from generator.spec.option import database_option, format_option
from generator.spec.problem import SPEC, error_location, mark_of
from generator.spec.schema import spec_schema
from generator.spec.settings import ObjectSettings, Output, Print, Robot, Symbols
from generator.spec.shape import KINDS
from generator.spec.starter import starter, starter_named

FIXTURES = Path(__file__).parents[3] / "fixtures"
CUBE = "name: Cube\nshape: {cube: 60 mm}\n"
LETTERS = json.dumps(dict(PROFILES["tactel-8"].encoding))


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def specs(text, name="c.yaml"):
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(text)
    return read_specs([name])


def spec(text):
    (one,) = specs(text)
    return one


def place_of(one, path):
    return str(mark_of(one.source, path))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12", 12),
        ("-3", -3),
        ("0x1099", 0x1099),
        ("1.5", 1.5),
        (".5e3", 500.0),
        ("007", 7),
        ("true", True),
        ("~", None),
        ("", None),
        ("yes", "yes"),
        ("1:30", "1:30"),
        ("2026-01-01", "2026-01-01"),
        ("'12'", "12"),
        ("<<", "<<"),
        ("[1, [2]]", [1, [2]]),
    ],
)
def test_values_follow_yaml_1_2(text, value):
    Path("c.yaml").write_text(f"a: {text}")
    assert read_tree(Path("c.yaml"), SPEC).value == {"a": value}


def test_marks_of_keys_and_values():
    Path("c.yaml").write_bytes(b"\xef\xbb\xbfa: 1\r\nb:\r\n  - {c: 2}\r\n")
    tree = read_tree(Path("c.yaml"), SPEC)
    assert tree.value == {"a": 1, "b": [{"c": 2}]}
    assert str(tree.value_mark(("b", 0, "c"))) == "c.yaml:3:9"
    assert str(tree.key_mark(("b", 0, "c"))) == "c.yaml:3:6"
    assert str(tree.value_mark(("b", 0, "nothing"))) == "c.yaml:3:5"
    assert tree.value_mark(("a",)).source.lines == ("a: 1", "b:", "  - {c: 2}", "")


@pytest.mark.parametrize("profile", PROFILES)
def test_defaults_of_every_profile_print(profile):
    made = spec(CUBE + f"profile: {profile}\n")
    assert made.encoding == PROFILES[profile].array().definition()
    assert made.alphabet.name == PROFILES[profile].alphabet
    assert made.style.pitch_mm == PROFILES[profile].pitch_mm
    check_printable(made.alphabet, made.style, made.printer)


def test_glyphs_of_a_file_are_those_of_the_spec(tmp_path):
    glyphs = "[[[[-1, 1], [-1, -1], [1, -1]]], [[[0, 1], [0, 0], [-1, -1]]]]"
    letters = f"{{name: mine, reach: 0.28, glyphs: {glyphs}}}"
    (tmp_path / "letters.yaml").write_text(letters)
    two = CUBE + "profile: thesis\nsymbols: {alphabet: "
    written, filed = (spec(f"{two}{one}}}") for one in (letters, tmp_path / "letters.yaml"))
    assert written == filed
    assert written.meaning["alphabet"] == written.alphabet.definition()
    assert written.alphabet.glyphs[1].strokes == (((0, 1), (0, 0)), ((0, 0), (-1, -1)))
    ships = ALPHABETS["thesis-2"].definition()
    glyphs = [glyph["strokes"] for glyph in ships["glyphs"]]
    again = {**ships, "glyphs": glyphs}  # the letters that ship, given once more
    assert spec(f"{two}{again}}}".replace("'", "")).meaning == spec(f"{two}thesis-2}}").meaning


@pytest.mark.parametrize(
    ("settings", "stroke_mm"),
    [("{pitch: 10 mm}", 2.0), ("{pitch: 1 cm, alphabet: letters-4}", 1.4),
     ("{pitch: 1 cm, stroke: 1.4}", 1.4)],
)  # fmt: skip
def test_stroke_follows_the_pitch_and_the_alphabet(settings, stroke_mm):
    assert spec(CUBE + f"symbols: {settings}\n").style.stroke_mm == stroke_mm


@pytest.mark.parametrize(
    ("settings", "draft_deg"),
    [("profile: large\n", 10), ("profile: large\nsymbols: {height: 1.2 mm}\n", 7.5), ("", 5),
     ("profile: fine\n", 5)],
)  # fmt: skip
def test_draft_gives_way_where_strokes_need_the_room(settings, draft_deg):
    assert math.degrees(spec(CUBE + settings).style.draft_rad) == pytest.approx(draft_deg)
    with pytest.raises(SpecError, match="draft"):
        spec(CUBE + "profile: large\nsymbols: {height: 1.2 mm, draft: 10 deg}\n")


@pytest.mark.parametrize(
    ("settings", "pitch_mm"),
    [
        ("print: {printer: fdm-0.6}\n", 5.5),
        ("print: {printer: resin}\n", 5.0),
        ("symbols: {alphabet: letters-4}\n", 6.0),  # strokes of .14 of the pitch: .8 mm wide
        ("symbols: {draft: 10 deg}\n", 6.0),
        ("symbols: {stroke: 1.4 mm}\n", 6.0),
        ("symbols: {alphabet: dense-4, stroke: 1.4 mm}\n", 5.0),
        ("symbols: {pitch: 6 mm}\n", 6.0),
        ("sensor_type: flexitac-16x32\n", 6.0),
        ("sensor_type: gel-24x32\nprint: {printer: resin}\n", 3.0),
        ("sensor_type: gel-24x32\n", 4.0),  # the finest that a nozzle of .4 mm makes
        ("sensor_type: gel-24x32\nsymbols: {pitch: 7 mm}\n", 7.0),
    ],
)
def test_auto_takes_the_pitch_that_reads_best_of_those_that_print(settings, pitch_mm):
    made = spec(CUBE + settings)
    assert made.profile == "auto"
    assert made.style.pitch_mm == pitch_mm
    check_printable(made.alphabet, made.style, made.printer)


def test_a_sensor_file_stands_beside_the_spec_and_an_option_comes_first():
    Path("specs").mkdir()
    Path("specs/mine.yaml").write_text("name: mine\nrows: 16\ncolumns: 16\npitch: 2.54 mm\n")
    (mine,) = specs(CUBE + "sensor_type: mine.yaml\n", "specs/cube.yaml")
    assert mine.style.pitch_mm == 8.0  # 3.15 of 2.54 mm
    assert mine.sensor.half_mm == pytest.approx((20.32, 20.32))
    (other,) = read_specs(["specs/cube.yaml"], sensor_type="fsr-8x8")
    assert other.style.pitch_mm == 7.0


@pytest.mark.parametrize(
    ("written", "length"),
    [("60", 60), ("60.0", 60), ("60 mm", 60), ("60mm", 60), ("6 cm", 60), ("0.06 m", 60),
     ("2.5 in", 63.5), ('2.5"', 63.5), ("6e1 mm", 60), (" 60 mm ", 60), ("60000 um", 60),
     ("+60", 60), ('2 1/2"', 63.5), ("2-1/2 in", 63.5), ("3/4 in", 19.05), ("1 1/8 in", 28.575),
     ("1/2", 0.5)],
)  # fmt: skip
def test_lengths(written, length):
    assert length_mm(written) == pytest.approx(length, abs=1e-9)


@pytest.mark.parametrize("text", ["1/0 in", "1/2/3 in", "a 1/2 in", "1 /2 in x"])
def test_what_is_no_fraction_is_refused(text):
    with pytest.raises(PydanticCustomError):
        length_mm(text)


@pytest.mark.parametrize("written", ["10", "10 deg", "10 degrees", "0.174532925199 rad", "10°"])
def test_angles(written):
    assert spec(CUBE + f"symbols: {{draft: {written}}}\n").style.draft_rad == pytest.approx(
        math.pi / 18, abs=1e-11
    )


@pytest.mark.parametrize("written", ["[80, 8 cm, 120 mm]", "80 x 80 x 120 mm", "80x80x120",
                                     "8 cm by 80 mm by 12 cm", "8×8×12 cm"])  # fmt: skip
def test_boxes(written):
    assert spec(f"name: C\nshape: {{box: {written}}}\n").shape.parameters == {"size": [80, 80, 120]}


def test_coordinates_have_signs_and_units():
    made = spec(
        "name: C\nshape:\n  polyhedron:\n"
        "    vertices: [[0, 0, 0], [9, 0, 0], [0, -1 cm, 0], [0, 0, 9 mm]]\n"
        "    faces: [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]\n"
    )
    assert made.shape.parameters["vertices"][2:] == [[0, -10, 0], [0, 0, 9]]


def test_files_are_relative_to_the_spec_and_count_by_content_and_scale():
    Path("parts").mkdir()
    Path("parts/a.stl").write_bytes(b"one")
    Path("parts/b.stl").write_bytes(b"one")

    def model(name, scale=""):
        text = f"name: {name}\nshape: {{file: {name}.stl{scale}}}\n"
        return specs(text, f"parts/{name}.yaml")[0]

    a, b, inches = model("a"), model("b", ", scale: 1"), model("a", ", scale: 25.4")
    assert a.shape.file == Path("parts/a.stl")
    assert a.meaning == b.meaning
    assert inches.meaning["shape"] == {**a.meaning["shape"], "scale": 25.4}
    Path("parts/b.stl").write_bytes(b"two")
    assert model("b").meaning != a.meaning


@pytest.mark.parametrize(
    "same",
    [
        "# a comment\nshape: {cube: 6 cm}\nname: Cube\n",
        CUBE + "profile: auto\nsymbols: {pitch: 5, draft: 5 deg}\nprint: {wall: 0.3 cm}\n",
        CUBE + "symbols:\nprint:\ncopies: 1\nlayout:\n",
        CUBE + "output: {folder: elsewhere, formats: [glb], database: other.db}\n",
        CUBE + "sensor_type: gel-24x32\nprofile: tactel-8\n",
        "name: Another\nshape: {cube: 60}\n",
        CUBE + f"encoding: {LETTERS}\nsymbols: {{pitch: 5, alphabet: tactel-8}}\n",
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
        CUBE + "sensor_type: gel-24x32\n",
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


def test_set_shares_its_defaults():
    Path("ball.yaml").write_text(
        "name: Ball\nshape: {dodecahedron: 4 cm}\nsymbols: {height: 0.8 mm}\n"
    )
    made = specs(
        "profile: large\nsymbols: {pitch: 8 mm, height: 1.2 mm}\nprint: {wall: 4 mm}\n"
        "output: {formats: stl, database: lab2.db}\n"
        "objects:\n"
        "  - {name: A, shape: {cube: 60}, copies: 2}\n"
        "  - {name: B, shape: {cube: 70}, symbols: {pitch: 9 mm}, print: {parts: whole}}\n"
        "  - ball.yaml\n"
    )
    by_name = {one.name: one for one in made}
    styles = {name: (s.style.pitch_mm, s.style.height_mm) for name, s in by_name.items()}
    assert styles == {"A-1": (8, 1.2), "A-2": (8, 1.2), "B": (9, 1.2), "Ball": (8, 0.8)}
    assert {s.wall_mm for s in made} == {4.0}
    assert [s.parts for s in made] == ["panels", "panels", "whole", "panels"]
    assert {(s.profile, s.database, s.formats) for s in made} == {
        ("large", "sqlite:///lab2.db", ("stl",))
    }
    assert place_of(by_name["B"], "symbols.pitch") == "c.yaml:7:51"
    assert place_of(by_name["B"], "symbols.height") == "c.yaml:2:32"
    assert place_of(by_name["Ball"], "symbols.height") == "ball.yaml:3:19"
    assert place_of(by_name["Ball"], "print.wall") == "c.yaml:3:15"


def test_a_set_has_a_name_and_folders_of_their_own():
    one = "{name: Cube A, shape: {cube: 60 mm}}"
    assert spec(f"name: Course\nobjects:\n- {one}\n").origin == "Course"
    assert spec(f"objects:\n- {one}\n").origin == "c"
    for other in ("cube a", "Cube-a", "CUBE  A"):
        with pytest.raises(SpecError, match="only by case, spaces or dashes"):
            specs(f"objects:\n- {one}\n- {one.replace('Cube A', other)}\n")


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
    assert place_of(spec(SEVERAL), path) == place


def test_errors_of_a_stage_get_the_place_of_a_setting():
    source = spec(SEVERAL).source

    def error_at(error, path):
        with pytest.raises(type(error).__mro__[1]) as caught, error_location(source, path):
            raise error
        return caught.value

    found = error_at(ShapeError("not closed", fix="close it", place="face F1"), "shape")
    assert str(found) == (
        "c.yaml:2:1: error: face F1: not closed\n    2 | shape:\n      | ^\n  fix: close it"
    )
    assert error_at(found, "print") is found
    database = DatabaseError("cannot be opened")
    assert error_at(database, "output.database") is database
    several = error_at(LayoutError("two faces:\n  face F1\n  face F2"), "print.wall")
    assert str(several).startswith("c.yaml:4:15: error: two faces:\n  face F1\n  face F2\n")


def test_every_setting_is_described_and_shown_once():
    for block in spec_schema()["$defs"].values():
        assert block["additionalProperties"] is False
        assert block["description"]
        for name, setting in block["properties"].items():
            assert "$ref" in setting or setting["description"], name
            assert {"$ref", "type", "anyOf", "enum", "const"} & set(setting), name
    text = (FIXTURES / "specs/full.yaml").read_text()
    blocks = (ObjectSettings, Symbols, Print, Robot, Output)
    missing = {name for block in blocks for name in block.model_fields if f"{name}:" not in text}
    assert missing == set()


@pytest.mark.parametrize("shape", [shape for shape in KINDS if shape != "file"])
def test_starters_can_be_made_as_they_are(shape):
    assert spec(starter(shape)).shape.kind == shape


def test_starter_shows_the_values_that_hold_without_it():
    text = re.sub(r"(?m)^# ( *[a-z_]+:)", r"\1", starter("cube"))
    (smallest,) = read_specs([FIXTURES / "cube.yaml"])
    assert spec(text) == smallest
    assert set(ObjectSettings.model_fields) - {"encoding"} <= set(re.findall(r"([a-z_]+):", text))


def test_words_of_people():
    assert starter_named("Parallelepiped")[0] == "box"
    assert starter_named("triangular-prism")[0] == "triangular_prism"
    assert format_option("STEP, .stl,step") == ("step", "stl")
    with pytest.raises(SpecError, match="no format is named"):
        format_option(" , ")
    with pytest.raises(SpecError, match="--database: error: 'postgresql:/name' is half an address"):
        database_option("postgresql:/name")


@pytest.mark.parametrize(
    "block", ["print: {printer: {file: own.yaml}}", "symbols: {alphabet: {file: own.yaml}}"]
)
def test_a_file_of_settings_that_names_itself_is_refused(block, tmp_path):
    (tmp_path / "own.yaml").write_text("file: own.yaml\n")
    (tmp_path / "c.yaml").write_text(f"name: C\nshape: {{cube: 40 mm}}\n{block}\n")
    with pytest.raises(SpecError) as refused:
        read_specs([tmp_path / "c.yaml"])
    assert "own.yaml:1:7: error: this file names another one" in str(refused.value)
