"""Encode public CAD models: made and verified, or refused with a reason; none may crash.

    python tests/campaigns/cad_models.py -o cad-models -j 2 [--packages admesh cura]

Nothing of the models is kept here (they have licences of their own): packages of `SOURCES` come by
their ordinary clients (`pip download`, `npm pack`, `apt-get download`) unless the folder holds
them. Each is scaled so that its largest face is as large as a square of 60 to 120 mm, compared with
the kernel's volume, and made as `verified.py` does; what cannot be made of panels is made whole.
Exit code 1 when a model crashes, runs out of time, fails verification, or is refused without
cause, place and way out.
"""

import fnmatch
import gzip
import io
import json
import math
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import runner
import verified

from generator.errors import GeneratorError
from generator.export.check import read_step, read_stl
from generator.polyhedron import Polyhedron, face_area, volume
from generator.polyhedron.read import read_shape

SMALL_MM, LARGE_MM = 60.0, 120.0  #: sides of a square as large as the largest face
PLANAR = 1e-4  #: share of the volume by which what is read may be off
CHORD_MM = 1.0  #: distance of round faces by which it may be off: the coarsest division


def encoded(model: Path) -> runner.Row:
    """Encode one model and return a row of the table."""
    row: runner.Row = {"name": model.name}
    try:
        solid = read_shape(model)
        scale = scale_of(solid)
        solid = read_shape(model, scale)
    except GeneratorError as error:
        told = {"place": error.place, "cause": error.cause, "fix": error.fix}
        return row | verified.refusal(told)
    if problem := volume_problem(model, solid, scale):
        return row | {"failed": problem}
    row["scale"] = scale
    with tempfile.TemporaryDirectory() as folder:
        for parts in ("whole",) if solid.surfaces or solid.blank else ("panels", "whole"):
            spec = Path(folder) / f"{parts}.yaml"
            shape = f"{{file: {json.dumps(str(model.resolve()))}, scale: {scale}}}"
            spec.write_text(f"name: Part\nshape: {shape}\nprint: {{parts: {parts}}}\n")
            made = verified.made(spec) | row
            if "refused" not in made:
                break
    return made


def scale_of(solid: Polyhedron) -> float:
    """Return the scale, to two digits, at which the largest face is neither small nor large."""
    runs = [surface.facets for surface in solid.surfaces]
    bent = {facet for facets in (*runs, solid.blank) for facet in facets}
    areas = [face_area(solid, k) for k in range(len(solid.faces)) if k not in bent]
    areas += [sum(face_area(solid, k) for k in facets) for facets in runs]
    side = math.sqrt(max(areas, default=float(np.ptp(solid.vertices, axis=0).max()) ** 2))
    exact = min(max(1.0, SMALL_MM / side), LARGE_MM / side)
    return float(f"{exact:.2g}")


def volume_problem(model: Path, solid: Polyhedron, scale: float) -> str:
    """Compare the volume that was read with that of the kernel or mesh library."""
    suffix = model.suffix.lower()
    if suffix == ".obj":
        return ""
    report = (read_stl if suffix == ".stl" else read_step)(model)
    exact = abs(report.volume_mm3) * scale**3
    bent = {facet for surface in solid.surfaces for facet in surface.facets} | {*solid.blank}
    allowed = PLANAR * exact + CHORD_MM * sum(face_area(solid, facet) for facet in bent)
    error = volume(solid) - exact
    if abs(error) <= allowed:
        return ""
    return f"it is read with a volume of {volume(solid):.6g} mm3; the kernel says {exact:.6g} mm3"


@dataclass(frozen=True)
class Source:
    """A package at the version that the models were chosen from."""

    client: str  #: pip (an sdist), npm, apt
    package: str
    version: str
    models: tuple[str, ...]  #: patterns of paths in it; `*` also matches `/`


SOURCES = (
    Source("pip", "build123d", "0.13.0", (
        "*/M6-1x12-countersunk-screw.step", "*/nema-17-bracket.step", "*/low_poly_benchy.stl",
        "*/cyl_w_rect_hole.stl",
    )),
    Source("npm", "occt-import-js", "0.0.23", (
        "*/cax-if/as1-oc-214.stp", "*/cax-if/io1-*.stp", "*/cax-if/sg1-c5-214.stp",
        "*/s1-c5-214/[HMT]*_*.stp", "*/s1-tu-203/tailturbine.stp", "*/s1_pe_214/[mt]*_prt.stp",
        "*/conical-surface/*.step", "*/cube-units/cube-in.step", "*/rounded-cube/*.step",
        "*/simple-basic-cube/*.stp", "*/cube-10x10mm/*.stl",
    )),
    Source("apt", "gmsh-doc", "4.8.4+ds2-3", (
        "*/lever.stl.gz", "*/surface1.stl.gz", "*/step_boundary_colors.stp.gz",
        "*/t20_data.step.gz",
    )),
    Source("apt", "netgen-doc", "6.2.2006+really6.2.1905+dfsg-5.1", ("*.step", "*.stl")),
    Source("apt", "occt-misc", "7.6.3+dfsg1-7", ("*/step/linkrods.step", "*/stl/sh*.stl")),
    Source("apt", "kicad-packages3d", "6.0.10-1", (
        "*/Heatsink_*.step", "*/Mounting_Wuerth_WA-SMSI-M3_H9mm_9774090360.step",
        "*/IDC-Header_2x03_P2.54mm_Vertical.step", "*/L_Wuerth_MAPI-2510.step",
        "*/BatteryHolder_Keystone_2993.step", "*/Relay_SPST_StandexMeder_SIL_Form1B.step",
        "*/Relay_SPST_Panasonic_JW1_FormA.step", "*/Relay_SPDT_HJR-4102.step",
        "*/RV_Disc_D9mm_W3.4mm_P5mm.step", "*/Altech_AK300_1x02_P5.00mm_45-Degree.step",
        "*/DWM1000.step", "*/Diodes_DFN1006-3.step", "*/Converter_DCDC_RECOM_R-78B-2.0_THT.step",
        "*/Filter_Mini-Circuits_FV1206.step", "*/SW_SPST_EVQPE1.step",
    )),
    Source("apt", "assimp-testmodels", "5.2.5~ds0-1", (
        "*/models/OBJ/*.obj", "*/models/STL/*.stl", "*/models/STL/*.STL", "*/models/invalid/*.obj",
    )),
    Source("apt", "admesh", "0.98.4-2", ("*/examples/block.stl",)),
    Source("apt", "cura", "4.13.0-1", tuple(
        f"*/meshes/{name}" for name in (
            "3di_d300_platform.STL", "BIQU_BX_PLATE.stl", "Hellbot_Magna_2_230.obj",
            "STREAM20PRO_platform.STL", "anycubic_*.obj", "anycubic_*.stl",
            "cremaker_platform_200.obj",
            "eryone_er20_plateform.stl", "flyingbear_platform.obj", "hellbot_*.obj",
            "inat_proton_x_buildplate.stl", "jgaurora_a6_platform.stl", "koonovo.obj", "moai.obj",
            "pbr3d_g1_buildplate.stl", "sapphirepro_platform.stl", "tinyboy_*.stl", "tinyboy_*.obj",
            "twotrees235x235_generic.stl", "twotrees_platform.stl", "ultimaker_s3_platform.obj",
            "uni_*_platform.stl",
        )
    )),
)  # fmt: skip


def fetched(folder: Path, source: Source) -> list[Path]:
    """Return the models of a package, which is brought in unless its folder is there."""
    target = folder / source.package
    if not target.exists():
        archives = folder / "archives"
        archives.mkdir(parents=True, exist_ok=True)
        before = set(archives.iterdir())
        subprocess.run(_command(source), cwd=archives, check=True, stdout=sys.stderr)
        (archive,) = set(archives.iterdir()) - before
        partial = folder / f"{source.package}.part"
        for name, content in _members(archive, source.models):
            path = partial / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        archive.unlink()
        partial.rename(target)
    return sorted(path for path in target.rglob("*") if path.is_file())


def _command(source: Source) -> list[str]:
    if source.client == "npm":
        return ["npm", "pack", "--silent", f"{source.package}@{source.version}"]
    if source.client == "apt":
        return ["apt-get", "download", "-q", f"{source.package}={source.version}"]
    pip = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--no-binary", ":all:"]
    return [*pip, f"{source.package}=={source.version}"]


def _members(archive: Path, patterns: tuple[str, ...]) -> list[tuple[str, bytes]]:
    """Return name and content of the files in an archive that match; `.gz` is unpacked."""
    if archive.suffix == ".deb":
        command = ["dpkg-deb", "--fsys-tarfile", str(archive)]
        with (
            subprocess.Popen(command, stdout=subprocess.PIPE) as unpacked,
            tarfile.open(fileobj=unpacked.stdout, mode="r|") as tar,
        ):
            return _matching(tar, patterns)
    with tarfile.open(archive) as tar:
        return _matching(tar, patterns)


def _matching(tar: tarfile.TarFile, patterns: tuple[str, ...]) -> list[tuple[str, bytes]]:
    found: dict[str, bytes] = {}
    for member in tar:
        if not member.isfile() or not any(fnmatch.fnmatchcase(member.name, p) for p in patterns):
            continue
        content = tar.extractfile(member) or io.BytesIO()
        parts = [part for part in Path(member.name).parts[-2:] if part not in ("..", "/")]
        data, name = content.read(), "/".join(parts)
        if name.endswith(".gz"):
            data, name = gzip.decompress(data), name.removesuffix(".gz")
        found[name] = data
    return sorted(found.items())


def main() -> int:
    """Encode the models and print a line for each."""
    known = [source.package for source in SOURCES]
    asked = runner.asked(__doc__, output=True, packages=known, jobs=1)
    models = [(source.package, model) for source in SOURCES if source.package in asked.packages
              for model in fetched(asked.output, source)]  # fmt: skip
    runner.table(("model", "package", "scale", "what"))
    rows = []
    jobs = [model for _, model in models]
    done = runner.in_processes(encoded, jobs, asked.jobs)
    for (package, model), row in zip(models, done, strict=True):
        what = row.get("failed") or row.get("refused") or f"{row['parts']} parts, verified"
        runner.row(model.name, package, row.get("scale", ""), " ".join(what.split())[:200])
        rows.append(row)
    return verified.summarise(rows)


if __name__ == "__main__":
    sys.exit(main())
