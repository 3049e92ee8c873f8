"""Our own Crate files, as OpenUSD reads them: values, arrays of whole numbers, trees."""

import numpy as np
import pytest

from generator.export.robot.crate import Attribute, Prim, crate_chunks


def opened(tmp_path, root):
    from pxr import Usd

    path = tmp_path / "stage.usdc"
    path.write_bytes(b"".join(crate_chunks(root)))
    return Usd.Stage.Open(str(path))


@pytest.mark.parametrize("size", [0, 1, 15, 16, 17, 5000])
@pytest.mark.parametrize("largest", [1, 120, 130, 32_000, 33_000, 2**31 - 1])
def test_whole_numbers(tmp_path, size, largest):
    """Differences of 1, 2 and 4 bytes, both signs, and those that leave 32 bits."""
    values = np.random.default_rng(size).integers(-largest, largest, size, endpoint=True)
    stage = opened(tmp_path, Prim("A", "Mesh", {"faceVertexCounts": Attribute("int[]", values)}))
    assert list(stage.GetPrimAtPath("/A").GetAttribute("faceVertexCounts").Get()) == list(values)


def test_values_of_every_type(tmp_path):
    T = np.arange(16.0).reshape(4, 4)
    told = {
        "a": Attribute("bool", True), "b": Attribute("bool", False), "c": Attribute("int", -7),
        "d": Attribute("float", -0.25), "e": Attribute("token", "guide", uniform=True),
        "f": Attribute("token[]", ["x", "", "y"]), "g": Attribute("matrix4d", T),
        "h": Attribute("point3f", [1.5, -2, 3]), "i": Attribute("float3[]", np.ones((2, 3))),
        "j": Attribute("normal3f[]", np.zeros((0, 3)), interpolation="uniform"),
        "k": Attribute("quatf", [0.5, 0.5, -0.5, 0.5]),
    }  # fmt: skip
    stage = opened(tmp_path, Prim("A", "Xform", told))
    prim = stage.GetPrimAtPath("/A")
    read = {name: prim.GetAttribute(name).Get() for name in told}
    assert [read[name] for name in "abcde"] == [True, False, -7, -0.25, "guide"]
    assert list(read["f"]) == ["x", "", "y"]
    assert (np.array(read["g"]) == T).all()
    assert tuple(read["h"]) == (1.5, -2, 3)
    assert np.array(read["i"]).tolist() == [[1, 1, 1], [1, 1, 1]]
    assert len(read["j"]) == 0
    assert (*read["k"].GetImaginary(), read["k"].GetReal()) == (0.5, 0.5, -0.5, 0.5)
    uniform = [str(prim.GetAttribute(name).GetVariability()).endswith("Uniform") for name in "ade"]
    assert uniform == [False, False, True]
    assert prim.GetAttribute("j").GetMetadata("interpolation") == "uniform"


def test_trees_keep_their_order(tmp_path):
    """Prims with and without attributes and children, first, amid and last."""
    one = {"x": Attribute("int", 1)}
    leaves = [Prim("z", "Scope"), Prim("a", "Scope", one), Prim("m", "Scope")]
    middle = Prim("Middle", "Xform", {}, leaves, ("PhysicsRigidBodyAPI",))
    below = [Prim("First", "Scope", one), middle, Prim("Last", "Scope", {}, leaves)]
    root = Prim("Root", "Xform", one, below, (), "component", "Würfel / 1")
    stage = opened(tmp_path, root)
    assert [str(prim.GetPath()) for prim in stage.Traverse()] == [
        "/Root", "/Root/First", "/Root/Middle", "/Root/Middle/z", "/Root/Middle/a",
        "/Root/Middle/m", "/Root/Last", "/Root/Last/z", "/Root/Last/a", "/Root/Last/m",
    ]  # fmt: skip
    assert stage.GetDefaultPrim().GetDisplayName() == "Würfel / 1"
    assert stage.GetPrimAtPath("/Root/Middle").GetAppliedSchemas() == ["PhysicsRigidBodyAPI"]
    assert stage.GetPrimAtPath("/Root/Last/a").GetAttribute("x").Get() == 1
