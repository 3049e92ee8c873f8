"""PrusaSlicer reads and slices what is written, repairs nothing, and keeps symbols in place.

Needs the Debian package `prusa-slicer`; without it these tests fail.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from reference.cube_panels import cube_panels

from generator.export.meshes import stl_chunks
from generator.export.threemf import print_files
from generator.pipeline import encode
from generator.solid.measure import volume
from generator.solid.part import Part
from generator.solid.triangulate import triangles
from generator.spec.read import read_specs


@pytest.fixture(scope="module")
def slicer() -> str:
    found = shutil.which("prusa-slicer")
    if found is None:
        pytest.fail("prusa-slicer is missing: apt-get install prusa-slicer (Debian package)")
    return found


@pytest.fixture(scope="module")
def parts() -> tuple[Part, ...]:
    return cube_panels(40.0)


def run(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout


def info(text: str) -> list[dict[str, str]]:
    """Return the values that `--info` prints, one dict for each object."""
    blocks = re.split(r"^\[[^\]]*\]$", text, flags=re.MULTILINE)[1:]
    pairs = [re.findall(r"^(\w+) = +(\S+)$", block, flags=re.MULTILINE) for block in blocks]
    return [dict(found) for found in pairs]


def test_stl_is_manifold_and_needs_no_repair(
    slicer: str, parts: tuple[Part, ...], tmp_path: Path
) -> None:
    for part in parts:
        path = tmp_path / f"{part.name}.stl"
        path.write_bytes(b"".join(stl_chunks(triangles(part))))
        (found,) = info(run(slicer, "--info", str(path)))
        assert found["manifold"] == "yes"
        assert found["number_of_parts"] == "1"
        assert not {"open_edges", "facets_reversed", "degenerate_facets"} & set(found)
        assert float(found["volume"]) == pytest.approx(volume(part), rel=1e-5)


def test_3mf_components_are_read_as_body_and_symbols(
    slicer: str, parts: tuple[Part, ...], tmp_path: Path
) -> None:
    path = tmp_path / "components.3mf"
    path.write_bytes(print_files("Cube", parts, (250.0, 210.0))[0].content)
    found = info(run(slicer, "--info", str(path)))
    assert len(found) == 2 * len(parts)
    assert {values["manifold"] for values in found} == {"yes"}
    for part, body, symbols in zip(parts, found[::2], found[1::2], strict=True):
        together = float(body["volume"]) + float(symbols["volume"])
        assert together == pytest.approx(volume(part), rel=1e-5)
        assert float(symbols["min_z"]) == pytest.approx(float(body["max_z"]))


def test_3mf_volumes_are_sliced_with_the_symbols_on_their_panels(
    slicer: str, parts: tuple[Part, ...], tmp_path: Path
) -> None:
    path, gcode = tmp_path / "volumes.3mf", tmp_path / "volumes.gcode"
    path.write_bytes(print_files("Cube", parts[:2], (250.0, 210.0))[0].prusaslicer)
    found = info(run(slicer, "--info", str(path)))
    assert len(found) == 2
    assert {values["manifold"] for values in found} == {"yes"}
    settings = ("--layer-height", "0.2", "--first-layer-height", "0.2", "--bed-shape",
                "0x0,250x0,250x210,0x210", "--skirts", "0")  # fmt: skip
    run(slicer, "--export-gcode", *settings, "-o", str(gcode), str(path))
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


def test_a_body_that_needs_no_supports_gets_none(slicer: str, tmp_path: Path) -> None:
    spec = tmp_path / "a.yaml"
    shape = "{cone: {diameter: 36 mm, top_diameter: 30 mm, height: 16 mm}}"
    spec.write_text(f"name: A\nshape: {shape}\n")
    url = f"sqlite:///{tmp_path}/l.db"
    made = encode(read_specs([spec]), folder=tmp_path, database=url, formats=("3mf",), jobs=1)
    assert "no supports needed" in str(made.objects[0].lying)
    project, gcode = tmp_path / "A-prusaslicer.3mf", tmp_path / "a.gcode"
    run(slicer, "--export-gcode", "--dont-arrange", "-o", str(gcode), str(project))
    kinds = set(re.findall(r"^;TYPE:(.*)$", gcode.read_text(), flags=re.MULTILINE))
    assert "External perimeter" in kinds
    assert not {kind for kind in kinds if kind.startswith("Support")}
