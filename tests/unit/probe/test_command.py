"""`probe-sensor` in one process: what each command prints and writes, and how it is misused."""

import csv
import io
import json
import subprocess
import sys

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from encoded_objects.base.output import write_json
from probe.calibration import calibration_from, even_load, write_calibration
from probe.circuit import QUIET, Electronics, fsr_of, read_sequence
from probe.command import run
from probe.command.calibrated import board_from, loads_given
from probe.errors import CalibrationError, CircuitError
from probe.frame import frame_from, median_filter
from probe.recording.read import Recording
from probe.recording.record import Recorder

FORCES = (0, 40, 100, 200, 400)
STEP_NS = 4_545_455


def recorded(path, counts, **named):
    with Recorder(path, **named) as recorder:
        for i, image in enumerate(counts):
            recorder.append(frame_from(image, t_ns=i * STEP_NS, seq=i))
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
def asked(capsys):
    """Run a command: code, stdout, stderr."""

    def ask(*words):
        capsys.readouterr()
        code = run([str(word) for word in words])
        return code, *capsys.readouterr()

    return ask


def error_of(result):
    code, out, err = result
    assert out == ""
    assert err.count("error: ") == 1, err
    return code, err


def test_a_part_alone_is_touched_without_a_database(tmp_path):
    part = tmp_path / "plate.stl"
    corners = np.array([[0, 0, 0], [40, 0, 0], [40, 40, 0], [0, 40, 0]], "<f4")
    facets = np.zeros(2, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["corners"] = corners[[[0, 1, 2], [0, 2, 3]]]
    part.write_bytes(bytes(80) + np.uint32(2).tobytes() + facets.tobytes())
    script = (
        "import sys\n"
        "from probe.command import run\n"
        f"code = run(['simulate', {str(part)!r}, '--x', '0', '--y', '0', '-o', 'a.h5'])\n"
        "heavy = ('sqlalchemy', 'scipy.signal', 'skfem')\n"
        "print([name for name in heavy if name in sys.modules], code)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.stdout.splitlines()[-1] == "[] 0", done.stderr


def test_the_help_loads_nothing_heavy():
    script = (
        "import sys\n"
        "from probe.command import run\n"
        "codes = [run(words) for words in (['--help'], ['simulate', '--help'], ['list', '-h'],\n"
        "                                  ['calibrate', 'loads', '--help'])]\n"
        "heavy = 'numpy scipy matplotlib h5py skfem skimage sqlalchemy serial generator'.split()\n"
        "heavy += ['pydantic', 'markdown_it']\n"
        "print([name for name in heavy if name in sys.modules], codes)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[] [0, 0, 0, 0]"
    assert "Exit codes: 0 done, 1 ran but failed, 2 bad input, 3 device, 4 database" in done.stdout


def test_without_a_command_the_help_is_shown_and_the_code_is_2(asked):
    for words, name in (((), "simulate"), (("calibrate",), "loads")):
        code, out, _ = asked(*words)
        assert code == 2
        assert "Usage: probe-sensor" in out
        assert name in out


def test_the_version(asked):
    code, out, _ = asked("--version", "--json")
    assert code == 0
    assert asked("--version")[1] == f"probe-sensor {json.loads(out)['version']}\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["simulate", "washer", "--force", "-1"], "'--force': Input should be greater"),
        (["simulate", "washer", "--nope"], "No such option: --nope"),
        (["simulate", "washer", "--overlay", "wool"], "--overlay wool: give tab or pad"),
        (["simulate", "washer", "--noise", "loud"], "--noise loud: give typical or quiet"),
        (["simulate"], "Missing argument 'TARGET'"),
        (["record", "sim:"], "Missing option '-o' / '--output'"),
        (["info", "sim:", "--sensor", "8"], "'--sensor': Input should be less"),
        (["replay", "x.h5", "--speed", "fast"], "'--speed': Input should be a valid number"),
        (["replay", "x.h5", "--speed", "nan"], "'--speed': Input should be greater"),
        (["export", "x.h5"], "nothing to write: give --csv, --npy, --png or --mcap"),
        (["calibrate", "port", "sim:", "-o", "a.json", "--newtons", "1,b"], "--newtons 1,b"),
        (["fly"], "No such command 'fly'"),
    ],
)
def test_a_misused_option_is_named(asked, words, said):
    code, err = error_of(asked(*words))
    assert code == 2
    assert f"error: {said}" in err
    called = {"fly": [], "calibrate": words[:2]}.get(words[0], words[:1])
    assert f"fix: see {' '.join(['probe-sensor', *called])} --help" in err
    code, out, err = asked(*words, "--json")
    if words[0] == "fly":
        return
    assert (code, err) == (2, "")
    assert json.loads(out)["error"]["cause"].startswith(said)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["info", "gone.h5"], 2, "there is no such recording"),
        (["info", "gone.json"], 2, "cannot be read: No such file"),
        (["info", "/dev/ttyGONE"], 3, "write serial:///dev/ttyGONE"),
        (["info", "serial:///dev/ttyGONE"], 3, "there is no /dev/ttyGONE"),
        (["info", "sim:?firmware=avr"], 3, "its options are rate, sensor_type"),
        (["live", "sim:nothing"], 2, "this names no surface"),
        (["live", "sim:gone.db#Cube/F1"], 4, "this database does not exist"),
        (["record", "file:gone.h5", "-o", "a.h5"], 2, "there is no such recording"),
        (["record", "sim:", "-o", "a.csv"], 2, "take a name like touch.h5"),
        (["record", "sim:", "-o", "gone/a.h5", "--frames", "1"], 2, "make the folder first"),
        (["record", "sim:", "-o", "a.h5", "--calibration", "gone.json"], 2, "No such file"),
        (["replay", "gone.h5"], 2, "there is no such recording"),
        (["export", "gone.h5", "--csv", "a.csv"], 2, "there is no such recording"),
        (["export", "gone.h5", "--npy", "a.txt"], 2, "write a.npy"),
        (["export", "gone.h5", "--png", "gone/a.png"], 2, "there is no folder gone"),
        (["import", "gone.npy", "-o", "a.h5"], 2, "there is no such recording"),
        (["repair", "gone.h5"], 2, "gone.h5"),
        (["calibrate", "bias", "gone.h5"], 2, "there is no such recording"),
        (["calibrate", "loads", "gone.h5", "-o", "a.json"], 2, "write gone.h5=NEWTONS"),
        (["calibrate", "loads", "gone.h5=0", "-o", "a.txt"], 2, "write a.json"),
        (["simulate", "gone.stl"], 2, "a file that you can read"),
        (["simulate", "cube"], 2, "write part.stl, or database#object/face"),
        (["simulate", "gone.db#Cube/F1"], 4, "this database does not exist"),
        (["simulate", "washer", "--x", "99", "-o", "a.h5"], 2, "move the sensor over the object"),
        (["simulate", "washer", "--accuracy", "layer"], 2, "take auto, an error such as 0.01"),
        (["simulate", "washer", "--accuracy", "1e-9"], 2, "ask for"),
        (["simulate", "washer", "--theta", "inf"], 2, "give mm, degrees and N"),
        (["simulate", "washer", "--truth", "a.txt"], 2, "write a.json"),
    ],
)  # fmt: skip
def test_what_is_not_there_is_one_message_with_a_way_out_and_no_file(
    asked, tmp_path, monkeypatch, words, code, said
):
    monkeypatch.chdir(tmp_path)
    given, err = error_of(asked(*words))
    assert given == code
    assert said in err
    assert "fix: " in err
    again, out, err = asked(*words, *(() if words[0] == "replay" else ("--json",)))
    assert again == code
    if words[0] != "replay":
        assert err == ""
        assert json.loads(out)["error"]["exit_code"] == code
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_is_kept(asked, bench, tmp_path):
    kept = {}
    for name in ("a.h5", "a.csv", "a.npy", "a.png", "a.json"):
        (tmp_path / name).write_text("mine")
        kept[name] = tmp_path / name
    for words in (
        ["record", "sim:", "-o", kept["a.h5"], "--frames", 1],
        ["import", bench / "noise.npy", "-o", kept["a.h5"]],
        ["simulate", "washer", "-o", kept["a.h5"]],
        ["simulate", "washer", "--png", kept["a.png"]],
        ["export", bench / "noise.h5", "--csv", kept["a.csv"]],
        ["export", bench / "noise.h5", "--npy", kept["a.npy"]],
        ["calibrate", "loads", bench / "load0.h5=0", "-o", kept["a.json"]],
    ):
        code, err = error_of(asked(*words))
        assert code == 2
        assert "--replace" in err
    assert {path.read_text() for path in tmp_path.iterdir()} == {"mine"}


def test_list_names_what_works_without_a_probe(asked):
    code, out, _ = asked("list", "--json")
    assert code == 0
    listed = json.loads(out)
    assert all(port["url"].startswith("serial://") for port in listed["ports"])
    assert "sim:" in {one["url"] for one in listed["always"]}


def test_info_of_a_probe_a_recording_and_a_calibration(asked, bench):
    code, out, _ = asked("info", "sim:?rate=200", "--seconds", "0.3", "--sensor", "3", "--json")
    probe = json.loads(out)
    assert (code, probe["sensor"], probe["client"]["lost"]) == (0, "sim/3", 0)
    assert probe["client"]["frames"] >= 30
    assert probe["device"]["frames"] >= 30
    assert probe["ident"]["bits"] == 10

    values = json.loads(asked("info", bench / "load40.h5", "--json")[1])
    assert (values["frames"], values["sensor"], values["lost"]) == (60, "bench/0", 0)
    assert values["rate"] == pytest.approx(220, abs=0.01)
    assert "60 in 0.27 s, 220.0 a second" in asked("info", bench / "load40.h5")[1]

    values = json.loads(asked("info", bench / "bench.json", "--json")[1])
    assert (values["sound"], values["sensor"]) == (256, "bench/0")
    assert asked("info", bench / "bench.json")[1].count("\n") > 8


@pytest.mark.parametrize("command", [("info",), ("calibrate", "bias")])
def test_a_scheme_that_nobody_opens_is_no_missing_file(asked, command):
    code, _, err = asked(*command, "udp://0.0.0.0:5005")
    assert code == 3
    assert "must begin with serial:, flexitac:, sim: or file:" in err
    assert "recording" not in err.replace("file:recording.h5", "")


def test_record_ends_by_frames_and_by_seconds(asked, tmp_path):
    out = tmp_path / "a.h5"
    code, text, err = asked("record", "sim:?rate=500", "-o", out, "--frames", "40", "--json")
    assert (code, err) == (0, "")
    told = json.loads(text)
    assert (told["frames"], told["ended"], told["lost"]) == (40, "frames", 0)
    frames = list(Recording(out).frames())
    assert [f.seq - frames[0].seq for f in frames] == list(range(40))
    assert Recording(out).origin.sensor == "sim/0"
    code, text, _ = asked("record", "sim:?rate=500", "-o", out, "--seconds", "0.2", "--replace")
    assert code == 0
    assert "100 frames in 0.20 s (500.0 a second), lost 0" in text


def test_a_played_recording_keeps_its_sensor_and_its_calibration(asked, bench, tmp_path):
    out, calibration = tmp_path / "a.h5", bench / "bench.json"
    url = f"file:{bench / 'load40.h5'}?speed=0"
    assert asked("record", url, "-o", out, "--calibration", calibration)[0] == 0
    made = Recording(out)
    assert made.origin.sensor == "bench/0"
    assert (made.block().counts == Recording(bench / "load40.h5").block().counts).all()
    digest = json.loads(asked("info", calibration, "--json")[1])["hash"]
    assert made.origin.calibration == digest


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


def test_replay_writes_every_frame_in_its_time(asked, bench):
    path = bench / "noise.h5"
    held = list(Recording(path).frames())
    for speed in ("0", "2"):
        code, out, _ = asked("replay", path, "--speed", speed)
        rows = list(csv.reader(out.splitlines()))
        assert code == 0
        assert len(rows) == 31
        assert rows[0][:3] == ["seq", "t_ns", "r0c0"]
        assert [int(value) for value in rows[7][2:258]] == held[6].counts.ravel().tolist()
    code, out, _ = asked("replay", path, "--speed", "0", "--json")
    frames = [json.loads(line) for line in out.splitlines()]
    assert [frame["seq"] for frame in frames] == [frame.seq for frame in held]
    assert (np.array(frames[-1]["counts"]) == held[-1].counts).all()


def test_export_and_import_give_the_same_images(asked, bench, tmp_path):
    path, table, array = bench / "noise.h5", tmp_path / "a.csv", tmp_path / "a.npy"
    code, out, _ = asked("export", path, "--csv", table, "--npy", array, "--json")
    assert (code, json.loads(out)["frames"]) == (0, 30)
    images = np.load(bench / "noise.npy")
    assert (np.load(array) == images).all()
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [int(row["r15c15"]) for row in rows] == images[:, 15, 15].tolist()

    savemat(tmp_path / "b.mat", {"pressure": images / 1023})
    for source, scale in ((array, 1), (tmp_path / "b.mat", 1 / 1023)):
        made = tmp_path / f"{source.stem}.h5"
        code, out, _ = asked("import", source, "-o", made, "--json")
        told = json.loads(out)
        assert (code, told["frames"]) == (0, 30)
        counts = Recording(made).block().counts * told.get("scale", 1)
        assert counts == pytest.approx(images * scale, abs=2e-5)
    words = ["import", bench / "load0.h5", "-o", tmp_path / "c.h5", "--dataset", "nothing"]
    assert error_of(asked(*words))[0] == 2


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
    assert (
        "at most 3"
        in error_of(asked(*words[:3], tmp_path / "c.npy", *words[4:], "--deblur", "8"))[1]
    )
    _, err = error_of(asked(*words[:2], "--csv", tmp_path / "a.csv", *words[4:]))
    assert "--csv and --mcap hold counts" in err


def test_a_picture_of_a_frame_that_is_not_there(asked, bench, tmp_path):
    words = ["export", bench / "noise.h5", "--png", tmp_path / "a.png", "--frame", "30"]
    code, err = error_of(asked(*words))
    assert (code, list(tmp_path.iterdir())) == (2, [])
    assert "frame 30 was asked for, it holds 30" in err
    assert "take 0 ... 29" in err


def test_repair_tells_whether_there_was_anything_to_do(asked, bench, tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes((bench / "noise.h5").read_bytes())
    assert asked("repair", path)[1] == f"{path} is whole; 30 frames\n"
    told = json.loads(asked("repair", path, "--json")[1])
    assert (told["changed"], told["frames"], told["lost"]) == (False, 30, 0)
    with h5py.File(path, "r") as file:
        assert file["frames"].shape == (30, 16, 16)


def test_calibrate_from_recordings_and_from_their_table(asked, bench, tmp_path):
    words = [f"{bench / f'load{force}.h5'}={force}" for force in FORCES]
    common = ["--board", "simulated", "--made", "2026-01-01", "--json"]
    code, out, _ = asked("calibrate", "loads", *words, "-o", tmp_path / "a.json", *common)
    first = json.loads(out)
    assert (code, first["sound"], first["loads"]) == (0, 256, ["40 N", "100 N", "200 N", "400 N"])
    assert all(0 < line["median"] < 0.4 for line in first["uncertainty"])
    lines = ["recording,newtons", *(f"{bench / f'load{force}.h5'},{force}" for force in FORCES)]
    (tmp_path / "list.csv").write_text("\n".join(lines))
    code, out, _ = asked("calibrate", "loads", tmp_path / "list.csv", "-o", tmp_path / "b.json",
                         *common)  # fmt: skip
    assert json.loads(out)["hash"] == first["hash"]
    code, err = error_of(asked("calibrate", "loads", *words[:2], "-o", tmp_path / "c.json"))
    assert code == 2
    assert "fix: add" in err
    code, err = error_of(asked("calibrate", "loads", *words[1:], "-o", tmp_path / "c.json"))
    assert "add one with 0 N" in err
    mixed = [*words, f"{bench / 'noise.h5'}=30"]
    code, err = error_of(asked("calibrate", "loads", *mixed, "-o", tmp_path / "c.json"))
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


def test_simulate_gives_recording_picture_and_truth(asked, tmp_path):
    out, png, truth = tmp_path / "a.h5", tmp_path / "a.png", tmp_path / "a.json"
    words = ["simulate", "washer", "--x", "1.5", "--theta", "10", "--force", "80", "--frames", "3",
             "--touches", "2", "--seed", "4"]  # fmt: skip
    code, text, err = asked(*words, "-o", out, "--png", png, "--truth", truth, "--json")
    told = json.loads(text)
    assert (code, err) == (0, "")
    assert (told["touches"], told["frames"], told["overlay"]) == (2, 6, "tab")
    assert told["first"]["felt_n"] == pytest.approx(80, abs=1e-3)
    held = Recording(out)
    assert (len(held), held.origin.sensor) == (6, "simulated/tab")
    assert held.block().counts.max() >= told["first"]["peak_counts"]
    assert not any("mm" in name for name in held.origin.more), "the truth is not in the recording"
    kept = json.loads(truth.read_text())["touches"]
    assert [one["seq"] for one in kept] == [0, 3]
    assert [one["x_mm"] for one in kept] == [1.5, 1.5]
    assert [one["theta_deg"] for one in kept] == pytest.approx([10, 10])
    assert kept[0]["y_mm"] != kept[1]["y_mm"]
    assert png.read_bytes().startswith(b"\x89PNG")

    asked(*words, "-o", tmp_path / "b.h5")
    again = Recording(tmp_path / "b.h5").block().counts
    assert (again == held.block().counts).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.h5", "a.json", "a.png", "b.h5"]


def test_touch_i_is_the_same_among_any_number_of_touches(asked, tmp_path):
    for number in (1, 3):
        words = ["--touches", number, "--noise", "quiet", "-o", tmp_path / f"{number}.h5"]
        assert (
            asked("simulate", "washer", "--overlay", "pad", "--accuracy", "footprint", *words)[0]
            == 0
        )
    few, many = (Recording(tmp_path / f"{n}.h5").block().counts for n in (1, 3))
    assert (few[0] == many[0]).all()
    assert not (many[0] == many[1]).all()


def test_a_scan_chooses_its_places(asked, tmp_path):
    for words in (("--scan", "spiral"), ("--scan", "raster", "--x", "1")):
        assert error_of(asked("simulate", "washer", *words))[0] == 2


def test_boards_from_text():
    assert board_from("none") is None
    assert board_from("simulated") == Electronics()
    board = board_from("readout=floating,load_ohm=1e4,bits=8")
    assert (board.readout, board.load_ohm, board.bits) == ("floating", 1e4, 8)
    for text in ("colour=red", "bits=few", "readout=none", "load_ohm=-1"):
        with pytest.raises(CircuitError) as refused:
            board_from(text)
        assert refused.value.fix


def test_lists_of_loads(tmp_path):
    (tmp_path / "share.csv").write_text("\n".join(",".join("1" * 16) for _ in range(16)))
    path = tmp_path / "list.csv"
    path.write_text("\ufeffrecording,newtons,footprint\na.h5,0,\nb.h5,12.5,share.csv\n")
    rest, load = loads_given([str(path)])
    assert (rest.newtons, rest.footprint) == (0, None)
    assert (load.recording, load.newtons, load.footprint.sum()) == (tmp_path / "b.h5", 12.5, 256)
    for text in ("recording,force\na.h5,1\n", "recording,newtons\na.h5,-1\n",
                 "recording,newtons\na.h5,nan\n", "recording,newtons,footprint\na.h5,1,list.csv\n",
                 "recording,newtons,footprint\na.h5,1,gone.csv\n"):  # fmt: skip
        path.write_text(text)
        with pytest.raises(CalibrationError) as refused:
            loads_given([str(path)])
        assert refused.value.fix
        assert str(tmp_path) in refused.value.place


def test_the_median_filter_takes_single_tactels_away():
    image = np.zeros((16, 16))
    image[5, 5] = 900
    assert not median_filter(image).any()
    image[:, 8:] = 100
    assert (median_filter(image)[:, 8:] == 100).all()
    assert (median_filter(image)[:, :8] == 0).all()


def test_json_is_json_whatever_the_values(capsys):
    write_json({"nan": float("nan"), "numpy": np.array([1.5, np.inf]), "path": QUIET})
    told = json.loads(capsys.readouterr().out)
    assert (told["nan"], told["numpy"]) == (None, [1.5, None])
