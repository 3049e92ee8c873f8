"""Robot model -> URDF: one link with mass and meshes, and a fixed link for every face.

Mesh files are named relative to the file, which yourdfpy, PyBullet and Drake follow; ROS wants
`package://` before them.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from encoded_objects.base.errors import require
from generator.export.colours import hexadecimal
from generator.export.formats import ExportedObject, Files
from generator.export.robot.model import (
    Floats,
    ModelMesh,
    ReadModel,
    RobotModel,
    compare_model,
    document,
    mesh_files,
    numbers,
    rgba,
    roll_pitch_yaw,
)

Attributes = dict[str, str]


def write(exported: ExportedObject) -> Files:
    """Yield the meshes and the file."""
    yield from mesh_files(exported.robot)
    yield f"{exported.name}.urdf", urdf_bytes(exported.robot)


def verify(exported: ExportedObject, path: Path) -> None:
    """Read a file back by another program; raises `SolidError` where it is not the model."""
    compare_model(exported.robot, read(exported.robot, path), path)


def urdf_bytes(model: RobotModel) -> bytes:
    """Return the file; its mesh files are named as `RobotModel.meshes`."""
    root = Element("robot", name=model.name)
    colours = {mesh.colour: rgba(mesh.colour) for mesh in model.visuals}
    for colour, text in colours.items():
        material = SubElement(root, "material", name=f"{model.name}-{hexadecimal(colour)[1:]}")
        SubElement(material, "color", rgba=text)
    link = SubElement(root, "link", name=model.name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=numbers(model.centre_m), rpy="0 0 0")
    SubElement(inertial, "mass", value=numbers([model.mass_kg]))
    J = model.inertia_kg_m2
    axes = "xyz"
    tensor = {f"i{axes[i]}{axes[k]}": numbers([J[i, k]]) for i in range(3) for k in range(i, 3)}
    SubElement(inertial, "inertia", tensor)
    for mesh in model.visuals:
        visual = SubElement(link, "visual", name=mesh.name)
        _geometry(visual, mesh)
        SubElement(visual, "material", name=f"{model.name}-{hexadecimal(mesh.colour)[1:]}")
    for number, placed in enumerate(model.collisions, 1):
        collision = SubElement(link, "collision", name=f"{model.name}-collision-{number}")
        T = placed.T_object_mesh
        SubElement(collision, "origin", _origin(T))
        _geometry(collision, placed.mesh)
    for frame in model.frames:
        SubElement(root, "link", name=frame.name)
        joint = SubElement(root, "joint", name=f"{frame.name}-joint", type="fixed")
        SubElement(joint, "parent", link=model.name)
        SubElement(joint, "child", link=frame.name)
        SubElement(joint, "origin", _origin(frame.T_object_face))
    return document(root)


def _origin(T: Floats) -> Attributes:
    return {"xyz": numbers(T[:3, 3]), "rpy": numbers(roll_pitch_yaw(T[:3, :3]))}


def _geometry(parent: Element, mesh: ModelMesh) -> None:
    SubElement(SubElement(parent, "geometry"), "mesh", filename=f"{mesh.name}.obj")


def read(model: RobotModel, path: Path) -> ReadModel:
    """Return what yourdfpy makes of a file."""
    require("yourdfpy", extra="robot", purpose="--verify of urdf")
    import yourdfpy

    read = yourdfpy.URDF.load(str(path))
    inertial = read.link_map[model.name].inertial
    frames = {frame.face: read.get_transform(frame.name, model.name) for frame in model.frames}
    return ReadModel(inertial.mass, inertial.origin[:3, 3], inertial.inertia, frames)
