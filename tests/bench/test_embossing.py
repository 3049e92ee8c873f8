"""What embossing costs by step: a whole cube of 600 symbols (`pytest tests/bench`)."""

import math
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


STEPS = {
    "prove": prove_closed,
    "step": lambda part: b"".join(step_chunks(part)),
    "mesh": triangles,
    "stl": lambda part: b"".join(stl_chunks(triangles(part))),
}


@pytest.mark.parametrize("step", STEPS)
def test_embossing_600(benchmark, part, step):
    benchmark(STEPS[step], part)
