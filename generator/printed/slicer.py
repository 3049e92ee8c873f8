"""A part's file -> G-code by PrusaSlicer, and where the part lies in it. mm.

The part is sliced as its file has it, the flat back on the bed; its box is put on the middle
of a bed that is large enough, which gives T_part_gcode, and the plastic is compared with the
part's box, so that a slicer that turned, scaled or moved it does not pass. PrusaSlicer
2.5 gives other G-code each run unless its memory lies where it lay and one processor works:
its environment and the names of its files have a fixed length, too.
"""

from __future__ import annotations

import configparser
import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import CrossSection, JoinType
from numpy.typing import NDArray

from encoded_objects.base.files import staged_file
from encoded_objects.base.foreign import foreign_bytes
from generator.errors import PrintError, ShapeError
from generator.polyhedron.read.stl import MOST_PART_TRIANGLES, stl_triangles
from generator.printed.gcode import Toolpath, read_gcode
from generator.printers import Printer

#: Where distributions put the vendors' settings.
VENDOR_FOLDERS = (
    Path("/usr/share/PrusaSlicer/profiles"),
    Path("/usr/local/share/PrusaSlicer/profiles"),
    Path("/opt/PrusaSlicer/resources/profiles"),
)
_VENDOR = "PrusaResearch"
_PRINTER = "Original Prusa i3 MK3S & MK3S+"
_FILAMENT = "Prusament PLA"
_NOZZLE_MM = 0.051  # by which a profile's nozzle may differ


@dataclass(frozen=True, slots=True)
class PrintProfile:
    """One machine and how it prints; without vendor settings, a nozzle and a layer."""

    name: str
    nozzle_mm: float = 0.0  #: 0 where `file` says it
    layer_mm: float = 0.0
    vendor_print: str = ""  #: name of the vendor's print settings
    vendor_printer: str = ""  #: and of its printer
    file: Path | None = None  #: exported settings, in place of all others


PROFILES: dict[str, PrintProfile] = {
    name: PrintProfile(name, nozzle, layer, vendor, _PRINTER + printer)
    for name, nozzle, layer, vendor, printer in (
        ("fdm-0.25-0.1", 0.25, 0.1, "0.10mm DETAIL @0.25 nozzle MK3", " 0.25 nozzle"),
        ("fdm-0.4-0.1", 0.4, 0.1, "0.10mm DETAIL @MK3", ""),
        ("fdm-0.4-0.2", 0.4, 0.2, "0.20mm QUALITY @MK3", ""),
        ("fdm-0.4-0.3", 0.4, 0.3, "0.30mm DRAFT @MK3", ""),
        ("fdm-0.6-0.2", 0.6, 0.2, "0.20mm DETAIL @0.6 nozzle MK3", " 0.6 nozzle"),
        ("fdm-0.6-0.3", 0.6, 0.3, "0.30mm QUALITY @0.6 nozzle MK3", " 0.6 nozzle"),
        ("fdm-0.8-0.3", 0.8, 0.3, "0.30mm DETAIL @0.8 nozzle", " 0.8 nozzle"),
    )
}
DEFAULT = "fdm-0.4-0.2"


def print_profile(name: str) -> PrintProfile:
    """Return a profile by its name or of an exported file; `PrintError` lists the known ones."""
    if name in PROFILES:
        return PROFILES[name]
    if name.endswith(".ini"):
        file = Path(name)
        if file.is_file():
            return PrintProfile(file.stem, file=file)
        raise PrintError("there is no such file of print settings", fix="check it", place=name)
    raise PrintError(
        f"unknown print profile '{name}'",
        fix=f"choose one of {', '.join(PROFILES)}, or a .ini file that PrusaSlicer exported",
    )


def profile_of_printer(printer: Printer) -> PrintProfile:
    """Return the profile by which a spec's printer prints: of its nozzle, its layer or the nearest.

    Raises `PrintError` for a printer that lays no beads, or a nozzle without a profile.
    """
    nozzle = printer.nozzle_mm
    fitting = [one for one in PROFILES.values() if abs(one.nozzle_mm - nozzle) < _NOZZLE_MM]
    if not nozzle or not fitting:
        what = f"has a nozzle of {nozzle:g} mm" if nozzle else "lays no beads"
        raise PrintError(
            f"printer {printer.name} {what}: what it prints is not simulated",
            fix=f"choose a print profile, one of {', '.join(PROFILES)}",
        )
    return min(fitting, key=lambda one: abs(one.layer_mm - printer.layer_mm))


def settings_of(profile: PrintProfile) -> dict[str, str]:
    """Return all settings by the slicer's own names; raises `PrintError` for no settings file."""
    if profile.file is not None:
        return _read_exported(profile.file)
    vendor = next((f for f in VENDOR_FOLDERS if (f / f"{_VENDOR}.ini").is_file()), None)
    if vendor is None:
        return _plain_profile(profile)
    sections = _parser()
    sections.read(vendor / f"{_VENDOR}.ini", encoding="utf-8")
    try:
        return {
            **_inherit(sections, "print", profile.vendor_print),
            **_inherit(sections, "filament", _FILAMENT),
            **_inherit(sections, "printer", profile.vendor_printer),
        }
    except KeyError:  # another year's vendor file
        return _plain_profile(profile)


def _plain_profile(profile: PrintProfile) -> dict[str, str]:
    """Return the few settings that a nozzle and a layer need, else the slicer's defaults."""
    return {
        "nozzle_diameter": f"{profile.nozzle_mm:g}",
        "filament_diameter": "1.75",
        "layer_height": f"{profile.layer_mm:g}",
        "first_layer_height": f"{max(profile.layer_mm, 0.2):g}",
        "bed_shape": "0x0,250x0,250x210,0x210",
    }


def _inherit(sections: configparser.RawConfigParser, kind: str, name: str) -> dict[str, str]:
    """Return a section's settings over those of the sections that it inherits from."""
    section = sections[f"{kind}:{name}"]
    settings: dict[str, str] = {}
    for base in section.get("inherits", "").split(";"):
        if base.strip():
            settings |= _inherit(sections, kind, base.strip())
    return settings | {key: value for key, value in section.items() if key != "inherits"}


_MOST_SETTINGS = 4 << 20  # bytes; PrusaSlicer exports 20 KiB


def _read_exported(file: Path) -> dict[str, str]:
    sections = _parser()
    content = foreign_bytes(
        file, PrintError, most=_MOST_SETTINGS, fix="give a file of print settings that you can read"
    )
    try:
        sections.read_string("[all]\n" + content.decode("utf-8"))
    except (UnicodeDecodeError, configparser.Error):
        sections = _parser()
    settings = dict(sections["all"]) if sections.has_section("all") else {}
    if "nozzle_diameter" not in settings:
        raise PrintError(
            "no print settings are in this file",
            fix="in PrusaSlicer: File > Export > Export Config",
            place=str(file),
        )
    return settings


def _parser() -> configparser.RawConfigParser:
    parser = configparser.RawConfigParser(
        strict=False, delimiters=("=",), comment_prefixes=("#", ";"), interpolation=None
    )
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    return parser


Floats = NDArray[np.float64]

NAMES = ("prusa-slicer", "PrusaSlicer", "prusa-slicer-console")
TIMEOUT_S = 600
_TURNS = count()  # of the slicers that this process has begun
_BED_MARGIN_MM = 20.0  # around the part: skirt, brim, purge line
_AGREE_MM = 0.25  # by which plastic may reach beyond the part's box: half a bead, and seams
_POINTED_WIDTHS = 3.0  # by which it may fall short: beads are round in corners of 20 degrees
#: Of the slicer: a variable more or less moves its memory.
_ENVIRONMENT = {"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": ".", "LC_ALL": "C"}

# The machine's own business: nothing of it is on the part.
_WITHOUT = {
    "start_gcode": "G28",
    "end_gcode": "M84",
    "before_layer_gcode": "",
    "layer_gcode": "G92 E0",
    "use_relative_e_distances": "1",
    "toolchange_gcode": "",
    "start_filament_gcode": '""',
    "end_filament_gcode": '""',
    "skirts": "0",
    "brim_width": "0",
    "thumbnails": "",
    "post_process": "",
    "complete_objects": "0",
    "support_material": "0",
    "gcode_label_objects": "0",
}


@dataclass(frozen=True, slots=True, eq=False)
class SlicedPart:
    """One part's moves, and how they lie to the part."""

    toolpath: Toolpath
    T_part_gcode: Floats  #: (4, 4) a shift
    low_mm: Floats  #: (3,) the part's box, part frame
    high_mm: Floats  #: (3,)


def slice_part(
    file: Path, profile: PrintProfile, *, supports: bool = False, cache: Path | None = None
) -> SlicedPart:
    """Slice the binary STL of one part, mm, as it is printed.

    Supports are printed where the slicer finds them needed (whole parts), and removed. `cache`:
    folder that keeps G-code by the part's bytes and all settings. Raises `PrintError` if
    PrusaSlicer is missing or refuses, or the plastic is not where the part is.
    """
    corners = stl_corners(file)
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = high - low
    settings = settings_of(profile) | _WITHOUT | {"support_material": str(int(supports))}
    bed = np.ceil(np.maximum(size[:2] + 2 * _BED_MARGIN_MM, 100.0))
    width, depth = bed.tolist()
    settings["bed_shape"] = f"0x0,{width:g}x0,{width:g}x{depth:g},0x{depth:g}"
    settings["max_print_height"] = f"{max(200.0, float(size[2]) + 10):g}"
    T_part_gcode = np.eye(4)
    T_part_gcode[:2, 3] = (low + high)[:2] / 2 - bed / 2
    T_part_gcode[2, 3] = low[2]
    middle = f"{width / 2:g},{depth / 2:g}"
    text = "".join(f"{key} = {value}\n" for key, value in settings.items())
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder)
        if cache is not None:
            kept = cache
            kept.mkdir(parents=True, exist_ok=True)
        key = hashlib.sha256(file.read_bytes() + text.encode() + slicer_version().encode())
        gcode = kept / f"{file.stem}-{key.hexdigest()[:16]}.gcode"
        if not gcode.exists():
            _run(file, text, middle, gcode)
        path = read_gcode(gcode)
    sliced = SlicedPart(path, T_part_gcode, low, high)
    _check_place(sliced, corners, file.name)
    return sliced


def stl_corners(file: Path) -> Floats:
    """Return the corners (n, 3) of a part's STL, mm; raises `PrintError`."""
    place = str(file)
    try:
        content = file.read_bytes()
        corners = stl_triangles(content, place, most=MOST_PART_TRIANGLES, padded=False)
    except OSError as error:
        cause = f"cannot read the part: {error.strerror}"
        raise PrintError(cause, fix="check the name", place=place) from None
    except ShapeError:
        corners = np.empty(0)
    if not len(corners):
        fix = "give a part's STL as encode-object writes it"
        raise PrintError("not a binary STL", fix=fix, place=place)
    return corners.reshape(-1, 3)


def find_slicer() -> str:
    """Return the program; raises `PrintError` when it is not installed."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        raise PrintError(
            "PrusaSlicer is not installed",
            fix="install it (Debian, Ubuntu: apt-get install prusa-slicer)",
        )
    return found


@lru_cache(maxsize=1)
def slicer_version() -> str:
    """Return the slicer's version, as its help begins."""
    help_text = subprocess.run(  # noqa: S603
        [find_slicer(), "--help"], capture_output=True, text=True, timeout=60, check=False
    ).stdout
    match = re.search(r"PrusaSlicer-([\w.]+)", help_text)
    return match[1] if match else "unknown"


def _run(file: Path, settings: str, middle: str, gcode: Path) -> None:
    """Slice into a file of another name first, so that none is left half written."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "settings.ini").write_text(settings, encoding="utf-8")
        part = Path(folder) / f"part{file.suffix}"
        shutil.copyfile(file, part)
        written = Path(folder) / "part.gcode"
        command = [
            *_repeatable_command(), find_slicer(), "--export-gcode", "--datadir", ".",
            "--load", "settings.ini", "--center", middle, "-o", written.name, part.name,
        ]  # fmt: skip
        _call(command, written, file, "part", cwd=folder, env=_ENVIRONMENT)
        # The folder may be on another disk than where the slicer wrote.
        with staged_file(gcode) as draft:
            shutil.copyfile(written, draft)


def _call(command: Sequence[str], written: Path, file: Path, what: str, **more: Any) -> None:
    """Let the slicer write a file; raises `PrintError` where it does not."""
    try:
        done = subprocess.run(  # noqa: S603
            command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False, **more
        )
    except subprocess.TimeoutExpired:
        raise PrintError(
            f"PrusaSlicer did not end within {TIMEOUT_S} s",
            fix=f"print a smaller {what}",
            place=file.name,
        ) from None
    if done.returncode or not written.exists():
        lines = (done.stderr + done.stdout).splitlines()
        said = [line for line in lines if line.strip() and "[trace]" not in line]
        raise PrintError(
            f"PrusaSlicer refuses: {said[-1] if said else f'exit code {done.returncode}'}",
            fix=f"open the {what} in PrusaSlicer and look",
            place=file.name,
        )


def _repeatable_command() -> tuple[str, ...]:
    """Return the command's beginning that makes the slicer give the same G-code again."""
    steady: tuple[str, ...] = ()
    setarch, taskset = (shutil.which(name) or "" for name in ("setarch", "taskset"))
    if _works(setarch, "-R"):
        steady += (setarch, "-R")
    allowed = sorted(os.sched_getaffinity(0))
    if _works(taskset, "-c", str(allowed[0])):
        # Any one processor does; slicers that run at once take one after the other.
        turn = os.getpid() + next(_TURNS)
        steady += (taskset, "-c", str(allowed[turn % len(allowed)]))
    return steady


@lru_cache(maxsize=8)
def _works(*beginning: str) -> bool:
    """Whether a program is there and allowed; some containers forbid it."""
    if not beginning[0]:
        return False
    command = [*beginning, "true"]
    return not subprocess.run(command, capture_output=True, check=False).returncode  # noqa: S603


def _check_place(sliced: SlicedPart, corners: Floats, name: str) -> None:
    """Refuse G-code whose plastic does not fill the part's box, as far as beads reach into it."""
    path, T = sliced.toolpath, sliced.T_part_gcode
    laid = path.of_part
    height = path.height_mm[laid]
    width = path.volume_mm3[laid] / np.maximum(path.length_mm[laid], 0.05) / height
    half = np.minimum(width + height * (1 - np.pi / 4), 2.0) / 2
    ends = np.stack([path.start_mm[laid], path.end_mm[laid]]) + T[:3, 3]
    low = (ends[..., :2] - half[:, None]).min(axis=(0, 1))
    high = (ends[..., :2] + half[:, None]).max(axis=(0, 1))
    beyond = float(np.concatenate([sliced.low_mm[:2] - low, high - sliced.high_mm[:2]]).max())
    least, most = _reached(corners, float(np.median(half)))
    short = float(np.concatenate([low - least, most - high]).max())
    layer = float(np.median(height))
    off = abs(float(ends[..., 2].max()) - sliced.high_mm[2])
    pointed = _POINTED_WIDTHS * 2 * float(np.median(half))
    if beyond > _AGREE_MM or short > pointed or off > layer + 1e-3:
        by = max(beyond, short, off)
        raise PrintError(
            f"the plastic reaches {by:.2f} mm beyond or short of the part",
            fix="print profiles must not scale, turn or add; say which one you gave",
            place=name,
        )


def _reached(corners: Floats, radius: float) -> Floats:
    """Return the lowest and highest x, y (2, 2) that round beads reach in a part's outline.

    In a point of 11 degrees a bead of .45 mm ends 2 mm before it.
    """
    outline = CrossSection.hull_points(corners[:, :2].tolist())
    opened = outline.offset(-radius, JoinType.Miter).offset(radius, JoinType.Round)
    outline = outline if opened.is_empty() else opened
    return np.array(outline.bounds()).reshape(2, 2)


_TIME = re.compile(r"; estimated printing time \(normal mode\) = (.*)")
_GRAMS = re.compile(r"; total filament used \[g\] = ([0-9.]+)")
_MINUTES = {"d": 1440.0, "h": 60.0, "m": 1.0, "s": 1 / 60}


@dataclass(frozen=True, slots=True)
class PlateCost:
    """Time and filament of one plate."""

    minutes: int
    filament_g: float

    def __str__(self) -> str:
        hours, minutes = divmod(self.minutes, 60)
        return f"{hours} h {minutes} min, {self.filament_g:.0f} g"


def slice_plate(file: Path) -> PlateCost:
    """Slice a 3MF that holds its settings, and return the slicer's estimate.

    Parts stay where they lie: arranged with its own distances, six panels of 80 mm find no room on
    the bed that they fill. Raises `PrintError` if PrusaSlicer is missing or refuses.
    """
    with tempfile.TemporaryDirectory() as folder:
        gcode = Path(folder) / "plate.gcode"
        command = [find_slicer(), "--export-gcode", "--dont-arrange", "-o", str(gcode), str(file)]
        _call(command, gcode, file, "plate")
        return read_cost(gcode.read_text(encoding="utf-8", errors="replace"))


def read_cost(gcode: str) -> PlateCost:
    """Return what the comments of G-code say of time and filament."""
    time, grams = _TIME.search(gcode), _GRAMS.search(gcode)
    if time is None or grams is None:
        raise PrintError("the G-code says no time", fix="update PrusaSlicer")
    parts = re.findall(r"([0-9]+)([dhms])", time[1])
    return PlateCost(
        round(sum(int(number) * _MINUTES[unit] for number, unit in parts)), float(grams[1])
    )
