"""Drake's hydroelastic contact on a surface: an engine that shares no model with ours.

The part under the sensor is rigid: its triangles, as they are written or as heights are meshed, and
no grid. Every tab is a compliant box of the tab's area on one body, its pressure rising from 0 at
its sides to the elastomer's modulus along its middle; Drake cuts each box along the triangles and
adds up the pressure on the cut. The plant has no time step and is never stepped: a touch is a
handful of its contact results, at rest where forces and moments balance those of the touch and the
wrist. Left out: domes of tips, friction, and how tabs bulge. SI units are Drake's; mm and N here.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch, no_contact
from probe.contact.engines import Engine
from probe.contact.meshes import Mesh, check_tabs, mesh_under, rest_on, triangles_under
from probe.contact.tips import Tips
from probe.errors import ContactError
from probe.surface.contract import HeightMap

require("pydrake", extra="drake", purpose="engine drake")

Array = NDArray[np.float64]

#: A box is as stiff as a tab of the overlay under small forces, but bears no more than a third of
#: its modulus times its area, reached .56 mm deep. Presses beyond some 5 N get an elastomer that is
#: so stiff that a level plate would rest this deep.
DEEP_MM = 0.2
BOX_MM = 4.0  #: height of a box: its upper side never touches
TILTED_MM = 0.6  #: below the top of the part, beyond the tilt, where a level plate is looked for
HALVINGS = 4  #: of that way, about 1.5 mm; a contact result costs 40 ms
TOLERANCE = 1e-3  #: of the force; noise of a tactel is ten times as much
LEAST_SLOPE = 0.2  #: of force over depth, where a box is pressed to its middle


def press(surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips) -> Contact:
    """Press a sensor with tabs on a written part, or on heights alone, which are meshed first.

    Raises `ContactError` for an overlay that is no tabs, nothing under the sensor, or no rest.
    """
    check_tabs("drake", sensor, touch)
    if touch.force_n == 0:
        return no_contact(sensor, touch, "drake")
    at, lengths = sensor.centres_mm().reshape(-1, 2), np.zeros(sensor.rows * sensor.columns)
    if tips.shifts_mm is not None:
        at = at + tips.shifts_mm.reshape(-1, 2)
    if tips.lengths_mm is not None:
        lengths = tips.lengths_mm.ravel()
    gc.collect()  # the scene before, 30 MB, which a cycle of Drake's references keeps
    corners, triangles = mesh_under(surface, sensor, touch)
    top_mm, half_mm = float(corners[:, 2].max()), half_side_mm(sensor)
    forces_at = _scene((corners, triangles), at, lengths, half_mm, touch)
    level_n = float(forces_at(np.array([top_mm - DEEP_MM, 0.0, 0.0]))[0].sum())
    if level_n == 0:
        raise ContactError(
            "there is too little under the sensor to bear the force",
            fix="move the sensor over the object",
        )
    soft = sensor.overlay.young_mpa * half_mm / sensor.overlay.height_mm
    modulus = max(soft, touch.force_n / level_n)

    def stiffer(plate: Array) -> tuple[Array, Array]:
        forces, depths = forces_at(plate)
        slopes = forces / np.maximum(depths, 0.02) * np.maximum(1 - depths / half_mm, LEAST_SLOPE)
        return modulus * forces, modulus * slopes

    return rest_on(
        stiffer, top_mm, at, touch, sensor.shape, "drake",
        deep_mm=TILTED_MM, halvings=HALVINGS, tolerance=TOLERANCE,
    )  # fmt: skip


def half_side_mm(sensor: SensorType) -> float:
    """Return half the side of a square as large as the tip of a tab."""
    return math.sqrt(math.pi) / 4 * sensor.overlay.tab_diameter_mm


def _scene(
    part_mm: Mesh, at: Array, lengths: Array, half_mm: float, touch: Touch
) -> Callable[[Array], tuple[Array, Array]]:
    """Build the plant; return what it feels at a pose of the plate (z mm, tilt x, tilt y).

    That is the force along the sensor's axis on every box of 1 MPa, N, and how deep its contact
    lies in it, mm.
    """
    from pydrake.common import MemoryFile
    from pydrake.geometry import (
        AddCompliantHydroelasticProperties,
        AddRigidHydroelasticProperties,
        Box,
        HydroelasticContactRepresentation,
        InMemoryMesh,
        ProximityProperties,
    )
    from pydrake.geometry import Mesh as MeshShape
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel
    from pydrake.multibody.tree import SpatialInertia
    from pydrake.systems.framework import DiagramBuilder

    corners, triangles = part_mm
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in (1e-3 * corners).tolist()]
    lines += [f"f {a} {b} {c}\n" for a, b, c in (triangles + 1).tolist()]
    shape = MeshShape(InMemoryMesh(mesh_file=MemoryFile("".join(lines), ".obj", "part")))
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    rigid, box = ProximityProperties(), ProximityProperties()
    AddRigidHydroelasticProperties(rigid)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), shape, "part", rigid)
    pad = plant.AddRigidBody("pad", SpatialInertia.SolidBoxWithMass(0.1, 0.03, 0.03, 0.01))
    side = 2e-3 * half_mm
    AddCompliantHydroelasticProperties(side, 1e6, box)
    tab = Box(side, side, 1e-3 * BOX_MM)
    tabs = {}
    for k, ((x, y), length) in enumerate(zip(at.tolist(), lengths.tolist(), strict=True)):
        middle = RigidTransform([1e-3 * x, 1e-3 * y, 1e-3 * (BOX_MM / 2 - length)])
        tabs[plant.RegisterCollisionGeometry(pad, middle, tab, f"{k}", box)] = k
    plant.set_contact_model(ContactModel.kHydroelasticsOnly)
    plant.set_contact_surface_representation(HydroelasticContactRepresentation.kPolygon)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    inside = plant.GetMyContextFromRoot(context)
    results, turn = plant.get_contact_results_output_port(), RotationMatrix.MakeZRotation
    turned = turn(touch.theta_rad)

    def forces_at(plate: Array) -> tuple[Array, Array]:
        z, tilt_x, tilt_y = plate.tolist()
        tilted = RotationMatrix.MakeXRotation(tilt_x) @ RotationMatrix.MakeYRotation(tilt_y)
        at_m: Any = 1e-3 * np.array([touch.x_mm, touch.y_mm, z])  # as Drake's stubs want it
        T = RigidTransform(turned @ tilted, at_m)
        plant.SetFreeBodyPose(inside, pad, T)
        found, axis = results.Eval(inside), T.rotation().matrix()[:, 2]
        forces, depths = np.zeros(len(at)), np.zeros(len(at))
        for number in range(found.num_hydroelastic_contacts()):
            contact = found.hydroelastic_contact_info(number)
            cut = contact.contact_surface()
            k = tabs[cut.id_M() if cut.id_M() in tabs else cut.id_N()]
            forces[k] = abs(contact.F_Ac_W().translational() @ axis)
            depths[k] = 1e3 * (cut.centroid() - T.translation()) @ axis + lengths[k]
        return forces, depths

    return forces_at


ENGINE = Engine(press, points=1, overlays=("tab",), triangles=triangles_under)
