"""The compiled inner loop of the refinement gives what its numpy form gives."""

import shutil
import subprocess
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from generator.alphabet import SymbolStyle, alphabet_named
from probe.sensor import SensorType
from recognizer.touch.settings import DEFAULTS
from recognizer.touch.signal import Signal
from recognizer.touch.symbols import compiled
from recognizer.touch.symbols.gain import image_of_signal, normalize_image
from recognizer.touch.symbols.projection import project_template
from recognizer.touch.symbols.refine import refine_lattices
from recognizer.touch.symbols.template import template_of

STYLE = SymbolStyle(pitch_mm=5.0)
TRUE = np.array([[1.3, -0.7, 0.4, 0.1, 0.05, -0.02, 0.003]])


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Return evaluate.c as this machine's compiler makes it: also of a tree not installed."""
    made = tmp_path_factory.mktemp("kernels") / "evaluate.so"
    source = Path(compiled.__file__).with_name("evaluate.c")
    compile_kernels(source, made)
    return made


def compile_kernels(source, made):
    options = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", "-Wall", "-Werror"]
    made_of = f"-DSOURCE_SUM={zlib.crc32(source.read_bytes())}u"
    subprocess.run([shutil.which("cc"), *options, made_of, source, "-o", made, "-lm"], check=True)


@pytest.fixture
def use(library, monkeypatch):
    def chosen(kind):
        monkeypatch.setattr(compiled, "FILE", library)
        monkeypatch.setenv(compiled.CHOICE, kind)
        assert compiled.kernels_in_use() == kind

    return chosen


def scene(overlay="tab", *, tilt=0.0, noise=0.0, newtons=True, falls=None, dead=3):
    """Return an image of symbols pressed by a plate, its template, and the gain."""
    sensor = SensorType().with_overlay(overlay)
    template = template_of(alphabet_named("dense-4"), STYLE, sensor, DEFAULTS.template)
    draw = np.random.default_rng(7)
    trust = np.ones((16, 16))
    trust.flat[draw.choice(256, dead, replace=False)] = 0.0
    signal = Signal(np.ones((16, 16)), trust, contact=True, newtons=newtons, noise=noise)
    image = image_of_signal(sensor, signal, STYLE.height_mm)
    image = replace(image, falls=falls, noise=noise)
    gain = np.array([[np.log(image.pressing.scale), 0.3, tilt, -0.4 * tilt]])
    under = project_template(image, template, TRUE, gain)
    labels = (under.cells[..., 0] * 7 + under.cells[..., 1] * 3) % 4
    psi = np.take_along_axis(under.tables[..., 0], labels[..., None], axis=2)[0, :, 0]
    response = np.expm1(psi.clip(min=0) * np.log(4)) / 3
    felt = normalize_image(image, gain)
    forces = response * felt.plateau[0] * draw.lognormal(0, 0.08, 256) + draw.random(256) * 0.02
    return replace(image, forces=forces), template, gain


SCENES = {
    "flat": scene,
    "tilted until the bare face is pressed": lambda: scene(tilt=0.9),
    "hanging in the air": lambda: scene(tilt=0.45),
    "weak, beside noise": lambda: scene(noise=0.05),
    "counts": lambda: scene(newtons=False),
    "over a corner": lambda: over_a_corner(scene(tilt=0.6)),
    "a pad": lambda: scene("pad"),
    "a round face": lambda: scene(falls=np.linspace(0, 0.2, 256)[None]),
    "a round face under each gain": lambda: scene(
        falls=np.random.default_rng(3).random((1, 256)) * 0.3
    ),
}


def over_a_corner(found):
    image, template, gain = found
    loaded = image.points_mm.sum(axis=1) < 6.0
    forces = np.where(loaded, image.forces, 0.002 * image.forces)
    return replace(image, forces=forces, loaded=loaded), template, gain


def starts(gain, count=6):
    draw = np.random.default_rng(11)
    pose = TRUE + draw.normal(0, [0.2, 0.2, 0.05, 0.1, 0.1, 0.03, 0.003], (count, 7))
    return pose, gain * draw.lognormal(0, 0.05, (count, 4))


def given(cells):
    return np.where((cells[..., 0] + cells[..., 1]) % 5 == 0, -1, cells[..., 0] % 4)


@pytest.mark.parametrize("shown", [None, given], ids=["chosen", "given"])
@pytest.mark.parametrize("name", SCENES)
def test_one_evaluation(name, shown, use):
    image, template, gain = SCENES[name]()
    pose, gains = starts(gain)
    if name.endswith("each gain"):
        image = replace(image, falls=np.repeat(image.falls, len(pose), axis=0) * gains[:, 1:2])
    found = {}
    for kind in ("numpy", "compiled"):
        use(kind)
        found[kind] = refine_lattices(image, template, pose, gains, steps=0, shown=shown)
    expected, fast = found["numpy"], found["compiled"]
    assert fast.value == pytest.approx(expected.value, rel=1e-6, abs=1e-5)
    for one, other in ((fast.normal, expected.normal), (fast.right, expected.right)):
        size = np.sqrt(np.einsum("bii->bi", expected.normal))
        scale = size[:, :, None] * size[:, None, :] if one.ndim == 3 else 10 * size
        assert np.abs((one - other) / scale).max() < 1e-5


@pytest.mark.parametrize(
    "name", ["flat", "hanging in the air", "over a corner", "weak, beside noise", "a pad"]
)
def test_the_same_pose_is_reached(name, use):
    image, template, gain = SCENES[name]()
    pose, gains = starts(gain)
    reached = []
    for kind in ("numpy", "compiled"):
        use(kind)
        reached.append(refine_lattices(image, template, pose, gains, steps=8))
    assert np.abs(reached[0].pose[:, :3] - reached[1].pose[:, :3]).max() < 1e-6
    assert np.abs(reached[0].value - reached[1].value).max() < 1e-3


def test_what_is_missing_is_said(tmp_path, monkeypatch):
    monkeypatch.delenv(compiled.CHOICE, raising=False)
    monkeypatch.setattr(compiled, "FILE", tmp_path / "evaluate.so")
    assert compiled.compiled_kernels() is None
    assert compiled.kernels_in_use() == "numpy"


def test_what_was_made_of_another_text_is_left_out(tmp_path):
    source = tmp_path / "evaluate.c"
    source.write_text(compiled.SOURCE.read_text() + "\n")
    compile_kernels(source, tmp_path / "evaluate.so")
    assert compiled.load_kernels(tmp_path / "evaluate.so") is None


def test_scene_is_as_long_as_in_c(library):
    loaded = compiled.load_kernels(library)
    scene_of = compiled._Scene(b=2, n=5, q=3)
    assert loaded.work_size(compiled.ctypes.addressof(scene_of)) == 2 * 5 * 12 + 2 + 5 * 17 + 10
    assert compiled.ctypes.sizeof(scene_of) == 8 * (len(compiled._WHOLE) + len(compiled._REAL))
