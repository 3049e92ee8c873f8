"""From spec to files and database, and back: what is printed is what is registered."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.pipeline import encode
from generator.spec import read_specs

ROOT = Path(__file__).parents[2]
SPECS = ROOT / "fixtures" / "specs"
GOLDEN = json.loads((ROOT / "fixtures" / "golden.json").read_text())


def made(folder: Path, text: str, **options: object):
    spec = folder / "spec.yaml"
    spec.write_text(text)
    url = f"sqlite:///{folder / 'lab.db'}"
    return encode(read_specs([spec]), folder=folder / "out", database=url, **options)


def registered(folder: Path, name: str):
    with read_transaction(
        open_database(f"sqlite:///{folder / 'lab.db'}", writable=False)
    ) as connection:
        return read_object(connection, name)


def thesis_array() -> np.ndarray:
    """Fold appendix 4's recurrence by hand; checked against the golden digest."""
    s = [0] * 11 + [1]
    while len(s) < 4095:
        s.append(s[-5] ^ s[-8] ^ s[-9] ^ s[-12])
    t = np.arange(4095)
    array = np.zeros((63, 65), int)
    array[t % 63, t % 65] = s
    text = "".join(map(str, array.ravel()))
    assert hashlib.sha256(text.encode()).hexdigest() == GOLDEN["prba_63x65"]["sha256_rowmajor"]
    return array


def triangles_of(stl: Path) -> np.ndarray:
    """Read (m, 3, 3) triangles of a binary STL, mm."""
    data = stl.read_bytes()[84:]
    kind = np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    return np.frombuffer(data, kind)["v"].astype(float)


def is_raised(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether the part's highest level lies over points (n, 2)."""
    top = triangles[:, :, 2].max()
    flat = triangles[np.ptp(triangles[:, :, 2], axis=1) < 1e-4]
    flat = flat[np.abs(flat[:, 0, 2] - top) < 1e-4][:, :, :2]
    a, b, c = (flat[:, i] for i in range(3))

    def side(p, q):
        d, e = q - p, points[:, None, :] - p
        return d[:, 0] * e[:, :, 1] - d[:, 1] * e[:, :, 0]

    return ((side(a, b) >= 0) & (side(b, c) >= 0) & (side(c, a) >= 0)).any(axis=1)


# "0" of the thesis is an L, "1" a stem, a step and two branches: these nodes tell them apart.
NODES = np.array([(-1, 1), (-1, -1), (1, -1), (0, -1), (0, 0), (1, 0), (-1, 0)])
RAISED = {0: [1, 1, 1, 1, 0, 0, 1], 1: [1, 1, 0, 1, 1, 1, 0]}


def test_printed_thesis_cube_carries_the_thesis_array_where_the_database_says(tmp_path):
    result = made(tmp_path, (SPECS / "thesis-cube.yaml").read_text(), formats=("stl",))
    cube = registered(tmp_path, result.objects[0].name)
    truth = thesis_array()
    pitch, seen = cube.style.pitch_mm, 0
    for part in cube.parts:
        number = int(part.name.rsplit("F", 1)[1]) - 1
        face = cube.faces[number]
        assert face.placement is not None
        cells = cube.layout.faces[number]
        T = np.linalg.inv(part.T_object_part) @ face.T_object_face
        turn = -face.placement.rotation_rad
        R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        triangles = triangles_of(tmp_path / part.file)
        for r, c, centre in zip(cells.rows, cells.columns, cells.centres_mm, strict=True):
            at = centre + 0.26 * pitch * NODES @ R.T
            here = at @ T[:2, :2].T + T[:2, 3]
            assert is_raised(triangles, here).astype(int).tolist() == RAISED[truth[r, c]]
            seen += 1
    assert seen == result.objects[0].symbols > 100


def test_placements_map_cells_to_symbol_centres(tmp_path):
    made(tmp_path, "name: T\nshape: {tetrahedron: 90 mm}\n", formats=())
    solid = registered(tmp_path, "T")
    for face in solid.layout.faces:
        p, place = solid.style.pitch_mm, face.placement
        c, s = np.cos(place.rotation_rad), np.sin(place.rotation_rad)
        u = face.centres_mm @ np.array([[c, -s], [s, c]]).T + (place.x_mm, place.y_mm)
        columns = np.rint(u[:, 0] / p - 0.5).astype(int)
        rows = np.rint(-u[:, 1] / p - 0.5).astype(int)
        assert np.abs(u[:, 0] - (columns + 0.5) * p).max() < 1e-9
        assert ((rows + place.row) % 189 == face.rows).all()
        assert ((columns + place.column) % 1387 == face.columns).all()
