"""What robots and simulators load, as independent programs read it.

Mass, centre and inertia by the CAD kernel from the STEP files of the same run; frames by planes,
corners and edges of the kernel's solids; MJCF by MuJoCo, URDF by yourdfpy, USD by OpenUSD, SDF
by the rules of its specification.
"""

import math
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import trimesh
from build123d import GeomType, Solid
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdValidation
from reference.kernel import inertia_of, solid_of
from reference.sdformat import faults

from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.transaction import read_transaction
from generator.errors import SolidError
from generator.export.robot import usd, xml_files
from generator.pipeline import encode
from generator.spec import SpecError, read_specs

SHAPES = Path(__file__).parents[2] / "fixtures" / "shapes"
ROBOT = ("mjcf", "urdf", "sdf", "usd")
BRACKET = f"shape: {{file: {SHAPES}/l_bracket.stl}}\nprint: {{parts: whole, down: none}}\n"
COARSE = "name: Part\nprofile: one-touch\nsymbols: {pitch: 9 mm}\n"  # few symbols: fast
TEXTS = {
    "panels": COARSE + "shape: {box: 45 x 35 x 30 mm}\n",
    "whole": COARSE + BRACKET + "robot: {density: 2 g/cm3}\n",
    "round": COARSE + "shape: {cylinder: {diameter: 40 mm, height: 30 mm}}\n",
}


def make(folder: Path, text: str, formats=ROBOT, **options):
    (folder / "spec.yaml").write_text(text)
    url = f"sqlite:///{folder / 'lab.db'}"
    specs = read_specs([folder / "spec.yaml"])
    encode(specs, folder=folder / "out", database=url, formats=formats, **options)
    return url


@pytest.fixture(scope="module", params=TEXTS)
def part(request, tmp_path_factory):
    """An object with its files and what is registered of it."""
    folder = tmp_path_factory.mktemp(request.param)
    round_one = request.param == "round"  # `--verify` takes ten times as long as all else
    url = make(folder, TEXTS[request.param], (*ROBOT, "step"), verify=round_one)
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
        (".sdf", xml_files.read_sdf), (".usdc", usd.read),
    ):  # fmt: skip
        yield suffix, read(named, part.folder / f"Part{suffix}")


def test_mass_centre_and_inertia_are_the_kernels_and_frames_those_of_the_database(part):
    assert part.faces
    volume, centre, inertia = inertia_of(part.solids)
    density = 2000.0 if part.kind == "whole" else 1240.0
    facets = 2e-3 if part.kind == "round" else 0.0  #: what triangles cut off a true cylinder
    for suffix, read in read_models(part):
        assert read.mass_kg == pytest.approx(density * volume * 1e-9, rel=2e-7 + facets), suffix
        assert read.centre_m == pytest.approx(centre * 1e-3, abs=2e-9 + 1e-2 * facets), suffix
        expected = density * inertia * 1e-15
        within = (5e-7 + facets) * expected.max()
        assert np.abs(read.inertia_kg_m2 - expected).max() < within, suffix
        assert set(read.frames) == set(part.faces)
        for name, T in part.faces.items():
            expected = T.copy()
            expected[:3, 3] *= 1e-3
            assert np.abs(read.frames[name] - expected).max() < 1e-9, (suffix, name)


def test_frames_lie_in_planes_of_the_kernel(part):
    """The frame's z is the outward normal of a plane of a solid that holds its origin."""
    planes = []
    for shape, T in part.solids:
        for face in Solid(shape).faces().filter_by(GeomType.PLANE):
            normal = T[:3, :3] @ tuple(face.normal_at())
            planes.append((*normal, normal @ (T @ (*face.center(), 1))[:3]))
    flat = {name: T for name, T in part.faces.items() if part.kind != "round" or name != "F2"}
    for name, T in flat.items():
        wanted = np.append(T[:3, 2], T[:3, 2] @ T[:3, 3])
        assert np.abs(np.array(planes) - wanted).max(axis=1).min() < 1e-6, name


def test_what_simulators_feel_is_one_closed_mesh_of_what_is_printed(part):
    mesh = trimesh.load(part.folder / "Part-touch.obj", process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == (6 if part.kind == "panels" else 1)
    volume, _, _ = inertia_of(part.solids)
    rel = 2e-3 if part.kind == "round" else 1e-6
    assert mesh.volume == pytest.approx(volume * 1e-9, rel=rel)


def test_convex_pieces_reach_to_the_tops_of_the_symbols(part):
    files = sorted(part.folder.glob("Part-collision-*.obj"))
    pieces = [trimesh.load(file, force="mesh") for file in files]
    assert len(files) == (6 if part.kind == "whole" else 1)  # a bracket with a pocket at its end
    seen = trimesh.load(part.folder / "Part-visual-symbols.obj", force="mesh")
    above = []
    for piece in pieces:
        assert piece.is_watertight
        assert piece.volume == pytest.approx(piece.convex_hull.volume, rel=1e-8)
        large = piece.area_faces > 1e-13  # a thinner one's normal is rounding
        normals, corners = piece.face_normals[large], piece.triangles[large, 0]
        offsets = np.einsum("ij,ij->i", normals, corners)
        assert (piece.vertices @ normals.T - offsets).max() < 1e-6
        above.append((seen.vertices @ normals.T - offsets).max(axis=1))
    assert np.min(above, axis=0).max() < 1e-6  # no symbol stands out, and no piece farther than one
    low, high = np.min([p.bounds[0] for p in pieces], 0), np.max([p.bounds[1] for p in pieces], 0)
    bounds = trimesh.load(part.folder / "Part-visual-body.obj", force="mesh").bounds
    bounds = [np.minimum(bounds[0], seen.bounds[0]), np.maximum(bounds[1], seen.bounds[1])]
    assert np.allclose([low, high], bounds, atol=1e-7)
    if part.kind == "whole":  # the notch stays open, less the symbols on its walls
        total = sum(piece.volume for piece in pieces)
        assert total < 94400e-9 + 1.05 * 1e-3 * 22e-3


def test_dropped_on_a_table_it_comes_to_rest_on_its_symbols(part):
    """The lowest face hangs over the table by 1 mm, less what MuJoCo's soft contact takes."""
    spec = mujoco.MjSpec.from_file(str(part.folder / "Part.xml"))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1])
    spec.body("Part").pos, spec.body("Part").quat = [0, 0, 0.004], [1, 0.01, 0.006, 0]
    model = spec.compile()
    visual = model.geom_group == 2
    assert not (model.geom_contype[visual] | model.geom_conaffinity[visual]).any()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(1.5 / model.opt.timestep))
    assert np.abs(data.qvel).max() < 0.02
    faces = [data.site(f"Part-{name}") for name in part.faces]
    heights = [face.xpos[2] for face in faces if face.xmat.reshape(3, 3)[2, 2] < -0.999]
    on_symbols = 0.0 if part.kind == "round" else 1e-3  # a cylinder stands on its blank end
    assert min(heights) == pytest.approx(on_symbols, abs=1.5e-4)
    assert min(heights) < on_symbols


def test_a_notch_is_open_and_what_is_in_it_can_be_felt(part):
    """MuJoCo finds the touch mesh in contact, by its hull, and lets it bear nothing."""
    if part.kind != "whole":
        return
    pieces = [trimesh.load(file, force="mesh") for file in part.folder.glob("*-collision-*.obj")]
    hull = trimesh.util.concatenate(pieces).convex_hull
    steps = np.linspace(*hull.bounds, 15).T
    grid = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 3)
    heights = [
        (grid @ body.face_normals.T - (body.face_normals * body.triangles[:, 0]).sum(axis=1)).max(1)
        for body in (hull, *pieces)
    ]
    notch = grid[np.minimum(-heights[0], np.min(heights[1:], axis=0)).argmax()]
    spec = mujoco.MjSpec.from_file(str(part.folder / "Part.xml"))
    ball = spec.worldbody.add_body(mocap=True, pos=notch)
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.002, 0, 0])
    model = spec.compile()
    data, force = mujoco.MjData(model), np.zeros(6)
    mujoco.mj_forward(model, data)
    [contact] = data.contact
    assert "Part-touch" in [model.geom(number).name for number in contact.geom]
    assert contact.dist < -0.004  # the ball's radius and more
    mujoco.mj_contactForce(model, data, 0, force)
    assert np.abs(force).max() < 1e-3


def test_sdf_keeps_to_its_specification(part):
    assert faults((part.folder / "Part.sdf").read_bytes()) == []


@pytest.fixture
def stage(part):
    return Usd.Stage.Open(str(part.folder / "Part.usdc"))


def test_usd_passes_the_validators_of_openusd(stage):
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 20
    assert not UsdValidation.ValidationContext(validators).Validate(stage)


def test_usd_is_a_rigid_body_whose_colliders_are_guides(stage):
    root = stage.GetDefaultPrim()
    assert root.HasAPI(UsdPhysics.RigidBodyAPI)
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
    for mesh in (UsdGeom.Mesh(prim) for prim in Usd.PrimRange(root) if prim.IsA(UsdGeom.Mesh)):
        points = np.array(mesh.GetPointsAttr().Get())
        extent = [points.min(axis=0), points.max(axis=0)]
        assert np.allclose(np.array(mesh.GetExtentAttr().Get()), extent, atol=1e-7)
        index, counts = mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get()
        assert UsdGeom.Mesh.ValidateTopology(index, counts, len(points)) in (True, (True, ""))
        a, b, c = points[np.array(index).reshape(-1, 3)].swapaxes(0, 1).astype(float)
        normals, areas = np.array(mesh.GetNormalsAttr().Get()), np.cross(b - a, c - a)
        assert mesh.GetNormalsInterpolation() == "uniform"
        large = np.linalg.norm(areas, axis=1) > 1e-9  # 32-bit corners tell no thin one's normal
        cosines = (areas * normals).sum(axis=1)[large] / np.linalg.norm(areas[large], axis=1)
        assert cosines.min() > 0.999
    for prim in root.GetChild("collision").GetChildren():
        assert prim.HasAPI(UsdPhysics.CollisionAPI)
        assert UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get() == "sdf"
        assert UsdGeom.Imageable(prim).ComputePurpose() == "guide"


def test_usd_is_felt_where_tactile_sensors_of_isaac_look(part, stage):
    """TacSL: the mesh with approximation sdf, in the body's frame; FlexiTac: the first mesh."""
    root = stage.GetDefaultPrim()
    first = next(prim for prim in Usd.PrimRange(root) if prim.IsA(UsdGeom.Mesh))
    assert first.GetPath() == "/Part/collision/touch"
    assert UsdGeom.XformCache().ComputeRelativeTransform(first, root)[0] == Gf.Matrix4d(1)
    mesh = UsdGeom.Mesh(first)
    felt = np.array(mesh.GetPointsAttr().Get(), float)
    assert np.abs(felt - trimesh.load(part.folder / "Part-touch.obj", process=False).vertices
                  ).max() < 1e-8  # fmt: skip
    told = {one.GetName(): one.Get() for one in first.GetAuthoredAttributes()}
    extent = 1e3 * np.ptp(felt, axis=0).max()
    # Strokes of 9 mm symbols are 1.8 mm wide, so cells .36 mm.
    assert told["physxSDFMeshCollision:sdfResolution"] == 8 * math.ceil(extent / 0.36 / 8)
    assert told["newton:sdfTargetVoxelSize"] == pytest.approx(0.36e-3)
    assert told["newton:hydroelasticEnabled"] is True
    assert first.GetMetadata("apiSchemas").GetAddedOrExplicitItems() == [
        "PhysicsCollisionAPI", "PhysicsMeshCollisionAPI", "PhysxCollisionAPI",
        "PhysxSDFMeshCollisionAPI", "NewtonSDFCollisionAPI",
    ]  # fmt: skip


def test_another_file_than_was_meant_is_refused(tmp_path, monkeypatch):
    right = xml_files.write_mjcf

    def wrong(exported):
        for name, content in right(exported):
            changed = name == "Part.xml"
            yield name, content.replace(b' mass="0.', b' mass="1.', 3) if changed else content

    monkeypatch.setattr(xml_files, "write_mjcf", wrong)
    with pytest.raises(SolidError, match=r"'Part.xml' has a mass of 1\.\d+ kg where 0\."):
        make(tmp_path, TEXTS["panels"], ("mjcf",), verify=True)
    assert not (tmp_path / "out").exists()


def test_symbols_as_convex_pieces_are_no_more(tmp_path):
    with pytest.raises(SpecError, match=r"spec.yaml:5:20: error: .*symbols"):
        make(tmp_path, TEXTS["round"] + "robot: {collision: symbols}\n")
