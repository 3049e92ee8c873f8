"""Robot model -> SDFormat 1.9, for Gazebo: a model of one link, and a frame for every face.

Frames are `F1`, `F2`, ... in the scope of the model: `Cube::F1` from outside.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

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
    pose,
    pose_of,
    rgba,
)

LINK = "body"


def write(exported: ExportedObject) -> Files:
    """Yield the meshes and the file."""
    yield from mesh_files(exported.robot)
    yield f"{exported.name}.sdf", sdf_bytes(exported.robot)


def verify(exported: ExportedObject, path: Path) -> None:
    """Read a file back; raises `SolidError` where it is not the model."""
    compare_model(exported.robot, read(exported.robot, path), path)


def sdf_bytes(model: RobotModel) -> bytes:
    """Return the file; its mesh files are named as `RobotModel.meshes`."""
    root = Element("sdf", version="1.9")
    body = SubElement(root, "model", name=model.name)
    for frame in model.frames:
        place = SubElement(body, "frame", name=frame.face, attached_to=LINK)
        SubElement(place, "pose", relative_to=LINK).text = pose(frame.T_object_face)
    link = SubElement(body, "link", name=LINK)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "pose").text = numbers([*model.centre_m, 0, 0, 0])
    SubElement(inertial, "mass").text = numbers([model.mass_kg])
    inertia = SubElement(inertial, "inertia")
    for i in range(3):
        for k in range(i, 3):
            tensor = SubElement(inertia, f"i{'xyz'[i]}{'xyz'[k]}")
            tensor.text = numbers([model.inertia_kg_m2[i, k]])
    for mesh in model.visuals:
        visual = SubElement(link, "visual", name=mesh.name)
        _geometry(visual, mesh)
        material = SubElement(visual, "material")
        SubElement(material, "ambient").text = rgba(mesh.colour)
        SubElement(material, "diffuse").text = rgba(mesh.colour)
    for number, placed in enumerate(model.collisions, 1):
        collision = SubElement(link, "collision", name=f"collision-{number}")
        SubElement(collision, "pose").text = pose(placed.T_object_mesh)
        _geometry(collision, placed.mesh)
    return document(root)


def _geometry(parent: Element, mesh: ModelMesh) -> None:
    shape = SubElement(SubElement(parent, "geometry"), "mesh")
    SubElement(shape, "uri").text = f"{mesh.name}.obj"


def read(_model: RobotModel, path: Path) -> ReadModel:
    """Return what a file says, taken as XML."""
    from scipy.spatial.transform import Rotation

    body = ElementTree.parse(path).find("model")  # noqa: S314  our own file
    inertial = None if body is None else body.find("link/inertial")
    if body is None or inertial is None:
        return ReadModel(0.0, np.zeros(3), np.zeros((3, 3)), {})

    def values(element: ElementTree.Element, name: str) -> Floats:
        return np.array(element.findtext(name, "").split(), np.float64)

    tensor = np.zeros((3, 3))
    for i in range(3):
        for k in range(3):
            key = f"inertia/i{'xyz'[min(i, k)]}{'xyz'[max(i, k)]}"
            tensor[i, k] = values(inertial, key)[0]
    frames = {
        frame.attrib["name"]: pose_of(Rotation.from_euler("xyz", at[3:]).as_matrix(), at[:3])
        for frame in body.findall("frame")
        for at in [values(frame, "pose")]
    }
    mass, centre = values(inertial, "mass"), values(inertial, "pose")
    return ReadModel(float(mass[0]), centre[:3], tensor, frames)
