"""A project of Bambu Studio read by the rules of its importer, sharing nothing with the writer.

As the slicer does, meshes are found through relationships, put together by components, placed by
items, given filaments by `<part id>` of the settings, and must lie inside the cell of the plate
that lists them. What contradicts itself is refused with an `AssertionError`.
"""

from __future__ import annotations

import io
import json
import math
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import dataclass
from typing import Any

import numpy as np

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
PRODUCTION = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}"

Meshes = dict[int, tuple[str, np.ndarray]]  #: by number: the file, and its points


@dataclass(frozen=True)
class Placed:
    """One object of a plate."""

    name: str
    parts: tuple[str, ...]
    filaments: tuple[int, ...]  #: of each part
    low: tuple[float, float, float]  #: of its box on the plate, mm
    high: tuple[float, float, float]
    supports: bool


@dataclass(frozen=True)
class Project:
    """What a project holds."""

    application: str
    plates: tuple[tuple[Placed, ...], ...]
    settings: dict[str, Any]


def read_project(content: bytes) -> Project:
    """Return what a project holds."""
    package = zipfile.ZipFile(io.BytesIO(content))
    root = ET.fromstring(package.read("3D/3dmodel.model"))
    rels = ET.fromstring(package.read("3D/_rels/3dmodel.model.rels"))
    meshes: Meshes = {}
    uuids = [one.get(f"{PRODUCTION}UUID") for one in root.iter()]
    for target in (one.get("Target") for one in rels):
        model = ET.fromstring(package.read(target.lstrip("/")))
        uuids += [one.get(f"{PRODUCTION}UUID") for one in model.iter()]
        for found in model.iter(f"{CORE}object"):
            number = int(found.get("id"))
            assert number not in meshes, "two meshes of one id are one to the slicer"
            points = [[float(v.get(a)) for a in "xyz"] for v in found.iter(f"{CORE}vertex")]
            meshes[number] = target, np.array(points)
    settings = json.loads(package.read("Metadata/project_settings.config"))
    config = ET.fromstring(package.read("Metadata/model_settings.config"))
    described = {int(one.get("id")): one for one in config.iter("object")}
    objects = {int(one.get("id")): one for one in root.iter(f"{CORE}object")}
    items = {int(one.get("objectid")): one for one in root.iter(f"{CORE}item")}
    assert described.keys() == objects.keys() == items.keys()
    assert not objects.keys() & meshes.keys()
    plates = list(config.iter("plate"))
    assert [int(values(one)["plater_id"]) for one in plates] == list(range(1, len(plates) + 1))
    area = [tuple(map(float, corner.split("x"))) for corner in settings["printable_area"]]
    width, depth = max(x for x, _ in area), max(y for _, y in area)
    root_of = math.sqrt(len(plates))
    columns = round(root_of) + (root_of > round(root_of))
    held, listed = [], set()
    for k, plate in enumerate(plates):
        origin = np.array([k % columns * 1.2 * width, -(k // columns) * 1.2 * depth, 0.0])
        own = []
        for instance in plate.iter("model_instance"):
            number = int(values(instance)["object_id"])
            assert number not in listed
            listed.add(number)
            known = objects[number], items[number], described[number]
            placed = placed_object(*known, meshes, origin)
            assert min(placed.low) >= -1e-6, "in front of its plate, or below"
            assert placed.high[0] <= width + 1e-6, "beyond its plate"
            assert placed.high[1] <= depth + 1e-6, "beyond its plate"
            assert max(placed.filaments) <= len(settings["filament_colour"])
            own.append(placed)
        held.append(tuple(own))
    assert listed == objects.keys()
    named = {one.get("name"): one.text for one in root.iter(f"{CORE}metadata")}
    known = [one for one in uuids if one]
    assert len(set(known)) == len(known)
    return Project(named["Application"], tuple(held), settings)


def placed_object(
    described: ET.Element, item: ET.Element, config: ET.Element, meshes: Meshes, origin: np.ndarray
) -> Placed:
    """Return an object as it lies on the plate that begins at `origin`."""
    points, parts = [], {int(one.get("id")): one for one in config.iter("part")}
    components = list(described.iter(f"{CORE}component"))
    assert list(parts) == [int(one.get("objectid")) for one in components]
    for component in components:
        number = int(component.get("objectid"))
        target, own = meshes[number]
        assert component.get(f"{PRODUCTION}path") == target
        matrix = transform(component)
        said = np.array(values(parts[number])["matrix"].split(), float).reshape(4, 4)
        np.testing.assert_allclose(said, matrix, atol=1e-9)
        whole = transform(item) @ matrix
        points.append(own @ whole[:3, :3].T + whole[:3, 3] - origin)
    all_points = np.concatenate(points)
    own_values = values(config)
    assert own_values["name"] == described.get("name")
    return Placed(
        described.get("name"),
        tuple(values(part)["name"] for part in parts.values()),
        tuple(int(values(part)["extruder"]) for part in parts.values()),
        tuple(all_points.min(axis=0).tolist()),
        tuple(all_points.max(axis=0).tolist()),
        own_values["enable_support"] == "1",
    )


def values(element: ET.Element) -> dict[str, str]:
    """Return the settings that stand directly in an element."""
    return {one.get("key"): one.get("value") for one in element.findall("metadata")}


def transform(element: ET.Element) -> np.ndarray:
    """Return the (4, 4) transform of a component or an item."""
    matrix = np.eye(4)
    matrix[:3] = np.array(element.get("transform").split(), float).reshape(4, 3).T
    return matrix
