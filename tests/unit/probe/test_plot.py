"""Pictures: the same bytes every time, whatever the settings, and of the size that was asked."""

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.plot.frame import HEAT, HEIGHT, WIDTH, frame_picture
from probe.plot.touch import MARK, OUTLINE, touch_picture
from probe.surface.indenters import Washer

SENSOR = SensorType()


def rgb(colour):
    return tuple(round(255 * part) for part in mpl.colors.to_rgb(colour))


def near(pixels, colour, within=12):
    return (np.abs(pixels.astype(int) - rgb(colour)).max(axis=-1) <= within).sum()


def pixels_of(path):
    return np.asarray(Image.open(path).convert("RGB"))


def test_a_heat_map_shows_row_0_on_top_and_column_0_at_the_left(tmp_path):
    image = np.zeros((16, 16))
    image[0, :3], image[15, 15] = 1000, 500
    frame_picture(image, tmp_path / "a.png", title="three and one")
    pixels = pixels_of(tmp_path / "a.png")
    assert pixels.shape == (HEIGHT, WIDTH, 3)
    bright = np.argwhere(np.abs(pixels[:, :425].astype(int)
                                - rgb(mpl.colormaps[HEAT](1.0))).max(axis=-1) < 3)  # fmt: skip
    low, high = bright.min(axis=0), bright.max(axis=0)
    tactel = 0.352 * WIDTH / 16
    assert low == pytest.approx([31, 70], abs=2)
    assert high - low == pytest.approx([tactel, 3 * tactel], abs=3)


def test_the_same_image_is_the_same_file_under_any_settings(tmp_path):
    image = np.random.default_rng(1).integers(0, 1024, (16, 16))
    frame_picture(image, tmp_path / "a.png", unit="N", title="a")
    with mpl.rc_context({"axes.facecolor": "red", "font.size": 30, "image.cmap": "jet"}):
        frame_picture(image, tmp_path / "b.png", unit="N", title="a")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert not mpl.get_backend().lower().startswith("qt")


def test_a_touch_shows_surface_force_and_reading(tmp_path):
    touch = Touch(1.0, -2.0, 0.5, 80.0)
    forces = press(Washer(), SENSOR, touch, accuracy="tabs-7").forces_n
    touch_picture(Washer(), SENSOR, touch, forces, 200 * forces, tmp_path / "a.png", title="washer")
    pixels = pixels_of(tmp_path / "a.png")
    wide = pixels.shape[1] // 3
    assert near(pixels[:, :wide], MARK) > 400, "the outline of the sensor"
    for panel in (pixels[:, wide : 2 * wide], pixels[:, 2 * wide :]):
        assert near(panel, OUTLINE, 40) > 60, "the outline of the washer"
