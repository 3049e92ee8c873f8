"""`decode-window`: its JSON, its exit codes, its messages, its picture."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from decoder.command import run

WINDOW = "01 11 01 01 00 01"


def outcome(capsys, *arguments):
    code = run(list(arguments))
    output = capsys.readouterr()
    return code, output.out, output.err


@pytest.mark.parametrize("method", ["table", "serial", "milestones", "logarithm"])
def test_json_of_the_contract(capsys, method):
    code, out, err = outcome(capsys, WINDOW, "--profile", "thesis", "--method", method, "--json")
    found = json.loads(out)
    assert code == 0
    assert (found["row"], found["column"], found["t"]) == (1, 61, 2206)
    assert (found["reason"], err) == ("", "")


def test_likelihood_refuses_to_guess_and_lists(capsys):
    arguments = [WINDOW, "--profile", "thesis", "--method", "likelihood", "--json"]
    code, out, _ = outcome(capsys, *arguments, "--top", "3")
    found = json.loads(out)
    assert code == 1
    assert (found["row"], found["reason"], len(found["candidates"])) == (None, "ambiguous", 3)
    code, out, _ = outcome(capsys, *arguments, "--error", "1e-6", "--blank", "0")
    assert (code, json.loads(out)["t"]) == (0, 2206)


def test_text_erasures_and_rows_as_arguments(capsys):
    code, out, _ = outcome(capsys, "2?", "65", "?5", "21", "--profile", "product")
    assert code == 0
    assert out.startswith("row 5, column 7 (t = 82)\n")
    code, out, _ = outcome(capsys, "01 11 01 ?1 00 01", "--profile", "thesis")
    assert code == 1
    assert "too few symbols" in out
    assert "row 1, column 61" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["01 1x", "--profile", "thesis"], "'x' is no symbol"),
        (["01 1"], "equally long"),
        ([""], "empty"),
        (["01", "--profile", "nothing"], "unknown profile"),
        (["01", "--method", "nothing"], "unknown method"),
        (["01", "--nothing"], "nothing"),
        (["01", "--array", "{"], "--array cannot be read"),
        (["01", "--array", "[1]"], "--array cannot be read"),
        (["01", "--array", '{"family": "none"}'], "none"),
        (["01", "--array", "{}", "--profile", "thesis"], "both"),
        (["01", "--method", "likelihood", "--error", "2"], "error rate"),
        (["01", "--method", "likelihood", "--rotations", "x"], "quarter turns"),
        ([], ""),
    ],
)
def test_bad_input(capsys, arguments, message):
    code, _, err = outcome(capsys, *arguments)
    assert code == 2
    assert message in err
    assert not arguments or (err.startswith("error: ") and "  fix: " in err)
    if arguments:
        code, out, _ = outcome(capsys, *arguments, "--json")
        assert code == 2
        assert message in json.loads(out)["error"]["cause"]


def test_picture(capsys, tmp_path):
    path = tmp_path / "window.png"
    code, *_ = outcome(capsys, WINDOW, "--profile", "thesis", "--plot", str(path))
    assert code == 0
    with Image.open(path) as picture:
        assert picture.size == (65 * 16, 63 * 16)
        assert picture.getpixel((61 * 16, 1 * 16)) == (196, 60, 20)
        assert picture.getpixel((61 * 16 - 1, 1 * 16)) != (196, 60, 20)
    large = '{"family": "prba", "order": 2, "degree": 64}'
    window = "0" * 15 + "1"
    rows = [window[i : i + 4] for i in range(0, 16, 4)] * 16
    code, *_ = outcome(capsys, *rows[:1], "--array", large, "--plot", str(path))
    assert code == 1
    assert path.stat().st_size > 100
    code, _, err = outcome(capsys, WINDOW, "--profile", "thesis", "--plot", str(tmp_path / "a/b"))
    assert code == 1
    assert "cannot write" in err


def test_a_wrapping_window_is_outlined_on_both_sides(capsys, tmp_path):
    from generator.array import profile

    array = profile("thesis").array()
    rows = ["".join(str(array.symbols(60 + r, 64 + c)) for c in range(2)) for r in range(6)]
    path = tmp_path / "wrap.png"
    code, *_ = outcome(capsys, *rows, "--profile", "thesis", "--plot", str(path))
    assert code == 0
    with Image.open(path) as picture:
        assert picture.getpixel((64 * 16, 61 * 16)) == (196, 60, 20)
        assert picture.getpixel((15, 16)) == (196, 60, 20)


def test_nothing_heavy_is_imported():
    code = (
        "import sys, decoder.command; decoder.command.run(['01 11 01 01 00 01', '--profile',"
        " 'thesis']); print([m for m in sys.modules if m.split('.')[0] in"
        " {'scipy', 'matplotlib', 'PIL', 'numba', 'sqlalchemy', 'manifold3d'}])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_database_gives_array_prior_object_and_face(tmp_path, monkeypatch, capsys):
    from generator.database.open import open_database
    from generator.database.read import read_object
    from generator.database.transaction import read_transaction
    from generator.pipeline import encode
    from generator.spec import read_specs

    monkeypatch.chdir(tmp_path)
    Path("c.yaml").write_text("name: Small\nshape: {cube: 40 mm}\n")
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
    assert run([text, "--database", "none.db"]) == 4
    assert "none.db" in capsys.readouterr().err
