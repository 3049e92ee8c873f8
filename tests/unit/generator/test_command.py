"""The command `encode-object` as people run it: help, routes, exit codes, JSON, interruption."""

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from generator.command import run

FIXTURES = Path(__file__).parents[3] / "fixtures"
HEAVY = ("numpy", "sqlalchemy", "yaml", "manifold3d", "PIL", "scipy", "shapely", "trimesh", "OCP",
         "pymeshlab", "matplotlib", "build123d", "cadquery", "generator.spec", "generator.array",
         "generator.pipeline")  # fmt: skip
ENTRY = "import sys; from generator.command import main; main()"


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")


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


def test_problem_of_the_shape_points_at_its_line(capsys):
    text = (FIXTURES / "specs/full.yaml").read_text().replace("[0, 4, 5, 3]", "[0, 3, 5, 4]")
    assert run(["--dry-run", write(text)]) == 2
    first = capsys.readouterr().err.splitlines()[0]
    assert first.startswith("c.yaml:5:1: error: ")


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
