"""Letters made for tactels, embossed and touched: touches amid faces are read right."""

import numpy as np
import pytest

from encoded_objects import Reader, Scan, encode, open_lab, simulate
from generator.alphabet import alphabet_named

MIRRORED = [
    [[[-x, y] for x, y in stroke] for stroke in glyph.strokes]
    for glyph in alphabet_named("tactel-8").glyphs
]
OWN = {"alphabet": {"name": "mirrored", "reach": 0.28, "glyphs": MIRRORED}}


@pytest.mark.parametrize(("profile", "symbols", "name"), [
    ("tactel-16", {}, "tactel-16"), ("tactel-8", OWN, "mirrored"),
])  # fmt: skip
def test_touches_of_a_cube_are_read(tmp_path, profile, symbols, name):
    url = str(tmp_path / "lab.db")
    cube = {"name": "Cube", "shape": {"cube": "60 mm"}, "profile": profile, "symbols": symbols}
    encode(cube, database=url, folder=tmp_path / "out", formats=())
    reader = Reader(open_lab(url))
    assert [one.alphabet.name for one in reader.lab.arrays] == [name]
    rng = np.random.default_rng(12)
    for face in ("F1", "F1", "F3", "F3", "F6", "F6"):
        x, y, theta = *rng.uniform(17, 43, 2), rng.uniform(-180, 180)
        touch = simulate(f"{url}#Cube/{face}", x=x, y=y, theta=theta, force=60)
        answer = reader.read(touch.counts)
        assert (answer.object, answer.face) == ("Cube", face), answer
        assert np.hypot(*(answer.T_face_probe[:2, 3] - (x, y))) < 0.15
        turn = np.degrees(np.arctan2(*answer.T_face_probe[[1, 0], 0])) - theta
        assert abs((turn + 180) % 360 - 180) < 1.0
    scan = Scan(reader)
    for x in (9, 15):  # over an edge
        touch = simulate(f"{url}#Cube/F2", x=x, y=31, theta=20, force=60)
        answer = scan.add(touch.counts)
    assert (scan.touches, answer.object, answer.face) == (2, "Cube", "F2")
