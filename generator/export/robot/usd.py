"""Robot model -> USD (`.usdc`): a rigid body of UsdPhysics with its meshes inside.

`/Cube` is the body, `/Cube/F1` ... are the frames of its faces, `/Cube/collision` what collides
(guides, which no viewer draws), `/Cube/visual` what is seen. Metres, kilograms, z up. The touch
mesh is `/Cube/collision/touch`: the first mesh of the body, in the body's frame, the one with
approximation sdf. That is where the tactile sensors of Isaac Lab (TacSL) and FlexiTac look.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from encoded_objects.base.errors import require
from generator.export.formats import ExportedObject, Files
from generator.export.robot.crate import Attribute, Prim, crate_chunks
from generator.export.robot.model import (
    ModelMesh,
    ReadModel,
    RobotModel,
    compare_model,
    quaternion,
    rotation_of,
)

_SCHEMAS = ("PhysicsCollisionAPI", "PhysicsMeshCollisionAPI")
_TOUCH_SCHEMAS = ("PhysxCollisionAPI", "PhysxSDFMeshCollisionAPI", "NewtonSDFCollisionAPI")
#: Cells of a distance field across a stroke: touches are read as well as with exact distances
#: with 2 to 8 of them, badly with 1 (50 touches each of a 60 mm cube, strokes of 1 mm).
_CELLS = 5
_BAND_CELLS, _PADDING_CELLS = 10.0, 5.0  #: known about the surface, and around the box
_SUBGRID = 6  #: cells along a block of PhysX's sparse field
#: N/m^3, of Newton's hydroelastic contact: ten times a pad of 2 MPa and 2 mm, so the pad yields
_STIFFNESS = 1e10
_THIN_M2 = 1e-18  #: twice the area of a triangle without a normal


def write(exported: ExportedObject) -> Files:
    """Yield the file, which holds the meshes."""
    yield f"{exported.name}.usdc", crate_chunks(_body(exported.robot))


def verify(exported: ExportedObject, path: Path) -> None:
    """Read a file back by another program; raises `SolidError` where it is not the model."""
    compare_model(exported.robot, read(exported.robot, path), path)


def prim_name(name: str) -> str:
    """Return a name as USD allows one: letters, digits and underscores, no digit first."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if not plain[:1].isdigit() else f"_{plain}"


def _body(model: RobotModel) -> Prim:
    moments, axes = np.linalg.eigh(model.inertia_kg_m2)
    if np.linalg.det(axes) < 0:
        axes = -axes
    mass = {
        "physics:mass": Attribute("float", model.mass_kg),
        "physics:centerOfMass": Attribute("point3f", model.centre_m),
        "physics:diagonalInertia": Attribute("float3", moments),
        "physics:principalAxes": Attribute("quatf", np.roll(quaternion(axes), -1)),
    }
    frames = [
        Prim(prim_name(frame.face), "Xform", {
            "xformOp:transform": Attribute("matrix4d", frame.T_object_face.T),  # rows from the left
            "xformOpOrder": Attribute("token[]", ["xformOp:transform"], uniform=True),
        })
        for frame in model.frames
    ]  # fmt: skip
    guide = {"purpose": Attribute("token", "guide", uniform=True)}
    if model.touch:
        colliders = [_mesh("touch", model.touch, guide | _touch(model), _SCHEMAS + _TOUCH_SCHEMAS)]
    else:
        hull = {"physics:approximation": Attribute("token", "convexHull", uniform=True)}
        colliders = [
            _mesh(f"piece_{number}", mesh, guide | hull, _SCHEMAS)
            for number, mesh in enumerate(model.pieces, 1)
        ]
    visuals = [
        _mesh(prim_name(mesh.name), mesh, {"primvars:displayColor": Attribute(
            "color3f[]", [np.divide(mesh.colour, 255).round(4)], interpolation="constant"
        )})
        for mesh in model.visuals
    ]  # fmt: skip
    scopes = [Prim("collision", "Scope", {}, colliders), Prim("visual", "Scope", {}, visuals)]
    return Prim(
        prim_name(model.name), "Xform", mass, [*frames, *scopes],
        ("PhysicsRigidBodyAPI", "PhysicsMassAPI"), "component", model.name,
    )  # fmt: skip


def _touch(model: RobotModel) -> dict[str, Attribute]:
    """Return how PhysX and Newton make the distance field of the touch mesh.

    PhysX divides the largest side by the resolution, a multiple of 8; both otherwise take bands
    of a tenth of a metre, larger than the part. Newton feels two bodies that are hydroelastic.
    """
    assert model.touch is not None
    cell = model.stroke_m / _CELLS
    cells = 8 * math.ceil(float(np.ptp(model.touch.vertices, axis=0).max()) / cell / 8)
    return {
        "physics:approximation": Attribute("token", "sdf", uniform=True),
        "physxSDFMeshCollision:sdfResolution": Attribute("int", cells),
        "physxSDFMeshCollision:sdfSubgridResolution": Attribute("int", _SUBGRID),
        "physxCollision:contactOffset": Attribute("float", cell),
        "physxCollision:restOffset": Attribute("float", 0.0),
        "newton:sdfTargetVoxelSize": Attribute("float", cell, uniform=True),
        "newton:sdfNarrowBandInner": Attribute("float", -_BAND_CELLS * cell, uniform=True),
        "newton:sdfNarrowBandOuter": Attribute("float", _BAND_CELLS * cell, uniform=True),
        "newton:sdfPadding": Attribute("float", _PADDING_CELLS * cell, uniform=True),
        "newton:contactGap": Attribute("float", cell),
        "newton:hydroelasticEnabled": Attribute("bool", True),
        "newton:hydroelasticStiffness": Attribute("float", _STIFFNESS),
    }


def _mesh(
    name: str, mesh: ModelMesh, more: dict[str, Attribute], schemas: tuple[str, ...] = ()
) -> Prim:
    points, triangles = mesh.vertices, mesh.triangles
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), _THIN_M2)
    shape = {
        "extent": Attribute("float3[]", [points.min(axis=0), points.max(axis=0)]),
        "subdivisionScheme": Attribute("token", "none", uniform=True),
        "faceVertexCounts": Attribute("int[]", np.full(len(triangles), 3)),
        "faceVertexIndices": Attribute("int[]", triangles.ravel()),
        "points": Attribute("point3f[]", points),
        "normals": Attribute("normal3f[]", normals, interpolation="uniform"),
    }
    return Prim(name, "Mesh", shape | more, (), schemas)


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
