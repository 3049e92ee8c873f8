"""Settings that are wrong: every kind of message by its text, its place and its way out."""

from pathlib import Path

import pytest

from generator.spec import SpecError, read_specs

MESSAGES = Path(__file__).with_name("test_spec_messages.txt")
BASE = "name: Cube\nshape: {cube: 60 mm}\n"

# refused by the array or the alphabet: the place, and what their messages start with
REFUSED_LATER = {
    "draft": (BASE + "symbols: {draft: 70 deg}\n", "3:18", "draft 70 degrees"),
    "window": (
        BASE + "encoding: {family: prba, degree: 12, polynomial: 0x1099, window: 4x4}\n",
        "3:66",
        "a 4x4 window of 0x1099",
    ),
    "polynomial": (
        BASE + "encoding: {family: prba, degree: 12, polynomial: x^12+y}\n",
        "3:50",
        "'x^12+y'",
    ),
    "order": (BASE + "encoding: {family: prmva, order: 6, degree: 3}\n", "3:34", "no field has 6"),
    "pitch": (BASE + "symbols:\n  pitch: 3 mm\n", "4:10", "stroke 0.6 mm"),
    "stroke": (BASE + "symbols:\n  stroke: 0.5 mm\n", "4:11", "stroke 0.5 mm"),
    "height": (BASE + "symbols:\n  height: 0.2 mm\n", "4:11", "height 0.2 mm"),
    "chamfer": (BASE + "symbols: {chamfer: 0.6 mm}\n", "3:20", ""),
    "printer": (BASE + "symbols: {pitch: 4.5 mm, stroke: 0.99 mm}\n", "3:34", ""),
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


def problems(text):
    with open("c.yaml", "w") as file:
        file.write(text)
    with pytest.raises(SpecError) as caught:
        read_specs(["c.yaml"])
    return caught.value.problems


def written_messages():
    """Return (name, spec, message) of each `==== name`, spec, `----`, message of the file."""
    for block in MESSAGES.read_text(encoding="utf-8").split("==== ")[1:]:
        name, _, rest = block.partition("\n")
        spec, _, message = rest.partition("\n----\n")
        yield pytest.param(spec + "\n", message.rstrip("\n"), id=name)


@pytest.mark.parametrize(("spec", "message"), list(written_messages()))
def test_message(spec, message):
    assert str(SpecError(problems(spec))) == message


@pytest.mark.parametrize("case", REFUSED_LATER)
def test_later_stages_point_at_the_setting(case):
    text, place, cause = REFUSED_LATER[case]
    (problem,) = problems(text)
    assert problem.place == f"c.yaml:{place}"
    assert problem.cause.startswith(cause)
    assert problem.fix


def test_too_many_objects_are_refused_before_they_are_made():
    entries = "".join(f"- {{name: A{k}, shape: {{cube: 60}}, copies: 1000}}\n" for k in range(11))
    (problem,) = problems("objects:\n" + entries)
    assert problem.place == "c.yaml:12:42"
    assert problem.cause == "more than 10000 objects in one run"
