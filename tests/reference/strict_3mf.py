"""What lib3mf's strict reader finds in a 3MF."""

from pathlib import Path

import numpy as np


def read_strictly(path: Path) -> tuple[list[str], list[tuple[str, np.ndarray, np.ndarray]]]:
    """Return names of meshes, all manifold, and what is built: name, low and high corner, mm."""
    import lib3mf

    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    names, built = [], []
    meshes, items = model.GetMeshObjects(), model.GetBuildItems()
    while meshes.MoveNext():
        mesh = meshes.GetCurrentMeshObject()
        assert mesh.IsManifoldAndOriented()
        names.append(mesh.GetName())
    while items.MoveNext():
        item = items.GetCurrent()
        thing, shift = item.GetObjectResource(), item.GetObjectTransform().Fields[3]
        box = thing.GetOutbox()
        low, high = (np.array(c) + shift for c in (box.MinCoordinate, box.MaxCoordinate))
        built.append((thing.GetName(), low, high))
    return names, built
