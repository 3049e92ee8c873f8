"""What README, CONTRIBUTING, the guide and docs/examples show runs, and says what it promises."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from corpora.commands import Commands, started_server

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "examples"
BLOCKS = {
    f"{document.name}:{number}": code
    for document in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "docs/apriltag.md")
    for number, code in enumerate(
        re.findall(r"^```python\n(.*?)^```", document.read_text(), re.MULTILINE | re.DOTALL), 1
    )
}


@pytest.fixture(scope="module")
def encoded(tmp_path_factory):
    """A folder with the database of a registered cube."""
    from generator import encode

    folder = tmp_path_factory.mktemp("lab")
    cube = ROOT / "fixtures" / "cube.yaml"
    encode(cube, database=str(folder / "lab.db"), folder=folder / "out", formats=())
    return folder


@pytest.fixture
def lab(encoded, tmp_path):
    return shutil.copytree(encoded, tmp_path, dirs_exist_ok=True)


@pytest.mark.parametrize("block", BLOCKS)
def test_python_of(block, lab):
    done = subprocess.run(
        [sys.executable, "-c", BLOCKS[block]], cwd=lab, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    for line, said in re.findall(r"^print\((.*)\)  # (.*)$", BLOCKS[block], re.MULTILINE):
        assert said in done.stdout.splitlines(), line


def test_the_touch_of_the_readme_is_recognised(lab):
    shown = (ROOT / "README.md").read_text().partition("## Touch it")[2]
    commands = re.findall(r"^```sh\n(.*?)^```", shown, re.MULTILINE | re.DOTALL)[0]
    here = commands.replace(".venv/bin/", f"{Path(sys.executable).parent}/")
    done = subprocess.run(here, shell=True, cwd=lab, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Cube/F1 at (28." in done.stdout or "Cube/F1 at (27.9" in done.stdout


def test_the_readme_is_two_screens_before_it_tests():
    before = (ROOT / "README.md").read_text().partition("## Test it")[0]
    assert before.count("\n") <= 100


def test_the_glossary_points_to_modules_that_are_there():
    places = re.findall(r"`(\w+/[\w/]+\.py)`", (ROOT / "docs" / "glossary.md").read_text())
    assert len(places) > 30
    assert [place for place in places if not (ROOT / place).is_file()] == []


@pytest.fixture(scope="module")
def said_by():
    """Return a function: script, folder -> what it prints, in a process of its own, there."""
    with started_server() as server:

        def said_by(script, folder):
            code, said, error = Commands(folder, server).run("python", EXAMPLES / f"{script}.py")
            assert code == 0, error
            return said

        yield said_by


# What scripts say, where that is soon said.
SAID = {
    "decode_windows": r"row 1, column 61 \(t = 2206\)\n.*\n2206\n.*Cube/F1\n",
    "encode_set": r"Cube:.*\nBox-1:.*\nBox-2:(?s:.*)\n\d+ of 262143 cells in use\n(?s:.*)",
    "hand_eye": r"(1[6-9]|20) of 20 .*\n0\.[01]\d mm across, -?0\.\d+ mm along, 0\.[01]\d deg.*\n",
    "mujoco_press": r"Cube/F6 at \(.*\n",
    "follow_port": r"(?s:.*)Cube/F1(?s:.*)",
    "own_sensor_data": r"mine\.h5: 2 frames.*\n.*Cube/F4.*\n.*Cube/F4.*\n",
    "read_recording": r"touches\.h5: 40 frames, by simulated/tab\n(?s:(.*Cube/F2){3}.*)",
    "report": r"40 touches: \d+ right, 0 wrong, (?s:.*)True\n",
    "scan": r"(?s:.*)touches: Plate\n",
}


@pytest.mark.parametrize("script", SAID)
def test_example(script, tmp_path, said_by):
    assert re.fullmatch(SAID[script], said_by(script, tmp_path))


def test_build123d_bracket(tmp_path, said_by):
    said = said_by("build123d_bracket", tmp_path)
    before, after = map(int, re.findall(r"(?:volume|drilled) (\d+)", said))
    assert 60 * 30 * 12 + 12 * 30 * 24 < before < 1.15 * (60 * 30 * 12 + 12 * 30 * 24)
    # A hole of 3 mm through 12 mm, and through symbols of 1 mm where it meets them.
    assert 84 < before - after < 100
    assert {path.suffix for path in (tmp_path / "out" / "bracket").iterdir()} == {
        ".html", ".png", ".stl", ".svg",
    }  # fmt: skip


def test_cadquery_wedge(tmp_path, said_by):
    said = said_by("cadquery_wedge", tmp_path)
    assert " on 6 panels" in said
    extents = [float(n) for n in re.findall(r"([\d.]+) x ([\d.]+) x ([\d.]+) mm", said)[0]]
    # Symbols on both sides; on the slanted top they end below its highest edge.
    assert extents[0] == 51.6
    assert extents[1] == 41.6
    assert 40.0 < extents[2] < 41.6


def test_simulate_and_read(tmp_path, said_by):
    said = said_by("simulate_and_read", tmp_path)
    assert "Cube/F3" in said.splitlines()[1]
    assert float(re.findall(r"off by ([\d.]+) mm", said)[0]) < 0.1


def test_ros2_node(tmp_path, said_by):
    said = said_by("ros2_node", tmp_path)
    x, y, z = (float(n) for n in re.findall(r"'[xyz]': ([-\d.e]+)", said))
    assert said.startswith("Cube ")
    assert (x**2 + y**2 + z**2) ** 0.5 < 0.02  # the origin is the middle of the face, in metres


def test_trimesh_part(tmp_path, said_by):
    (symbols,) = re.findall(r"^Block: 6 faces, (\d+) symbols", said_by("trimesh_part", tmp_path))
    assert 320 < int(symbols) < 350  # of 5 mm; how faces are laid out depends on the lab's array


def test_mujoco_arm(tmp_path, said_by):
    """Two parts in MuJoCo, found by what MuJoCo's own tactile sensor feels of their files."""
    told = re.findall(r"^(\w+) lies at .* with F\d up, found by touch alone, ([\d.]+) mm",
                      said_by("mujoco_arm", tmp_path), re.MULTILINE)  # fmt: skip
    assert [name for name, _ in told] == ["Cube", "Prism"]
    assert max(float(off) for _, off in told) < 1.0


def test_examples_are_short_and_all_shown_and_run():
    scripts = {path.stem: path.read_text() for path in EXAMPLES.glob("*.py")}
    long = {stem for stem, text in scripts.items() if text.count("\n") > 30}
    assert long == {"hand_eye", "mujoco_arm"}  # a calibration, a world
    shown = re.findall(r"examples/(\w+)\.py", (EXAMPLES.parent / "examples.md").read_text())
    assert sorted(shown) == sorted(scripts)
    assert {f"test_{stem}" for stem in scripts if stem not in SAID} <= set(globals())
