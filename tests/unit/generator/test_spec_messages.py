"""Specs that are wrong: each sort of message with its place and its way out.

The file of messages holds specs with what is said of a line behind it, as a comment: column, cause
and way out. What `tests/corpora` holds is left out.
"""

from pathlib import Path

import pytest

from generator.spec import SpecError, read_specs

SPECS = Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").split("\n\n")
CUBE = "name: Cube\nshape: {cube: 60 mm}\n"


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


@pytest.mark.parametrize("text", SPECS, ids=lambda text: text.partition("\n# ")[2][:60])
def test_messages(text):
    wanted, line = [], 0
    for number, written in enumerate(text.splitlines(), 1):
        if not written.startswith("# "):
            line = number
            continue
        place, _, said = written[2:].partition(": ")
        wanted.append(f"c.yaml:{line}:{place}: {said}" if place.isdigit() else written[2:])
    found = [f"{one.place}: {one.cause} -> {one.fix}" for one in refusal(text=text).problems]
    assert sorted(found) == sorted(wanted)


@pytest.mark.parametrize(
    ("text", "place", "cause", "fix"),
    [
        ("name: Cu\x07be\n", ":1:9", "control character U+0007 in the text", "delete it"),
        ("%YAML 9.9\n---\nname: x\n", ":1:1",
         "not YAML: found incompatible YAML document (version 1.* is required)",
         "compare with: encode-object init cube"),
        ("name: Würfel\n".encode("latin-1"), ":1:8", "byte 0xfc is not UTF-8 text",
         "save the file as UTF-8"),
        (b"#" * 262_145, "", "the file is larger than 256 KiB",
         "give a large polyhedron as a file, for example shape: {file: part.stl}"),
    ],
    ids=["control character", "yaml version", "latin-1", "size"],
)  # fmt: skip
def test_a_file_that_is_no_text_of_ours(text, place, cause, fix):
    said = str(refusal(text=text))
    assert said.startswith(f"c.yaml{place}: error: {cause}\n")
    assert said.endswith(f"\n  fix: {fix}")
    assert said.replace("\n", "").isprintable()
    if place in (":1:9", ":1:8"):
        assert "\N{REPLACEMENT CHARACTER}" in said


@pytest.mark.parametrize(
    ("path", "cause", "fix"),
    [
        (".", "this is a folder, not a spec", "name the files in it, for example *.yaml"),
        ("no/x.yaml", "there is no such file", "check the folder 'no'"),
        ("part.stk", "there is no such file", "did you mean 'part.stl'?"),
        ("part.stl", "this is a model, not a spec",
         "encode-object init 'part.stl' -o 'part.yaml' writes one"),
        ("parts.stl", "there is no such file", "did you mean 'part.stl'?"),
        ("a\0b", "cannot read: embedded null byte", "check the name and the rights of the file"),
        ("/dev/zero", "cannot read: it is a device, not a file",
         "check the name and the rights of the file"),
    ],
)  # fmt: skip
def test_unreadable_file(path, cause, fix):
    shown = path.replace("\0", "\N{REPLACEMENT CHARACTER}")
    assert str(refusal(path)) == f"{shown}: error: {cause}\n  fix: {fix}"


def test_what_is_too_much_is_refused_at_its_place():
    text = str(refusal(text="name: " + "[" * 100_000))
    assert text.startswith("c.yaml:1:22: error: more than 16 levels of nesting\n")
    entries = "".join(f"- {{name: A{k}, shape: {{cube: 60}}, copies: 1000}}\n" for k in range(11))
    text = str(refusal(text="objects:\n" + entries))
    assert text.startswith("c.yaml:12:42: error: more than 10000 objects in one run\n")
    text = str(refusal(text=CUBE + "".join(f"x{k}: 1\n" for k in range(500))))
    assert text.count(": error:") == 26
    assert text.endswith("c.yaml: error: and 475 more problems\n  fix: correct these first")


def test_all_problems_of_all_files_at_once():
    Path("a.yaml").write_text("name: [\n")
    Path("b.yaml").write_text("nam: B\nshape: {cube: 6 mn}\n")
    found = refusal("a.yaml", "gone.yaml", "b.yaml").problems
    assert [one.place for one in found] == ["a.yaml:2:1", "gone.yaml", "b.yaml:1:1", "b.yaml:2:15"]


@pytest.mark.parametrize(
    ("text", "start"),
    [
        (f"{CUBE}layout: {'n' * 300}\n", "n"),
        (f"{{shape: {{cube: 60}}, name: C, print: {{{' ' * 300}wal: 3 mm}}}}\n", "wal: 3 mm"),
    ],
)
def test_long_lines_are_shown_around_the_caret(text, start):
    shown, caret = str(refusal(text=text)).splitlines()[1:3]
    assert len(shown) <= 108
    assert shown[caret.index("^") :].startswith(start)


def test_caret_stands_under_wide_characters_and_no_escapes_reach_the_terminal():
    assert "\x1b" not in str(refusal(text='name: "\\e[31mCube"\nshape: {cube: 60}\n'))
    text = "{name: 立方, layout: x, shape: {cube: 60}}\n"
    shown, caret = str(refusal(text=text)).splitlines()[1:3]
    assert len(caret) - 1 == shown.index("x,") + 2  # each of the two takes two terminal cells


def test_several_databases_are_fine_when_one_is_given():
    for name in "ab":
        Path(f"{name}.yaml").write_text(
            f"name: {name}\nshape: {{cube: 60}}\noutput: {{database: {name}.db}}\n"
        )
    assert "another database" in str(refusal("a.yaml", "b.yaml"))
    assert len(read_specs(["a.yaml", "b.yaml"], database="sqlite:///lab.db")) == 2
