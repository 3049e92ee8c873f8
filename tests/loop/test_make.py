"""From spec to files and database: what is printed is what is registered."""

import hashlib
import json
from pathlib import Path

import numpy as np

from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.pipeline import encode
from generator.spec import read_specs
from probe.simulate.target import part_surface

FIXTURES = Path(__file__).parents[2] / "fixtures"
GOLDEN = json.loads((FIXTURES / "golden.json").read_text())
# "0" of the thesis is an L, "1" a stem, a step and two branches: these nodes tell them apart.
NODES = np.array([(-1, 1), (-1, -1), (1, -1), (0, -1), (0, 0), (1, 0), (-1, 0)])
RAISED = {0: [1, 1, 1, 1, 0, 0, 1], 1: [1, 1, 0, 1, 1, 1, 0]}


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


def test_printed_thesis_cube_carries_the_thesis_array_where_the_database_says(tmp_path):
    specs, database = read_specs([FIXTURES / "specs" / "thesis-cube.yaml"]), f"{tmp_path}/lab.db"
    made = encode(specs, folder=tmp_path / "out", database=database, formats=("stl",)).objects[0]
    with read_transaction(open_database(database, writable=False)) as connection:
        cube = read_object(connection, made.name)
    truth, seen = thesis_array(), 0
    for part in cube.parts:
        number = int(part.name.rsplit("F", 1)[1]) - 1
        cells, turn = cube.layout.faces[number], -cube.faces[number].placement.rotation_rad
        R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        surface = part_surface(
            tmp_path / part.file, database=database, face=f"F{number + 1}"
        ).surface
        for r, c, centre in zip(cells.rows, cells.columns, cells.centres_mm, strict=True):
            heights = surface.heights_mm(centre + 0.26 * cube.style.pitch_mm * NODES @ R.T)
            assert (heights > surface.top_mm - 1e-3).astype(int).tolist() == RAISED[truth[r, c]]
            seen += 1
    assert seen == made.symbols > 100
