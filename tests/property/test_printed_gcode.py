"""Whatever stands in a file, the reader of G-code gives moves or says what is wrong, and where."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator.errors import PrintError
from generator.printed.deposit import beads_of
from generator.printed.gcode import Toolpath, toolpath_of

numbers = st.one_of(
    st.floats(-1e4, 1e4).map(lambda v: f"{v:.5f}"),
    st.sampled_from(["0", ".5", "-.25", "1e9", "", "x", "nan", "--1", "5.", "9999999999"]),
)
words = st.builds(lambda a, b: a + b, st.sampled_from("XYZEFIJRPSxyze"), numbers)
COMMANDS = "G0 G1 g1 G2 G3 G20 G21 G28 G90 G91 G92 M82 M83 M200 M117 N5 N T0 G1X5E1 (a"
commands = st.sampled_from(COMMANDS.split(" "))
comments = st.sampled_from(
    ["", ";TYPE:Perimeter", "; FEATURE: Support", ";WIDTH:0.4", ";WIDTH:", ";HEIGHT:-1", "; (",
     "; filament_diameter = 0", ";FLAVOR:Marlin(Volumetric)", "*57"]
)  # fmt: skip
lines = st.builds(
    lambda command, given, comment: " ".join([command, *given]) + comment,
    commands, st.lists(words, max_size=5), comments,
)  # fmt: skip


def attempt(text: str) -> Toolpath | PrintError:
    try:
        return toolpath_of(text, "part.gcode")
    except PrintError as error:
        return error


@given(st.lists(st.one_of(lines, st.text(max_size=20)), max_size=30))
def test_moves_or_a_clear_error(text: list[str]) -> None:
    path = attempt("\n".join(text))
    if isinstance(path, PrintError):
        assert path.fix
        assert path.place.startswith("part.gcode")
        return
    assert np.isfinite(path.start_mm).all()
    assert (path.volume_mm3 >= 0).all()
    assert (path.height_mm[path.of_part] > 0).all()
    beads = beads_of(path)
    assert np.isfinite(beads.width_mm).all()
    assert (beads.height_mm <= beads.width_mm + 1e-9).all()


@given(st.binary(max_size=200))
def test_bytes_of_any_kind(content: bytes) -> None:
    path = attempt(content.decode("utf-8", errors="replace"))
    assert not isinstance(path, PrintError) or path.fix
