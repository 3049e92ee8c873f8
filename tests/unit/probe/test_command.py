"""`probe-sensor` in one process: what each command prints and writes, and how it is misused."""

import io
import json
from functools import partial

import numpy as np
import pytest
from recorded import record
from reference.drawn_fsr import read_sequence

from probe.calibration import calibration_from, even_load, write_calibration
from probe.circuit import Electronics, fsr_of
from probe.command import run
from probe.command.calibrated import board_from, loads_given
from probe.errors import CalibrationError, CircuitError
from probe.frame import frame_from, median_filter

FORCES = (0, 40, 100, 200, 400)


def recorded(path, counts, **named):
    record(path, (frame_from(c, t_ns=i * 4_545_455, seq=i) for i, c in enumerate(counts)), **named)
    return path


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Recordings of even loads, their calibration, and one recording of noise."""
    folder = tmp_path_factory.mktemp("bench")
    rng, board = np.random.default_rng(3), Electronics()
    loads = {}
    for force in FORCES:
        forces = np.full((60, 16, 16), force / 256)
        loads[force], _ = read_sequence(forces, board, fsr_of(16, 16), None, rng)
        recorded(folder / f"load{force}.h5", loads[force], sensor="bench/0")
    made = calibration_from(
        loads[0], [even_load(loads[f], f, name=f"{f} N") for f in FORCES[1:]],
        sensor="bench/0", made="2026-01-01", board=board,
    )  # fmt: skip
    write_calibration(made, folder / "bench.json")
    noise = rng.integers(0, 1024, (30, 16, 16))
    recorded(folder / "noise.h5", noise, sensor="sim/0")
    np.save(folder / "noise.npy", noise)
    return folder


@pytest.fixture
def asked(ask):
    return partial(ask, run)


def error_of(result):
    code, out, err = result
    assert out == ""
    assert err.count("error: ") == 1, err
    return code, err


def test_a_calibration_of_another_sensor_is_refused(asked, bench, tmp_path):
    calibration = ("--calibration", bench / "bench.json")
    for words in (
        ["record", "sim:", "-o", tmp_path / "a.h5", "--frames", "2"],
        ["live", "sim:", "--seconds", "1"],
        ["export", bench / "noise.h5", "--npy", tmp_path / "a.npy"],
        ["calibrate", "bias", bench / "noise.h5"],
    ):
        code, err = error_of(asked(*words, *calibration))
        assert code == 2
        assert "is of sensor 'bench/0', not of 'sim/0'" in err
    other = recorded(
        tmp_path / "b.h5", np.zeros((3, 16, 16)), sensor="bench/0", calibration="0" * 64
    )
    code, err = error_of(asked("export", other, "--npy", tmp_path / "a.npy", *calibration))
    assert code == 2
    assert "made with calibration 000000000000..." in err
    assert not (tmp_path / "a.npy").exists()


def test_export_in_newtons(asked, bench, tmp_path):
    out = tmp_path / "a.npy"
    words = ["export", bench / "load100.h5", "--npy", out, "--calibration", bench / "bench.json"]
    assert asked(*words)[0] == 0
    newtons = np.load(out)
    assert newtons.dtype == np.float32
    assert newtons.mean(axis=0).sum() == pytest.approx(100, rel=0.03)
    clear = tmp_path / "b.npy"
    assert asked(*words[:3], clear, *words[4:], "--deblur", "1")[0] == 0
    assert np.load(clear).mean(axis=0).sum() == pytest.approx(newtons.mean(axis=0).sum(), rel=0.1)
    assert np.load(clear).std() > newtons.std()
    assert "--calibration" in error_of(asked(*words[:4], "--deblur", "1"))[1]
    _, err = error_of(asked(*words[:3], tmp_path / "c.npy", *words[4:], "--deblur", "8"))
    assert "at most 3" in err
    _, err = error_of(asked(*words[:2], "--csv", tmp_path / "a.csv", *words[4:]))
    assert "--csv and --mcap hold counts" in err


def test_recordings_of_two_sensors_give_no_calibration(asked, bench, tmp_path):
    words = [f"{bench / f'load{force}.h5'}={force}" for force in FORCES]
    words += [f"{bench / 'noise.h5'}=30", "-o", tmp_path / "c.json"]
    code, err = error_of(asked("calibrate", "loads", *words))
    assert code == 2
    assert "bench/0, sim/0" in err
    assert not (tmp_path / "c.json").exists()


def test_a_guided_calibration_needs_somebody_to_answer(asked, tmp_path, monkeypatch):
    words = ["calibrate", "port", "sim:", "-o", tmp_path / "a.json", "--seconds", "0.3",
             "--newtons", "20"]  # fmt: skip
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    code, _, err = asked(*words)
    assert code == 2
    assert "the input ended before the calibration did" in err
    monkeypatch.setattr("sys.stdin", io.StringIO("\nr\n\n\n\n\nmuch\n\n"))
    code, _, err = asked(*words)
    assert code == 2
    assert err.count("1/2  unload the sensor") == 2, "it is read again where that is asked"
    assert "2/2  put 20 N on the whole sensor" in err
    assert "not yet: " in err
    assert "'much' is no force above 0" in err
    assert not (tmp_path / "a.json").exists()
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == ["load-0-0N.h5", "load-1-20N.h5", "loads.csv"]


def test_bias_warns_of_drift_with_code_1(asked, bench):
    words = ["calibrate", "bias", bench / "load0.h5", "--calibration", bench / "bench.json"]
    code, out, err = asked(*words)
    assert (code, err) == (0, "")
    assert "0.00 counts at most since 2026-01-01" in out
    words[2] = bench / "load40.h5"
    code, _, err = asked(*words)
    assert code == 1
    assert "warning: " in err
    assert "calibrate again" in err
    assert json.loads(asked(*words, "--json")[1])["shift_counts"] > 20


def test_attributes_cannot_command_a_terminal(asked, tmp_path):
    more = {"note": "a\x1b[31mred\x07", "bell\x07": "b"}
    recorded(tmp_path / "a.h5", np.zeros((2, 16, 16), np.uint16), attributes=more)
    code, out, err = asked("info", str(tmp_path / "a.h5"))
    assert (code, err) == (0, "")
    assert "a\ufffd[31mred\ufffd" in out
    assert "bell\ufffd" in out
    assert not {"\x1b", "\x07"} & set(out)


def test_boards_from_text():
    assert board_from("none") is None
    assert board_from("simulated") == Electronics()
    board = board_from("readout=floating,load_ohm=1e4,bits=8")
    assert (board.readout, board.load_ohm, board.bits) == ("floating", 1e4, 8)
    for text in ("colour=red", "bits=few", "readout=none", "load_ohm=-1"):
        with pytest.raises(CircuitError) as refused:
            board_from(text)
        assert refused.value.fix


def test_the_median_filter_takes_single_tactels_away():
    image = np.zeros((16, 16))
    image[5, 5] = 900
    assert not median_filter(image).any()
    image[:, 8:] = 100
    assert (median_filter(image)[:, 8:] == 100).all()
    assert (median_filter(image)[:, :8] == 0).all()


def test_lists_of_loads(tmp_path):
    (tmp_path / "share.csv").write_text("\n".join(",".join("1" * 16) for _ in range(16)))
    path = tmp_path / "list.csv"
    path.write_text("\ufeffrecording,newtons,footprint\na.h5,0,\nb.h5,12.5,share.csv\n")
    rest, load = loads_given([str(path)])
    assert (rest.newtons, rest.footprint) == (0, None)
    assert (load.recording, load.newtons, load.footprint.sum()) == (tmp_path / "b.h5", 12.5, 256)
    for row in ("recording,force\na.h5,1", "recording,newtons\na.h5,nan",
                "recording,newtons,footprint\na.h5,1,list.csv"):  # fmt: skip
        path.write_text(row + "\n")
        with pytest.raises(CalibrationError, match="; ") as refused:
            loads_given([str(path)])
        assert str(tmp_path) in refused.value.place
