"""Specs that are wrong: each sort of message with its place and its way out.

The file of messages holds specs with the problems that are found in them, as lines that begin
with `>`; `...` stands for the lines of a plain cube. What `tests/corpora` holds is left out.
"""

from pathlib import Path

import pytest

from generator.spec import SpecError, read_specs

MESSAGES = Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").split("\n\n")
CUBE = "name: Cube\nshape: {cube: 60 mm}\n"

# refused by the array or the printer: the place, and what their messages start with
REFUSED_LATER = {
    "window": (
        CUBE + "encoding: {family: prba, degree: 12, polynomial: 0x1099, window: 4x4}\n",
        "3:66",
        "a 4x4 window of 0x1099",
    ),
    "polynomial": (
        CUBE + "encoding: {family: prba, degree: 12, polynomial: x^12+y}\n",
        "3:50",
        "'x^12+y'",
    ),
    "order": (CUBE + "encoding: {family: prmva, order: 6, degree: 3}\n", "3:34", "no field has 6"),
    "height": (CUBE + "symbols:\n  height: 0.2 mm\n", "4:11", "height 0.2 mm"),
    "chamfer": (CUBE + "symbols: {chamfer: 0.6 mm, alphabet: dense-4}\n", "3:20", ""),
    "printer": (CUBE + "symbols: {pitch: 4.5 mm, stroke: 0.99 mm}\n", "3:34", ""),
    "shared pitch": (
        "symbols: {pitch: 3}\nobjects: [{name: A, shape: {cube: 9}}, {name: B, shape: {cube: 8}}]",
        "1:18",
        "stroke 0.6 mm",
    ),
}


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.stl").write_text("solid")


def refusal(*paths, text=None, database=None):
    """Return the error of reading these files; of `text` in c.yaml where it is given."""
    if text is not None:
        Path("c.yaml").write_bytes(text if isinstance(text, bytes) else text.encode())
        paths = ("c.yaml",)
    with pytest.raises(SpecError) as caught:
        read_specs(paths, database=database)
    return caught.value


@pytest.mark.parametrize("written", MESSAGES, ids=lambda text: text.partition("\n> ")[2][:60])
def test_message(written):
    spec, mark, message = written.strip("\n").partition("\n> ")
    spec = f"{spec}\n".replace("...\n", CUBE)
    found = refusal(text=spec).problems
    said = "\n".join(
        f"> {problem.place}: {problem.cause}\n> fix: {problem.fix}" for problem in found
    )
    assert said == mark.lstrip() + message


@pytest.mark.parametrize("case", REFUSED_LATER)
def test_later_stages_point_at_the_setting(case):
    text, place, cause = REFUSED_LATER[case]
    (problem,) = refusal(text=text).problems
    assert problem.place == f"c.yaml:{place}"
    assert problem.cause.startswith(cause)
    assert problem.fix


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: Cu\x07be\n", """\
c.yaml:1:9: error: control character U+0007 in the text
    1 | name: Cu\N{REPLACEMENT CHARACTER}be
      |         ^
  fix: delete it"""),
        ("%YAML 9.9\n---\nname: x\n", """\
c.yaml:1:1: error: not YAML: found incompatible YAML document (version 1.* is required)
    1 | %YAML 9.9
      | ^
  fix: compare with: encode-object init cube"""),
        ("name: Würfel\n".encode("latin-1"), """\
c.yaml:1:8: error: byte 0xfc is not UTF-8 text
    1 | name: W\N{REPLACEMENT CHARACTER}rfel
      |        ^
  fix: save the file as UTF-8"""),
        (b"#" * 262_145, """\
c.yaml: error: the file is larger than 256 KiB
  fix: give a large polyhedron as a file, for example shape: {file: part.stl}"""),
    ],
    ids=["control character", "yaml version", "latin-1", "size"],
)  # fmt: skip
def test_a_file_that_is_no_text_of_ours(text, message):
    assert str(refusal(text=text)) == message


@pytest.mark.parametrize(
    ("path", "cause", "fix"),
    [
        (".", "this is a folder, not a spec", "name the files in it, for example *.yaml"),
        ("no/x.yaml", "there is no such file", "check the folder 'no'"),
        ("a\0b", "cannot read: embedded null byte", "check the name and the rights of the file"),
        ("/dev/zero", "cannot read: it is a device, not a file",
         "check the name and the rights of the file"),
    ],
)  # fmt: skip
def test_unreadable_file(path, cause, fix):
    shown = path.replace("\0", "\N{REPLACEMENT CHARACTER}")
    assert str(refusal(path)) == f"{shown}: error: {cause}\n  fix: {fix}"


def test_missing_file_names_similar_ones():
    Path("cube.yaml").touch()
    assert "did you mean 'cube.yaml'?" in str(refusal("cube.yml"))


def test_deep_nesting_is_refused_at_its_place():
    text = str(refusal(text="name: " + "[" * 100_000))
    assert text.startswith("c.yaml:1:22: error: more than 16 levels of nesting\n")


def test_too_many_objects_are_refused_before_they_are_made():
    entries = "".join(f"- {{name: A{k}, shape: {{cube: 60}}, copies: 1000}}\n" for k in range(11))
    (problem,) = refusal(text="objects:\n" + entries).problems
    assert problem.place == "c.yaml:12:42"
    assert problem.cause == "more than 10000 objects in one run"


def test_all_problems_of_all_files_at_once():
    Path("a.yaml").write_text("name: [\n")
    Path("b.yaml").write_text("nam: B\nshape: {cube: 6 mn}\n")
    found = refusal("a.yaml", "gone.yaml", "b.yaml").problems
    assert [one.place for one in found] == ["a.yaml:2:1", "gone.yaml", "b.yaml:1:1", "b.yaml:2:15"]


def test_many_problems_are_cut_short():
    text = str(refusal(text=CUBE + "".join(f"x{k}: 1\n" for k in range(500))))
    assert text.count(": error:") == 26
    assert text.endswith("c.yaml: error: and 475 more problems\n  fix: correct these first")


def test_a_misread_shape_hides_no_problem_of_other_blocks():
    found = refusal(text="name: A\nshape: {sphere: 3}\nprint: {wall: 0.1 mm, gap: 9 mm}\n").problems
    assert [one.place for one in found] == ["c.yaml:2:9", "c.yaml:3:15", "c.yaml:3:28"]
    found = refusal(
        text="name: A\nshape: {sphere: 3}\nsymbols: {pitch: x}\nprint: {gap: 9 mm}\n"
    ).problems
    assert len(found) == 2  # nothing is concluded from a default pitch


@pytest.mark.parametrize(
    ("line", "start"),
    [
        ("layout: " + "n" * 300, "n"),
        ("{shape: {cube: 60}, name: C, print: {" + " " * 300 + "wal: 3 mm}}", "wal: 3 mm"),
    ],
)
def test_long_lines_are_shown_around_the_caret(line, start):
    before = "shape: {cube: 60}\nname: C\n" if line[0] != "{" else ""
    shown, caret = str(refusal(text=before + line + "\n")).splitlines()[1:3]
    assert len(shown) <= 108
    assert shown[caret.index("^") :].startswith(start)


def test_caret_stands_under_wide_characters():
    text = "{name: 立方, layout: x, shape: {cube: 60}}\n"
    shown, caret = str(refusal(text=text)).splitlines()[1:3]
    assert len(caret) - 1 == shown.index("x,") + 2  # each of the two takes two terminal cells


def test_terminal_escapes_do_not_reach_the_terminal():
    assert "\x1b" not in str(refusal(text='name: "\\e[31mCube"\nshape: {cube: 60}\n'))


def test_several_databases_are_fine_when_one_is_given():
    for name in "ab":
        Path(f"{name}.yaml").write_text(
            f"name: {name}\nshape: {{cube: 60}}\noutput: {{database: {name}.db}}\n"
        )
    assert "another database" in str(refusal("a.yaml", "b.yaml"))
    assert len(read_specs(["a.yaml", "b.yaml"], database="sqlite:///lab.db")) == 2
