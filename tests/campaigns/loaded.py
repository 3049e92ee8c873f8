"""Every fixture as robots load it: mass, inertia and frames of every format against the CAD kernel.

    apt-get install libsdformat-dev; python tests/campaigns/loaded.py -o DIR

Encodes every spec and shape of `fixtures` and the round shapes, and loads MJCF by MuJoCo, URDF by
yourdfpy, USD by OpenUSD, SDF by libsdformat (`tests/reference/sdformat.cc`, built here). Mass,
centre and inertia are compared with those of the STEP files by the CAD kernel, frames with the
database's. A line an object and format, then the largest errors of each format.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[1]))
from reference.kernel import inertia_of, solid_of

from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.export.robot import usd, xml_files
from generator.export.robot.model import ReadModel
from generator.pipeline import encode
from generator.spec import read_specs

ROOT = Path(__file__).parents[2]
ROUND = {
    "cylinder": "{cylinder: {diameter: 50 mm, height: 60 mm}}",
    "cone": "{cone: {diameter: 60 mm, height: 50 mm}}",
}
FORMATS = ("mjcf", "urdf", "sdf", "usd", "step")


def build_reader(folder: Path) -> Path:
    """Compile what reads SDF by libsdformat."""
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "sdformat12"],
                           check=True, capture_output=True, text=True).stdout.split()  # fmt: skip
    source, program = ROOT / "tests" / "reference" / "sdformat.cc", folder / "sdformat"
    command = ["g++", "-std=c++17", str(source), "-o", str(program), *flags]
    subprocess.run(command, check=True)
    return program


def read_sdf(program: Path, path: Path) -> ReadModel:
    """Return what libsdformat makes of a file; anything on stderr is a failure."""
    ran = subprocess.run([program, path], capture_output=True, text=True, check=False)
    if ran.returncode or ran.stderr:
        raise ValueError(ran.stderr or f"exit code {ran.returncode}")
    told = json.loads(ran.stdout)
    frames = {}
    for name, (x, y, z, *q) in told["frames"].items():
        frames[name] = np.eye(4)
        frames[name][:3, :3] = Rotation.from_quat(np.roll(q, -1)).as_matrix()
        frames[name][:3, 3] = x, y, z
    inertia = np.reshape(told["inertia"], (3, 3))
    return ReadModel(told["mass"], np.array(told["centre"]), inertia, frames)


def readers(program: Path) -> dict[str, Callable[[Any, Path], ReadModel]]:
    """Return what reads each format."""
    return {".xml": xml_files.read_mjcf, ".urdf": xml_files.read_urdf, ".usda": usd.read,
            ".sdf": lambda _model, path: read_sdf(program, path)}  # fmt: skip


def errors(path: Path, folder: Path, program: Path) -> list[dict[str, Any]]:
    """Encode a spec and return how far each format is off: of mass, centre, inertia, frames."""
    url = f"sqlite:///{folder / 'lab.db'}"
    specs = read_specs([path])
    encode(specs, folder=folder / "out", database=url, formats=FORMATS, jobs=1)
    files = {path.stem: path.parent for path in (folder / "out").rglob("*.sdf")}
    found = []
    with read_transaction(open_database(url, writable=False)) as connection:
        known = [read_object(connection, name) for name in files]
    for one in known:
        there = files[one.entry.name]
        solids = [(solid_of(there / Path(part.file).name), part.T_object_part)
                  for part in one.parts if part.format == "step"]  # fmt: skip
        volume, centre, inertia = inertia_of(solids)
        faces = {face.name: face.T_object_face for face in one.faces if "." not in face.name}
        frames = tuple(SimpleNamespace(face=f, name=f"{one.entry.name}-{f}") for f in faces)
        model = SimpleNamespace(name=one.entry.name, frames=frames)
        for suffix, read in readers(program).items():
            line = {"fixture": path.stem, "object": one.entry.name, "format": suffix[1:]}
            began = time.process_time()
            got = read(model, there / f"{one.entry.name}{suffix}")
            line["read_s"] = round(time.process_time() - began, 3)
            density = got.mass_kg / (volume * 1e-9)
            line["density"] = round(density, 1)
            line["mass"] = abs(density / round(density) - 1)
            line["centre_m"] = float(np.abs(got.centre_m - 1e-3 * centre).max())
            expected = density * inertia * 1e-15
            line["inertia"] = float(np.abs(got.inertia_kg_m2 - expected).max() / expected.max())
            off = [off_frame(got.frames[name], T) for name, T in faces.items()]
            line["frame_m"], line["frame_rotation"] = np.max(off, axis=0).tolist()
            line["faces"] = len(faces)
            found.append(line)
    return found


def off_frame(got: np.ndarray, T_object_face: np.ndarray) -> tuple[float, float]:
    """Return how far a frame is off: origin (m), largest element of the rotation."""
    off = np.abs(got - np.block([[T_object_face[:3, :3], 1e-3 * T_object_face[:3, 3:]],
                                 [np.zeros((1, 3)), np.ones((1, 1))]]))  # fmt: skip
    return float(off[:3, 3].max()), float(off[:3, :3].max())


def fixtures(folder: Path) -> list[Path]:
    """Return the specs, with one for every shape."""
    shapes = {path.stem: f"{{file: {path}}}" for path in (ROOT / "fixtures" / "shapes").iterdir()
              if path.suffix != ".md"}  # fmt: skip
    made = []
    for name, shape in (shapes | ROUND).items():
        made.append(folder / f"{name}.yaml")
        whole = "print: {parts: whole}\n" if "bracket" in name else ""  # too small for panels
        made[-1].write_text(f"name: {name}\nshape: {shape}\n{whole}")
    specs = ROOT / "fixtures" / "specs"
    return [ROOT / "fixtures" / "cube.yaml", *sorted(specs.glob("*.yaml")), *sorted(made)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    folder = parser.parse_args().output.absolute()
    folder.mkdir(parents=True)
    program, lines = build_reader(folder), []
    for path in fixtures(folder):
        (folder / path.stem).mkdir()
        made = errors(path, folder / path.stem, program)
        lines += made
        for line in made:
            print(json.dumps(line), flush=True)
    for kind in ("xml", "urdf", "sdf", "usda"):
        own = [line for line in lines if line["format"] == kind]
        keys = ("mass", "centre_m", "inertia", "frame_m", "frame_rotation", "read_s")
        worst = {key: f"{max(line[key] for line in own):.1e}" for key in keys}
        print(kind, len(own), "objects", sum(line["faces"] for line in own), "frames", worst)


if __name__ == "__main__":
    main()
