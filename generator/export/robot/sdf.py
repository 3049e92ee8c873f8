"""Robot model -> SDFormat 1.9, for Gazebo: a model of one link, and a frame for every face.

Frames are `F1`, `F2`, ... in the scope of the model: `Cube::F1` from outside.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from generator.export.robot.model import ModelMesh, RobotModel
from generator.export.robot.text import document, numbers, pose, rgba

LINK = "body"


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
