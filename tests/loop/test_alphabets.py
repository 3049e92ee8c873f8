"""Letters made for tactels, embossed and touched: touches amid faces are read right."""

import numpy as np
import pytest

from encoded_objects import Reader, encode, open_lab, simulate


@pytest.mark.parametrize(("profile", "order", "shape"), [
    ("tactel-8", 8, (189, 1387)), ("tactel-16", 16, (51, 1285)),
])  # fmt: skip
def test_touches_of_a_cube_are_read(tmp_path, profile, order, shape):
    url = str(tmp_path / "lab.db")
    cube = {"name": "Cube", "shape": {"cube": "60 mm"}, "profile": profile}
    encode(cube, database=url, folder=tmp_path / "out", formats=())
    reader = Reader(open_lab(url))
    (array,) = (one.array for one in reader.lab.arrays)
    assert (array.order, array.rows, array.columns) == (order, *shape)
    rng = np.random.default_rng(12)
    for face in ("F1", "F3", "F6"):
        for _ in range(3):
            x, y, theta = *rng.uniform(17, 43, 2), rng.uniform(-180, 180)
            touch = simulate(f"{url}#Cube/{face}", x=x, y=y, theta=theta, force=60)
            answer = reader.read(touch.counts)
            assert (answer.object, answer.face) == ("Cube", face), answer
            assert np.hypot(*(answer.T_face_probe[:2, 3] - (x, y))) < 0.15
            turn = np.degrees(np.arctan2(*answer.T_face_probe[[1, 0], 0])) - theta
            assert abs((turn + 180) % 360 - 180) < 1.0
