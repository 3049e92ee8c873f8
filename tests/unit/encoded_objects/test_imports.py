"""What is loaded, and what is not: a command says its help at once, a scene takes what it needs."""

import subprocess
import sys
from pathlib import Path

import pytest

CUBE = Path(__file__).parents[3] / "fixtures" / "cube.yaml"
PROBE = "numpy scipy matplotlib h5py skfem skimage sqlalchemy serial generator pydantic"
HELP = """
numpy sqlalchemy yaml manifold3d PIL scipy shapely trimesh OCP pymeshlab matplotlib build123d
cadquery generator.spec generator.array generator.pipeline"""
SCENE = f"""
from generator.command import run
assert run([{str(CUBE)!r}, '-o', 'made', '--database', 'd.db']) == 0"""
# Fields are described by the text under them: in the schema, not at start-up.
SETTINGS = """
import linecache, generator.spec.settings
assert not [name for name in linecache.cache if "generator" in name]"""
PLATE = """
import numpy
from probe.command import run
corners = numpy.array([[0, 0, 0], [40, 0, 0], [40, 40, 0], [0, 40, 0]], "<f4")
facet = lambda *three: bytes(12) + corners[list(three)].tobytes() + bytes(2)
part = bytes(80) + numpy.uint32(2).tobytes() + facet(0, 1, 2) + facet(0, 2, 3)
open("plate.stl", "wb").write(part)
assert run(["simulate", "plate.stl", "-o", "a.h5"]) == 0"""
READING = """
numpy scipy matplotlib h5py skimage sqlalchemy serial skfem pyarrow jinja2 fastapi distributed"""
MISUSE = """
import sys
sys.stderr = sys.stdout
from recognizer.command import run
assert run([]) == run(["--follow", "x.h5"]) == 2"""
BENCH = """
from recognizer.bench.command import main
try:
    main(["--help"])
except SystemExit as end:
    assert end.code == 0"""
# What is run, and modules that are not loaded by it.
PROGRAMS = {
    "public names": (
        "import encoded_objects",
        "numpy scipy sqlalchemy typer rich pydantic yaml h5py generator decoder probe recognizer",
    ),
    "generator": ("import generator", "OCP numpy"),
    "array": (
        "import generator.array",
        """scipy shapely trimesh pydantic sqlalchemy yaml typer rich manifold3d PIL matplotlib OCP
        importlib.resources""",
    ),
    "help": ("from generator.command import run; assert run(['--help']) == 0", HELP),
    "help of list": ("from generator.command import run; assert run(['list', '-h']) == 0", HELP),
    "help of probe": ("from probe.command import run; assert run(['--help']) == 0", PROBE),
    "help of calibrate": (
        "from probe.command import run; assert run(['calibrate', 'loads', '-h']) == 0",
        PROBE,
    ),
    "help of reading": (
        "from recognizer.command import run; assert run(['--help']) == run(['-h']) == 0",
        READING,
    ),
    "misuse of reading": (MISUSE, READING),
    "help of validation": (
        """from recognizer.validation.command import run
assert run(['--help']) == run(['repeat', '-h']) == run(['--version']) == 0""",
        READING,
    ),
    "help of bench": (BENCH, READING),
    "window": (
        """from decoder.command import run
assert run(['01 11 01 01 00 01', '--profile', 'thesis']) == 0""",
        "scipy matplotlib PIL numba sqlalchemy manifold3d",
    ),
    "plate": (PLATE, "sqlalchemy scipy.signal skfem"),
    "database": (
        "import generator.database.open, generator.database.read, generator.database.register",
        "sqlalchemy.orm scipy shapely OCP matplotlib trimesh pymeshlab psycopg",
    ),
    "scene": (
        SCENE,
        """scipy h5py cobs serial matplotlib pandas OCP trimesh multiprocessing.pool
        generator.polyhedron.read
        generator.export.check generator.export.robot.model generator.printed
        generator.pipeline.sets""",
    ),
    "settings": (SETTINGS, ""),
}


@pytest.mark.parametrize("what", PROGRAMS)
def test_nothing_is_loaded_that_is_not_used(what, tmp_path):
    program, unused = PROGRAMS[what]
    program += f"\nimport sys; print([name for name in {unused.split()!r} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    "program",
    ["from probe.command import main; main(['list'])", "from encoded_objects import validate"],
)
def test_what_a_plain_install_lacks_is_said(program):
    lacks = "import sys; sys.modules.update(dict.fromkeys(('cobs', 'h5py', 'scipy', 'serial')))"
    program = f"{lacks}\n{program}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode != 0
    assert "pip install 'encoded-objects[touch]'" in done.stderr
    assert "probe.command" in program or "encoded_objects.validate needs " in done.stderr
