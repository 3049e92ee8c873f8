"""What a spec means: values, defaults, units, sets, places and the hash of the meaning."""

import json
import math
import re
from pathlib import Path

import pytest
from pydantic_core import PydanticCustomError

from encoded_objects.base.settings import length_mm
from encoded_objects.base.yaml_tree import read_tree, tree_of
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
    return read_specs([tree_of(text, name, Path(name).parent, SPEC)])


def spec(text):
    (one,) = specs(text)
    return one


def place_of(one, path):
    return str(mark_of(one.source, path))


def test_values_follow_yaml_1_2():
    text = "[12, -3, 0x1099, 1.5, .5e3, 007, true, ~, yes, 1:30, 2026-01-01, '12', <<, [1, [2]]]"
    values = [12, -3, 0x1099, 1.5, 500.0, 7, True, None, "yes", "1:30", "2026-01-01", "12", "<<"]
    assert tree_of(text, "", Path(), SPEC).value == [*values, [1, [2]]]
    assert tree_of("a:", "", Path(), SPEC).value == {"a": None}


def test_marks_of_keys_and_values():
    Path("c.yaml").write_bytes(b"\xef\xbb\xbfa: 1\r\nb:\r\n  - {c: 2}\r\n")
    tree = read_tree(Path("c.yaml"), SPEC)
    assert tree.value == {"a": 1, "b": [{"c": 2}]}
    assert str(tree.value_mark(("b", 0, "c"))) == "c.yaml:3:9"
    assert str(tree.key_mark(("b", 0, "c"))) == "c.yaml:3:6"
    assert str(tree.value_mark(("b", 0, "nothing"))) == "c.yaml:3:5"
    assert tree.value_mark(("a",)).source.lines == ("a: 1", "b:", "  - {c: 2}", "")


def test_glyphs_of_a_file_are_those_of_the_spec():
    glyphs = "[[[[-1, 1], [-1, -1], [1, -1]]], [[[0, 1], [0, 0], [-1, -1]]]]"
    letters = f"{{name: mine, reach: 0.28, glyphs: {glyphs}}}"
    Path("letters.yaml").write_text(letters)
    two = CUBE + "profile: thesis\nsymbols: {alphabet: "
    written, filed = (spec(f"{two}{one}}}") for one in (letters, "letters.yaml"))
    assert written == filed
    assert written.meaning["alphabet"] == written.alphabet.definition()
    assert written.alphabet.glyphs[1].strokes == (((0, 1), (0, 0)), ((0, 0), (-1, -1)))
    ships = ALPHABETS["thesis-2"].definition()
    again = {**ships, "glyphs": [glyph["strokes"] for glyph in ships["glyphs"]]}
    assert spec(f"{two}{again}}}".replace("'", "")).meaning == spec(f"{two}thesis-2}}").meaning


@pytest.mark.parametrize(
    ("settings", "wanted"),
    [
        # strokes follow the pitch and the alphabet
        ("symbols: {pitch: 10 mm}", {"stroke_mm": 2.0}),
        ("symbols: {pitch: 1 cm, alphabet: letters-4}", {"stroke_mm": 1.4}),
        ("symbols: {pitch: 1 cm, stroke: 1.4}", {"stroke_mm": 1.4}),
        # the draft gives way where strokes need the room
        ("profile: large", {"draft_rad": math.radians(10)}),
        ("profile: large\nsymbols: {height: 1.2 mm}", {"draft_rad": math.radians(7.5)}),
        ("profile: fine", {"draft_rad": math.radians(5)}),
        # auto takes the pitch that reads best of those that print
        ("", {"pitch_mm": 5.0, "draft_rad": math.radians(5)}),
        ("print: {printer: fdm-0.6}", {"pitch_mm": 5.5}),
        ("print: {printer: resin}", {"pitch_mm": 5.0}),
        ("symbols: {alphabet: letters-4}", {"pitch_mm": 6.0}),  # strokes of .14 of it: .8 mm wide
        ("symbols: {draft: 10 deg}", {"pitch_mm": 6.0}),
        ("symbols: {stroke: 1.4 mm}", {"pitch_mm": 6.0}),
        ("symbols: {alphabet: dense-4, stroke: 1.4 mm}", {"pitch_mm": 5.0}),
        ("symbols: {pitch: 6 mm}", {"pitch_mm": 6.0}),
        ("sensor_type: flexitac-16x32", {"pitch_mm": 6.0}),
        ("sensor_type: gel-24x32\nprint: {printer: resin}", {"pitch_mm": 3.0}),
        ("sensor_type: gel-24x32", {"pitch_mm": 4.0}),  # the finest that a nozzle of .4 mm makes
        ("sensor_type: gel-24x32\nsymbols: {pitch: 7 mm}", {"pitch_mm": 7.0}),
    ],
)
def test_what_follows_from_settings_can_be_printed(settings, wanted):
    made = spec(f"{CUBE}{settings}\n")
    assert {name: getattr(made.style, name) for name in wanted} == pytest.approx(wanted)
    check_printable(made.alphabet, made.style, made.printer)


def test_a_sensor_file_stands_beside_the_spec_and_an_option_comes_first():
    Path("specs").mkdir()
    Path("specs/mine.yaml").write_text("name: mine\nrows: 16\ncolumns: 16\npitch: 2.54 mm\n")
    (mine,) = specs(CUBE + "sensor_type: mine.yaml\n", "specs/cube.yaml")
    assert mine.style.pitch_mm == 8.0  # 3.15 of 2.54 mm
    assert mine.sensor.half_mm == pytest.approx((20.32, 20.32))
    (other,) = read_specs([mine.source], sensor_type="fsr-8x8")
    assert other.style.pitch_mm == 7.0


@pytest.mark.parametrize(
    ("length", "written"),
    [(60, ["60", "60.0", "60 mm", "60mm", "6 cm", "0.06 m", "6e1 mm", " 60 mm ", "+60"]),
     (63.5, ["2.5 in", '2.5"', '2 1/2"', "2-1/2 in"]), (19.05, ["3/4 in"]), (0.5, ["1/2"]),
     (28.575, ["1 1/8 in"]), (None, ["1/0 in", "1/2/3 in", "a 1/2 in", "1 /2 in x"])],
)  # fmt: skip
def test_lengths(length, written):
    for text in written:
        if length is None:
            with pytest.raises(PydanticCustomError):
                length_mm(text)
        else:
            assert length_mm(text) == pytest.approx(length, abs=1e-9), text


def test_angles_boxes_and_coordinates():
    for draft in ("10", "10 deg", "10 degrees", "0.174532925199 rad", "10°"):
        style = spec(CUBE + f"symbols: {{draft: {draft}}}\n").style
        assert style.draft_rad == pytest.approx(math.pi / 18, abs=1e-11)
    for box in ("[80, 8 cm, 120 mm]", "80 x 80 x 120 mm", "80x80x120", "8 cm by 80 mm by 12 cm",
                "8×8×12 cm"):  # fmt: skip
        assert spec(f"name: C\nshape: {{box: {box}}}\n").shape.parameters["size"] == [80, 80, 120]
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
    ("text", "same"),
    [
        ("# a comment\nshape: {cube: 6 cm}\nname: Cube\n", True),
        (CUBE + "profile: auto\nsymbols: {pitch: 5, draft: 5 deg}\nprint: {wall: 0.3 cm}\n", True),
        (CUBE + "symbols:\nprint:\ncopies: 1\nlayout:\n", True),
        (CUBE + "output: {folder: elsewhere, formats: [glb], database: other.db}\n", True),
        (CUBE + "sensor_type: gel-24x32\nprofile: tactel-8\n", True),
        ("name: Another\nshape: {cube: 60}\n", True),
        (CUBE + f"encoding: {LETTERS}\nsymbols: {{pitch: 5, alphabet: tactel-8}}\n", True),
        ("name: Cube\nshape: {cube: 61 mm}\n", False),
        ("name: Cube\nshape: {box: [60, 60, 60]}\n", False),
        (CUBE + "profile: large\n", False),
        (CUBE + "sensor_type: gel-24x32\n", False),
        (CUBE + "symbols: {height: 1.2 mm}\n", False),
        (CUBE + "symbols: {alphabet: letters-4, stroke: 1.4}\n", False),
        (CUBE + "layout: net\n", False),
        (CUBE + "print: {parts: whole}\n", False),
        (CUBE + "print: {wall: 4 mm}\n", False),
        (CUBE + "print: {printer: fdm-0.25}\n", False),
    ],
)
def test_the_same_meaning_as_a_cube(text, same):
    assert (spec(text).meaning == spec(CUBE).meaning) == same


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
    Path("c.yaml").write_text(f"objects:\n- {one}\n")
    assert read_specs(["c.yaml"])[0].origin == "c"
    for other in ("cube a", "Cube-a", "CUBE  A"):
        with pytest.raises(SpecError, match="only by case, spaces or dashes"):
            specs(f"objects:\n- {one}\n- {one.replace('Cube A', other)}\n")


SEVERAL = "name: C\nshape:\n  cube: 60 mm\nprint: {wall: 4 mm}\n"


def test_errors_of_a_stage_get_the_place_of_a_setting():
    one = spec(SEVERAL)
    paths = ("shape", "shape.cube", "print.wall", "print.printer", "symbols.pitch",
             "symbols.pitch, profile, shape", "")  # fmt: skip
    places = [place_of(one, path).removeprefix("c.yaml:") for path in paths]
    assert places == ["2:1", "3:9", "4:15", "4:1", "1:1", "2:1", "1:1"]

    def error_at(error, path):
        with pytest.raises(type(error).__mro__[1]) as caught, error_location(one.source, path):
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
    assert not {name for block in blocks for name in block.model_fields if f"{name}:" not in text}


def test_starters_can_be_made_as_they_are_and_show_the_values_that_hold_without_them():
    for shape in set(KINDS) - {"file"}:
        assert spec(starter(shape)).shape.kind == shape
    text = re.sub(r"(?m)^# ( *[a-z_]+:)", r"\1", starter("cube"))
    assert spec(text) == spec(CUBE)
    assert set(ObjectSettings.model_fields) - {"encoding"} <= set(re.findall(r"([a-z_]+):", text))


@pytest.mark.parametrize("name", ["part 2", "No", "12", "a, {b}: #c", "it's"])
def test_a_model_gets_a_spec_that_names_it_from_where_the_spec_is(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    model, own = Path(f"{name}.stl"), Path("specs/own.yaml")
    model.write_bytes((FIXTURES / "shapes/l_bracket.stl").read_bytes())
    own.parent.mkdir()
    kind, text = starter_named(str(model), own)
    own.write_text(text)
    assert kind == "file"
    wanted = read_tree(own, SPEC).value
    assert wanted["shape"] == {"file": f"../{model}"}
    assert wanted["name"] == name


def test_words_of_people():
    assert starter_named("Parallelepiped")[0] == "box"
    assert starter_named("triangular-prism")[0] == "triangular_prism"
    assert format_option("STEP, .stl,step") == ("step", "stl")
    with pytest.raises(SpecError, match="no format is named"):
        format_option(" , ")
    with pytest.raises(SpecError, match="--database: error: 'postgresql:/name' is half an address"):
        database_option("postgresql:/name")


@pytest.mark.parametrize("block", ["print: {printer: ", "symbols: {alphabet: "])
def test_a_file_of_settings_that_names_itself_is_refused(block):
    Path("own.yaml").write_text("file: own.yaml\n")
    with pytest.raises(SpecError, match=r"own\.yaml:1:7: error: this file names another one"):
        spec(f"{CUBE}{block}{{file: own.yaml}}}}\n")
