"""Robot model -> MJCF, for MuJoCo: a free body with its meshes, and a site for every face.

Geoms in group 2 are seen, those in group 3 are hit, as in MuJoCo's own models.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from encoded_objects.base.errors import require
from generator.export.formats import ExportedObject, Files
from generator.export.robot.model import (
    ReadModel,
    RobotModel,
    compare_model,
    document,
    mesh_files,
    numbers,
    pose_of,
    quaternion,
    rgba,
    rotation_of,
)


def write(exported: ExportedObject) -> Files:
    """Yield the meshes and the file."""
    yield from mesh_files(exported.robot)
    yield f"{exported.name}.xml", mjcf_bytes(exported.robot)


def verify(exported: ExportedObject, path: Path) -> None:
    """Read a file back by another program; raises `SolidError` where it is not the model."""
    compare_model(exported.robot, read(exported.robot, path), path)


def mjcf_bytes(model: RobotModel) -> bytes:
    """Return the file; its mesh files are named as `RobotModel.meshes`."""
    root = Element("mujoco", model=model.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    default = SubElement(root, "default")
    seen = SubElement(default, "default", {"class": f"{model.name}-visual"})
    SubElement(seen, "geom", type="mesh", group="2", contype="0", conaffinity="0", mass="0")
    hit = SubElement(default, "default", {"class": f"{model.name}-collision"})
    SubElement(hit, "geom", type="mesh", group="3", mass="0")
    asset = SubElement(root, "asset")
    for mesh in model.meshes:
        SubElement(asset, "mesh", name=mesh.name, file=f"{mesh.name}.obj")
    body = SubElement(SubElement(root, "worldbody"), "body", name=model.name)
    SubElement(body, "freejoint", name=model.name)
    J = model.inertia_kg_m2
    SubElement(
        body, "inertial", pos=numbers(model.centre_m), mass=numbers([model.mass_kg]),
        fullinertia=numbers([J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]),
    )  # fmt: skip
    for mesh in model.visuals:
        SubElement(
            body, "geom", {"class": f"{model.name}-visual"}, name=mesh.name, mesh=mesh.name,
            rgba=rgba(mesh.colour),
        )  # fmt: skip
    for placed in model.collisions:
        T = placed.T_object_mesh
        SubElement(
            body, "geom", {"class": f"{model.name}-collision"}, mesh=placed.mesh.name,
            pos=numbers(T[:3, 3]), quat=numbers(quaternion(T[:3, :3])),
        )  # fmt: skip
    for frame in model.frames:
        T = frame.T_object_face
        SubElement(
            body, "site", name=frame.name, pos=numbers(T[:3, 3]),
            quat=numbers(quaternion(T[:3, :3])), size="0.001", group="4",
        )  # fmt: skip
    return document(root)


def read(model: RobotModel, path: Path) -> ReadModel:
    """Return what MuJoCo makes of a file."""
    require("mujoco", extra="robot", purpose="--verify of mjcf")
    import mujoco

    read = mujoco.MjModel.from_xml_path(str(path))
    body = read.body(model.name).id
    turn = rotation_of(read.body_iquat[body])
    frames = {}
    for frame in model.frames:
        site = read.site(frame.name).id
        frames[frame.face] = pose_of(rotation_of(read.site_quat[site]), read.site_pos[site])
    return ReadModel(
        float(read.body_mass[body]), np.array(read.body_ipos[body]),
        turn @ np.diag(read.body_inertia[body]) @ turn.T, frames,
    )  # fmt: skip
