"""Written parts' files as triangles and height fields."""

import struct

import numpy as np
import pytest

from probe.errors import SurfaceError
from probe.simulate.written import part_mesh, written_triangles


def binary(triangles, header=b"solid of a lying header"):
    """Bytes of a binary STL."""
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *np.asarray(t, float).ravel(), 0) for t in triangles
    )
    return header.ljust(80, b" ") + struct.pack("<I", len(triangles)) + body


@pytest.mark.parametrize("kind", ["binary", "ascii"])
def test_files_are_read_exactly(tmp_path, kind):
    triangles = np.random.default_rng(0).normal(size=(40, 3, 3)).astype(np.float32)
    file = tmp_path / "part.stl"
    if kind == "binary":
        file.write_bytes(binary(triangles))
    else:
        rows = ["solid x"]
        for t in triangles:
            rows += ["facet normal 0 0 0", " outer loop"]
            rows += [f"  vertex {x!r} {y!r} {z!r}" for x, y, z in t.astype(float).tolist()]
            rows += [" endloop", "endfacet"]
        file.write_text("\n".join([*rows, "endsolid x"]))
    assert np.array_equal(written_triangles(file), triangles.astype(float))
    assert part_mesh(file).top_mm == triangles[..., 2].max()


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (binary([np.eye(3)])[:-1], "announces 1 triangles, but ends at byte 133 after 0"),
        (binary([]), "no triangle"),
        (binary([np.eye(3) * np.nan]), "triangle 1 at byte 84 has a corner that is not a number"),
        (b"solid x\nendsolid", "no triangle"),
        (b"\x89PNG", "neither ASCII nor binary STL"),
        (b"", "empty"),
    ],
)
def test_what_is_no_stl_is_refused(tmp_path, content, match):
    file = tmp_path / "bad.stl"
    file.write_bytes(content)
    with pytest.raises(SurfaceError, match=match) as caught:
        written_triangles(file)
    assert caught.value.place.startswith(str(file))
    assert caught.value.fix


def test_missing_files_and_folders_are_refused(tmp_path):
    for path, match in ((tmp_path / "none.stl", "no such file"), (tmp_path, "is a directory")):
        with pytest.raises(SurfaceError, match=match):
            written_triangles(path)
