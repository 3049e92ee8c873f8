"""Robot model -> MJCF, SDFormat and URDF, each read back by another program.

MJCF, for MuJoCo: a free body, geoms in group 2 (visual) and 3 (collision), a site for every face.
MuJoCo's contacts are of convex bodies: pieces bear the part. A `tactile` sensor feels the meshes
that are in contact and have an octree: that of the touch mesh comes from a geom of type sdf.
SDFormat 1.9, for Gazebo: a model of one link, frames `F1`, ... in its scope, `Cube::F1` outside.
URDF: one link, and a fixed link for every face. Both tell Drake to make the touch mesh the rigid
side of a hydroelastic contact: of a compliant mesh it would take the convex hull. Mesh files are
named relative to the file, which yourdfpy, PyBullet and Drake follow; ROS wants `package://`
before them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from encoded_objects.base.errors import require
from generator.export.colours import hexadecimal
from generator.export.formats import ExportedObject, Files
from generator.export.robot.model import (
    Floats,
    ModelMesh,
    ReadModel,
    RobotModel,
    compare_model,
    mesh_files,
    numbers,
    pose,
    pose_of,
    quaternion,
    rgba,
    roll_pitch_yaw,
    rotation_of,
)

LINK = "body"  #: of an SDFormat model
DRAKE = "http://drake.mit.edu"  #: namespace of what Drake alone reads
#: Of contacts of the touch mesh: listed, so that a tactile sensor finds them, and without force
#: (MuJoCo's least impedance is 1e-4, and a stiffness is divided by it). A mesh collides as its
#: hull: in a notch it would push away what does not touch it.
_FORCELESS = {"priority": "1", "solimp": "0 0 0.001", "solref": "-1e-6 -1e-6"}
_MOMENTS = ("xx", "xy", "xz", "yy", "yz", "zz")
ElementTree.register_namespace("drake", DRAKE)


def mjcf_bytes(model: RobotModel) -> bytes:
    """Return the MJCF file; its mesh files are named as the meshes of `_mjcf_meshes`."""
    root = Element("mujoco", model=model.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    default = SubElement(root, "default")
    seen = SubElement(default, "default", {"class": f"{model.name}-visual"})
    SubElement(seen, "geom", type="mesh", group="2", contype="0", conaffinity="0", mass="0")
    hit = SubElement(default, "default", {"class": f"{model.name}-collision"})
    SubElement(hit, "geom", type="mesh", group="3", mass="0")
    asset = SubElement(root, "asset")
    for mesh in _mjcf_meshes(model):
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
    for mesh in model.pieces:
        SubElement(body, "geom", {"class": f"{model.name}-collision"}, mesh=mesh.name)
    if model.touch:
        which = {"class": f"{model.name}-collision", "mesh": model.touch.name}
        SubElement(body, "geom", {**which, "name": model.touch.name, **_FORCELESS})
        off = {"contype": "0", "conaffinity": "0"}
        SubElement(body, "geom", {**which, "type": "sdf", **off})
    for frame in model.frames:
        T = frame.T_object_face
        SubElement(
            body, "site", name=frame.name, pos=numbers(T[:3, 3]),
            quat=numbers(quaternion(T[:3, :3])), size="0.001", group="4",
        )  # fmt: skip
    return _document(root)


def _mjcf_meshes(model: RobotModel) -> tuple[ModelMesh, ...]:
    return (*model.visuals, *model.pieces, *([model.touch] if model.touch else []))


def read_mjcf(model: RobotModel, path: Path) -> ReadModel:
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


def sdf_bytes(model: RobotModel) -> bytes:
    """Return the SDFormat file; its mesh files are named as the meshes of `_meshes`."""
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
    for name, moment in _moments(model).items():
        SubElement(inertia, name).text = moment
    for mesh in model.visuals:
        visual = SubElement(link, "visual", name=mesh.name)
        _mesh_element(visual, uri=f"{mesh.name}.obj")
        material = SubElement(visual, "material")
        SubElement(material, "ambient").text = rgba(mesh.colour)
        SubElement(material, "diffuse").text = rgba(mesh.colour)
    for number, mesh in enumerate(model.colliders, 1):
        collision = SubElement(link, "collision", name=f"collision-{number}")
        _mesh_element(collision, uri=f"{mesh.name}.obj")
        _for_drake(collision, model)
    return _document(root)


def read_sdf(_model: RobotModel, path: Path) -> ReadModel:
    """Return what a file says, taken as XML."""
    from scipy.spatial.transform import Rotation

    body = ElementTree.parse(path).find("model")  # noqa: S314  our own file
    inertial = None if body is None else body.find("link/inertial")
    if body is None or inertial is None:
        return ReadModel(0.0, np.zeros(3), np.zeros((3, 3)), {})

    def values(element: Element, name: str) -> Floats:
        return np.array(element.findtext(name, "").split(), np.float64)

    xx, xy, xz, yy, yz, zz = (values(inertial, f"inertia/i{name}")[0] for name in _MOMENTS)
    frames = {
        frame.attrib["name"]: pose_of(Rotation.from_euler("xyz", at[3:]).as_matrix(), at[:3])
        for frame in body.findall("frame")
        for at in [values(frame, "pose")]
    }
    mass, centre = values(inertial, "mass"), values(inertial, "pose")
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return ReadModel(float(mass[0]), centre[:3], tensor, frames)


def urdf_bytes(model: RobotModel) -> bytes:
    """Return the URDF file; its mesh files are named as the meshes of `_meshes`."""
    root = Element("robot", name=model.name)
    colours = {mesh.colour: rgba(mesh.colour) for mesh in model.visuals}
    for colour, text in colours.items():
        material = SubElement(root, "material", name=f"{model.name}-{hexadecimal(colour)[1:]}")
        SubElement(material, "color", rgba=text)
    link = SubElement(root, "link", name=model.name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=numbers(model.centre_m), rpy="0 0 0")
    SubElement(inertial, "mass", value=numbers([model.mass_kg]))
    SubElement(inertial, "inertia", _moments(model))
    for mesh in model.visuals:
        visual = SubElement(link, "visual", name=mesh.name)
        _mesh_element(visual, filename=f"{mesh.name}.obj")
        SubElement(visual, "material", name=f"{model.name}-{hexadecimal(mesh.colour)[1:]}")
    for number, mesh in enumerate(model.colliders, 1):
        collision = SubElement(link, "collision", name=f"{model.name}-collision-{number}")
        _mesh_element(collision, filename=f"{mesh.name}.obj")
        _for_drake(collision, model)
    for frame in model.frames:
        SubElement(root, "link", name=frame.name)
        joint = SubElement(root, "joint", name=f"{frame.name}-joint", type="fixed")
        SubElement(joint, "parent", link=model.name)
        SubElement(joint, "child", link=frame.name)
        T = frame.T_object_face
        turn = numbers(roll_pitch_yaw(T[:3, :3]))
        SubElement(joint, "origin", xyz=numbers(T[:3, 3]), rpy=turn)
    return _document(root)


def read_urdf(model: RobotModel, path: Path) -> ReadModel:
    """Return what yourdfpy makes of a file."""
    require("yourdfpy", extra="robot", purpose="--verify of urdf")
    import yourdfpy

    read = yourdfpy.URDF.load(str(path))
    inertial = read.link_map[model.name].inertial
    frames = {frame.face: read.get_transform(frame.name, model.name) for frame in model.frames}
    return ReadModel(inertial.mass, inertial.origin[:3, 3], inertial.inertia, frames)


def _moments(model: RobotModel) -> dict[str, str]:
    """Return the six moments of inertia, kg m^2: "ixx", "ixy", ..."""
    J, axes = model.inertia_kg_m2, "xyz"
    return {f"i{m}": numbers([J[axes.index(m[0]), axes.index(m[1])]]) for m in _MOMENTS}


def _mesh_element(parent: Element, *, uri: str = "", filename: str = "") -> None:
    """Add a geometry: the mesh file as text of `uri`, or as an attribute."""
    geometry = SubElement(parent, "geometry")
    if filename:
        SubElement(geometry, "mesh", filename=filename)
    else:
        SubElement(SubElement(geometry, "mesh"), "uri").text = uri


def _for_drake(collision: Element, model: RobotModel) -> None:
    if model.touch:
        properties = SubElement(collision, f"{{{DRAKE}}}proximity_properties")
        SubElement(properties, f"{{{DRAKE}}}rigid_hydroelastic")


def _document(root: Element) -> bytes:
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _meshes(model: RobotModel) -> tuple[ModelMesh, ...]:
    return (*model.visuals, *model.colliders)


def _write(
    suffix: str,
    content: Callable[[RobotModel], bytes],
    meshes: Callable[[RobotModel], tuple[ModelMesh, ...]],
    exported: ExportedObject,
) -> Files:
    yield from mesh_files(meshes(exported.robot))
    yield exported.name + suffix, content(exported.robot)


def _verify(
    read: Callable[[RobotModel, Path], ReadModel], exported: ExportedObject, path: Path
) -> None:
    """Read a file back; raises `SolidError` where it is not the model."""
    compare_model(exported.robot, read(exported.robot, path), path)


write_mjcf = partial(_write, ".xml", mjcf_bytes, _mjcf_meshes)
write_sdf = partial(_write, ".sdf", sdf_bytes, _meshes)
write_urdf = partial(_write, ".urdf", urdf_bytes, _meshes)
verify_mjcf, verify_sdf = partial(_verify, read_mjcf), partial(_verify, read_sdf)
verify_urdf = partial(_verify, read_urdf)
