"""The sheet of a kit: what to print, buy, cast and assemble, in one HTML page that prints on paper.

Everything is written from the sizes, so that it holds for any sensor type.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from generator.printers import Printer, printer_named
from probe.kit.board import Item, has_board
from probe.kit.coupon import DATABASE, Coupon
from probe.kit.sizes import KitSizes
from probe.kit.tolerances import TOLERANCES

FILAMENT, RESIN = "fdm-0.4", "resin"
G = 9.80665  #: m / s^2
PLA_G_MM3 = 1.24e-3

_STYLE = """
body{font:15px/1.45 Helvetica,Arial,sans-serif;color:#0F172A;max-width:900px;margin:24px auto;
padding:0 16px}h1{font-size:26px;margin:0 0 8px}h2{font-size:19px;margin:28px 0 8px}
table{border-collapse:collapse}td,th{text-align:left;padding:3px 14px 3px 0;vertical-align:top;
border-bottom:1px solid #E2E8F0}li{margin:5px 0}svg{max-width:100%;height:auto}
@media print{body{margin:0}}
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
    k: KitSizes,
    parts: Sequence[PrintedPart],
    items: Sequence[Item],
    coupon: Coupon,
    wiring: str,
) -> str:
    """Return the page; `wiring` is the picture of the board, empty without one."""
    name = k.sensor.name
    body = [
        f"<h1>{escape(name)}: probe kit</h1>",
        f"<p>{escape(_about(k))}</p>",
        "<h2>Print</h2>",
        _table(
            ("file", "what it does", "size, mm", "print"),
            [
                (f"{p.name}.stl", p.what, " x ".join(f"{s:.1f}" for s in p.size_mm),
                 "; ".join(filter(None, (
                     "resin, .05 mm layers" if p.resin else "filament, .2 mm layers, no supports",
                     p.bed_hint))))
                for p in parts
            ],
        ),
        f"<p>{escape(_coupon(coupon))}</p>",
        "<h2>Parts list</h2>",
        _table(
            ("part", "value", "quantity", "for"),
            [(i.what, i.value, i.quantity, i.use) for i in items],
        ),
        *([] if not wiring else ["<h2>Wiring</h2>", wiring]),
        f"<p>{escape(_board(k))}</p>",
        "<h2>Cast the overlay</h2>",
        _steps(casting_steps(k)),
        "<h2>Assemble</h2>",
        _steps(assembly_steps(k)),
        "<h2>Calibrate</h2>",
        _steps(calibration_steps(k, parts)),
        "<h2>What must fit how well</h2>",
        _table(
            ("dimension", "keep within", "what it costs"),
            [(t.what, t.keep, t.costs) for t in TOLERANCES],
        ),
        ("<p>Measured in simulation (tests/bench/kit_tolerances.py). No part of this kit was cast, "
        "wired or calibrated by its authors: sizes and connections were checked by programs.</p>"),
    ]  # fmt: skip
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(name)}: probe kit</title><style>{_STYLE}</style></head><body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def casting_steps(k: KitSizes) -> list[str]:
    """Return how the overlay is cast."""
    s, overlay = k.settings, k.sensor.overlay
    screws = "Spray all inner faces with release agent and let it dry."
    if not k.tip_mm:
        return [
            screws,
            (
                f"Mix and evacuate {k.silicone_mm3 * 1.3 / 1000:.1f} ml of silicone; pour it "
                f"into the pocket "
                "of mould-plate, slowly, from one corner."
            ),
            (
                f"Lay mould-lid on, one edge first, and screw it down (4 x M3): "
                f"{k.thickness_mm:g} mm "
                f"remain. Silicone rises through the four holes of {s.riser_mm:g} mm."
            ),
            "Cure as its maker says. Open, cut off what rose, and take the layer out by its rim.",
        ]
    return [
        screws,
        (
            "Put mould-plate on the vented side of mould-base, the pocket up; two dowels "
            f"({s.pin_mm:g} mm) and four M3 screws hold them. Air leaves the {k.tabs} holes "
            f"between both "
            f"plates and through vents {k.vent_mm:.2f} mm wide, which end at the mould's sides."
        ),
        (
            f"Mix and evacuate {k.silicone_mm3 * 1.3 / 1000:.1f} ml of silicone. Brush a first "
            f"thin coat over "
            "the holes, evacuate again (or wait ten minutes), then fill the pocket."
        ),
        (
            f"Lay mould-lid on, boss down, one edge first, and screw it down: {s.web_mm:g} mm "
            f"of skin "
            f"remain under it. Silicone rises through the four holes of {s.riser_mm:g} mm."
        ),
        (
            "Cure as its maker says. Take off the base first: all tips must be flat and whole. "
            "Then the "
            "lid; cut off what rose; push the tabs out from the tips' side with a flat block."
        ),
        (
            f"Check: {k.tabs} tabs of {overlay.height_mm:g} mm, tips {k.tip_mm:.3g} mm, feet "
            f"{k.foot_mm:.3g} mm ({math.degrees(k.draft_rad):.1f} degrees of draft); skin "
            f"{s.web_mm:g} mm; "
            f"four holes of {s.pin_mm:g} mm. A missing tab is a dead tactel: up to a tenth is read."
        ),
    ]


def assembly_steps(k: KitSizes) -> list[str]:
    """Return how the probe is put together."""
    s = k.settings
    found = [
        (
            "Screw flange-adapter to the robot (4 x M6 x 16), its deep holes towards you. On "
            "a bench, "
            "leave it off."
        ),
    ]
    if k.sensor.value != "depth":
        found += [
            (
                "Lay the film into the bed of housing-body, its tail over the rounded edge: row 0 "
                "opposite the tail, column 0 on the left, seen through the sensor's back."
            ),
            (
                f"Put the overlay's four holes over the posts, tabs up: a tab stands on every "
                f"tactel. "
                f"Posts and holes play {s.clearance_mm:g} mm each side."
            ),
        ]
    else:
        found.append("Put the layer over the posts; camera and light are yours: the housing is "
                     "open below.")  # fmt: skip
    return [
        *found,
        (f"Put housing-frame over it and screw all together (4 x M3 x 30). Tips stand "
        f"{k.thickness_mm - k.thickness_skin_mm - k.lip_mm:.2g} mm above the frame."),
        *([] if k.sensor.value == "depth" else
          [("Bend the tail down onto the tongue and hold tail and cable by a cable tie through "
           "both slots: nothing pulls at the film.")]),
    ]  # fmt: skip


def calibration_steps(k: KitSizes, parts: Sequence[PrintedPart]) -> list[str]:
    """Return how it is calibrated, with the weight of the cap."""
    if k.sensor.value == "depth":
        return ["A depth map needs no load. Check its scale on a step of known height."]
    cap = next((p for p in parts if p.name == "calibration-cap"), None)
    grams = (cap.volume_mm3 if cap else 0.0) * PLA_G_MM3
    own = grams * G / 1000
    loads = ", ".join(f"{mass:g} kg: {own + mass * G:.1f} N" for mass in (0.5, 1, 2, 5, 10))
    return [
        (
            f"Glue {k.settings.foam_mm:g} mm of foam under the foot of calibration-cap. The cap "
            f"weighs "
            f"{grams:.0f} g printed solid ({own:.2f} N): weigh yours."
        ),
        "Lay the probe on its back; put the cap over the frame: it bears on the tips alone.",
        (
            f"Loads of the whole sensor: {loads}. probe-sensor calibrate port URL -o "
            f"sensor.json asks "
            "for them one after another; 0 N first."
        ),
    ]


def _about(k: KitSizes) -> str:
    s = k.sensor
    step = " x ".join(f"{one:g}" for one in dict.fromkeys(s.step_mm))
    what = {"tab": f"{k.tabs} tabs", "pad": "a pad", "gel": "a gel"}[s.overlay.kind]
    return (
        f"{s.rows} x {s.columns} tactels, {step} mm apart, under {what} of "
        f"{s.overlay.height_mm:g} mm. "
        f"The film is taken as {k.film_mm[0]:g} x {k.film_mm[1]:g} mm ({k.settings.border_mm:g} mm "
        f"around the matrix) with a tail {k.settings.tail_mm:g} mm wide: measure yours first."
    )


def _coupon(coupon: Coupon) -> str:
    made_of = "resin" if coupon.printer == "resin" else "filament"
    return (
        f"coupon.stl: an encoded plate of {coupon.side_mm:g} x {coupon.side_mm:g} mm, "
        f"{coupon.symbols} symbols of {coupon.pitch_mm:g} mm ({made_of}), lying on its back. It is "
        f"{coupon.face} in {DATABASE}: read by recognize-object --port URL --database {DATABASE}."
    )


def _board(k: KitSizes) -> str:
    if k.sensor.value == "depth":
        return "A gel is looked at by a camera: no board."
    if has_board(k.sensor):
        return (
            f"The firmware is in probe/firmware (make ROWS={k.sensor.rows} "
            f"COLUMNS={k.sensor.columns} BAUD=1000000, then make flash). Rows that are not "
            f"read are "
            "held at ground, so columns do not know of each other."
        )
    return (
        f"Our board has 16 x 16 lines at most; {k.sensor.rows} x {k.sensor.columns} need that "
        f"of the "
        "film's maker (flexitac:///dev/ttyUSB0 reads FlexiTac's), or a port of yours."
    )


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    titles = "".join(f"<th>{escape(one)}</th>" for one in head)
    lines = ("".join(f"<td>{escape(one)}</td>" for one in row) for row in rows)
    return f"<table><tr>{titles}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def _steps(texts: Sequence[str]) -> str:
    return f"<ol>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ol>"
