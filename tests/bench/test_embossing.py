"""What embossing costs: whole cubes of 600 symbols (`pytest tests/bench`), and the campaign.

`embossing.py` beside this file races the kernels; here it runs on this project alone.
"""

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.array.profiles import PROFILES
from generator.export.meshes import stl_chunks
from generator.export.step import step_chunks
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron.shapes import cube
from generator.solid import emboss_whole, prove_closed, triangles

CAMPAIGN = Path(__file__).with_name("embossing.py")


@pytest.fixture(scope="module")
def part():
    k, pitch = 10, 7.0
    array = PROFILES["one-touch"].array()
    r, c = (index.ravel() for index in np.indices((k, k)))
    centres = np.stack([(c + 0.75) * pitch, (k - r - 0.25) * pitch], axis=1)
    nowhere = Placement(0, 0, 0.0, 0.0, 0.0)
    faces = tuple(
        FaceLayout(f, nowhere, r, c + f * k, array.symbols(r, c + f * k), centres, 0)
        for f in range(6)
    )
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle(pitch))
    return emboss_whole(cube((k + 0.5) * pitch), Layout("faces", pitch, faces), tiers, "cube")


def test_prove_closed_600(benchmark, part):
    benchmark(prove_closed, part)


def test_step_600(benchmark, part):
    text = benchmark(lambda: b"".join(step_chunks(part)))
    assert text.endswith(b"END-ISO-10303-21;\n")


def test_mesh_600(benchmark, part):
    assert len(benchmark(triangles, part).triangles) > 600


def test_stl_600(benchmark, part):
    mesh = triangles(part)
    assert len(benchmark(stl_chunks, mesh)) == 84 + 50 * len(mesh.triangles)


def test_the_campaign_agrees_with_the_closed_form():
    """Its exit code is 0 only where every volume is right and every cube one solid."""
    command = [sys.executable, str(CAMPAIGN), "--symbols", "24,54", "--ways", "this, draft 10 deg"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    line = next(line for line in done.stdout.splitlines() if line.startswith("this"))
    times = [float(figure) for figure in re.findall(r"([\d.]+) \|\s+\d+ \|", line)]
    assert len(times) == 2
    assert all(0 < cpu_s < math.inf for cpu_s in times)
