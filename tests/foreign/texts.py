"""Calibrations, sensor states, sensor types, printers and specs."""

import io
import json
import os
from contextlib import redirect_stderr, redirect_stdout
from functools import cache

import numpy as np
import yaml

from encoded_objects.base.errors import EncodedObjectsError
from foreign.case import FIXTURES, FaultError, Kind, kept
from foreign.damage import damaged, damaged_text, mutated, written_json, written_yaml
from foreign.models import shapes


@cache
def calibration_text():
    return (FIXTURES / "recordings" / "calibration.json").read_text()


@cache
def state_text():
    """Return the state of a sensor that was learned."""
    from recognizer.sensor.file import write_state
    from recognizer.touch.sensor_state import SensorState

    ones, flags = np.ones((16, 16)), np.zeros((16, 16), bool)
    pairs = np.full((16, 16, 2), 0.1)
    state = SensorState("mat 3", 40, False, flags, flags, 0 * ones, ones, ones, pairs, pairs)
    write_state(state, kept()[0] / "s.json")
    return (kept()[0] / "s.json").read_text()


def _json_writer(name, sound):
    def write(rng, folder):
        path = folder / name
        if rng.random() < 0.3:
            content = damaged_text(rng, sound(), ("[", "]", "{", "null,", '"', "NaN", "-"))
        else:
            content = written_json(rng, mutated(rng, json.loads(sound())))
        path.write_bytes(content)
        return path

    return write


def read_calibration(path, _out):
    from probe.calibration.file import calibration_hash
    from probe.calibration.file import read_calibration as read

    if calibration_hash(read(path)) != json.loads(calibration_text())["sha256"]:
        raise FaultError("wrong value", "a calibration that was changed")


def read_state(path, _out):
    from recognizer.sensor.file import read_state as read
    from recognizer.sensor.file import state_words

    state_words(read(path))


YAML_SPLICES = ("{", "}", "[", "]", ":", "- ", "\t", "\n", "'", '"', "#", "&a ", "*a", "!!int ",
                "|", "? ", "---\n", "...\n", "%YAML 1.2\n", "\x00", "\x85", "<<: ", "\u2028", "\r",
                "objects:", "{{{{{{", "file: c.yaml")  # fmt: skip
MINE = (
    "like: prusa-mini\nname: mine\nnozzle: 0.6 mm\nbed: 180 x 180 mm\nstroke: 1 mm\ngap: 1 mm\n"
    "height: 0.6 mm\nedge: 1 mm\noverhang: 45 deg\n"
)


@cache
def spec_texts():
    return tuple(file.read_text() for file in sorted(FIXTURES.glob("**/*.yaml")))


@cache
def sensor_texts():
    from encoded_objects.base.sensor_type_file import shipped_names, shipped_text

    return tuple(shipped_text(name) for name in shipped_names())


def _yaml_file(rng, texts):
    text = rng.choice(texts)
    if rng.random() < 0.4:
        return damaged_text(rng, text, YAML_SPLICES)
    return written_yaml(rng, mutated(rng, yaml.safe_load(text)))


def write_sensor_type(rng, folder):
    path = folder / f"mine-{rng.randrange(10**9)}.yaml"  # types are kept by their names
    path.write_bytes(_yaml_file(rng, sensor_texts()))
    return path


def read_sensor_type(path, _out):
    from encoded_objects.base.sensor_type_file import sensor_type_named

    sensor = sensor_type_named(str(path))
    if not 0 < sensor.rows * sensor.columns <= 255 * 255:
        raise FaultError("wrong value", f"a matrix of {sensor.shape}")


def write_printer(rng, folder):
    """Write a spec whose printer stands in a damaged file, which may name itself."""
    path = folder / "printer.yaml"
    if rng.random() < 0.1:
        named = rng.choice(("printer.yaml", "./printer.yaml", "other.yaml", "..", "/dev/zero"))
        path.write_text(f"file: {named}\n")
        (folder / "other.yaml").write_text("file: printer.yaml\n")
    else:
        path.write_bytes(_yaml_file(rng, (MINE, "file: other.yaml\n")))
    spec = "name: Cube\nshape: {cube: 60 mm}\nprint: {printer: {file: printer.yaml}}\n"
    (folder / "c.yaml").write_text(spec)
    return path


def read_printer(path, _out):
    """Read the spec next to a printer's file."""
    from generator.spec import read_specs

    (spec,) = read_specs([path.parent / "c.yaml"])
    if not (spec.printer.layer_mm > 0 and min(spec.printer.bed_mm) > 0):
        raise FaultError("wrong value", str(spec.printer))


def write_spec(rng, folder):
    path = folder / "c.yaml"
    do = rng.random()
    path.write_bytes(_yaml_file(rng, spec_texts()))
    if do < 0.15:
        entries = [rng.choice(("c.yaml", "a.yaml", "b.yaml", "..", "../secret.txt", "fifo.yaml",
                               "/dev/zero", "x" * 300 + ".yaml", {"name": "A", "shape": "b.stl"},
                               {"name": "Cube", "shape": {"cube": "60 mm"}}))
                   for _ in range(rng.choice((1, 2, 3)))]  # fmt: skip
        (folder / "a.yaml").write_bytes(path.read_bytes())
        (folder / "b.yaml").write_text("objects: [c.yaml, b.yaml]\n")
        os.mkfifo(folder / "fifo.yaml")
        path.write_bytes(written_yaml(rng, {"objects": entries}))
    elif do < 0.3:
        named = rng.choice(("m.stl", "m.step", "m.obj", "fifo.stl", "../secret.txt", ".", "m.tri",
                            "/dev/zero", "zero.stl"))  # fmt: skip
        (folder / "m.stl").write_bytes(damaged(rng, shapes(".stl")[0]))
        os.mkfifo(folder / "fifo.stl")
        (folder / "zero.stl").symlink_to("/dev/zero")
        path.write_text(f"name: M\nshape: {{file: {named}}}\n")
    return path


def read_spec(path, _out):
    """Read specs; what is wrong has places in the files, causes and ways out."""
    from generator.spec import SpecError, read_specs

    try:
        specs = read_specs([path])
    except SpecError as error:
        for problem in error.problems:
            mark, told = problem.mark, problem.cause and problem.fix and problem.place
            if mark:
                told = told and 1 <= mark.line <= len(mark.source.lines) + 1 and mark.column >= 1
            if not told:
                cause = f"a problem without a place: {problem.cause[:60]}"
                raise FaultError("wrong value", cause) from error
        raise
    for spec in specs:
        if not 0 < spec.style.pitch_mm < 1e4:
            raise FaultError("wrong value", f"a pitch of {spec.style.pitch_mm}")


def read_by_command(path, out):
    """Encode a spec by the whole command; what is refused leaves nothing."""
    from generator.command import run

    os.chdir(out)
    said = io.StringIO()
    with redirect_stderr(said), redirect_stdout(io.StringIO()):
        code = run([str(path), "--format", "stl"])
    if code == 0:
        return
    fix = "-" if all(word in said.getvalue() for word in ("error: ", "fix: ")) else ""
    error = EncodedObjectsError(said.getvalue(), fix=fix, place=path.name)
    error.exit_code = code
    if code == 2 and any(out.iterdir()):
        raise FaultError("left outside", ", ".join(one.name for one in out.iterdir()))
    raise error


KINDS = {
    "calibration": Kind(_json_writer("c.json", calibration_text), read_calibration),
    "state": Kind(_json_writer("s.state.json", state_text), read_state, sound=(state_text,)),
    "sensor type": Kind(write_sensor_type, read_sensor_type),
    "printer": Kind(write_printer, read_printer),
    "spec": Kind(write_spec, read_spec),
    "command": Kind(write_spec, read_by_command, (1, 2, 4), longest_s=30.0),
}
