"""`decode-window`: its picture, and what a database adds."""

import json
from pathlib import Path

import numpy as np
from PIL import Image

from decoder.command import run
from generator.array import profile

WINDOW = "01 11 01 01 00 01"


def test_picture(ask, tmp_path):
    path, marked = tmp_path / "window.png", (196, 60, 20)
    assert ask(run, WINDOW, "--profile", "thesis", "--plot", path)[0] == 0
    with Image.open(path) as picture:
        assert picture.size == (65 * 16, 63 * 16)
        assert picture.getpixel((61 * 16, 1 * 16)) == marked
        assert picture.getpixel((61 * 16 - 1, 1 * 16)) != marked
    array = profile("thesis").array()  # a window that wraps is outlined on both sides
    rows = ["".join(str(array.symbols(60 + r, 64 + c)) for c in range(2)) for r in range(6)]
    assert ask(run, *rows, "--profile", "thesis", "--plot", path)[0] == 0
    with Image.open(path) as picture:
        assert picture.getpixel((64 * 16, 61 * 16)) == picture.getpixel((15, 16)) == marked
    large = '{"family": "prba", "order": 2, "degree": 64}'
    assert ask(run, "0000", "--array", large, "--plot", path)[0] == 1
    code, _, err = ask(run, WINDOW, "--profile", "thesis", "--plot", tmp_path / "a/b")
    assert code == 2
    assert "cannot write" in err


def test_database_gives_array_prior_object_and_face(tmp_path, monkeypatch, capsys):
    from generator.database.open import open_database
    from generator.database.read import read_object
    from generator.database.transaction import read_transaction
    from generator.pipeline import encode
    from generator.spec import read_specs

    monkeypatch.chdir(tmp_path)
    Path("c.yaml").write_text("name: Small\nshape: {cube: 40 mm}\nsymbols: {alphabet: dense-4}\n")
    encode(read_specs(["c.yaml"]), formats=(), database="lab.db")
    with read_transaction(open_database("lab.db", writable=False)) as connection:
        small = read_object(connection, "Small")
    face = small.layout.faces[3]
    low, left = face.rows.min(), face.columns.min()
    chosen = (face.rows < low + 3) & (face.columns < left + 3)
    grid = np.full((3, 3), -1)
    grid[face.rows[chosen] - low, face.columns[chosen] - left] = face.labels[chosen]
    text = " ".join("".join(map(str, row)) for row in grid.tolist())
    assert run([text, "--database", "lab.db", "--json"]) == 0
    exact = json.loads(capsys.readouterr().out)
    assert (exact["row"], exact["column"]) == (low, left)
    assert (exact["object"], exact["face"]) == ("Small", "F4")
    # One symbol wrong and one not seen: the prior decides, where all places would be ambiguous.
    worn = f"?{(int(text[1]) + 1) % 4}" + text[2:]
    assert run([worn, "--method", "likelihood", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["row"] is None
    assert run([worn, "--method", "likelihood", "--database", "lab.db", "--doubt", "0.05"]) == 0
    assert "Small, face F4" in capsys.readouterr().out
    assert run([text, "--database", "lab.db", "--profile", "thesis"]) == 2
