"""Recordings and a calibration of earlier code are read bit for bit; its database answers them."""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from encoded_objects import Reader, open_lab
from encoded_objects.base.sensor_type import choose_sensor_type
from probe.calibration.file import calibration_hash, read_calibration, write_calibration
from probe.recording.read import Recording

EARLIER = Path(__file__).parents[3] / "fixtures" / "recordings"
DATABASES = EARLIER.parent / "database"
AS_READ = json.loads((EARLIER / "as_read.json").read_text())


@pytest.mark.parametrize("name", ["touch.h5", "scan.h5"])
def test_every_byte_is_read_as_it_was(name):
    recording, told = Recording(EARLIER / name), AS_READ[name]
    assert len(recording) == told["frames"]
    assert (recording.origin.sensor, recording.origin.units) == (told["sensor"], told["units"])
    arrays = recording.block().datasets()
    assert {key for key, values in arrays.items() if values is not None} == set(told["arrays"])
    for key, expected in told["arrays"].items():
        held = np.ascontiguousarray(arrays[key])
        assert hashlib.sha256(held.tobytes()).hexdigest() == expected, key


def test_a_calibration_keeps_its_bytes_and_its_hash(tmp_path):
    held = read_calibration(EARLIER / "calibration.json")
    assert calibration_hash(held) == AS_READ["calibration.json"]["sha256"]
    write_calibration(held, tmp_path / "again.json")
    again = (tmp_path / "again.json").read_bytes()
    assert again == (EARLIER / "calibration.json").read_bytes()


def test_without_a_type_a_recording_is_of_the_usual_one_and_its_database_names_it(tmp_path):
    shutil.copy(DATABASES / "v2.db", tmp_path / "lab.db")
    recording = Recording(EARLIER / "touch.h5")
    sensor = choose_sensor_type(None, recording.origin.sensor_type, (16, 16), "touch.h5")
    assert sensor.name == "fsr-16"
    counts = recording.block().counts.mean(axis=0)
    answer = Reader(open_lab(tmp_path / "lab.db"), sensor).read(counts)
    assert (answer.object, answer.face, answer.index) == ("Cube", "F1", (2, 2))
    assert (answer.x_mm, answer.y_mm) == pytest.approx((16.0, 14.0), abs=0.05)
    assert answer.theta_deg == pytest.approx(25.0, abs=0.2)
