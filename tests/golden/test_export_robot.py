"""What robots and simulators load, as independent programs read it.

Mass, centre and inertia by the CAD kernel from the STEP files of the same run; frames by planes,
corners and edges of the kernel's solids; MJCF by MuJoCo, URDF by yourdfpy, USD by OpenUSD, SDF
by the rules of its specification.
"""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from reference.kernel import inertia_of, solid_of
from reference.sdformat import faults

from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.errors import SolidError
from generator.export.robot import usd, xml_files
from generator.pipeline import encode
from generator.spec import SpecError, read_specs

ROOT = Path(__file__).parents[2]
FIXTURES = ROOT / "fixtures"
ROBOT = ("mjcf", "urdf", "sdf", "usd")
BRACKET = f"shape: {{file: {FIXTURES / 'shapes' / 'l_bracket.stl'}}}\nprint: {{parts: whole}}\n"
COARSE = "name: Part\nprofile: one-touch\nsymbols: {pitch: 9 mm}\n"  # few symbols: fast
TEXTS = {
    "panels": COARSE + "shape: {box: 45 x 35 x 30 mm}\n",
    "whole": COARSE + BRACKET + "robot: {density: 2 g/cm3, collision: symbols}\n",
    "round": COARSE + "shape: {cylinder: {diameter: 40 mm, height: 30 mm}}\n",
}


def make(folder: Path, text: str, formats=ROBOT, **options):
    (folder / "spec.yaml").write_text(text)
    url = f"sqlite:///{folder / 'lab.db'}"
    specs = read_specs([folder / "spec.yaml"])
    made = encode(specs, folder=folder / "out", database=url, formats=formats, **options)
    return made, url


@pytest.fixture(scope="module", params=TEXTS)
def part(request, tmp_path_factory):
    """An object with its files and what is registered of it."""
    folder = tmp_path_factory.mktemp(request.param)
    _, url = make(folder, TEXTS[request.param], (*ROBOT, "step"), verify=True)
    with read_transaction(open_database(url, writable=False)) as connection:
        known = read_object(connection, "Part")
    faces = {face.name: face.T_object_face for face in known.faces if "." not in face.name}
    solids = [
        (solid_of(folder / "out" / Path(entry.file).name), entry.T_object_part)
        for entry in known.parts
    ]
    return SimpleNamespace(kind=request.param, folder=folder / "out", faces=faces, solids=solids)


def read_models(part):
    """Yield what every program reads: mass, centre, inertia, frames."""
    frames = tuple(SimpleNamespace(face=name, name=f"Part-{name}") for name in part.faces)
    named = SimpleNamespace(name="Part", frames=frames)
    for suffix, read in (
        (".xml", xml_files.read_mjcf), (".urdf", xml_files.read_urdf),
        (".sdf", xml_files.read_sdf), (".usda", usd.read),
    ):  # fmt: skip
        yield suffix, read(named, part.folder / f"Part{suffix}")


def test_mass_centre_and_inertia_are_the_kernels(part):
    volume, centre, inertia = inertia_of(part.solids)
    density = 2000.0 if part.kind == "whole" else 1240.0
    facets = 2e-3 if part.kind == "round" else 0.0  #: what triangles cut off a true cylinder
    for suffix, read in read_models(part):
        assert read.mass_kg == pytest.approx(density * volume * 1e-9, rel=2e-7 + facets), suffix
        assert read.centre_m == pytest.approx(centre * 1e-3, abs=2e-9 + 1e-2 * facets), suffix
        expected = density * inertia * 1e-15
        within = (5e-7 + facets) * expected.max()
        assert np.abs(read.inertia_kg_m2 - expected).max() < within, suffix


def test_frames_of_faces_are_those_of_the_database(part):
    assert part.faces
    for suffix, read in read_models(part):
        assert set(read.frames) == set(part.faces)
        for name, T in part.faces.items():
            expected = T.copy()
            expected[:3, 3] *= 1e-3
            assert np.abs(read.frames[name] - expected).max() < 1e-9, (suffix, name)


def test_frames_lie_in_planes_of_the_kernel(part):
    """The frame's z is the outward normal of a plane of a solid that holds its origin."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    planes = []
    for shape, T in part.solids:
        explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
        while explorer.More():
            face = TopoDS.Face_s(explorer.Current())
            surface = BRepAdaptor_Surface(face)
            if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_Plane:
                plane = surface.Plane()
                axis, at = plane.Axis().Direction(), plane.Location()
                normal = np.array([axis.X(), axis.Y(), axis.Z()])
                if (face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED) == plane.Direct():
                    normal = -normal
                normal = T[:3, :3] @ normal
                planes.append((*normal, normal @ (T @ (at.X(), at.Y(), at.Z(), 1))[:3]))
            explorer.Next()
    planes = np.array(planes)
    flat = {name: T for name, T in part.faces.items() if part.kind != "round" or name != "F2"}
    for name, T in flat.items():
        wanted = np.append(T[:3, 2], T[:3, 2] @ T[:3, 3])
        assert np.abs(planes - wanted).max(axis=1).min() < 1e-6, name


def test_pieces_that_are_hit_fill_the_body_and_are_convex(part):
    import trimesh

    files = sorted(part.folder.glob("Part-collision-*.obj"))
    pieces = [trimesh.load(file, force="mesh") for file in files]
    assert all(piece.is_watertight and piece.is_convex for piece in pieces)
    body = {"panels": 45 * 35 * 30e-9, "whole": 94400e-9, "round": math.pi * 0.02**2 * 0.03}
    assert len(files) == (6 if part.kind == "whole" else 1)  # a bracket with a pocket at its end
    total = sum(piece.volume for piece in pieces)
    assert total == pytest.approx(body[part.kind], rel=3e-3 if part.kind == "round" else 1e-6)
    symbols = list(part.folder.glob("Part-symbol-*.obj"))
    assert bool(symbols) == (part.kind == "whole")


def test_symbols_that_are_hit_fill_the_symbols(part):
    """MuJoCo's geoms: each piece stands where a symbol does, and all weigh what symbols weigh."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(part.folder / "Part.xml"))
    hit = model.geom_contype == 1
    assert (model.geom_group[hit] == 3).all()
    assert (model.geom_group[~hit] == 2).all()
    if part.kind != "whole":
        return
    import trimesh

    seen = trimesh.load(part.folder / "Part-visual-symbols.obj", force="mesh")
    volumes = {
        file.stem: trimesh.load(file, force="mesh").volume
        for file in part.folder.glob("Part-symbol-*.obj")
    }
    names = [model.mesh(model.geom_dataid[geom]).name for geom in np.flatnonzero(hit)]
    total = sum(volumes[name] for name in names if name in volumes)
    assert total == pytest.approx(seen.volume, rel=0.01)


def test_dropped_on_a_table_it_comes_to_rest_on_a_face(part):
    import mujoco

    spec = mujoco.MjSpec.from_file(str(part.folder / "Part.xml"))
    plane = [2, 2, 0.1]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=plane)
    spec.body("Part").pos = [0, 0, 0.05]
    spec.body("Part").quat = [1, 0.03, 0.02, 0]
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(int(1.5 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 0.02
    if part.kind == "round":  # it stands on its base, or rolls; never sinks
        assert data.body("Part").xipos[2] > 0.012
        return
    down = [data.site(f"Part-{name}").xmat.reshape(3, 3)[2, 2] for name in part.faces]
    assert min(down) < -0.999 or part.kind == "whole"  # the bracket may lie on two edges
    assert 0.005 < data.body("Part").xipos[2] < 0.04


def test_sdf_keeps_to_its_specification(part):
    assert faults((part.folder / "Part.sdf").read_bytes()) == []


def test_usd_is_a_rigid_body_whose_pieces_are_guides(part):
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.Open(str(part.folder / "Part.usda"))
    root = stage.GetDefaultPrim()
    assert root.HasAPI(UsdPhysics.RigidBodyAPI)
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
    seen = UsdGeom.Mesh(root.GetPrimAtPath("visual/Part_visual_symbols"))
    low, high = np.array(seen.GetExtentAttr().Get())
    points = np.array(seen.GetPointsAttr().Get())
    assert np.allclose([low, high], [points.min(axis=0), points.max(axis=0)], atol=1e-7)
    assert UsdGeom.Mesh.ValidateTopology(
        seen.GetFaceVertexIndicesAttr().Get(), seen.GetFaceVertexCountsAttr().Get(), len(points)
    ) in (True, (True, ""))
    for prim in root.GetChild("collision").GetChildren():
        assert prim.HasAPI(UsdPhysics.CollisionAPI)
        assert UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get() == "convexHull"
        assert UsdGeom.Imageable(prim).ComputePurpose() == "guide"


def test_another_file_than_was_meant_is_refused(tmp_path, monkeypatch):
    right = xml_files.write_mjcf

    def wrong(exported):
        for name, content in right(exported):
            changed = name == "Part.xml"
            yield name, content.replace(b' mass="0.', b' mass="1.', 3) if changed else content

    monkeypatch.setattr(xml_files, "write_mjcf", wrong)
    with pytest.raises(SolidError, match=r"'Part.xml' has a mass of 1\.\d+ kg where 0\."):
        make(tmp_path, TEXTS["panels"], verify=True)
    assert not (tmp_path / "out").exists()


def test_symbols_on_a_round_face_cannot_collide(tmp_path):
    with pytest.raises(SpecError, match=r"spec.yaml:5:20: error: .* round face cannot collide"):
        make(tmp_path, TEXTS["round"] + "robot: {collision: symbols}\n")
