"""Robot model -> MJCF, for MuJoCo: a free body with its meshes, and a site for every face.

Geoms in group 2 are seen, those in group 3 are hit, as in MuJoCo's own models.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from generator.export.robot.model import RobotModel
from generator.export.robot.text import document, numbers, quaternion, rgba


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
