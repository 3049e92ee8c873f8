"""The scripts of docs/examples run, in a folder of their own, and say what they made."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


def said_by(script: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / script)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_build123d_bracket(tmp_path):
    said = said_by("build123d_bracket.py", tmp_path)
    before, after = map(int, re.findall(r"(?:volume|drilled) (\d+)", said))
    assert 60 * 30 * 12 + 12 * 30 * 24 < before < 1.15 * (60 * 30 * 12 + 12 * 30 * 24)
    # A hole of 3 mm through 12 mm, and through symbols of 1 mm where it meets them.
    assert 84 < before - after < 100
    assert {path.suffix for path in (tmp_path / "out" / "bracket").iterdir()} == {
        ".html", ".png", ".stl", ".svg",
    }  # fmt: skip


def test_cadquery_wedge(tmp_path):
    said = said_by("cadquery_wedge.py", tmp_path)
    assert " on 6 panels" in said
    extents = [float(n) for n in re.findall(r"([\d.]+) x ([\d.]+) x ([\d.]+) mm", said)[0]]
    # Symbols on both sides; on the slanted top they end below its highest edge.
    assert extents[0] == 51.6
    assert extents[1] == 41.6
    assert 40.0 < extents[2] < 41.6


def test_encode_set(tmp_path):
    said = said_by("encode_set.py", tmp_path)
    assert [line.partition(":")[0] for line in said.splitlines()[:3]] == ["Cube", "Box-1", "Box-2"]
    assert re.search(r"^\d+ of 65535 cells in use$", said, re.MULTILINE)


def test_simulate_and_read(tmp_path):
    said = said_by("simulate_and_read.py", tmp_path)
    assert "Cube/F3" in said.splitlines()[1]
    assert float(re.findall(r"off by ([\d.]+) mm", said)[0]) < 0.1


def test_read_recording(tmp_path):
    said = said_by("read_recording.py", tmp_path).splitlines()
    assert said[0] == "touches.h5: 40 frames, by simulated/tab"
    assert len(said) == 6
    assert sum("Cube/F2" in line for line in said) >= 3


def test_follow_port(tmp_path):
    assert "Cube/F1" in said_by("follow_port.py", tmp_path)


def test_ros2_node(tmp_path):
    said = said_by("ros2_node.py", tmp_path)
    x, y, z = (float(n) for n in re.findall(r"'[xyz]': ([-\d.e]+)", said))
    assert said.startswith("Cube ")
    assert (x**2 + y**2 + z**2) ** 0.5 < 0.02  # the origin is the middle of the face, in metres


def test_scan(tmp_path):
    assert said_by("scan.py", tmp_path).splitlines()[-1].endswith("touches: Plate")


def test_decode_windows(tmp_path):
    said = said_by("decode_windows.py", tmp_path).splitlines()
    assert said[0] == "row 1, column 61 (t = 2206)"
    assert said[2] == "2206"
    assert said[3].endswith("Cube/F1")


def test_own_sensor_data(tmp_path):
    said = said_by("own_sensor_data.py", tmp_path).splitlines()
    assert said[0].startswith("mine.h5: 2 frames")
    assert ["Cube/F4" in line for line in said[1:]] == [True, True], said


def test_report(tmp_path):
    said = said_by("report.py", tmp_path)
    assert re.match(r"40 touches: \d+ right, 0 wrong, ", said)
    assert said.endswith("True\n")


def test_trimesh_part(tmp_path):
    (symbols,) = re.findall(r"^Block: 6 faces, (\d+) symbols", said_by("trimesh_part.py", tmp_path))
    assert 320 < int(symbols) < 350  # of 5 mm; how faces are laid out depends on the lab's array


def test_mujoco_bench(tmp_path):
    """Three objects on a table, found by touch alone; poses as the simulator has them."""
    told = [json.loads(line) for line in said_by("mujoco_bench.py", tmp_path).splitlines()]
    assert [one["answer"] for one in told] == [one["object"] for one in told]
    assert {one["object"] for one in told} == {"Cube", "Box", "Prism"}
    assert max(one["position_mm"] for one in told) < 2.0
    assert max(one["turn_deg"] for one in told) < 2.0
    assert max(one["chi2"] for one in told) < 22.5  # 1 of 1,000 lies beyond


def test_examples_are_short_and_all_shown_and_run():
    scripts = {path.stem: path.read_text() for path in EXAMPLES.glob("*.py")}
    long = {stem for stem, text in scripts.items() if text.count("\n") > 30}
    assert long == {"mujoco_bench"}  # a world
    shown = re.findall(r"examples/(\w+)\.py", (EXAMPLES.parent / "examples.md").read_text())
    assert sorted(shown) == sorted(scripts)
    assert {f"test_{stem}" for stem in scripts} <= set(globals())
