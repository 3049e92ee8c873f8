"""The files of a whole set: the packing list as CSV, and an overview of all plates as PDF.

The list says which part of which object lies where: UTF-8, commas, lines end in CR LF (RFC 4180).
The overview has A4 pages, portrait: the objects, and a plan of every plate as the printer shows
it, in the plate frame of `bed`. The bytes hold no dates, and fonts are embedded.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from generator.export.bed import BedPlace
from generator.export.colours import BODY_RGB, hexadecimal
from generator.export.lettering import transliterate

COLUMNS = (
    "object", "part", "printer", "plate", "x_mm", "y_mm", "turned",
    "width_mm", "depth_mm", "height_mm", "symbols", "fits",
)  # fmt: skip
_PAGE = (8.27, 11.69)  # inches
_LINES = 44  # objects on one page
_INK, _EDGE = "#0F172A", "#475569"
_TABLE = (("object", 0.0), ("parts", 0.56), ("symbols", 0.67), ("plates", 0.8))


@dataclass(frozen=True, slots=True)
class PackedPart:
    """One part of a set and its place."""

    order: tuple[int, int]  #: object and part, as the set lists them
    object: str
    part: str
    plate: int  #: from 1
    printer: str
    place: BedPlace
    size_mm: tuple[float, float, float]  #: as it comes from the file, before it is turned
    symbols: int
    fits: bool  #: whether the plate fits the bed

    @property
    def lying_mm(self) -> tuple[float, float]:
        """Width and depth as it lies on the bed."""
        width, depth, _ = self.size_mm
        return (depth, width) if self.place.turned else (width, depth)


def packing_csv(packed: Sequence[PackedPart]) -> bytes:
    """Return the list, one line for each part."""
    text = io.StringIO(newline="")
    table = csv.writer(text)
    table.writerow(COLUMNS)
    for one in packed:
        width, depth = one.lying_mm
        table.writerow(
            [
                one.object,
                one.part,
                one.printer,
                one.plate,
                *(f"{value + 0.0:.1f}" for value in (one.place.x_mm, one.place.y_mm)),
                "yes" if one.place.turned else "no",
                *(f"{value:.1f}" for value in (width, depth, one.size_mm[2])),
                one.symbols,
                "yes" if one.fits else "no",
            ]
        )
    return text.getvalue().encode()


def can_draw() -> bool:
    """Tell whether what draws the pages is installed; a plain install leaves it out."""
    return find_spec("matplotlib") is not None


def overview_pdf(
    title: str, plates: Sequence[Sequence[PackedPart]], beds_mm: Sequence[tuple[float, float]]
) -> bytes:
    """Return the pages: the parts on each plate, and width and depth of its bed."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import PdfPages

    buffer = io.BytesIO()
    dateless = {"CreationDate": None, "Creator": "encoded-objects", "Producer": None}
    fonts = {"pdf.fonttype": 42, "font.family": "DejaVu Sans"}  # those of matplotlib, embedded
    with rc_context(fonts), PdfPages(buffer, metadata={**dateless, "Title": title}) as pages:
        for page in _object_pages(title, plates):
            pages.savefig(page)
        for number, (packed, bed) in enumerate(zip(plates, beds_mm, strict=True), 1):
            pages.savefig(_plate_page(title, number, packed, bed))
    return buffer.getvalue()


def _object_pages(title: str, plates: Sequence[Sequence[PackedPart]]) -> list[Any]:
    of: dict[tuple[int, str], list[PackedPart]] = {}
    for row in (row for packed in plates for row in packed):
        of.setdefault((row.order[0], row.object), []).append(row)
    objects = sorted(of.items())
    counts = f"{len(objects)} objects, {sum(map(len, of.values()))} parts, {len(plates)} plates"
    pages = []
    for first in range(0, len(objects), _LINES):
        page, axes = _page(f"{transliterate(title)}: {counts}", (0.08, 0.05, 0.84, 0.85))
        axes.set(xlim=(0, 1), ylim=(_LINES + 1, 0))
        axes.axis("off")
        for text, x in _TABLE:
            axes.text(x, 0.5, text, weight="bold", size=9, color=_INK, va="center")
        for line, ((_, name), rows) in enumerate(objects[first : first + _LINES], 1):
            on = ", ".join(str(number) for number in sorted({row.plate for row in rows}))
            symbols = sum(row.symbols for row in rows)
            texts = (transliterate(name), str(len(rows)), str(symbols), on)
            for (_, x), text in zip(_TABLE, texts, strict=True):
                axes.text(x, line + 0.5, text, size=9, color=_INK, va="center")
            axes.plot([0, 1], [line, line], color="#CBD5E1", linewidth=0.4)
        pages.append(page)
    return pages


def _plate_page(
    title: str, number: int, packed: Sequence[PackedPart], bed_mm: tuple[float, float]
) -> Any:
    """Return the plan of one plate: every part as a rectangle with its name."""
    from matplotlib.patches import Rectangle

    beyond = "" if all(row.fits for row in packed) else "; larger than the bed"
    head = (
        f"{transliterate(title)}: plate {number}, {packed[0].printer}, {len(packed)} parts{beyond}"
    )
    page, axes = _page(head, (0.08, 0.08, 0.84, 0.8))
    width, depth = bed_mm
    axes.add_patch(Rectangle((0, 0), width, depth, facecolor="#F1F5F9", edgecolor=_EDGE))
    ends = [(width, depth)]
    for row in packed:
        x, y, (w, d) = row.place.x_mm, row.place.y_mm, row.lying_mm
        axes.add_patch(
            Rectangle((x, y), w, d, facecolor=hexadecimal(BODY_RGB), edgecolor=_EDGE, linewidth=0.6)
        )
        upright = d > 1.5 * w
        text = transliterate(row.part)
        room = (d if upright else w) / width * 0.84 * _PAGE[0] * 72  # points
        size = max(3.0, min(9.0, 0.9 * room / (0.62 * max(1, len(text)))))
        axes.text(
            x + w / 2, y + d / 2, text, size=round(size, 2), color=_INK,
            ha="center", va="center", rotation=90 if upright else 0,
        )  # fmt: skip
        ends += [(x, y), (x + w, y + d)]
    low = [min(0.0, *(end[k] for end in ends)) for k in range(2)]
    high = [max(end[k] for end in ends) for k in range(2)]
    axes.set(xlim=(low[0] - 2, high[0] + 2), ylim=(low[1] - 2, high[1] + 2), aspect="equal")
    axes.set_xlabel("x, mm (front of the bed)", size=8)
    axes.set_ylabel("y, mm", size=8)
    axes.tick_params(labelsize=7)
    return page


def _page(head: str, box: tuple[float, float, float, float]) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    page = Figure(figsize=_PAGE)
    page.text(0.08, 0.95, head, size=12, weight="bold", color=_INK)
    return page, page.add_axes(box)
