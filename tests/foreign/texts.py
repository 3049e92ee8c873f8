"""Calibrations, sensor states, sensor types, printers and specs."""

from __future__ import annotations

import io
import json
import os
import random
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path

import numpy as np
import yaml

from encoded_objects.base.errors import EncodedObjectsError
from foreign.case import FIXTURES, LeftError, WrongValueError, kept
from foreign.damage import damaged, damaged_text, mutated, written_json, written_yaml
from foreign.models import shapes


def write_calibration(rng: random.Random, folder: Path) -> Path:
    """Write a damaged calibration."""
    text = (FIXTURES / "recordings" / "calibration.json").read_text()
    path = folder / "c.json"
    path.write_bytes(
        damaged_text(rng, text, ("[", "]", "{", "null,", '"', "NaN", "-"))
        if rng.random() < 0.3
        else written_json(rng, mutated(rng, json.loads(text)))
    )
    return path


@cache
def _true_calibration() -> str:
    document = json.loads((FIXTURES / "recordings" / "calibration.json").read_text())
    return str(document["sha256"])


def read_calibration(path: Path, _out: Path) -> None:
    """Read a calibration, whose sha256 is in it."""
    from probe.calibration.file import calibration_hash
    from probe.calibration.file import read_calibration as read

    if calibration_hash(read(path)) != _true_calibration():
        raise WrongValueError("a calibration that was changed")


@cache
def state_text() -> str:
    """Return the state of a sensor that was learned."""
    from recognizer.sensor.file import write_state as write
    from recognizer.touch.sensor_state import SensorState

    ones, flags = np.ones((16, 16)), np.zeros((16, 16), bool)
    pairs = np.full((16, 16, 2), 0.1)
    state = SensorState("mat 3", 40, False, flags, flags, 0 * ones, ones, ones, pairs, pairs)
    write(state, kept()[0] / "s.json")
    return (kept()[0] / "s.json").read_text()


def write_state(rng: random.Random, folder: Path) -> Path:
    """Write a damaged state of a sensor."""
    path = folder / "s.state.json"
    path.write_bytes(
        damaged_text(rng, state_text(), ("[", "]", "{", "null,", '"', "NaN", "-"))
        if rng.random() < 0.3
        else written_json(rng, mutated(rng, json.loads(state_text())))
    )
    return path


def read_state(path: Path, _out: Path) -> None:
    """Read a state, and say it as commands do."""
    from recognizer.sensor.file import read_state as read
    from recognizer.sensor.file import state_words

    state_words(read(path))


YAML_SPLICES = ("{", "}", "[", "]", ":", "- ", "\t", "\n", "'", '"', "#", "&a ", "*a", "!!int ",
                "|", "? ", "---\n", "...\n", "%YAML 1.2\n", "\x00", "\x85", "<<: ", "\u2028", "\r",
                "objects:", "{{{{{{", "file: c.yaml")  # fmt: skip


@cache
def texts(what: str) -> tuple[str, ...]:
    """Return sound files of people: `spec`, `printer`, `sensor`."""
    if what == "spec":
        return tuple(file.read_text() for file in sorted(FIXTURES.glob("**/*.yaml")))
    if what == "printer":
        limits = "stroke: 1 mm\ngap: 1 mm\nheight: 0.6 mm\nedge: 1 mm\noverhang: 45 deg\n"
        mine = f"like: prusa-mini\nname: mine\nnozzle: 0.6 mm\nbed: 180 x 180 mm\n{limits}"
        return (mine, "file: other.yaml\n")
    from encoded_objects.base.sensor_type_file import shipped_names, shipped_text

    return tuple(shipped_text(name) for name in shipped_names())


def _yaml_file(rng: random.Random, what: str) -> bytes:
    text = rng.choice(texts(what))
    if rng.random() < 0.4:
        return damaged_text(rng, text, YAML_SPLICES)
    return written_yaml(rng, mutated(rng, yaml.safe_load(text)))


def write_sensor_type(rng: random.Random, folder: Path) -> Path:
    """Write a damaged sensor type."""
    path = folder / f"mine-{rng.randrange(10**9)}.yaml"  # types are kept by their names
    path.write_bytes(_yaml_file(rng, "sensor"))
    return path


def read_sensor_type(path: Path, _out: Path) -> None:
    """Read a sensor type."""
    from encoded_objects.base.sensor_type_file import sensor_type_named

    sensor = sensor_type_named(str(path))
    if not 0 < sensor.rows * sensor.columns <= 255 * 255:
        raise WrongValueError(f"a matrix of {sensor.shape}")


def write_printer(rng: random.Random, folder: Path) -> Path:
    """Write a spec whose printer stands in a damaged file, which may name itself."""
    path = folder / "printer.yaml"
    do = rng.random()
    if do < 0.1:
        named = rng.choice(("printer.yaml", "./printer.yaml", "other.yaml", "..", "/dev/zero"))
        path.write_text(f"file: {named}\n")
        (folder / "other.yaml").write_text("file: printer.yaml\n")
    else:
        path.write_bytes(_yaml_file(rng, "printer"))
    spec = "name: Cube\nshape: {cube: 60 mm}\nprint: {printer: {file: printer.yaml}}\n"
    (folder / "c.yaml").write_text(spec)
    return path


def read_printer(path: Path, _out: Path) -> None:
    """Read the spec next to a printer's file."""
    from generator.spec import read_specs

    (spec,) = read_specs([path.parent / "c.yaml"])
    if not (spec.printer.layer_mm > 0 and min(spec.printer.bed_mm) > 0):
        raise WrongValueError(str(spec.printer))


def write_spec(rng: random.Random, folder: Path) -> Path:
    """Write a damaged spec, or set of specs, which may name itself, others and models."""
    path = folder / "c.yaml"
    do = rng.random()
    path.write_bytes(_yaml_file(rng, "spec"))
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


def read_spec(path: Path, _out: Path) -> None:
    """Read specs; what is wrong has places in the files, causes and ways out."""
    from generator.spec import SpecError, read_specs

    try:
        specs = read_specs([path])
    except SpecError as error:
        for problem in error.problems:
            mark = problem.mark
            lines = len(mark.source.lines) if mark else 0
            if not (problem.cause and problem.fix and problem.place) or (
                mark and not (1 <= mark.line <= lines + 1 and mark.column >= 1)
            ):
                raise WrongValueError(f"a problem without a place: {problem.cause[:60]}") from error
        raise
    for spec in specs:
        if not 0 < spec.style.pitch_mm < 1e4:
            raise WrongValueError(f"a pitch of {spec.style.pitch_mm}")


def read_by_command(path: Path, out: Path) -> None:
    """Encode a spec by the whole command; what is refused leaves nothing."""
    from generator.command import run

    os.chdir(out)
    said = io.StringIO()
    with redirect_stderr(said), redirect_stdout(io.StringIO()):
        code = run([str(path), "--format", "stl"])
    if code == 0:
        return
    error = EncodedObjectsError(said.getvalue(), fix="-", place=path.name)
    error.exit_code = code
    if not all(word in said.getvalue() for word in ("error: ", "fix: ")):
        error.fix = ""
    if code == 2 and any(out.iterdir()):
        raise LeftError(", ".join(one.name for one in out.iterdir()))
    raise error
