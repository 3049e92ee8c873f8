"""What embossing costs: whole cubes of 600 symbols (`pytest tests/bench`), and the campaign.

`embossing.py` beside this file races the kernels; here it runs on this project alone.
"""

import math
import subprocess
import sys
from pathlib import Path

import pytest

from generator.export.meshes import stl_chunks
from generator.export.step import step_chunks
from generator.solid import emboss_whole, prove_closed, triangles

sys.path.insert(0, str(Path(__file__).parent))
import embossing


@pytest.fixture(scope="module")
def part():
    made = embossing.scene(600, math.radians(10))
    return emboss_whole(made.polyhedron, made.layout, made.tiers, "cube")


def test_prove_closed_600(benchmark, part):
    benchmark(prove_closed, part)


def test_step_600(benchmark, part):
    text = benchmark(lambda: b"".join(step_chunks(part)))
    assert text.endswith(b"END-ISO-10303-21;\n")


def test_mesh_600(benchmark, part):
    assert len(benchmark(triangles, part).triangles) > 600


def test_stl_600(benchmark, part):
    mesh = triangles(part)
    assert len(benchmark(lambda: b"".join(stl_chunks(mesh)))) == 84 + 50 * len(mesh.triangles)


def test_the_campaign_agrees_with_the_closed_form():
    """Its exit code is 0 only where every volume is right and every cube one solid."""
    command = [sys.executable, embossing.__file__, "--symbols", "24", "54", "--ways",
               embossing.DRAFTED]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    rows = [line.split(" | ") for line in done.stdout.splitlines() if embossing.DRAFTED in line]
    assert [int(row[1]) for row in rows] == [24, 54]
    assert all(0 < float(row[2]) < math.inf for row in rows)
