"""Robot model -> USD as text (`.usda`): a rigid body of UsdPhysics with its meshes inside.

`/Cube` is the body, `/Cube/F1` ... are the frames of its faces, `/Cube/visual` what is seen,
`/Cube/collision` what is hit: guides, so that no viewer draws them. Metres, kilograms, z up.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from encoded_objects.base.errors import require
from generator.export.colours import RGB
from generator.export.formats import ExportedObject, Files
from generator.export.robot.model import (
    Floats,
    ModelMesh,
    PlacedMesh,
    ReadModel,
    RobotModel,
    compare_model,
    numbers,
    quaternion,
    rotation_of,
)

_ROW = 4096  #: points or triangles on a line of text


def write(exported: ExportedObject) -> Files:
    """Yield the file, which holds the meshes."""
    yield f"{exported.name}.usda", usd_chunks(exported.robot)


def verify(exported: ExportedObject, path: Path) -> None:
    """Read a file back by another program; raises `SolidError` where it is not the model."""
    compare_model(exported.robot, read(exported.robot, path), path)


def usd_chunks(model: RobotModel) -> Iterator[bytes]:
    """Yield the file, piece by piece."""
    for text in _lines(model):
        yield text.encode()


def prim_name(name: str) -> str:
    """Return a name as USD allows one: letters, digits and underscores, no digit first."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if not plain[:1].isdigit() else f"_{plain}"


def _lines(model: RobotModel) -> Iterator[str]:
    root = prim_name(model.name)
    moments, axes = np.linalg.eigh(model.inertia_kg_m2)
    if np.linalg.det(axes) < 0:
        axes = -axes
    yield (
        f'#usda 1.0\n(\n    defaultPrim = "{root}"\n    kilogramsPerUnit = 1\n'
        '    metersPerUnit = 1\n    upAxis = "Z"\n)\n\n'
        f'def Xform "{root}" (\n'
        f'    prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]\n'
        f"    displayName = {json.dumps(model.name, ensure_ascii=False)}\n"
        '    kind = "component"\n)\n{\n'
        f"    float physics:mass = {numbers([model.mass_kg])}\n"
        f"    point3f physics:centerOfMass = {_tuple(model.centre_m)}\n"
        f"    float3 physics:diagonalInertia = {_tuple(moments)}\n"
        f"    quatf physics:principalAxes = {_tuple(quaternion(axes))}\n"
    )
    for frame in model.frames:
        yield f'\n    def Xform "{prim_name(frame.face)}"\n    {{\n'
        yield f"{_matrix(frame.T_object_face)}    }}\n"
    yield '\n    def Scope "visual"\n    {\n'
    for mesh in model.visuals:
        yield from _mesh(mesh, f"{prim_name(mesh.name)}", _colour(mesh.colour))
    yield '    }\n\n    def Scope "collision"\n    {\n'
    for number, placed in enumerate(model.collisions, 1):
        yield from _collision(placed, f"piece_{number}")
    yield "    }\n}\n"


def _collision(placed: PlacedMesh, name: str) -> Iterator[str]:
    yield from _mesh(
        placed.mesh, name,
        '            uniform token physics:approximation = "convexHull"\n'
        '            uniform token purpose = "guide"\n' + _matrix(placed.T_object_mesh, 12),
        ' (\n            prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"]\n'
        "        )",
    )  # fmt: skip


def _mesh(mesh: ModelMesh, name: str, more: str, schemas: str = "") -> Iterator[str]:
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    yield (
        f'        def Mesh "{name}"{schemas}\n        {{\n'
        f"            float3[] extent = [{_tuple(low)}, {_tuple(high)}]\n"
        '            uniform token subdivisionScheme = "none"\n'
        "            int[] faceVertexCounts = ["
    )
    yield from _joined(["3"] * len(mesh.triangles))
    yield "]\n            int[] faceVertexIndices = ["
    yield from _joined(list(map(str, mesh.triangles.ravel().tolist())))
    yield "]\n            point3f[] points = ["
    yield from _joined(
        [f"({x:.8g}, {y:.8g}, {z:.8g})" for x, y, z in (mesh.vertices + 0.0).tolist()]
    )
    yield f"]\n{more}        }}\n"


def _joined(values: list[str]) -> Iterator[str]:
    for start in range(0, len(values), _ROW):
        yield (", " if start else "") + ", ".join(values[start : start + _ROW])


def _colour(colour: RGB) -> str:
    shares = _tuple(np.array([round(value / 255, 4) for value in colour]))
    return (
        f"            color3f[] primvars:displayColor = [{shares}] (\n"
        '                interpolation = "constant"\n            )\n'
    )


def _matrix(T: Floats, indent: int = 8) -> str:
    """Return the attributes of a placed prim; USD multiplies rows from the left."""
    rows = ", ".join(_tuple(row) for row in T.T)
    space = " " * indent
    return (
        f"{space}matrix4d xformOp:transform = ( {rows} )\n"
        f'{space}uniform token[] xformOpOrder = ["xformOp:transform"]\n'
    )


def _tuple(values: Floats) -> str:
    return f"({numbers(values.tolist()).replace(' ', ', ')})"


def read(model: RobotModel, path: Path) -> ReadModel:
    """Return what OpenUSD makes of a file."""
    require("pxr.Usd", extra="usd", purpose="--verify of usd")
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.Open(str(path))
    root = stage.GetDefaultPrim()
    mass = UsdPhysics.MassAPI(root)
    quaternion = mass.GetPrincipalAxesAttr().Get()
    turn = rotation_of(np.array([quaternion.GetReal(), *quaternion.GetImaginary()], np.float64))
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
