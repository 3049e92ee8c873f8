"""`encode-object SPEC --printed-check`: table, JSON, picture, and what is wrong with the call.

The slicer is left out: what it would have led to is given. The real one runs in
tests/loop/test_printed_panel.py.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from generator.command import run
from generator.pipeline import printed_check
from generator.printed import slicer
from generator.printed.check import PrintedCheck
from generator.printed.survey import SymbolCheck, SymbolTile


def tile(face, label, overlap, height, verdict):
    check = SymbolCheck("Cube-F1", face, f"r0c{label}", label, overlap, 0.5, 13.5, 0.4, 0.2,
                        height, 1.0, (0.0, 0.0), verdict)  # fmt: skip
    designed = np.zeros((41, 41))
    designed[10:30, 15:25] = 1.0
    return SymbolTile(check, designed, designed * height)


TILES = (
    tile("F1", 0, 0.99, 1.0, "survives"),
    tile("F1", 0, 0.95, 1.0, "survives"),
    tile("F2", 3, 0.62, 1.2, "doubtful"),
    tile("F2", 3, 0.2, 1.2, "lost"),
)


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """What was asked of the simulated print; it answers with `TILES`."""
    monkeypatch.chdir(tmp_path)
    Path("c.yaml").write_text("name: Cube\nshape: {cube: 30 mm}\n")
    calls = []

    def check_parts(parts, profile, **options):
        calls.append((len(parts), profile.name, options["faults"].flow))
        return PrintedCheck(profile.name, TILES, ("F6 of Cube",), ())

    monkeypatch.setattr(printed_check, "find_slicer", lambda: "prusa-slicer")
    monkeypatch.setattr(printed_check, "check_parts", check_parts)
    return calls


def test_a_table_of_symbols_and_a_picture_and_nothing_registered(asked, capsys):
    assert run(["c.yaml", "--printed-check", "-o", "seen"]) == 0
    out, err = capsys.readouterr()
    assert asked == [(6, "fdm-0.4-0.2", 1.0)]
    assert "Cube on fdm-0.4-0.2" in out
    rows = {" ".join(line.split()) for line in out.splitlines()}
    assert "F1 0 2 0.970 0.950 0.40 0.20 1.00 of 1.00 2" in rows
    assert "F2 A^2 2 0.410 0.200 0.40 0.20 1.20 of 1.00 1 1" in rows
    assert "2 of 4 symbols survive, 1 doubtful, 1 lost" in out
    assert "warning: symbols print 1.20 mm high, 1 mm was designed" in err
    assert "F6 of Cube" in err
    with Image.open("seen/Cube-printed.png") as picture:
        assert picture.size[0] > 800
    files = sorted(str(path) for path in Path().rglob("*.*"))
    assert files == ["c.yaml", "seen/Cube-printed.png"]


def test_json(asked, capsys):
    options = ["--print-profile", "fdm-0.6-0.3", "--print-faults", "bad", "-o", "seen", "--json"]
    assert run(["c.yaml", "--printed-check", *options]) == 0
    assert asked == [(6, "fdm-0.6-0.3", 1.06)]
    (one,) = json.loads(capsys.readouterr().out)["objects"]
    assert one["print_profile"] == "fdm-0.6-0.3"
    assert one["unseen_faces"] == ["F6 of Cube"]
    assert Path(one["picture"]).name == "Cube-printed.png"
    first, second = one["kinds"]
    assert (first["face"], first["symbol"], first["count"], first["survives"]) == ("F1", "0", 2, 2)
    assert second["worst_overlap"] == 0.2
    assert (second["survives"], second["doubtful"], second["lost"]) == (0, 1, 1)


@pytest.mark.usefixtures("asked")
def test_without_a_slicer_one_clear_line_and_exit_code_2(capsys, monkeypatch):
    monkeypatch.setattr(printed_check, "find_slicer", slicer.find_slicer)
    monkeypatch.setattr(slicer.shutil, "which", lambda _name: None)
    assert run(["c.yaml", "--printed-check"]) == 2
    assert capsys.readouterr().err == (
        "error: PrusaSlicer is not installed\n"
        "  fix: install it (Debian, Ubuntu: apt-get install prusa-slicer)\n"
    )
