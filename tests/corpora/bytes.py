"""Every file that is made of the fixture specs and of a sample of every option.

Command and spec -> SHA-256 of each file, in groups:

- `geometry`: STEP, STL, 3MF, GLB, OBJ, MJCF, URDF, SDF, USD. Of a compressed file (3MF, stpz)
  the hash of what it holds, member by member.
- `picture`: PNG (its pixels), SVG, sheets, tables. They may change once on purpose.
- `packed`: the bytes of compressed files as they are. They depend on the zlib that Python was
  built with: where it packs otherwise than that of the stored corpus, the stored hashes stand.
- `report`: what `--json` says of the run, and exit code.
- `volatile`: files that depend on versions of libraries, as a form that does not: matplotlib
  draws the overview of a set (number of pages, fonts embedded) and the kit's plate pictures.

All are made with one lab key. Gzipped STEP is made of three specs only, the formats of single
options are those that they change. `--slice` and `--printed-check` need PrusaSlicer and are left
to the tests of `generator.printed`.
"""

import hashlib
import io
import json
import re
import zipfile
import zlib
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

from corpora.commands import DATA, FIXTURES, LAB_KEY, Commands, started_commands

NAME = "bytes"
ALL = "step,stpz,stl,3mf,glb,mjcf,urdf,sdf,usd"
SPECS = ("cube.yaml", *sorted(f"specs/{path.name}" for path in (FIXTURES / "specs").iterdir()))
SENSOR_TYPES = ("flexitac-12x32", "fsr-16", "fsr-8x8", "gel-24x32")
LARGE_TYPES = ("flexitac-16x32", "mat-32x32")
MOST = ALL.replace("stpz,", "")  # gzipped STEP costs more than all else together
PARTS = ("specs", "shapes", "options", "kit", "large-kit")
SLOW = ("large-kit",)  #: 50 s of CPU, and `kit` takes the same ways: left to `make.py --check`
Cases = tuple[tuple[str, str, str], ...]

_RING = (
    "shape: {polyhedron: {vertices: [[0, 0, 0], [60, 0, 0], [60, 60, 0], [0, 60, 0], "
    "[0, 0, 30], [60, 0, 30], [60, 60, 30], [0, 60, 30], [20, 20, 0], [40, 20, 0], "
    "[40, 40, 0], [20, 40, 0], [20, 20, 30], [40, 20, 30], [40, 40, 30], [20, 40, 30]], "
    "faces: [[[0, 3, 2, 1], [8, 9, 10, 11]], [[4, 5, 6, 7], [12, 15, 14, 13]], "
    "[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], "
    "[8, 12, 13, 9], [9, 13, 14, 10], [10, 14, 15, 11], [11, 15, 12, 8]]}}"
)
# Name of the case, what is written of it, and a spec; SHAPES stands for the fixtures' folder.
SHAPES: Cases = (
    ("step-hole", MOST, "shape: {file: SHAPES/cube_with_hole.step}"),
    ("step-bore", "step,stl,3mf,glb,sdf,usd", "shape: {file: SHAPES/block_with_bore.step}"),
    ("stl", MOST, "shape: {file: SHAPES/l_bracket.stl}"),
    ("stl-ascii", "stl", "shape: {file: SHAPES/l_bracket_ascii.stl}"),
    ("stl-scaled", "stl,step", "shape: {file: SHAPES/l_bracket.stl, scale: 1.25}"),
    ("obj", "step,stl,3mf", "shape: {file: SHAPES/prism.obj}"),
    ("box", "step,stl,glb", "shape: {box: 40 x 30 x 25 mm}"),
    ("triangular-prism", "stl,urdf", "shape: {triangular_prism: {side: 50 mm, height: 40 mm}}"),
    ("octahedron", "step,stl,3mf", "shape: {octahedron: 60 mm}"),
    ("dodecahedron", "step,stl,3mf,mjcf", "shape: {dodecahedron: 30 mm}"),
    ("prism", "step,stl", "shape: {prism: {sides: 6, side: 25 mm, height: 50 mm}}"),
    ("pyramid", "step,stl,sdf", "shape: {pyramid: {sides: 5, radius: 40 mm, height: 50 mm}}"),
    ("cylinder", MOST, "shape: {cylinder: {diameter: 50 mm, height: 40 mm}}"),
    ("cone", ALL, "shape: {cone: {diameter: 60 mm, top_diameter: 30 mm, height: 45 mm}}"),
    ("cone-pointed", "step,stl,usd", "shape: {cone: {diameter: 70 mm, height: 60 mm}}"),
    ("tag", "step,stl,3mf,glb,usd", "shape: {tag: 40 x 40 mm}\nmount: {screws: M3}"),
    ("flange", "step,stl", "shape: {cylinder: {diameter: 70 mm, height: 20 mm}}\nmount: 50-4-M6"),
    ("face-with-hole", "step,stl,3mf,glb", _RING),
)
_ROD = "shape: {cylinder: {diameter: 40 mm, height: 36 mm}}\n"
_SMALL = "shape: {cube: 36 mm}\n"
_SHELF = (
    "name: Shelf\nprofile: one-touch\nobjects:\n"
    "  - {name: Cube, shape: {cube: 30 mm}, copies: 2}\n"
    "  - {name: Rod, shape: {cylinder: {diameter: 30 mm, height: 60 mm}}}\n"
    "  - {name: Block, shape: {box: [40, 30, 20]}, print: {parts: whole, printer: resin}}\n"
)
OPTIONS: Cases = (
    ("whole", ALL, _SMALL + "print: {parts: whole}"),
    ("whole-cylinder", "step,3mf", _ROD + "print: {parts: whole}"),
    ("whole-bracket", "step,stl", "shape: {file: SHAPES/l_bracket.stl}\nprint: {parts: whole}"),
    ("two-colours", "3mf,glb,step", _SMALL + "print: {colours: 2}"),
    ("collision-body", "mjcf,urdf,sdf,usd", _SMALL + "robot: {collision: body}"),
    ("density", "mjcf,urdf,sdf,usd", _SMALL + "robot: {density: 2.7 g/cm3}"),
    ("layout-net", "step,stl", _SMALL + "layout: net"),
    ("layout-faces", "step,stl", _SMALL + "layout: faces"),
    ("copies", "stl,3mf", _SMALL + "copies: 3"),
    ("fine-printer", "stl,3mf", _SMALL + "print: {printer: fdm-0.25}"),
    ("resin", "stl,3mf,step", _SMALL + "print: {printer: resin}"),
    ("own-printer", "stl,3mf", _SMALL + "print: {printer: {like: ender-3, layer: 0.3 mm}}"),
    ("bambu", "3mf,bambu", _SMALL + "print: {printer: bambu-x1c}"),
    ("wall-gap", "step,stl", _SMALL + "print: {wall: 4 mm, gap: 0.3 mm}"),
    ("symbols", "step,stl", _SMALL + "profile: one-touch\nsymbols: {pitch: 7.5 mm, "
     "height: 1.2 mm, stroke: 1.3 mm, draft: 5 deg, chamfer: 0.2 mm, alphabet: letters-4}"),
    ("alphabet-thesis", "stl", "shape: {cube: 60 mm}\nprofile: thesis"),
    ("profile-large", "stl", _SMALL + "profile: large"),
    ("profile-fine", "stl", _SMALL + "profile: fine"),
    ("gel", "stl", _SMALL + "sensor_type: gel-24x32"),
    ("mat", "stl", "shape: {cube: 90 mm}\nsensor_type: mat-32x32"),
    ("prmvs", "stl", _SMALL + "encoding: {family: prba, order: 2, degree: 12, "
     "rows: 63, columns: 65, window: 6x2}\nsymbols: {pitch: 7 mm}"),
    ("name", "stl,step,urdf,usd", "name: Würfel 1 & 2\nshape: {cube: 32 mm}"),
    ("set", "step,stl,3mf,glb", _SHELF),
)  # fmt: skip

GEOMETRY = {"step", "stl", "glb", "obj", "xml", "urdf", "sdf", "usdc", "mtl"}
PACKED = {"3mf", "stpz", "png"}
_SAMPLE = b"".join(b"%d " % (k * k % 9973) for k in range(20_000))
DEFLATE = "a65a"  #: how the zlib of the stored corpus packs `_SAMPLE`


def collect(part: str) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a part."""
    with started_commands() as commands:
        for entry, value in CASES[part](commands):
            yield f"{part}/{entry}", value


def _specs(commands: Commands) -> Iterator[tuple[str, Any]]:
    for name in SPECS:
        case = Path(name).stem
        formats = ALL if case == "full" else MOST
        yield from _encoded(commands, case, FIXTURES / name, formats)


def _written(cases: Cases, commands: Commands) -> Iterator[tuple[str, Any]]:
    for case, formats, text in cases:
        spec = commands.folder / f"{case}.yaml"
        named = "" if text.startswith("name:") else f"name: {case}\n"
        spec.write_text(named + text.replace("SHAPES", str(FIXTURES / "shapes")))
        yield from _encoded(commands, case, spec, formats)


def _encoded(commands: Commands, case: str, spec: Path, formats: str) -> Iterator[tuple[str, Any]]:
    asked = ("--lab-key", LAB_KEY, "--database", f"{case}.db", "--format", formats)
    yield from _made(commands, case, "encode-object", spec, *asked)


def _kits(types: tuple[str, ...], commands: Commands) -> Iterator[tuple[str, Any]]:
    for case in types:
        yield from _made(commands, case, "probe-kit", case)


def _made(commands: Commands, case: str, *words: object) -> Iterator[tuple[str, Any]]:
    """Yield what a command reports and makes in the folder of its case."""
    out = commands.folder / case
    said = commands.entry(*words, "-o", out, "--json")
    yield f"report/{case}", {"code": said["code"], "json": said["stdout"]}
    yield from _files(case, out)


def _files(case: str, folder: Path) -> Iterator[tuple[str, Any]]:
    """Yield the entries of all files of a folder."""
    for path in sorted(folder.rglob("*")):
        if not path.is_file():
            continue
        name = f"{case}/{path.relative_to(folder).as_posix()}"
        data, ending = path.read_bytes(), path.suffix[1:].lower()
        _check_no_place(data, name, folder)
        if ending == "db":
            continue  # the corpus `databases` holds what is registered
        if ending == "pdf":
            yield f"volatile/{name}", _pdf(data)
            continue
        group = "geometry" if ending in GEOMETRY | {"3mf", "stpz"} else "picture"
        yield f"{group}/{name}", _sha256(content(data, ending))
        if ending in PACKED:
            yield f"packed/{name}", _packed(data, f"packed/{name}")


def content(data: bytes, ending: str) -> bytes:
    """Return what a file holds, unpacked: the same whichever zlib packed it."""
    if ending == "png":
        from PIL import Image

        with Image.open(io.BytesIO(data)) as image:
            return f"{image.mode} {image.size} ".encode() + image.tobytes()
    if ending == "html":  # its picture stands beside it
        return re.sub(rb"data:image/png;base64,[^\"]*", b"", data)
    if ending == "stpz":
        return zlib.decompress(data, wbits=47)
    if ending == "3mf":
        unpacked = []
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for info in archive.infolist():
                member = content(archive.read(info), info.filename.rpartition(".")[2])
                unpacked += [repr((info.filename, info.date_time, len(member))).encode(), member]
        return b"".join(unpacked)
    return data


def _packed(data: bytes, entry: str) -> str:
    if _deflate() == DEFLATE:
        return _sha256(data)
    return _stored().get(next((key for key in _stored() if key.endswith(entry)), ""), "unknown")


@cache
def _deflate() -> str:
    return _sha256(zlib.compress(_SAMPLE, 6) + zlib.compress(_SAMPLE, 9))[:4]


@cache
def _stored() -> dict[str, str]:
    return json.loads((DATA / f"{NAME}.json").read_text())


def _pdf(data: bytes) -> dict[str, Any]:
    """Return what does not depend on the version of matplotlib that drew the pages."""
    fonts = sorted(set(re.findall(rb"/BaseFont /(?:[A-Z]{6}\+)?([\w-]+)", data)))
    return {
        "pages": len(re.findall(rb"/Type /Page\b", data)),
        "fonts": [font.decode() for font in fonts],
        "dated": b"CreationDate" in data,
    }


def _check_no_place(data: bytes, name: str, folder: Path) -> None:
    """Refuse a file that tells where or when it was made."""
    for leak in (str(folder.parent), str(FIXTURES.parent)):
        if leak.encode() in data:
            raise ValueError(f"{name} holds the path {leak}")


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


CASES = {
    "specs": _specs,
    "shapes": partial(_written, SHAPES),
    "options": partial(_written, OPTIONS),
    "kit": partial(_kits, SENSOR_TYPES),
    "large-kit": partial(_kits, LARGE_TYPES),
}
