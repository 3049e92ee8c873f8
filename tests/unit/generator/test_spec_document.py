"""Files that are no specs: every message by its text, with place, line, caret and fix."""

import os

import pytest

from encoded_objects.base.yaml_tree import read_tree
from generator.spec import SpecError, read_specs
from generator.spec.problem import SPEC

ODD = {
    "control character": ("name: Cu\x07be\n", """\
c.yaml:1:9: error: control character U+0007 in the text
    1 | name: Cu\N{REPLACEMENT CHARACTER}be
      |         ^
  fix: delete it"""),
    "yaml version": ("%YAML 9.9\n---\nname: x\n", """\
c.yaml:1:1: error: not YAML: found incompatible YAML document (version 1.* is required)
    1 | %YAML 9.9
      | ^
  fix: compare with: encode-object init cube"""),
    "second document": ("name: Cube\nshape: {cube: 60}\n---\nname: Ball\n", """\
c.yaml:3:1: error: a second document starts here
    3 | ---
      | ^
  fix: list several objects under objects:, in one document"""),
    "latin-1": ("name: Würfel\n".encode("latin-1"), """\
c.yaml:1:8: error: byte 0xfc is not UTF-8 text
    1 | name: W\N{REPLACEMENT CHARACTER}rfel
      |        ^
  fix: save the file as UTF-8"""),
    "size": (b"#" * 262_145, """\
c.yaml: error: the file is larger than 256 KiB
  fix: give a large polyhedron as a file, for example shape: {file: part.stl}"""),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def refusal(text, name="c.yaml"):
    """Return what is printed for a file with this content."""
    data = text if isinstance(text, bytes) else text.encode()
    with open(name, "wb") as file:
        file.write(data)
    with pytest.raises(SpecError) as caught:
        read_specs([name])
    return str(caught.value)


@pytest.mark.parametrize("case", ODD)
def test_message(case):
    text, message = ODD[case]
    assert refusal(text) == message


def test_missing_file_names_similar_ones():
    open("cube.yaml", "w").close()
    with pytest.raises(SpecError) as caught:
        read_specs(["cube.yml"])
    assert str(caught.value) == (
        "cube.yml: error: there is no such file\n  fix: did you mean 'cube.yaml'?"
    )


def test_deep_nesting_is_refused_at_its_place():
    text = refusal("name: " + "[" * 100_000)
    assert text.startswith("c.yaml:1:22: error: more than 16 levels of nesting\n")
    assert text.endswith("  fix: flatten the file")


@pytest.mark.parametrize(
    ("path", "cause", "fix"),
    [
        (".", "this is a folder, not a spec", "name the files in it, for example *.yaml"),
        ("no/x.yaml", "there is no such file", "check the folder 'no'"),
        ("x.yaml", "there is no such file",
         "write a first one with: encode-object init cube -o cube.yaml"),
        ("a\0b", "cannot read: embedded null byte", "check the name and the rights of the file"),
    ],
)  # fmt: skip
def test_unreadable_file(path, cause, fix):
    with pytest.raises(SpecError) as caught:
        read_specs([path])
    shown = path.replace("\0", "\N{REPLACEMENT CHARACTER}")
    assert str(caught.value) == f"{shown}: error: {cause}\n  fix: {fix}"


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no endless file here")
def test_endless_file_is_refused_after_a_part_of_it():
    with pytest.raises(SpecError, match="larger than 256 KiB"):
        read_specs(["/dev/zero"])


def test_all_problems_of_all_files_at_once():
    for name, text in (("a.yaml", "name: [\n"), ("b.yaml", "nam: B\nshape: {cube: 6 mn}\n")):
        with open(name, "w") as file:
            file.write(text)
    with pytest.raises(SpecError) as caught:
        read_specs(["a.yaml", "gone.yaml", "b.yaml"])
    places = [problem.place for problem in caught.value.problems]
    assert places == ["a.yaml:2:1", "gone.yaml", "b.yaml:1:1", "b.yaml:2:15"]


def test_many_problems_are_cut_short():
    text = refusal("name: C\nshape: {cube: 60}\n" + "".join(f"x{k}: 1\n" for k in range(500)))
    assert text.count(": error:") == 26
    assert text.endswith("c.yaml: error: and 475 more problems\n  fix: correct these first")


def test_long_lines_are_shown_around_the_caret():
    text = refusal("shape: {cube: 60}\nname: C\nlayout: " + "n" * 300 + "\n")
    shown, caret = text.splitlines()[1:3]
    assert len(shown) <= 108
    assert shown[caret.index("^")] == "n"
    far = refusal("{shape: {cube: 60}, name: C, print: {" + " " * 300 + "wal: 3 mm}}\n")
    shown, caret = far.splitlines()[1:3]
    assert len(shown) <= 108
    assert shown[caret.index("^") :].startswith("wal: 3 mm")


def test_caret_stands_under_wide_characters():
    shown, caret = refusal('shape: {cube: 60}\nname: "立方" \nlayout: x\n').splitlines()[1:3]
    assert shown == "    3 | layout: x"
    shown, caret = refusal("{name: 立方, layout: x, shape: {cube: 60}}\n").splitlines()[1:3]
    assert len(caret) - 1 == shown.index("x,") + 2  # each of the two takes two terminal cells


def test_terminal_escapes_do_not_reach_the_terminal():
    assert "\x1b" not in refusal('name: "\\e[31mCube"\nshape: {cube: 60}\n')


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: 12", 12),
        ("a: -3", -3),
        ("a: 0x1099", 0x1099),
        ("a: 1.5", 1.5),
        ("a: .5e3", 500.0),
        ("a: 007", 7),
        ("a: true", True),
        ("a: ~", None),
        ("a:", None),
        ("a: yes", "yes"),
        ("a: 1:30", "1:30"),
        ("a: 2026-01-01", "2026-01-01"),
        ("a: '12'", "12"),
        ("a: <<", "<<"),
        ("a: [1, [2]]", [1, [2]]),
    ],
)
def test_values_follow_yaml_1_2(text, value):
    with open("c.yaml", "w") as file:
        file.write(text)
    from pathlib import Path

    assert read_tree(Path("c.yaml"), SPEC).value == {"a": value}


def test_marks_of_keys_and_values():
    with open("c.yaml", "wb") as file:
        file.write(b"\xef\xbb\xbfa: 1\r\nb:\r\n  - {c: 2}\r\n")
    from pathlib import Path

    tree = read_tree(Path("c.yaml"), SPEC)
    assert tree.value == {"a": 1, "b": [{"c": 2}]}
    assert str(tree.value_mark(("b", 0, "c"))) == "c.yaml:3:9"
    assert str(tree.key_mark(("b", 0, "c"))) == "c.yaml:3:6"
    assert str(tree.value_mark(("b", 0, "nothing"))) == "c.yaml:3:5"
    assert tree.value_mark(("a",)).source.lines == ("a: 1", "b:", "  - {c: 2}", "")
