"""Calibration files: readable, the same every time, and refused when they do not fit."""

import json
import os

import numpy as np
import pytest
from reference.drawn_fsr import Spread, draw_fsr, read_sequence

from probe.calibration import (
    calibrate_image,
    calibration_from,
    drift_of,
    expected_counts,
    known_load,
    read_calibration,
    write_calibration,
)
from probe.circuit import Electronics
from probe.errors import CalibrationError

NONE = np.zeros((16, 16))
BOARD = Electronics()


@pytest.fixture(scope="module")
def sensor():
    return draw_fsr(np.random.default_rng(3), Spread(dead=0.05, stuck=0.01, preloaded=0.01))


@pytest.fixture(scope="module")
def made(sensor):
    def load(force, seed):
        return known_load(recorded(sensor, NONE + force, seed), NONE + force)

    return calibration_from(
        recorded(sensor, NONE, 0),
        [load(f, i) for i, f in enumerate((0.1, 0.4, 1.0, 2.5))],
        sensor="bench-1",
        made="2024-05-01T10:00:00Z",
        board=BOARD,
    )


def recorded(fsr, forces, seed, board=BOARD):
    rng = np.random.default_rng(seed)
    return read_sequence(np.broadcast_to(forces, (220, 16, 16)), board, fsr, None, rng)[0]


def recorded_counts():
    return np.random.default_rng(1).integers(0, 300, (16, 16))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda d: d.update(version=2), "version 2"),
        (lambda d: d.update(format="spec"), "no calibration"),
        (lambda d: d["gain_s"][3].__setitem__(3, 1.0), "was changed"),
        (lambda d: d.update(sensor="other"), "was changed"),
        (lambda d: d.update(sha256="0"), "was changed"),
        (lambda d: d.pop("gain_s"), "damaged"),
        (lambda d: d["gain_s"].pop(), "damaged"),
        (lambda d: d["board"].update(bits=99), "damaged"),
        (lambda d: d["condition"].__setitem__(0, "?" * 16), "damaged"),
    ],
)
def test_what_was_changed_is_refused(made, tmp_path, change, match):
    path = tmp_path / "a.json"
    write_calibration(made, path)
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(CalibrationError, match=match):
        read_calibration(path)


def test_another_sensor_s_file_and_no_file_are_refused(made, tmp_path):
    path = tmp_path / "a.json"
    write_calibration(made, path)
    with pytest.raises(CalibrationError, match="'bench-1', not of 'bench-2'"):
        read_calibration(path, sensor="bench-2")
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_calibration(tmp_path / "none.json")
    path.write_bytes(b"\xff\x00 nonsense")
    with pytest.raises(CalibrationError, match="JSON"):
        read_calibration(path)
    with pytest.raises(CalibrationError, match="cannot be written"):
        write_calibration(made, tmp_path / "no" / "folder" / "a.json")


def test_a_failed_writing_keeps_the_old_file(made, tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    write_calibration(made, path)
    before = path.read_bytes()

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full_disk)
    with pytest.raises(CalibrationError, match="No space"):
        write_calibration(made, path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_bad_and_saturated_tactels_tell_no_force(made):
    counts = np.full((16, 16), 200.0)
    sound = np.argwhere(made.condition == 0)[0]
    counts[tuple(sound)] = 1023
    read = calibrate_image(counts, made)
    assert read.bad[tuple(sound)]
    assert (read.bad >= made.bad).all()
    assert (read.values[read.bad] == 0).all()
    assert np.isinf(read.sigma[read.bad]).all()
    assert np.isfinite(read.values).all()


def test_rest_reads_as_no_force(made, sensor):
    for seed in range(5):
        read = calibrate_image(recorded(sensor, NONE, seed)[0], made)
        assert (read.values[~read.bad] > 0).mean() < 0.02


def test_drift_of_the_bias_warns_and_nothing_else_does(made, sensor):
    rest = recorded(sensor, NONE, 50)
    assert drift_of(made, rest).warning == ""
    moved = drift_of(made, rest + 3).warning
    assert "bias" in moved
    assert "calibrate again" in moved
    with pytest.raises(CalibrationError):
        drift_of(made, np.zeros((20, 8, 8)))
    for bad in (np.zeros((8, 8)), NONE - 1, NONE + np.nan):
        with pytest.raises(CalibrationError):
            expected_counts(bad, made)


def test_the_file_is_read_by_people(made, tmp_path):
    write_calibration(made, tmp_path / "a.json")
    document = json.loads((tmp_path / "a.json").read_text())
    assert max(map(len, (tmp_path / "a.json").read_text().splitlines())) < 1500
    letters = "".join(document["condition"])
    assert letters.count("D") + letters.count("S") == made.bad.sum()
    assert list(document)[-1] == "sha256"
