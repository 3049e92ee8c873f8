"""What was written for robots, as the programs that load it read it.

MuJoCo reads the MJCF, yourdfpy the URDF, OpenUSD the USD: mass, centre, inertia and the frame of
every face must be what was meant. Of SDF there is no reader that installs by pip; it is read as
XML here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from generator.errors import SolidError
from generator.export.robot.model import RobotModel
from generator.export.robot.usd import prim_name

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ModelTolerance:
    """How far a file may be from what was meant: USD holds masses as 32-bit floats."""

    share: float = 1e-6  #: of mass, and of the largest moment of inertia
    pose: float = 1e-7  #: m, and of the elements of a rotation


@dataclass(frozen=True, slots=True, eq=False)
class ReadModel:
    """A model as a program read it."""

    mass_kg: float
    centre_m: Floats  #: (3,)
    inertia_kg_m2: Floats  #: (3, 3) about the centre, axes of the object
    frames: Mapping[str, Floats]  #: (4, 4) m, by face


def verify_robot(model: RobotModel, files: Iterable[Path]) -> None:
    """Read files of a model back; meshes are read with the files that name them.

    Raises
    ------
    SolidError
        A file says something else than was meant.
    MissingExtraError
        What reads it is not installed.
    """
    for path in files:
        if path.suffix in READERS:
            _compare(model, READERS[path.suffix](model, path), path)


def read_mjcf(model: RobotModel, path: Path) -> ReadModel:
    """Return what MuJoCo makes of a file."""
    require("mujoco", extra="robot", purpose="--verify of mjcf")
    import mujoco

    read = mujoco.MjModel.from_xml_path(str(path))
    body = read.body(model.name).id
    turn = _rotation(read.body_iquat[body])
    frames = {}
    for frame in model.frames:
        site = read.site(frame.name).id
        frames[frame.face] = _pose(_rotation(read.site_quat[site]), read.site_pos[site])
    return ReadModel(
        float(read.body_mass[body]), np.array(read.body_ipos[body]),
        turn @ np.diag(read.body_inertia[body]) @ turn.T, frames,
    )  # fmt: skip


def read_urdf(model: RobotModel, path: Path) -> ReadModel:
    """Return what yourdfpy makes of a file."""
    require("yourdfpy", extra="robot", purpose="--verify of urdf")
    import yourdfpy

    read = yourdfpy.URDF.load(str(path))
    inertial = read.link_map[model.name].inertial
    frames = {frame.face: read.get_transform(frame.name, model.name) for frame in model.frames}
    return ReadModel(inertial.mass, inertial.origin[:3, 3], inertial.inertia, frames)


def read_usd(model: RobotModel, path: Path) -> ReadModel:
    """Return what OpenUSD makes of a file."""
    require("pxr.Usd", extra="usd", purpose="--verify of usd")
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.Open(str(path))
    root = stage.GetDefaultPrim()
    mass = UsdPhysics.MassAPI(root)
    quaternion = mass.GetPrincipalAxesAttr().Get()
    turn = _rotation(np.array([quaternion.GetReal(), *quaternion.GetImaginary()], np.float64))
    frames = {
        frame.face: np.array(
            UsdGeom.Xformable(
                root.GetChild(prim_name(frame.face))
            ).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        ).T
        for frame in model.frames
    }  # fmt: skip
    return ReadModel(
        mass.GetMassAttr().Get(), np.array(mass.GetCenterOfMassAttr().Get(), np.float64),
        turn @ np.diag(np.array(mass.GetDiagonalInertiaAttr().Get(), np.float64)) @ turn.T, frames,
    )  # fmt: skip


def read_sdf(_model: RobotModel, path: Path) -> ReadModel:
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
        frame.attrib["name"]: _pose(Rotation.from_euler("xyz", at[3:]).as_matrix(), at[:3])
        for frame in body.findall("frame")
        for at in [values(frame, "pose")]
    }
    mass, centre = values(inertial, "mass"), values(inertial, "pose")
    return ReadModel(float(mass[0]), centre[:3], tensor, frames)


READERS: dict[str, Callable[[RobotModel, Path], ReadModel]] = {
    ".xml": read_mjcf,
    ".urdf": read_urdf,
    ".sdf": read_sdf,
    ".usda": read_usd,
}


def _compare(model: RobotModel, read: ReadModel, path: Path) -> None:
    given = ModelTolerance()
    moment = float(np.abs(model.inertia_kg_m2).max())
    wrong = []
    if abs(read.mass_kg / model.mass_kg - 1) > given.share:
        wrong.append(f"a mass of {read.mass_kg:g} kg where {model.mass_kg:g} kg was meant")
    if np.abs(read.centre_m - model.centre_m).max() > given.pose:
        wrong.append("another centre of mass than was meant")
    if np.abs(read.inertia_kg_m2 - model.inertia_kg_m2).max() > given.share * moment:
        wrong.append("another inertia than was meant")
    for frame in model.frames:
        found = read.frames.get(frame.face)
        if found is None or np.abs(found - frame.T_object_face).max() > given.pose:
            wrong.append(f"another frame of {frame.face} than was meant")
    if wrong:
        raise SolidError(
            f"'{path.name}' has " + ", ".join(wrong),
            fix="do not load it; report the spec together with this message",
            place=str(path),
        )


def _rotation(quaternion: Floats) -> Floats:
    """Return (3, 3) of (w, x, y, z)."""
    from scipy.spatial.transform import Rotation

    turned: Floats = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
    return turned


def _pose(R: Floats, at: Floats) -> Floats:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, at
    return T
