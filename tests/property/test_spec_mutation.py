"""Whatever a file holds, reading it gives a spec or problems with a place, and nothing else."""

import os
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from encoded_objects.base.settings import MILLIMETRES, length_mm
from generator.spec import ObjectSpec, SpecError, read_specs

MUTATIONS = int(os.environ.get("SPEC_MUTATIONS", "300"))
FIXTURES = Path(__file__).parents[2] / "fixtures"
TEXTS = [file.read_bytes() for file in sorted(FIXTURES.glob("**/*.yaml"))]
VALUES = [yaml.safe_load(text) for text in TEXTS]

SPLICES = st.sampled_from(
    [b"{", b"}", b"[", b"]", b":", b"- ", b"\t", b"\n", b"'", b'"', b"#", b"&a", b"*a", b"!!int ",
     b"|", b"? ", b"---\n", b"...\n", b"%YAML 1.2\n", b"\xff", b"\x00", b"\x85", b"1e999", b"-1",
     b"0x", b"~", b".nan", b"objects:", b"<<: ", "µ".encode(), "\u2028".encode(), b"\r", b"{{{{{{"]
)  # fmt: skip
WORDS = st.sampled_from(
    ["cube", "60 mm", "1e400 mm", "-3 in", "12 deg", "prmva", "x^6+x^2+x+A", "0", "null", "file",
     "part.stl", "cube.yaml", "a\0b", "\ud800", "é", "../../etc/passwd", "sqlite://", "", " "]
)  # fmt: skip
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(2**70), 2**70)
    | st.floats(allow_nan=True)
    | st.text(max_size=20)
    | WORDS
)
ANYTHING = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=8,
)  # fmt: skip


@contextmanager
def spec_file(data):
    """Write a spec into a folder that holds nothing else."""
    before = Path.cwd()
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            Path("c.yaml").write_bytes(data)
            yield Path("c.yaml")
        finally:
            os.chdir(before)


def check(data):
    """Read a spec; its problems must have places in the file, causes and ways out."""
    with spec_file(data) as file:
        try:
            found = read_specs([file])
        except SpecError as error:
            lines = data.decode("utf-8", errors="replace").count("\n") + 1 + data.count(b"\r")
            for problem in error.problems:
                assert problem.cause
                assert problem.fix
                assert problem.place.startswith("c.yaml")
                if problem.mark:
                    assert 1 <= problem.mark.line <= lines + 20
                    assert problem.mark.column >= 1
                    assert len(problem.mark.source.lines) >= problem.mark.line - 1
            shown = str(error)
            assert ": error: " in shown
            assert all(c == "\n" or c.isprintable() for c in shown)
            shown.encode("utf-8")
        else:
            assert found
            assert all(isinstance(one, ObjectSpec) for one in found)
            assert all(0 < one.style.pitch_mm < 1e4 for one in found)
        assert sorted(os.listdir()) == ["c.yaml"]


@settings(max_examples=MUTATIONS, deadline=None)
@given(st.sampled_from(TEXTS), st.data())
def test_mutated_bytes(text, data):
    mutated = bytearray(text)
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(mutated)))
        end = min(len(mutated), at + data.draw(st.sampled_from([0, 0, 0, 1, 3, 40])))
        mutated[at:end] = data.draw(SPLICES | st.binary(max_size=4) | st.just(bytes(mutated[:60])))
    check(bytes(mutated))


@settings(deadline=None)
@given(st.sampled_from(TEXTS), st.data())
def test_truncated(text, data):
    check(text[: data.draw(st.integers(0, len(text)))])


def places(value, here=()):
    """Yield the places of everything in nested lists and mappings."""
    yield here
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from places(inner, (*here, key))
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from places(inner, (*here, number))


def mutate(value, place, change):
    """Return a copy in which `change` has taken the place of what was there."""
    if not place:
        return change(value)
    key, *rest = place
    if isinstance(value, dict):
        return {k: mutate(v, rest, change) if k == key else v for k, v in value.items()}
    return [mutate(v, rest, change) if k == key else v for k, v in enumerate(value)]


CHANGES = [
    lambda _old, _name, new: new,
    lambda old, _name, new: [old, new],
    lambda old, name, new: {**old, name: new} if isinstance(old, dict) else {name: old},
    lambda old, _name, _new: old[1:] if isinstance(old, list) else None,
    lambda old, _name, _new: dict(list(old.items())[1:]) if isinstance(old, dict) else old,
    lambda old, _name, _new: f"{old} mm",
]


@settings(max_examples=MUTATIONS, deadline=None)
@given(st.sampled_from(VALUES), st.data())
def test_mutated_structure(value, data):
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.sampled_from(sorted(places(value), key=str)))
        new = data.draw(ANYTHING)
        name = data.draw(
            st.text(max_size=6) | st.sampled_from(["name", "shape", "objects", "pitch"])
        )
        change = data.draw(st.sampled_from(CHANGES))
        value = mutate(value, place, lambda old, c=change, n=name, v=new: c(old, n, v))
    check(yaml.safe_dump(value, sort_keys=False).encode("utf-8", errors="replace"))


@given(
    st.integers(1, 4_000_000),
    st.sampled_from(sorted(MILLIMETRES)),
)
def test_one_length_in_two_units_is_one_number(micrometres, unit):
    """Lengths that people write (to 1 um) come out the same, whatever the unit."""
    written = f"{micrometres / 1000 / MILLIMETRES[unit]:.15g}{unit}"
    assert abs(length_mm(written) - micrometres / 1000) <= 1e-9
    assert length_mm(f"{micrometres / 10000:.12g} cm") == micrometres / 1000


@given(st.permutations(["name: Cube", "shape: {cube: 60 mm}", "symbols: {pitch: 8 mm, height: 1}",
                        "print: {wall: 4, parts: whole}", "layout: net"]),
       st.lists(st.sampled_from(["# a comment", "", "   "]), min_size=5, max_size=5))  # fmt: skip
@example(["name: Cube", "shape: {cube: 6 cm}", "symbols: {height: 1 mm, pitch: 0.8 cm}",
          "print: {parts: whole, wall: 4 mm}", "layout: net"], [""] * 5)  # fmt: skip
def test_hash_is_independent_of_order_comments_and_units(lines, between):
    text = "\n".join(line for pair in zip(between, lines, strict=True) for line in pair) + "\n"
    with spec_file(text.encode()) as file:
        (one,) = read_specs([file])
    assert one.meaning == REFERENCE_MEANING


def _reference_hash():
    text = "name: C\nshape: {cube: 60}\nsymbols: {pitch: 8}\nprint: {wall: 4, parts: whole}\n"
    with spec_file(f"{text}layout: net\n".encode()) as file:
        return read_specs([file])[0].meaning


REFERENCE_MEANING = _reference_hash()
