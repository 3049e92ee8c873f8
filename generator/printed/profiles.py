"""Print profiles: machine, nozzle, layers and filament for the slicer.

A name stands for settings of the slicer's own vendor (PrusaSlicer ships them as one file with
inheritance, resolved here), and for a few plain options where that file is not installed. A
file that PrusaSlicer exported (`File > Export > Export Config`) serves as well.
"""

from __future__ import annotations

import configparser
from dataclasses import dataclass
from pathlib import Path

from generator.errors import PrintError
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


def _read_exported(file: Path) -> dict[str, str]:
    sections = _parser()
    try:
        sections.read_string("[all]\n" + file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, configparser.Error):
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
