"""The sheet of a kit: what to print, buy, cast and assemble, in one HTML page that prints on paper.

Everything is written from the sizes, so that it holds for any sensor type. The cost of tolerances
in reading is measured by `tests/bench/kit_tolerances.py`: touches of `fsr-16` amid faces, a typical
sensor with one defect more, read as if it had none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from generator.export.sheet import Section
from generator.export.sheet import sheet_html as page
from generator.printers import Printer, printer_named
from probe.kit import sizes
from probe.kit.board import Item, has_board
from probe.kit.coupon import DATABASE, Coupon
from probe.kit.sizes import KitSizes

FILAMENT, RESIN = "fdm-0.4", "resin"
G = 9.80665  #: m / s^2
PLA_G_MM3 = 1.24e-3

_RESIN, _FILAMENT = "resin, .05 mm layers", "filament, .2 mm layers, no supports"
_MEASURED = (
    "Measured in simulation (tests/bench/kit_tolerances.py). No part of this kit was cast, wired "
    "or calibrated by its authors: sizes and connections were checked by programs."
)


#: Dimension | tolerance | the reading measured there.
TOLERANCES = """
place of each tab, by itself | 0.15 mm (standard deviation) | nothing off: 60 of 60 right, .040 mm;
    .15 mm: 60 of 60, .055 mm; .25 mm: 48 of 60, .080 mm; .4 mm: 12 of 60

height of each tab, by itself | 0.15 mm (standard deviation) | .1 mm: 60 of 60, .046 mm; .15 mm:
    60 of 60, .052 mm; .2 mm: 57 of 60, .061 mm; .3 mm: 17 of 60

overlay over film, as a whole | 0.1 mm, or measured | every place is off by as much: .1 mm: .107 mm;
    .25 mm: .250 mm; .5 mm: .493 mm, all 60 of 60 right; a touch at a known place tells it

size of the overlay (shrinkage of the silicone) | 0.3 % | .3 %: .077 mm; .6 %: .132 mm; 1 %:
    .212 mm; 2 %: .424 mm; all 60 of 60 right, from .6 % on beyond the stated error: print the mould
    larger by what your silicone shrinks

diameter of the tips | 30 % | 30 % smaller: 60 of 60, .042 mm; 30 % larger: 60 of 60, .051 mm

Young's modulus of the silicone | half to double | half or double: 60 of 60, .043 mm; four times:
    60 of 60, .054 mm

roundness of the tips | 0.5 mm | domes of .2 to .5 mm: 60 of 60, .040 mm

housing against the face | 3 degrees | wrist tilts up to 3 degrees: 60 of 60, .041 mm
"""


@dataclass(frozen=True, slots=True)
class PrintedPart:
    """A part that is printed, as the sheet names it."""

    name: str
    what: str
    size_mm: tuple[float, float, float]
    volume_mm3: float
    resin: bool

    @property
    def printer(self) -> Printer:
        """What it is made for."""
        return printer_named(RESIN if self.resin else FILAMENT)

    @property
    def bed_hint(self) -> str:
        """Return the bed that it wants, where the usual ones are too small; else empty."""
        (x, y, _), bed = self.size_mm, self.printer.bed_mm
        if max(x, y) <= max(bed) and min(x, y) <= min(bed):
            return ""
        return f"wants a bed of {x:.0f} x {y:.0f} mm, more than the usual {bed[0]:g} x {bed[1]:g}"


def sheet_html(
    k: KitSizes, parts: Sequence[PrintedPart], items: Sequence[Item], coupon: Coupon, wiring: str
) -> str:
    """Return the page; `wiring` is the picture of the board, empty without one."""
    files = [
        (
            f"{part.name}.stl",
            part.what,
            " x ".join(f"{side:.1f}" for side in part.size_mm),
            "; ".join(filter(None, (_RESIN if part.resin else _FILAMENT, part.bed_hint))),
        )
        for part in parts
    ]
    fits = [[field.strip() for field in line.split("|")] for line in _paragraphs(TOLERANCES)]
    return page(
        f"{k.sensor.name}: probe kit",
        [
            Section(text=_about(k)),
            Section(
                "Print", head=("file", "what it does", "size, mm", "print"), rows=files,
                notes=[_coupon(coupon)],
            ),
            Section("Parts list", head=("part", "value", "quantity", "for"), rows=items),
            Section("Wiring" if wiring else "", drawing=wiring, notes=[_board(k)]),
            Section("Cast the overlay", steps=casting_steps(k)),
            Section("Assemble", steps=assembly_steps(k)),
            Section("Calibrate", steps=calibration_steps(k, parts)),
            Section(
                "What must fit how well", head=("dimension", "keep within", "what it costs"),
                rows=fits, notes=[_MEASURED],
            ),
        ],
    )  # fmt: skip


def casting_steps(k: KitSizes) -> list[str]:
    """Return how the overlay is cast."""
    release = "Spray all inner faces with release agent and let it dry."
    millilitres = f"{k.silicone_mm3 * 1.3 / 1000:.1f}"
    if not k.tip_mm:
        return [release, *_paragraphs(f"""
            Mix and evacuate {millilitres} ml of silicone; pour it into the pocket of mould-plate,
            slowly, from one corner.

            Lay mould-lid on, one edge first, and screw it down (4 x M3): {k.thickness_mm:g} mm
            remain. Silicone rises through the four holes of {sizes.RISER_MM:g} mm.

            Cure as its maker says. Open, cut off what rose, and take the layer out by its rim.
            """)]  # fmt: skip
    return [release, *_paragraphs(f"""
        Put mould-plate on the vented side of mould-base, the pocket up; two dowels
        ({sizes.PIN_MM:g} mm) and four M3 screws hold them. Air leaves the {k.tabs} holes between
        both plates and through vents {k.vent_mm:.2f} mm wide, which end at the mould's sides.

        Mix and evacuate {millilitres} ml of silicone. Brush a first thin coat over the holes,
        evacuate again (or wait ten minutes), then fill the pocket.

        Lay mould-lid on, boss down, one edge first, and screw it down: {sizes.WEB_MM:g} mm of skin
        remain under it. Silicone rises through the four holes of {sizes.RISER_MM:g} mm.

        Cure as its maker says. Take off the base first: all tips must be flat and whole. Then the
        lid; cut off what rose; push the tabs out from the tips' side with a flat block.

        Check: {k.tabs} tabs of {k.sensor.overlay.height_mm:g} mm, tips {k.tip_mm:.3g} mm, feet
        {k.foot_mm:.3g} mm ({math.degrees(k.draft_rad):.1f} degrees of draft); skin
        {sizes.WEB_MM:g} mm; four holes of {sizes.PIN_MM:g} mm. A missing tab is a dead tactel: up
        to a tenth is read.
        """)]  # fmt: skip


def assembly_steps(k: KitSizes) -> list[str]:
    """Return how the probe is put together."""
    film = f"""
        Lay the film into the bed of housing-body, its tail over the rounded edge: row 0 opposite
        the tail, column 0 on the left, seen through the sensor's back.

        Put the overlay's four holes over the posts, tabs up: a tab stands on every tactel. Posts
        and holes play {sizes.CLEARANCE_MM:g} mm each side.
        """
    layer = """Put the layer over the posts; camera and light are yours: the housing is open
        below."""
    tail = """Bend the tail down onto the tongue and hold tail and cable by a cable tie through both
        slots: nothing pulls at the film."""
    free_mm = k.thickness_mm - k.thickness_skin_mm - k.lip_mm
    depth = k.sensor.value == "depth"
    return _paragraphs(f"""
        Screw flange-adapter to the robot (4 x M6 x 16), its deep holes towards you. On a bench,
        leave it off.

        {layer if depth else film.strip()}

        Put housing-frame over it and screw all together (4 x M3 x 30). Tips stand {free_mm:.2g} mm
        above the frame.

        {"" if depth else tail}
        """)


def calibration_steps(k: KitSizes, parts: Sequence[PrintedPart]) -> list[str]:
    """Return how it is calibrated, with the weight of the cap."""
    if k.sensor.value == "depth":
        return ["A depth map needs no load. Check its scale on a step of known height."]
    cap = next((p for p in parts if p.name == "calibration-cap"), None)
    grams = (cap.volume_mm3 if cap else 0.0) * PLA_G_MM3
    own = grams * G / 1000
    loads = ", ".join(f"{mass:g} kg: {own + mass * G:.1f} N" for mass in (0.5, 1, 2, 5, 10))
    return _paragraphs(f"""
        Glue {sizes.FOAM_MM:g} mm of foam under the foot of calibration-cap. The cap weighs
        {grams:.0f} g printed solid ({own:.2f} N): weigh yours.

        Lay the probe on its back; put the cap over the frame: it bears on the tips alone.

        Loads of the whole sensor: {loads}. probe-sensor calibrate port URL -o sensor.json asks for
        them one after another; 0 N first.
        """)


def _paragraphs(text: str) -> list[str]:
    """Return the paragraphs of a text, each as one line."""
    return [" ".join(one.split()) for one in text.split("\n\n") if one.strip()]


def _about(k: KitSizes) -> str:
    s = k.sensor
    step = " x ".join(f"{one:g}" for one in dict.fromkeys(s.step_mm))
    what = {"tab": f"{k.tabs} tabs", "pad": "a pad", "gel": "a gel"}[s.overlay.kind]
    return (
        f"{s.rows} x {s.columns} tactels, {step} mm apart, under {what} of "
        f"{s.overlay.height_mm:g} mm. "
        f"The film is taken as {k.film_mm[0]:g} x {k.film_mm[1]:g} mm ({sizes.BORDER_MM:g} mm "
        f"around the matrix) with a tail {sizes.TAIL_MM:g} mm wide: measure yours first."
    )


def _coupon(coupon: Coupon) -> str:
    made_of = "resin" if coupon.printer == "resin" else "filament"
    part = coupon.part
    return (
        f"coupon.stl: an encoded plate of {coupon.side_mm:g} x {coupon.side_mm:g} mm, "
        f"{part.symbols} symbols of {coupon.pitch_mm:g} mm ({made_of}), lying on its back. It is "
        f"{part.name} in {DATABASE}: read by recognize-object --port URL --database {DATABASE}."
    )


def _board(k: KitSizes) -> str:
    if k.sensor.value == "depth":
        return "A gel is looked at by a camera: no board."
    if has_board(k.sensor):
        return (
            f"The firmware is in probe/firmware (make ROWS={k.sensor.rows} "
            f"COLUMNS={k.sensor.columns} BAUD=1000000, then make flash). Rows that are not read "
            "are held at ground, so columns do not know of each other."
        )
    return (
        f"Our board has 16 x 16 lines at most; {k.sensor.rows} x {k.sensor.columns} need that of "
        "the film's maker (flexitac:///dev/ttyUSB0 reads FlexiTac's), or a port of yours."
    )
