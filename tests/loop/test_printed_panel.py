"""PrusaSlicer reads and slices what is written, repairs nothing, keeps symbols in place.

What its G-code deposits of one small panel is what was designed; the checks share no model with
the beads: extruded against deposited volume, the mesh of the STL, the symbols' volume in closed
form. Needs the Debian package `prusa-slicer`; without it these tests fail.
"""

import re
import shutil
import subprocess

import numpy as np
import pytest
from reference.cube_panels import cube_panels

from generator.export.meshes import stl_chunks
from generator.export.threemf import print_files
from generator.printed.deposit import deposit
from generator.printed.faults import print_faults
from generator.printed.slicer import PROFILES, slice_part
from generator.printed.survey import SURVIVES, survey_face
from generator.printed.view import face_surface
from generator.solid.measure import symbol_volume, volume
from generator.solid.triangulate import triangles
from probe.simulate.written import written_triangles
from probe.surface.mesh import mesh

PROFILE = PROFILES["fdm-0.4-0.2"]


@pytest.fixture(scope="module")
def part():
    return cube_panels(24.0)[0]


@pytest.fixture(scope="module")
def stl(part, tmp_path_factory):
    path = tmp_path_factory.mktemp("printed") / "panel.stl"
    path.write_bytes(b"".join(stl_chunks(triangles(part))))
    return path


@pytest.fixture(scope="module")
def sliced(stl):
    return slice_part(stl, PROFILE)


@pytest.fixture(scope="module")
def printed(sliced):
    return deposit(sliced)


@pytest.fixture(scope="module")
def surface(part, printed):
    return face_surface(printed, part.embossings[0].T_part_facet)


def test_every_symbol_is_deposited_as_designed(part, surface):
    tiles = survey_face(surface, part.embossings[0])
    assert len(tiles) >= 4
    for tile in tiles:
        assert tile.check.verdict == SURVIVES
        assert tile.check.overlap > 0.98
        assert tile.check.height_mm == pytest.approx(1.0, abs=0.02)
        assert tile.check.moved_mm == pytest.approx((0.0, 0.0), abs=0.02)


def test_the_plastic_over_the_face_is_what_was_extruded_over_it(part, sliced, surface):
    path = sliced.toolpath
    extruded = path.volume_mm3[path.of_part & (path.end_mm[:, 2] > 3.05)].sum()
    over = surface.heights[surface.heights > 0.06].astype(np.float64)
    deposited = over.sum() * surface.step_mm**2
    assert deposited == pytest.approx(extruded, rel=0.04)
    embossing = part.embossings[0]
    designed = sum(symbol_volume(embossing.tiers[k]) for k in embossing.labels.tolist())
    assert deposited == pytest.approx(designed, rel=0.03)


def test_beads_hold_the_extruded_volume(sliced, printed):
    beads = printed.beads
    length = np.hypot(*(beads.end_mm - beads.start_mm).T)
    path = sliced.toolpath
    extruded = path.volume_mm3[path.of_part].sum()
    w, h = beads.width_mm, beads.height_mm
    section = h * (w - h * (1 - np.pi / 4))
    assert (section * length).sum() == pytest.approx(extruded, rel=0.02)


def test_heights_are_those_of_the_mesh_away_from_its_walls(part, stl, surface):
    designed = mesh(written_triangles(stl), np.linalg.inv(part.embossings[0].T_part_facet))
    points = np.random.default_rng(3).uniform(1.5, 22.5, (400, 2))
    top = designed.heights_mm(points)
    found = surface.heights_mm(points)
    level = (np.abs(top) < 1e-4) | (np.abs(top - 1) < 1e-4)  # the face or a symbol's top
    off = np.abs(found - top)[level]
    # Grooves between beads are .04 mm deep; a point beside a wall may see its layers' steps.
    assert np.median(off) < 0.02
    assert (off < 0.1).mean() > 0.95


def test_faults_move_and_wear_symbols_and_leave_them_readable(part, sliced):
    worn = deposit(sliced, print_faults("bad"), np.random.default_rng(1))
    surface = face_surface(worn, part.embossings[0].T_part_facet)
    checks = [tile.check for tile in survey_face(surface, part.embossings[0])]
    assert {check.verdict for check in checks} == {SURVIVES}
    assert 0.75 < np.mean([check.overlap for check in checks]) < 0.97


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


def test_stl_needs_no_repair(told, part, stl):
    (found,) = told(stl)
    assert found["number_of_parts"] == "1"
    assert not {"open_edges", "facets_reversed", "degenerate_facets"} & set(found)
    assert float(found["volume"]) == pytest.approx(volume(part), rel=1e-5)


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
