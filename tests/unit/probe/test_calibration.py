"""Calibrations: of simulated sensors whose truth is known, and their files; what is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reference.drawn_fsr import DATASHEET, MEASURED, Spread, draw_fsr, read_sequence

from probe.calibration import (
    Condition,
    calibrate_image,
    calibration_from,
    drift_of,
    even_load,
    expected_counts,
    known_load,
    read_calibration,
    write_calibration,
)
from probe.calibration.fit import FittedLaw, shrink_laws
from probe.calibration.load import average_frames
from probe.circuit import Electronics, Noise, fsr_of
from probe.errors import CalibrationError

BOARD = Electronics()
NONE = np.zeros((16, 16))
LEVELS = (0.1, 0.3, 0.8, 2.4)


def recorded(fsr, forces, seed, board=BOARD, frames=220):
    rng = np.random.default_rng(seed)
    steady = np.broadcast_to(forces, (frames, 16, 16))
    return read_sequence(steady, board, fsr, None, rng)[0]


def calibration_of(fsr, levels=LEVELS, board=BOARD, frames=220):
    loads = [
        known_load(recorded(fsr, NONE + f, [i], board, frames), NONE + f, f"{f} N each")
        for i, f in enumerate(levels)
    ]
    rest = recorded(fsr, NONE, 99, board, frames)
    return calibration_from(rest, loads, sensor="S1", board=board)


def test_an_average_leaves_spikes_out_and_knows_slow_noise():
    rng = np.random.default_rng(1)
    plain = np.rint(100 + 3 * rng.standard_normal((400, 4, 4)))
    spiked = plain.copy()
    spiked[rng.random(plain.shape) < 0.01] += 200
    assert np.abs(average_frames(spiked).mean - average_frames(plain).mean).max() < 0.2
    np.testing.assert_allclose(average_frames(plain).sigma, 3 / 20, rtol=0.5)
    slow = np.repeat(plain[:20], 20, axis=0)
    assert np.median(average_frames(slow).sigma) > 3 * np.median(average_frames(plain).sigma)


def test_the_condition_of_every_tactel_is_found():
    fsr = draw_fsr(np.random.default_rng(4), replace(MEASURED, preload_n=0.5))
    condition = calibration_of(fsr).condition
    np.testing.assert_array_equal(condition == Condition.DEAD, fsr.dead)
    assert ((condition == Condition.HIDDEN) <= (fsr.stuck_s > 1e-4).any(axis=0)).all()
    np.testing.assert_array_equal(condition == Condition.STUCK, fsr.stuck_s > 0)
    assert ((condition == Condition.PRELOADED) <= (fsr.preload_n > 0)).all()
    assert (condition == Condition.PRELOADED).sum() >= 3


@pytest.mark.parametrize("readout", ["grounded", "virtual"])
def test_forces_of_held_out_touches(readout):
    board = Electronics(readout=readout, feedback_ohm=1000.0)
    fsr = draw_fsr(np.random.default_rng(5), Spread(dead=0.1))
    calibration = calibration_of(fsr, np.geomspace(0.1, 2.5, 6), board)
    rng = np.random.default_rng(6)
    errors, scaled = [], []
    for seed in range(6):
        forces = np.where(rng.random((16, 16)) < 0.3, rng.uniform(0.2, 2.0, (16, 16)), 0.0)
        read = calibrate_image(
            recorded(fsr, forces, [6, seed], board, 100).mean(axis=0), calibration
        )
        well = ~read.bad & (forces > 0)
        errors.append((read.values / np.where(well, forces, 1) - 1)[well])
        single = calibrate_image(recorded(fsr, forces, [7, seed], board, 1)[0], calibration)
        scaled.append(((single.values - forces) / single.sigma)[~single.bad & (forces > 0)])
    assert np.median(np.abs(np.concatenate(errors))) < 0.06
    usual = np.abs(np.concatenate(scaled))
    assert 0.7 < np.sqrt((usual[usual < 8] ** 2).mean()) < 1.4
    assert (usual > 8).mean() < 0.01  # spikes


STILL = replace(BOARD, noise=Noise(0.3, 0, 0.05, 0, 0))  # a contact that does not flutter
DEAD = replace(fsr_of(), dead=NONE == 0)
BRIGHT = replace(STILL, readout="virtual", feedback_ohm=1e5)


@pytest.mark.parametrize(
    ("match", "fsr", "levels", "board"),
    [
        (r"felt 2 different loads clearly, a law needs 3; add 1 on them", fsr_of(), (0.3, 1.0),
         STILL),
        (r"felt loads of 0.5 ... 0.6 N only.*add a load of 1.5 N", fsr_of(), (0.5, 0.55, 0.6),
         STILL),
        (r"carried less than 0.2 N", fsr_of(), (0.02, 0.05, 0.1), STILL),
        (r"256 tactels \[\(0, 0\), \(0, 1\)", fsr_of(), (0.5, 0.5, 0.5), STILL),
        (r"saturated.*below 0.3", fsr_of(), (0.3, 1.0, 2.4), BRIGHT),
        ("no tactel responds", DEAD, LEVELS, STILL),
    ],
)  # fmt: skip
def test_loads_that_do_not_determine_the_laws_are_named(match, fsr, levels, board):
    with pytest.raises(CalibrationError, match=match):
        calibration_of(fsr, levels, board, frames=20)


FRAMES = np.zeros((20, 16, 16))
OTHER = np.zeros((20, 8, 8))


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: average_frames(FRAMES[:1]), "1 frame, at least 20 are averaged"),
        (lambda: average_frames(NONE), "shape"),
        (lambda: average_frames(FRAMES + np.nan), "shape"),
        (lambda: known_load(FRAMES, np.zeros((4, 4))), "forces"),
        (lambda: known_load(FRAMES, NONE - 1), "forces"),
        (lambda: even_load(FRAMES, 1.0, NONE), "footprint"),
        (lambda: calibration_from(FRAMES, [known_load(OTHER, OTHER[0] + 1)], sensor="S1"),
         "one sensor"),
        (lambda: calibration_from(FRAMES, [], sensor="S1"), "no loads"),
    ],
)  # fmt: skip
def test_frames_that_are_none_are_refused(call, match):
    with pytest.raises(CalibrationError, match=match):
        call()


def test_tactels_that_are_alike_help_each_other_where_loads_are_few():
    fsr = draw_fsr(np.random.default_rng(2), DATASHEET)
    calibration = calibration_of(fsr, (0.2, 0.6, 1.8))
    truth = np.log(fsr.gain_s / fsr.gain_s.mean())
    found = np.log(calibration.gain_s / np.exp(np.log(calibration.gain_s).mean()))
    assert np.std(found - truth) < 0.05
    assert calibration.exponent.std() < 0.05  # the loads alone: 0.08
    assert np.median(np.sqrt(calibration.covariance[..., 0])) < 0.05


def test_few_or_unlike_tactels_are_left_as_they_are():
    rng = np.random.default_rng(3)
    law = FittedLaw(
        np.exp(rng.normal(size=40)), 1 + 0.1 * rng.normal(size=40), 0.1 * rng.random(40),
        np.broadcast_to(1e-4 * np.eye(3), (40, 3, 3)), np.ones(40),
    )  # fmt: skip
    few = shrink_laws(law, np.arange(40) < 20)
    np.testing.assert_array_equal(few.gain_s, law.gain_s)
    apart = replace(law, gain_s=np.r_[law.gain_s[:39], 1e9])
    together = shrink_laws(apart, np.ones(40, bool))
    assert together.gain_s[39] == pytest.approx(1e9)
    np.testing.assert_allclose(together.gain_s[:39], law.gain_s[:39], rtol=0.05)


FILE = Path(__file__).parents[3] / "fixtures/recordings/calibration.json"


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
        *((lambda d, name=name, value=value: d.update({name: value}), "is damaged: ")
          for name, value in (
              ("full", "x"), ("full", None), ("full", 10**30), ("full", 0), ("sensor", []),
              ("made", 3), ("gain_s", [[]]), ("gain_s", 10**30), ("board", []),
              ("condition", [["?"]]), ("loads", 3))),
    ],
)  # fmt: skip
def test_what_was_changed_is_refused(tmp_path, change, match):
    document, path = json.loads(FILE.read_text()), tmp_path / "a.json"
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(CalibrationError, match=match) as refused:
        read_calibration(path)
    assert refused.value.place == str(path)


def test_another_sensor_s_file_and_no_file_are_refused(tmp_path):
    made = read_calibration(FILE)
    with pytest.raises(CalibrationError, match=f"'{made.sensor}', not of 'bench-2'"):
        read_calibration(FILE, sensor="bench-2")
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_calibration(tmp_path / "none.json")
    with pytest.raises(CalibrationError, match="cannot be written"):
        write_calibration(made, tmp_path / "no" / "folder" / "a.json")


def test_rest_reads_as_no_force_and_drift_of_it_warns():
    sensor = draw_fsr(np.random.default_rng(3), Spread(dead=0.05, stuck=0.01, preloaded=0.01))
    made = calibration_of(sensor, (0.1, 0.4, 1.0, 2.5))
    for seed in range(5):
        read = calibrate_image(recorded(sensor, NONE, seed)[0], made)
        assert (read.values[~read.bad] > 0).mean() < 0.02
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
