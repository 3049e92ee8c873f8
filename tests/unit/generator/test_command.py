"""The command `encode-object` as people run it: help, routes, exit codes, JSON, interruption."""

import json
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from generator.command import run
from generator.spec.shape import KINDS

FIXTURES = Path(__file__).parents[3] / "fixtures"
HEAVY = ("numpy", "sqlalchemy", "yaml", "manifold3d", "PIL", "scipy", "shapely", "trimesh", "OCP",
         "pymeshlab", "matplotlib", "build123d", "cadquery", "generator.spec", "generator.array",
         "generator.pipeline")  # fmt: skip
ENTRY = "import sys; from generator.command import main; main()"


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")


def command(*arguments):
    """Run the command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", ENTRY, *map(str, arguments)], capture_output=True, text=True
    )


def write(text, name="c.yaml"):
    Path(name).write_text(text)
    return name


@pytest.mark.parametrize("arguments", [["--help"], ["init", "--help"], ["list", "--help"]])
def test_help_loads_nothing_heavy(arguments):
    program = (
        "import sys\nfrom generator.command import main\n"
        f"try: main({arguments!r})\n"
        "except SystemExit as left: code = left.code\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], code)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == "[] 0"


def test_a_scene_loads_what_it_needs():
    unused = ("scipy", "matplotlib", "pandas", "OCP", "trimesh", "multiprocessing.pool",
              "generator.polyhedron.read", "generator.export.check",
              "generator.export.robot.model", "generator.printed",
              "generator.pipeline.sets")  # fmt: skip
    program = (
        "import sys\nfrom generator.command import run\n"
        f"code = run([{str(FIXTURES / 'cube.yaml')!r}, '-o', 'made', '--database', 'd.db'])\n"
        f"print([name for name in {unused!r} if name in sys.modules], code)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[] 0", done.stderr


def test_help_names_every_option_and_command(capsys):
    assert run(["--help"]) == 0
    text = capsys.readouterr().out
    words = "--output -o --format --database --dry-run --verify --replace --json"
    words += " SPEC.yaml... init schema printers list show retire export import"
    for word in (*words.split(), "shape: {cube: 60 mm}", "130 interrupted"):
        assert word in text
    assert run(["-h"]) == 0


def test_without_arguments_help_and_exit_code_2(capsys):
    assert run([]) == 2
    assert "encode-object init" in capsys.readouterr().out


def test_made_object_end_to_end():
    done = command(FIXTURES / "cube.yaml", "-o", "made", "--format", "stl", "--database", "d.db",
                   "--json")  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    value = json.loads(done.stdout)
    (cube,) = value["objects"]
    assert (cube["name"], cube["faces"]) == ("Cube", 6)
    assert cube["symbols"] > 300
    assert all(Path(file).is_file() for file in cube["files"])
    assert {Path(file).parts[0] for file in cube["files"]} == {"made"}
    assert any(file.endswith(".stl") for file in cube["files"])
    assert not any(file.endswith((".step", ".3mf")) for file in cube["files"])
    assert value["array"] == {"rows": 51, "columns": 1285, "used_cells": cube["symbols"]}
    assert value["database"] == "sqlite:///d.db"
    assert value["seconds"] > 0
    listed = command("list", "--database", "d.db", "--json")
    (entry,) = json.loads(listed.stdout)["objects"]
    assert (entry["name"], entry["symbols"]) == ("Cube", cube["symbols"])
    table = command("list", "--database", "d.db")
    assert table.returncode == 0
    assert "large 51x1285" in table.stdout


def test_dry_run_says_what_would_be_made_and_writes_nothing(capsys):
    name = write("name: Cube\nshape: {cube: 60 mm}\n")
    assert run(["--dry-run", name]) == 0
    text, messages = capsys.readouterr()
    assert text.startswith("Cube: would be made; 6 faces, ")
    assert "nothing was written" in text
    assert messages == ""
    assert os.listdir() == [name]


def test_result_says_what_was_made_and_what_to_do_next(capsys):
    name = write("name: Cube\nshape: {cube: 30 mm}\noutput: {formats: 3mf}\n")
    assert run([name]) == 0
    text = capsys.readouterr().out
    assert text.startswith("Cube: made; 6 faces, ")
    assert f"out{os.sep}cube{os.sep}  " in text
    assert "registered in sqlite:///lab.db" in text
    assert "next: open out/cube/Cube-build.html, then print out/cube/Cube.3mf" in text
    assert run([name]) == 0
    assert capsys.readouterr().out.startswith("Cube: registered before, same cells; 6 faces")


def test_warnings_go_to_stderr_and_into_json(capsys):
    name = FIXTURES / "specs/thesis-prism.yaml"
    assert run(["--dry-run", str(name)]) == 0
    assert capsys.readouterr().err.startswith("warning: Triangular prism thesis: ")
    assert run(["--dry-run", "--json", str(name)]) == 0
    assert len(json.loads(capsys.readouterr().out)["objects"][0]["warnings"]) == 1


def test_problems_of_a_spec_with_exit_code_2():
    name = write("name: Cube\nshape: {cube: 60 mn}\nedgee: 3\nprint: {wal: 2}\n")
    done = command(name)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == (
        "c.yaml:2:15: error: unknown unit 'mn' for a length\n"
        "    2 | shape: {cube: 60 mn}\n"
        "      |               ^\n"
        "  fix: use one of mm, cm, m, um, in\n"
        "\n"
        "c.yaml:3:1: error: unknown setting 'edgee'\n"
        "    3 | edgee: 3\n"
        "      | ^\n"
        "  fix: use one of version, profile, encoding, sensor_type, layout, symbols, print, robot, "
        "copies, output, name, shape\n"
        "\n"
        "c.yaml:4:9: error: unknown setting 'wal' in 'print'\n"
        "    4 | print: {wal: 2}\n"
        "      |         ^\n"
        "  fix: did you mean 'wall'?\n"
    )
    assert os.listdir() == [name]


def test_problems_as_json(capsys):
    name = write("name: Cube\nshape: {cube: 60 mn}\n")
    assert run([name, "nothing", "--json"]) == 2
    text, messages = capsys.readouterr()
    assert messages == ""
    assert json.loads(text) == {
        "error": {
            "kind": "SpecError",
            "exit_code": 2,
            "place": "c.yaml:2:15",
            "cause": "unknown unit 'mn' for a length (and 1 more)",
            "fix": "use one of mm, cm, m, um, in",
            "problems": [
                {
                    "place": "c.yaml:2:15",
                    "file": "c.yaml",
                    "line": 2,
                    "column": 15,
                    "cause": "unknown unit 'mn' for a length",
                    "fix": "use one of mm, cm, m, um, in",
                },
                {
                    "place": "nothing",
                    "file": None,
                    "line": None,
                    "column": None,
                    "cause": "there is no such file",
                    "fix": "write a first one with: encode-object init cube -o cube.yaml",
                },
            ],
        }
    }


def test_problem_of_the_shape_points_at_its_line(capsys):
    text = (FIXTURES / "specs/full.yaml").read_text().replace("[0, 4, 5, 3]", "[0, 3, 5, 4]")
    assert run(["--dry-run", write(text)]) == 2
    first = capsys.readouterr().err.splitlines()[0]
    assert first.startswith("c.yaml:5:1: error: ")


@pytest.mark.parametrize(
    ("arguments", "start", "fix"),
    [
        (["--dry-runn", "c.yaml"], "error: No such option: --dry-runn", "see encode-object --help"),
        (["list", "--data", "x"], "error: No such option: --data", "see encode-object list --help"),
        (["--json-lines"], "error: No such option", "see encode-object --help"),
        (["--dry-run"], "error: no spec is named", "see encode-object --help"),
        (["c.yaml", "--format", "stepp"], "--format: error: unknown format 'stepp'",
         "did you mean 'step'?"),
        (["c.yaml", "--database", "mysql://h/n"], "--database: error: objects cannot be kept",
         "write sqlite:///lab.db or postgresql://user@host/name"),
        (["init", "prisma"], "error: unknown shape 'prisma'", "did you mean 'prism'?"),
        (["init", "cube", "-o", "c.yaml"], "c.yaml: error: the file is there already",
         "choose another name, or replace it with --force"),
    ],
)  # fmt: skip
def test_misused_options_are_bad_input(arguments, start, fix, capsys):
    write("name: Cube\nshape: {cube: 60 mm}\n")
    assert run(arguments) == 2
    text, messages = capsys.readouterr()
    assert text == ""
    assert messages.startswith(start)
    assert messages.endswith(f"  fix: {fix}\n")
    assert run([*arguments, "--json"]) == 2
    text, messages = capsys.readouterr()
    assert messages == ""
    assert json.loads(text)["error"]["fix"] == fix


def test_missing_database_has_exit_code_4(capsys):
    assert run(["list"]) == 4
    assert ": error: " in capsys.readouterr().err
    assert run(["list", "--json"]) == 4
    error = json.loads(capsys.readouterr().out)["error"]
    assert (error["kind"], error["exit_code"]) == ("DatabaseError", 4)
    assert os.listdir() == []


def test_changed_spec_is_refused_without_replace(capsys):
    assert run([write("name: Cube\nshape: {cube: 30 mm}\noutput: {formats: stl}\n")]) == 0
    write("name: Cube\nshape: {cube: 31 mm}\noutput: {formats: stl}\n")
    assert run(["c.yaml"]) == 4
    assert "--replace" in capsys.readouterr().err
    assert run(["c.yaml", "--replace"]) == 0


def test_init_writes_a_spec_that_can_be_made(capsys):
    assert run(["init", "tetrahedron", "-o", "t.yaml"]) == 0
    assert capsys.readouterr().out == "wrote t.yaml; make it with: encode-object t.yaml\n"
    assert run(["t.yaml", "--dry-run"]) == 0
    assert os.listdir() == ["t.yaml"]
    capsys.readouterr()
    assert run(["init", "box", "-o", "t.yaml", "--force", "--json"]) == 0
    value = json.loads(capsys.readouterr().out)
    assert (value["shape"], value["file"]) == ("box", "t.yaml")
    assert Path("t.yaml").read_text() == value["spec"]
    assert run(["init"]) == 0
    assert "shape: {cube: 60 mm}" in capsys.readouterr().out


def test_init_into_a_folder_that_is_not_there_has_exit_code_1(capsys):
    assert run(["init", "cube", "-o", "no/c.yaml"]) == 1
    assert capsys.readouterr().err.startswith("error: cannot write 'no/")


def test_schema_and_printers(capsys):
    assert run(["schema"]) == 0
    assert json.loads(capsys.readouterr().out)["$defs"]["Shape"]
    assert run(["printers", "--json"]) == 0
    first = json.loads(capsys.readouterr().out)["printers"][0]
    assert (first["name"], first["overhang_max_deg"]) == ("fdm-0.4", 45)
    assert run(["printers"]) == 0
    assert "fdm-0.25" in capsys.readouterr().out
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("encode-object 0.")


def test_interruption_has_exit_code_130():
    os.mkfifo("c.yaml")
    process = subprocess.Popen(
        [sys.executable, "-c", ENTRY, "c.yaml"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    with open("c.yaml", "wb") as file:  # opens once the command reads
        file.write(b"name: ")
        file.flush()
        for _ in range(6):  # as a person does: again, where a first one came amid an import
            process.send_signal(signal.SIGINT)
            if select.select([process.stderr], [], [], 10)[0]:  # it says so, or has gone
                break
        text, messages = process.communicate(timeout=30)
    assert process.returncode == 130
    assert text == b""
    assert messages == b"\nencode-object: interrupted\n"


def test_output_into_a_closed_pipe_is_no_traceback():
    process = subprocess.Popen(
        [sys.executable, "-c", ENTRY, "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    process.stdout.close()
    messages = process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=30) == 1
    assert messages == b""


def test_init_names_every_shape():
    said = command("init", "--help").stdout
    assert [kind for kind in KINDS if kind not in said] == []
