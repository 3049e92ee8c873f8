"""PrusaSlicer reads and slices what is written, repairs nothing, and keeps symbols in place.

Needs the Debian package `prusa-slicer`; without it these tests fail.
"""

import re
import shutil
import subprocess

import numpy as np
import pytest
from reference.cube_panels import cube_panels

from generator.export.meshes import stl_chunks
from generator.export.threemf import print_files
from generator.solid.measure import volume
from generator.solid.triangulate import triangles


@pytest.fixture(scope="module")
def slicer():
    """Return a function that runs PrusaSlicer."""
    found = shutil.which("prusa-slicer")
    if found is None:
        pytest.fail("prusa-slicer is missing: apt-get install prusa-slicer (Debian package)")

    def run(*words):
        command = [found, *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)

    return run


@pytest.fixture(scope="module")
def told(slicer):
    """Return a function: a file -> what `--info` says, one dict for each object."""

    def told(path):
        blocks = re.split(r"^\[[^\]]*\]$", slicer("--info", path).stdout, flags=re.MULTILINE)[1:]
        found = [dict(re.findall(r"^(\w+) = +(\S+)$", one, flags=re.MULTILINE)) for one in blocks]
        assert {values["manifold"] for values in found} == {"yes"}
        return found

    return told


@pytest.fixture(scope="module")
def parts():
    return cube_panels(40.0)


def test_stl_needs_no_repair(told, parts, tmp_path):
    path = tmp_path / "part.stl"
    path.write_bytes(b"".join(stl_chunks(triangles(parts[0]))))
    (found,) = told(path)
    assert found["number_of_parts"] == "1"
    assert not {"open_edges", "facets_reversed", "degenerate_facets"} & set(found)
    assert float(found["volume"]) == pytest.approx(volume(parts[0]), rel=1e-5)


def test_3mf_components_are_read_as_body_and_symbols(told, parts, tmp_path):
    path = tmp_path / "components.3mf"
    path.write_bytes(print_files("Cube", parts, (250.0, 210.0))[0].content)
    found = told(path)
    for part, body, symbols in zip(parts, found[::2], found[1::2], strict=True):
        together = float(body["volume"]) + float(symbols["volume"])
        assert together == pytest.approx(volume(part), rel=1e-5)
        assert float(symbols["min_z"]) == pytest.approx(float(body["max_z"]))


def test_3mf_volumes_are_sliced_with_the_symbols_on_their_panels(slicer, told, parts, tmp_path):
    path, gcode = tmp_path / "volumes.3mf", tmp_path / "volumes.gcode"
    path.write_bytes(print_files("Cube", parts[:1], (250.0, 210.0))[0].prusaslicer)
    assert len(told(path)) == 1
    slicer("--export-gcode", "--layer-height", 0.2, "--first-layer-height", 0.2, "--bed-shape",
           "0x0,250x0,250x210,0x210", "--skirts", 0, "-o", gcode, path)  # fmt: skip
    low, high = {}, {}
    z = 0.0
    for line in gcode.read_text().splitlines():
        if match := re.match(r"G1 Z([\d.]+)", line):
            z = float(match[1])
        elif match := re.match(r"G1 X([-\d.]+) Y([-\d.]+) E", line):
            point = np.array([float(match[1]), float(match[2])])
            low[z] = np.minimum(low.get(z, point), point)
            high[z] = np.maximum(high.get(z, point), point)
    assert max(high) == pytest.approx(4.0)
    assert (low[4.0] > low[3.0]).all()
    assert (high[4.0] < high[3.0]).all()
    assert (high[4.0] - low[4.0] > 0.8 * (high[3.0] - low[3.0])).all()
