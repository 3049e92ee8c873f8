"""The file of felt images has the layout that the emulator maps."""

import re

import numpy as np
import pytest

from probe.errors import PortError
from probe.firmware.build import SOURCES
from probe.firmware.emulator import FeltImages


@pytest.fixture
def images(tmp_path):
    return FeltImages(tmp_path / "images")


def word(path, offset):
    return int(np.frombuffer(path.read_bytes(), "<u4", 1, offset)[0])


def test_layout(images, tmp_path):
    path = tmp_path / "images"
    tactels = np.arange(8 * 256, dtype=np.float32).reshape(8, 16, 16)
    images.show(tactels, [1.5, 2.5, 3.5, 4.5])
    data = path.read_bytes()
    assert data[:8] == b"PROBEIMG"
    assert [word(path, at) for at in (8, 12, 16)] == [2, 2, 1]  # version, lock, number
    assert word(path, 20) == 0  # millivolts
    assert (np.frombuffer(data, "<f4", 2048, 64) == tactels.ravel()).all()
    assert np.frombuffer(data, "<f4", 4, 8256).tolist() == [1.5, 2.5, 3.5, 4.5]
    assert len(data) == 24664


def test_the_c_side_asserts_the_same_offsets():
    stated = dict(
        re.findall(
            r"offsetof\(images_t, (\w+)\) == (\d+)", (SOURCES / "emulator/images.c").read_text()
        )
    )
    assert stated == {"tactels": "64", "wrist_mv": "8256", "felt": "8280"}


def test_images_are_numbered_and_the_lock_is_even_between_them(images, tmp_path):
    assert [images.show(np.zeros((16, 16))) for _ in range(3)] == [1, 2, 3]
    assert word(tmp_path / "images", 12) == 6


def test_one_image_is_shown_to_all_sensors_and_the_wrist_stays(images, tmp_path):
    images.show(np.full((16, 16), 7.0), [1, 2, 3, 4])
    images.show(np.full((16, 16), 9.0))
    data = (tmp_path / "images").read_bytes()
    assert (np.frombuffer(data, "<f4", 2048, 64) == 9).all()
    assert np.frombuffer(data, "<f4", 4, 8256).tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("tactels", "wrist"),
    [
        (np.zeros(256), None),
        (np.zeros((7, 16, 16)), None),
        (np.full((16, 16), np.nan), None),
        (np.full((16, 16), 1e9), None),
        (np.zeros((16, 16)), np.zeros(3)),
        (np.zeros((16, 16)), [0, 0, 0, np.inf]),
    ],
)
def test_what_is_no_image_is_refused_and_changes_nothing(images, tmp_path, tactels, wrist):
    images.show(np.ones((16, 16)))
    before = (tmp_path / "images").read_bytes()
    with pytest.raises(PortError, match="give"):
        images.show(tactels, wrist)
    assert (tmp_path / "images").read_bytes() == before
