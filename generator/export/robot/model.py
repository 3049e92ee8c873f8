"""Parts -> the object as one rigid body, and what the files of robots share.

Visual: the bodies of all parts in one mesh, and the symbols. Collision: one closed mesh of all
parts with their symbols, which simulators feel, or convex pieces that reach to the tops of the
symbols. Mass, centre and inertia: of the parts as they are printed, symbols and marks included,
all solid; an object of panels is hollow. Metres, kilograms, radians; the origin is that of the
object frame, so that the frame of a face is its `T_object_face`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.export.colours import BODY_RGB, RGB, SYMBOL_RGB
from generator.export.meshes import join_meshes
from generator.layout.placement import Layout
from generator.polyhedron import Polyhedron, face_frame
from generator.solid import Mesh, Part, body_mesh, emboss_whole, symbol_meshes
from generator.solid.convex import DEPTH_MM, convex_pieces
from generator.solid.measure import inertia_of
from generator.solid.part import transform

Floats = NDArray[np.float64]
M = 1e-3  #: metres in a millimetre
ZERO = 1e-16  #: nothing in a file is smaller: rotations, metres, kilograms
GIMBAL = 1e-12  #: a cosine of the pitch below it leaves roll and yaw one freedom
_BLOCK = 65_536  #: lines written at once
SHARE = 1e-6  #: by which a mass or inertia that is read may be off: USD has 32-bit floats
POSE_M = 1e-7  #: the same of a point, m, and of the elements of a rotation


@dataclass(frozen=True, slots=True, eq=False)
class ModelMesh:
    """A mesh of a model."""

    name: str  #: of the mesh, and with .obj of its file
    vertices: Floats  #: (n, 3) m
    triangles: NDArray[np.int64]  #: (m, 3)
    colour: RGB = BODY_RGB


@dataclass(frozen=True, slots=True, eq=False)
class FaceFrame:
    """A face and its frame."""

    face: str  #: "F1"
    name: str  #: "Cube-F1", unique among objects
    T_object_face: Floats  #: (4, 4) m


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """An object as one rigid body."""

    name: str
    mass_kg: float
    centre_m: Floats  #: (3,) of mass, object frame
    inertia_kg_m2: Floats  #: (3, 3) about the centre of mass, axes of the object
    visuals: tuple[ModelMesh, ...]
    touch: ModelMesh | None  #: all parts with their symbols, closed; None: the pieces collide
    pieces: tuple[ModelMesh, ...]  #: convex each, to the tops of the symbols
    frames: tuple[FaceFrame, ...]
    stroke_m: float = 1e-3  #: width of the symbols' strokes
    warnings: tuple[str, ...] = ()

    @property
    def colliders(self) -> tuple[ModelMesh, ...]:
        """What collides, where a collider need not be convex."""
        return (self.touch,) if self.touch else self.pieces


def robot_model(
    name: str,
    polyhedron: Polyhedron,
    parts: Sequence[Part],
    meshes: Sequence[Mesh],
    *,
    density_kg_m3: float,
    stroke_mm: float,
    touch: bool = True,
) -> RobotModel:
    """Return the model of an object; `meshes` of its parts, part frame, mm.

    Parts never overlap, so their meshes side by side are their union.
    """
    vertices, triangles = _in_object_frame(zip(parts, meshes, strict=True))
    inertia = inertia_of(vertices[triangles])
    pieces, warnings = _pieces(name, polyhedron, vertices)
    return RobotModel(
        name=name,
        mass_kg=density_kg_m3 * inertia.volume * M**3,
        centre_m=inertia.centre * M,
        inertia_kg_m2=density_kg_m3 * inertia.tensor * M**5,
        visuals=tuple(_visuals(name, parts)),
        touch=ModelMesh(f"{name}-touch", M * vertices, triangles) if touch else None,
        pieces=pieces,
        frames=tuple(_frames(name, polyhedron)),
        stroke_m=stroke_mm * M,
        warnings=warnings,
    )


def _visuals(name: str, parts: Sequence[Part]) -> Iterator[ModelMesh]:
    """Yield the bodies of all parts in one mesh, and their symbols in another."""
    bodies = [(part, body_mesh(part)) for part in parts]
    symbols = [(part, mesh) for part in parts for mesh in symbol_meshes(part)]
    for what, colour, meshes in (("body", BODY_RGB, bodies), ("symbols", SYMBOL_RGB, symbols)):
        if meshes:
            vertices, triangles = _in_object_frame(meshes)
            yield ModelMesh(f"{name}-visual-{what}", M * vertices, triangles, colour)


def _in_object_frame(
    meshes: Iterable[tuple[Part, Mesh]],
) -> tuple[Floats, NDArray[np.int64]]:
    return join_meshes(
        (transform(part.T_object_part, mesh.vertices), mesh.triangles) for part, mesh in meshes
    )


def _pieces(
    name: str, polyhedron: Polyhedron, vertices: Floats
) -> tuple[tuple[ModelMesh, ...], tuple[str, ...]]:
    """Return the shape as convex meshes, and what they lack; `vertices` of its parts."""
    plain = emboss_whole(polyhedron, Layout("faces", 1.0, ()), (), name)
    mesh = body_mesh(plain)
    body = transform(plain.T_object_part, mesh.vertices)
    found = convex_pieces(body, mesh.triangles, vertices)
    warnings: tuple[str, ...] = ()
    if found.depth_mm > DEPTH_MM:
        warnings = (
            f"{len(found.pieces)} convex collision pieces stand out up to {found.depth_mm:.1f} mm",
        )
    meshes = (
        ModelMesh(f"{name}-collision-{number}", M * corners, triangles)
        for number, (corners, triangles) in enumerate(found.pieces, 1)
    )
    return tuple(meshes), warnings


def _frames(name: str, polyhedron: Polyhedron) -> Iterator[FaceFrame]:
    """Yield the frame of every face; a round face has that of its first facet."""
    done: set[str] = set()
    for number, facet in enumerate(polyhedron.faces):
        face = re.sub(r"\..*", "", facet.name)
        if face not in done:
            done.add(face)
            T = face_frame(polyhedron, number)
            T[:3, 3] *= M
            yield FaceFrame(face, f"{name}-{face}", T)


def mesh_files(meshes: Iterable[ModelMesh]) -> Iterator[tuple[str, Iterator[bytes]]]:
    """Yield name and content of the files of meshes, Wavefront OBJ."""
    for mesh in meshes:
        yield f"{mesh.name}.obj", _obj(mesh)


def _obj(mesh: ModelMesh) -> Iterator[bytes]:
    """Yield a Wavefront OBJ: metres, so that no slicer takes it for a part."""
    yield b"# metres\n"
    for line, rows in (
        ("v %.8g %.8g %.8g\n", mesh.vertices + 0.0),
        ("f %d %d %d\n", mesh.triangles + 1),
    ):
        for start in range(0, len(rows), _BLOCK):
            block = rows[start : start + _BLOCK]
            yield (line * len(block) % tuple(block.ravel().tolist())).encode()


def numbers(values: Iterable[float]) -> str:
    """Return numbers with spaces between, to 15 digits; what is rounding about zero is zero."""
    return " ".join(f"{value if abs(value) > ZERO else 0.0:.15g}" for value in values)


def rgba(colour: RGB) -> str:
    """Return a colour of 0 to 255 as four numbers of 0 to 1."""
    return numbers([*(round(value / 255, 4) for value in colour), 1])


def quaternion(R: Floats) -> Floats:
    """Return (w, x, y, z) of a rotation (3, 3), w not below 0; by the largest of the four."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R
    products = np.array(
        [
            [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
            [zy - yz, 1 + xx - yy - zz, yx + xy, xz + zx],
            [xz - zx, yx + xy, 1 - xx + yy - zz, zy + yz],
            [yx - xy, xz + zx, zy + yz, 1 - xx - yy + zz],
        ]
    )
    found: Floats = products[np.argmax(products.diagonal())]
    found = found / np.linalg.norm(found)
    return -found if found[0] < 0 else found


def roll_pitch_yaw(R: Floats) -> tuple[float, float, float]:
    """Return the angles with R = Rz(yaw) Ry(pitch) Rx(roll), rad; yaw is 0 where it is free."""
    cosine = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], cosine)
    if cosine < GIMBAL:
        return math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def pose(T: Floats) -> str:
    """Return x y z roll pitch yaw of a pose (4, 4)."""
    return numbers([*T[:3, 3], *roll_pitch_yaw(T[:3, :3])])


@dataclass(frozen=True, slots=True, eq=False)
class ReadModel:
    """A model as a program read it."""

    mass_kg: float
    centre_m: Floats  #: (3,)
    inertia_kg_m2: Floats  #: (3, 3) about the centre, axes of the object
    frames: Mapping[str, Floats]  #: (4, 4) m, by face


def compare_model(model: RobotModel, read: ReadModel, path: Path) -> None:
    """Compare a file, as a program read it, with the model; raises `SolidError` on a difference."""
    moment = float(np.abs(model.inertia_kg_m2).max())
    wrong = []
    if abs(read.mass_kg / model.mass_kg - 1) > SHARE:
        wrong.append(f"a mass of {read.mass_kg:g} kg where {model.mass_kg:g} kg was meant")
    if np.abs(read.centre_m - model.centre_m).max() > POSE_M:
        wrong.append("another centre of mass than was meant")
    if np.abs(read.inertia_kg_m2 - model.inertia_kg_m2).max() > SHARE * moment:
        wrong.append("another inertia than was meant")
    for frame in model.frames:
        found = read.frames.get(frame.face)
        if found is None or np.abs(found - frame.T_object_face).max() > POSE_M:
            wrong.append(f"another frame of {frame.face} than was meant")
    if wrong:
        raise SolidError(
            f"'{path.name}' has " + ", ".join(wrong),
            fix="do not load it; report the spec together with this message",
            place=str(path),
        )


def rotation_of(quaternion: Floats) -> Floats:
    """Return (3, 3) of (w, x, y, z)."""
    from scipy.spatial.transform import Rotation

    turned: Floats = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
    return turned


def pose_of(R: Floats, at: Floats) -> Floats:
    """Return the pose (4, 4) of a rotation and a point."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, at
    return T
