"""Files for simulators, in the simulators and validators that are installed: parts that rest.

    encode-object SPEC.yaml -o DIR --format mjcf,urdf,sdf,usd --database lab.db
    python tests/campaigns/simulators.py DIR... --press 18
    python tests/campaigns/simulators.py DIR... --read lab.db

Imports nothing of ours but to read: `pip install drake newton omniverse-asset-validator` may stand
in an environment of its own. Every part is dropped on a table in MuJoCo and Drake; printed are the
height of the lowest face over the table, and what the mesh with symbols says it is where it rests
on them. Then what OpenUSD's validators, NVIDIA's, and Newton's importer say of the USD file.

`--press N` presses amid the faces, N times in turn: a pad of 256 compliant boxes up to 60 N in
Drake, by URDF and SDF, and, .4 mm deep, 48 x 48 points that measure their depth in the first mesh
of the USD file by Warp, as FlexiTac's simulation does. `--read` reads the images that are left.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import runner

Array = np.ndarray
SECONDS = 1.5  #: of simulated time, until it rests
ABOVE_M = 0.002  #: of the table, when it is let go, tilted
TILT = np.array([1.0, 0.01, 0.006, 0.0])  #: quaternion: 1.3 degrees
PITCH_M, TIP_M, YOUNG_PA = 0.0254 / 16, 0.00112, 2e6  #: of the sensor fsr-16, its tips square
CENTRES_M = (np.arange(16) - 7.5) * PITCH_M
SYMBOL_M = 0.001


def points(path: Path) -> Array:
    """Return the corners of an OBJ, (n, 3) m."""
    lines = (line.split()[1:] for line in path.read_text().splitlines() if line.startswith("v "))
    return np.array(list(lines), float)


def rotation(quaternion: Array) -> Array:
    """Return (3, 3) of (w, x, y, z)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    first = [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)]
    second = [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)]
    third = [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
    return np.array([first, second, third])


class Part:
    """A part as its files say: frames of its faces, and the corners of what collides."""

    def __init__(self, folder: Path) -> None:
        self.xml = next(folder.glob("*.xml"))
        self.name = self.xml.stem
        root = ElementTree.parse(self.xml)
        self.faces = {}
        for site in root.iter("site"):
            at, turn = (np.array(site.attrib[name].split(), float) for name in ("pos", "quat"))
            self.faces[site.attrib["name"]] = at, rotation(turn)
        files = sorted(folder.glob("*-touch.obj")) or sorted(folder.glob("*-collision-*.obj"))
        self.corners = np.concatenate([points(file) for file in files])

    def start_m(self) -> float:
        """Return the height of the origin, when it is let go with its axes up."""
        return ABOVE_M - float((self.corners @ rotation(TILT).T)[:, 2].min())

    def report(self, simulator: str, R: Array, at: Array, seconds: float) -> None:
        """Print how a part came to rest: the lowest face, its height, and by the mesh."""
        down = {
            name: (R @ p + at)[2] for name, (p, F) in self.faces.items() if (R @ F)[2, 2] < -0.99
        }
        face = min(down, key=lambda name: down[name], default="")
        lowest = float((self.corners @ R.T + at)[:, 2].min())
        height = 1e3 * down[face] if face else float("nan")
        runner.row(
            self.name, simulator, face or "no face",
            f"{height:.3f}", f"{height - 1e3 * lowest:.3f}", f"{seconds:.1f}",
        )  # fmt: skip


def drop_in_mujoco(part: Part) -> None:
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


def drop_in_drake(part: Part, suffix: str) -> None:
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


def touches(part: Part, count: int) -> Iterator[tuple[str, Array, Array, Array]]:
    """Yield face, place (x, y mm, turn), and the sensor on the face: rotation, place (m)."""
    rng, faces = np.random.default_rng(5), list(part.faces.items())
    for number in range(count):
        name, (p, F) = faces[number % len(faces)]
        x, y, turn = *rng.uniform(16, 44, 2), rng.uniform(-3, 3)
        R = F @ rotation(np.array([math.cos(turn / 2), 0, 0, math.sin(turn / 2)]))
        yield name, np.array([x, y, turn]), R, p + F @ [1e-3 * x, 1e-3 * y, 0]


def press_in_drake(part: Part, suffix: str, count: int) -> list[Array]:
    """Return what 256 compliant tips bear when they press 60 N on a part, N."""
    from pydrake.geometry import AddCompliantHydroelasticProperties, Box, ProximityProperties
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel
    from pydrake.multibody.tree import SpatialInertia
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    [model] = Parser(plant).AddModels(str(part.xml.with_suffix(suffix)))
    own = plant.get_body(plant.GetBodyIndices(model)[0])
    plant.WeldFrames(plant.world_frame(), own.body_frame())
    inertia = SpatialInertia.SolidBoxWithMass(0.1, 0.03, 0.03, 0.01)
    pad = plant.AddRigidBody("pad", plant.AddModelInstance("sensor"), inertia)
    tactels = {}
    for row, column in np.ndindex(16, 16):
        rubber = ProximityProperties()
        AddCompliantHydroelasticProperties(TIP_M, YOUNG_PA, rubber)
        at = RigidTransform([CENTRES_M[column], -CENTRES_M[row], 0.002])
        tip = (at, Box(TIP_M, TIP_M, 0.004), f"{row}-{column}", rubber)
        tactels[plant.RegisterCollisionGeometry(pad, *tip)] = row, column
    plant.set_contact_model(ContactModel.kHydroelasticsOnly)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plants = plant.GetMyContextFromRoot(context)

    def image(R: Array, at: Array) -> Array:
        forces = np.zeros((16, 16))
        plant.SetFreeBodyPose(plants, pad, RigidTransform(RotationMatrix(R), at))
        results = plant.get_contact_results_output_port().Eval(plants)
        for number in range(results.num_hydroelastic_contacts()):
            contact = results.hydroelastic_contact_info(number)
            surface = contact.contact_surface()
            tactel = tactels.get(surface.id_M()) or tactels[surface.id_N()]
            forces[tactel] += abs(contact.F_Ac_W().translational() @ R[:, 2])
        return forces

    images = []
    for _, _, R, at in touches(part, count):
        low, high = 0.0002, 0.001
        for _ in range(5):
            height = (low + high) / 2
            forces = image(R, at + height * R[:, 2])
            low, high = (height, high) if forces.sum() > 60 else (low, height)
        images.append(forces)
    return images


def press_on_usd(part: Part, count: int) -> list[Array]:
    """Return how deep 48 x 48 points, .4 mm below the tops, are in the first mesh; m, by tactel."""
    import warp as wp
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(part.xml.with_suffix(".usdc")))
    meshes = (UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    mesh = next(meshes)
    corners = wp.array(np.array(mesh.GetPointsAttr().Get(), np.float32), dtype=wp.vec3)
    felt = wp.Mesh(corners, wp.array(mesh.GetFaceVertexIndicesAttr().Get(), dtype=int))
    steps = (np.arange(48) - 23.5) * PITCH_M / 3
    grid = np.array([[x, -y, SYMBOL_M - 0.0004] for y in steps for x in steps])
    images = []
    for _, _, R, at in touches(part, count):
        where = wp.array((grid @ R.T + at).astype(np.float32), dtype=wp.vec3)
        apart = wp.zeros(len(grid), dtype=float)
        wp.launch(signed_distance(), dim=len(grid), inputs=[felt.id, where, apart])
        images.append(np.maximum(-apart.numpy(), 0).reshape(16, 3, 16, 3).mean((1, 3)))
    return images


@cache
def signed_distance() -> Any:
    """Return the kernel: mesh, points -> their distance, below 0 inside."""
    import warp as wp

    def distance(mesh: wp.uint64, points: wp.array(dtype=wp.vec3), out: wp.array(dtype=float)):  # type: ignore[valid-type]
        at = wp.tid()
        found = wp.mesh_query_point_sign_normal(mesh, points[at], 1.0)
        if found.result:
            near = wp.mesh_eval_position(mesh, found.face, found.u, found.v)
            out[at] = found.sign * wp.length(points[at] - near)

    return wp.Kernel(distance)


def press(part: Part, count: int) -> None:
    """Press on a part in what is installed; write the images beside its files."""
    images = {}
    if importlib.util.find_spec("pydrake"):
        for suffix in (".urdf", ".sdf"):
            images[f"Drake {suffix}"] = press_in_drake(part, suffix, count)
    if importlib.util.find_spec("warp"):
        images["first mesh of USD"] = press_on_usd(part, count)
    np.savez(part.xml.with_suffix(".npz"), **images)


def read(part: Part, database: str) -> None:
    """Read the images of `--press`, as a board gives them: gains of 10 %, 4 counts of noise."""
    from encoded_objects import Reader, open_lab

    reader, rng = Reader(open_lab(database)), np.random.default_rng(1)
    for simulator, images in np.load(part.xml.with_suffix(".npz")).items():
        right, wrong, errors = 0, 0, []
        for image, (face, at, _, _) in zip(images, touches(part, len(images)), strict=True):
            counts = 900 * (image / image.max()) ** 0.8
            counts = counts * rng.normal(1, 0.1, counts.shape) + rng.normal(0, 4, counts.shape)
            answer = reader.read(np.clip(counts, 0, 1023))
            if answer:
                off = np.linalg.norm(answer.T_face_probe[:2, 3] - at[:2])
                right += (hit := face.endswith(f"-{answer.face}") and off < 2)
                wrong += not hit
                errors.append(off)
        rms = float(np.sqrt(np.mean(np.square(errors))))
        runner.row(part.name, simulator, f"{right} of {len(images)}", wrong, rms)


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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--press", type=int, metavar="N", default=0)
    parser.add_argument("--read", metavar="DATABASE")
    given = parser.parse_args()
    parts = [Part(folder) for folder in given.folders]
    if given.read:
        runner.table(("part", "pressed in", "right", "wrong", "rms mm"))
        for part in parts:
            read(part, given.read)
        return
    for part in parts if given.press else ():
        press(part, given.press)
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
