"""Robot model -> MJCF, SDFormat and URDF, each read back by another program.

MJCF, for MuJoCo: a free body, geoms in group 2 (visual) and 3 (collision), a site for every face.
MuJoCo's contacts are of convex bodies: pieces bear the part. A `tactile` sensor feels the meshes
that are in contact and have an octree: that of the touch mesh comes from a geom of type sdf.
SDFormat 1.9, for Gazebo: a model of one link, frames `F1`, ... in its scope, `Cube::F1` outside.
URDF: one link, and a fixed link for every face. Both tell Drake to make the touch mesh the rigid
side of a hydroelastic contact: of a compliant mesh it would take the convex hull. Mesh files are
named relative to the file, which yourdfpy, PyBullet and Drake follow; ROS wants `package://`
before them. Each is a template in this folder; names of objects need no escapes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from encoded_objects.base.errors import require
from encoded_objects.base.pages import page_environment
from generator.export.colours import hexadecimal
from generator.export.formats import ExportedObject, Files
from generator.export.robot.model import (
    Floats,
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

_MOMENTS = ("xx", "xy", "xz", "yy", "yz", "zz")


def _write(template: str, suffix: str, exported: ExportedObject) -> Files:
    """Yield the files of meshes, and the file that names them."""
    model = exported.robot
    meshes = (*model.visuals, *model.colliders)
    if template == "mjcf" and model.touch:  # its pieces bear the part, too
        meshes = (*model.visuals, *model.pieces, model.touch)

    def moments(*axes: str) -> str:
        """Return moments of inertia, kg m^2, of axes "xx", "xy", ..."""
        pairs = (tuple(map("xyz".index, each)) for each in axes)
        return numbers(model.inertia_kg_m2[pair] for pair in pairs)

    page = page_environment(Path(__file__).parent).get_template(f"{template}.xml.j2")
    text = page.render(
        model=model, meshes=meshes, moments=moments, numbers=numbers, rgba=rgba, pose=pose,
        hexadecimal=hexadecimal,
        point=lambda T: numbers(T[:3, 3]),
        quaternion=lambda T: numbers(quaternion(T[:3, :3])),
        turn=lambda T: numbers(roll_pitch_yaw(T[:3, :3])),
    )  # fmt: skip
    yield from mesh_files(meshes)
    yield exported.name + suffix, text.encode()


def _verify(
    read: Callable[[RobotModel, Path], ReadModel], exported: ExportedObject, path: Path
) -> None:
    """Read a file back; raises `SolidError` where it is not the model."""
    compare_model(exported.robot, read(exported.robot, path), path)


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


def read_urdf(model: RobotModel, path: Path) -> ReadModel:
    """Return what yourdfpy makes of a file."""
    require("yourdfpy", extra="robot", purpose="--verify of urdf")
    import yourdfpy

    read = yourdfpy.URDF.load(str(path))
    inertial = read.link_map[model.name].inertial
    frames = {frame.face: read.get_transform(frame.name, model.name) for frame in model.frames}
    return ReadModel(inertial.mass, inertial.origin[:3, 3], inertial.inertia, frames)


write_mjcf = partial(_write, "mjcf", ".xml")
write_sdf = partial(_write, "sdformat", ".sdf")
write_urdf = partial(_write, "urdf", ".urdf")
verify_mjcf, verify_sdf = partial(_verify, read_mjcf), partial(_verify, read_sdf)
verify_urdf = partial(_verify, read_urdf)
