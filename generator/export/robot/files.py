"""A robot model -> the files of the formats that are asked for, meshes once for all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from generator.export.robot.mjcf import mjcf_bytes
from generator.export.robot.model import ModelMesh, RobotModel
from generator.export.robot.sdf import sdf_bytes
from generator.export.robot.urdf import urdf_bytes
from generator.export.robot.usd import usd_chunks

WITH_MESHES: dict[str, tuple[str, Callable[[RobotModel], bytes]]] = {
    "mjcf": (".xml", mjcf_bytes),
    "urdf": (".urdf", urdf_bytes),
    "sdf": (".sdf", sdf_bytes),
}
_BLOCK = 65_536  #: lines written at once


def robot_files(
    model: RobotModel, formats: Sequence[str]
) -> Iterator[tuple[str, bytes | Iterable[bytes]]]:
    """Yield name and content of each file.

    Parameters
    ----------
    model
        The object.
    formats
        Of mjcf, urdf, sdf, usd; others are left out.
    """
    text = [kind for kind in WITH_MESHES if kind in formats]
    if text:
        for mesh in model.meshes:
            yield f"{mesh.name}.obj", _obj(mesh)
    for kind in text:
        suffix, write = WITH_MESHES[kind]
        yield model.name + suffix, write(model)
    if "usd" in formats:
        yield f"{model.name}.usda", usd_chunks(model)


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
