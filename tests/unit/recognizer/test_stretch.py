"""The stretch of one touch: what the reader's one scale cannot say."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from encoded_objects import encode
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.simulate.registered import registered_surface
from recognizer.as_built.touches import measure_prints
from recognizer.errors import AsBuiltError
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchImage

MIDDLE = np.array([20.0, 20.0])


@dataclass(frozen=True)
class Stretched:
    """A surface that is stretched about the middle of a 40 mm face."""

    surface: object
    matrix: np.ndarray

    @property
    def top_mm(self):
        return self.surface.top_mm

    def heights_mm(self, points):
        back = (points - MIDDLE) @ np.linalg.inv(self.matrix).T
        return self.surface.heights_mm(back + MIDDLE)


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stretch")
    for name in ("Cube", "Other"):
        encode(
            {"name": name, "shape": {"cube": "40 mm"}},
            database=f"sqlite:///{folder}/lab.db", folder=folder, formats=("stl",),
        )  # fmt: skip
    return Reader(open_lab(folder / "lab.db"))


def felt(reader, matrix, touch, name="Cube", seq=0):
    scene = registered_surface(reader.lab.url, name, "F1")
    forces = press(Stretched(scene.surface, matrix), reader.sensor, touch).forces_n
    return TouchImage(seq, 0, 1, 100 * forces, np.zeros(4), None)


@pytest.mark.parametrize(
    "matrix", [np.diag([0.98, 1.0]), np.diag([1.0, 1.02]), np.array([[1.0, 0.015], [0.0, 1.0]])]
)
def test_a_touch_tells_scales_and_skew_of_the_print(reader, matrix):
    touches = [
        felt(reader, matrix, Touch(18.0, 21.5, turn, 80.0)) for turn in (0.3, 1.9, -2.2, -0.8)
    ]
    found = np.mean([one.strain for one in measure_prints(reader, touches)], axis=0)
    E = (matrix.T @ matrix - np.eye(2)) / 2
    np.testing.assert_allclose(found, (E[0, 0], E[1, 1], E[0, 1]), atol=0.002)


def test_an_answer_carries_scale_and_stroke(reader):
    for scale in (0.985, 1.0, 1.015):
        image = felt(reader, scale * np.eye(2), Touch(18.0, 21.5, 0.3, 80.0))
        answer = reader.read(image.counts)
        assert answer.scale == pytest.approx(scale, abs=0.003)
        assert answer.stroke_mm == pytest.approx(1.0, abs=0.16)
        said = answer.as_json()
        assert (said["scale"], said["stroke_mm"]) == (answer.scale, answer.stroke_mm)
    nothing = reader.read(np.zeros((16, 16)))
    assert (nothing.scale, nothing.as_json()["stroke_mm"]) == (None, None)


def test_touches_that_tell_no_print_are_named(reader):
    blank = TouchImage(0, 0, 1, np.zeros((16, 16)), np.zeros(4), None)
    with pytest.raises(AsBuiltError, match=r"none of 2 touches tells of a print: 2 no contact"):
        measure_prints(reader, [blank, blank])
    with pytest.raises(AsBuiltError, match="no touch"):
        measure_prints(reader, [])
    at = Touch(18.0, 21.5, math.radians(20), 80.0)
    both = [felt(reader, np.eye(2), at, name) for name in ("Cube", "Other", "Cube")]
    with pytest.raises(AsBuiltError, match=r"touches of 2 objects: Cube \(2\), Other \(1\)"):
        measure_prints(reader, both, place="touch.h5")
