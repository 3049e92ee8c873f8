"""Files for simulators, in the simulators and validators that are installed: parts that rest.

    encode-object SPEC.yaml... --format mjcf,urdf,sdf,usd -o DIR
    python tests/campaigns/simulators.py DIR...

Imports nothing of ours: `pip install drake newton omniverse-asset-validator` may stand in an
environment of its own. Every part is dropped on a table in MuJoCo and Drake; printed are the height
of the lowest face over the table, and what the mesh with symbols says it is where it rests on them.
Then what OpenUSD's validators, NVIDIA's, and Newton's importer say of the USD file.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import runner

Array = np.ndarray
SECONDS = 1.5  #: of simulated time, until it rests
ABOVE_M = 0.002  #: of the table, when it is let go, tilted
TILT = np.array([1.0, 0.01, 0.006, 0.0])  #: quaternion: 1.3 degrees


def points(path: Path) -> Array:
    """Return the corners of an OBJ, (n, 3) m."""
    lines = (line.split()[1:] for line in path.read_text().splitlines() if line.startswith("v "))
    return np.array(list(lines), float)


def rotation(quaternion: Array) -> Array:
    """Return (3, 3) of (w, x, y, z)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


class Dropped:
    """A part as its files say: frames of its faces, and the corners of what collides."""

    def __init__(self, folder: Path) -> None:
        self.xml = next(folder.glob("*.xml"))
        self.name = self.xml.stem
        root = ElementTree.parse(self.xml)
        self.faces = {
            site.attrib["name"]: (
                np.array(site.attrib["pos"].split(), float),
                rotation(np.array(site.attrib["quat"].split(), float))[:, 2],
            )
            for site in root.iter("site")
        }
        files = sorted(folder.glob("*-touch.obj")) or sorted(folder.glob("*-collision-*.obj"))
        self.corners = np.concatenate([points(file) for file in files])

    def start_m(self) -> float:
        """Return the height of the origin, when it is let go with its axes up."""
        return ABOVE_M - float((self.corners @ rotation(TILT).T)[:, 2].min())

    def report(self, simulator: str, R: Array, at: Array, seconds: float) -> None:
        """Print how a part came to rest: the lowest face, its height, and by the mesh."""
        down = {name: (R @ p + at)[2] for name, (p, z) in self.faces.items() if (R @ z)[2] < -0.99}
        face = min(down, key=lambda name: down[name], default="")
        lowest = float((self.corners @ R.T + at)[:, 2].min())
        height = 1e3 * down[face] if face else float("nan")
        runner.row(
            self.name, simulator, face or "no face",
            f"{height:.3f}", f"{height - 1e3 * lowest:.3f}", f"{seconds:.1f}",
        )  # fmt: skip


def drop_in_mujoco(part: Dropped) -> None:
    """Drop a part by its MJCF."""
    import mujoco

    start = time.process_time()
    spec = mujoco.MjSpec.from_file(str(part.xml))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.1])
    body = spec.body(part.name)
    body.pos, body.quat = [0, 0, part.start_m()], TILT
    model = spec.compile()
    seconds, data = time.process_time() - start, mujoco.MjData(model)
    mujoco.mj_step(model, data, round(SECONDS / model.opt.timestep))
    rests = data.body(part.name)
    part.report("MuJoCo", rests.xmat.reshape(3, 3), rests.xpos, seconds)


def drop_in_drake(part: Dropped, suffix: str) -> None:
    """Drop a part by its URDF or SDF, on a half space that yields a little."""
    from pydrake.geometry import (
        AddCompliantHydroelasticPropertiesForHalfSpace,
        AddContactMaterial,
        HalfSpace,
        ProximityProperties,
    )
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    start, builder = time.process_time(), DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    [model] = Parser(plant).AddModels(str(part.xml.with_suffix(suffix)))
    table = ProximityProperties()
    AddCompliantHydroelasticPropertiesForHalfSpace(0.01, 1e8, table)
    AddContactMaterial(dissipation=1.0, friction=CoulombFriction(0.6, 0.6), properties=table)
    ground = RigidTransform()
    plant.RegisterCollisionGeometry(plant.world_body(), ground, HalfSpace(), "table", table)
    plant.set_contact_model(ContactModel.kHydroelasticWithFallback)
    plant.Finalize()
    [first, *_] = plant.GetBodyIndices(model)
    body, diagram = plant.get_body(first), builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyContextFromRoot(context)
    pose = RigidTransform(RotationMatrix(rotation(TILT)), [0, 0, part.start_m()])
    plant.SetFreeBodyPose(own, body, pose)
    seconds = time.process_time() - start
    Simulator(diagram, context).AdvanceTo(SECONDS)
    rests = plant.EvalBodyPoseInWorld(own, body)
    part.report(f"Drake {suffix}", rests.rotation().matrix(), rests.translation(), seconds)


def validate_usd(path: Path) -> str:
    """Return what the validators of OpenUSD find."""
    from pxr import Usd, UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))
    return f"{len(validators)} validators, {len(found)} findings" + "".join(
        f"; {one.GetName()}: {one.GetMessage()}" for one in found
    )


def validate_asset(path: Path) -> str:
    """Return what NVIDIA's asset validator says."""
    command = [str(Path(sys.executable).with_name("omni_asset_validate")), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = f"{done.stdout} {done.stderr}"
    return "No issues found" if "No issues found" in said else " ".join(said.split())[-600:]


def import_in_newton(path: Path) -> str:
    """Return what Newton's importer makes of the colliders."""
    import newton

    builder = newton.ModelBuilder()
    builder.add_usd(str(path))
    shapes = (
        f"{builder.shape_label[n]}: {newton.GeoType(builder.shape_type[n]).name}, "
        f"hydroelastic {bool(builder.shape_flags[n] & newton.ShapeFlags.HYDROELASTIC)}"
        for n in range(builder.shape_count)
        if builder.shape_flags[n] & newton.ShapeFlags.COLLIDE_SHAPES
    )
    return f"{sum(builder.body_mass):.6f} kg; " + "; ".join(shapes)


CHECKS: dict[str, tuple[str, Callable[[Path], str]]] = {
    "OpenUSD": ("pxr", validate_usd),
    "NVIDIA": ("omni", validate_asset),
    "Newton": ("newton", import_in_newton),
}


def main() -> None:
    """Drop and check the parts of all folders."""
    import argparse

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parts = [Dropped(folder) for folder in parser.parse_args().folders]
    runner.table(("part", "dropped in", "lies on", "face at mm", "symbols mm", "loaded s"))
    for part in parts:
        if importlib.util.find_spec("mujoco"):
            drop_in_mujoco(part)
        if importlib.util.find_spec("pydrake"):
            drop_in_drake(part, ".urdf")
            drop_in_drake(part, ".sdf")
    for name, (library, check) in CHECKS.items():
        for part in parts if importlib.util.find_spec(library) else ():
            print(f"{name}: {part.name}: {check(part.xml.with_suffix('.usdc'))}", flush=True)


if __name__ == "__main__":
    main()
