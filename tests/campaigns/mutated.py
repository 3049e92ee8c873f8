"""Feed mutated specs and truncated model files to the whole command.

    python tests/campaigns/mutated.py --examples 500

Half of the examples are specs of `fixtures/` with bytes replaced, removed or spliced in, the
other half sound specs of a STEP, STL or OBJ file that was cut off or had bytes changed. Every
run must end with exit code 0 (the mutation did no harm) or 2; with 2 the message must name
the place and the way out and no file may be left. No traceback, ever. Exit code 1 otherwise.
"""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from collections import Counter
from pathlib import Path

import runner
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from generator.command import run

FIXTURES = Path(__file__).parents[2] / "fixtures"
SPECS = [path.read_bytes() for path in sorted(FIXTURES.glob("**/*.yaml"))]
MODELS = sorted(p for p in (FIXTURES / "shapes").iterdir() if p.suffix in (".step", ".stl", ".obj"))
SPLICES = [
    *b"{ } [ ] : ' &a !!int 1e999 -1 0 ~ .nan <<:".split(),
    *(b'"', b"- ", b"\t", b"\n", b"---\n", b"\xff", b"\x00", b" mm"),
]

edit = st.tuples(st.floats(0, 1), st.sampled_from([0, 0, 1, 3, 40]), st.sampled_from(SPLICES))
mutated_spec = st.tuples(st.sampled_from(SPECS), st.lists(edit, min_size=1, max_size=4))
mutated_model = st.tuples(
    st.sampled_from(MODELS),
    st.floats(0, 1) | st.just(1.0),
    st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=4)), max_size=3),
)


def changed(data: bytes, edits: list[tuple[float, int, bytes]]) -> bytes:
    text = bytearray(data)
    for where, removed, added in edits:
        at = int(where * len(text))
        text[at : at + removed] = added
    return bytes(text)


def check(files: dict[str, bytes], seen: Counter[str]) -> None:
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for name, data in files.items():
                Path(name).write_bytes(data)
            messages = io.StringIO()
            with contextlib.redirect_stderr(messages), contextlib.redirect_stdout(io.StringIO()):
                code = run(["c.yaml", "-o", "out", "--database", "lab.db", "--format", "stl"])
            left = sorted(set(os.listdir()) - set(files))
        finally:
            os.chdir(before)
    seen[f"exit code {code}"] += 1
    said = messages.getvalue()
    assert code in (0, 2), said
    if code == 2:
        assert all(word in said for word in ("error: ", "c.yaml", "fix: ")), said
        assert not left, left


def main() -> None:
    """Try the examples and count exit codes; an assertion ends it."""
    asked = runner.asked(__doc__, examples=500, seed=1)
    half = settings(max_examples=asked.examples // 2, deadline=None, database=None,
                    phases=[Phase.generate], suppress_health_check=list(HealthCheck))  # fmt: skip
    specs, models = Counter[str](), Counter[str]()

    @seed(asked.seed)
    @half
    @given(mutated_spec)
    def try_specs(mutation: tuple[bytes, list[tuple[float, int, bytes]]]) -> None:
        check({"c.yaml": changed(*mutation)}, specs)

    @seed(asked.seed)
    @half
    @given(mutated_model)
    def try_models(mutation: tuple[Path, float, list[tuple[float, bytes]]]) -> None:
        path, share, edits = mutation
        data = path.read_bytes()
        data = changed(data[: int(share * len(data))], [(at, len(b), b) for at, b in edits])
        spec = f"name: C\nshape: {{file: part{path.suffix}}}\nprint: {{parts: whole}}\n"
        check({"c.yaml": spec.encode(), f"part{path.suffix}": data}, models)

    try_specs()
    try_models()
    for what, seen in (("mutated specs", specs), ("damaged model files", models)):
        print(f"{what}: " + ", ".join(f"{n} with {code}" for code, n in sorted(seen.items())))


if __name__ == "__main__":
    main()
