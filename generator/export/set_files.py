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
from typing import TYPE_CHECKING, Any

from generator.export.bed import BedPlace, Plate
from generator.export.colours import BODY_RGB, hexadecimal
from generator.export.lettering import transliterate

if TYPE_CHECKING:
    from generator.export.threemf import SlicerSettings
    from generator.printers import Printer

COLUMNS = (
    "object", "part", "printer", "plate", "x_mm", "y_mm", "turned",
    "width_mm", "depth_mm", "height_mm", "symbols", "fits",
)  # fmt: skip
_PAGE = (8.27, 11.69)  # inches
_LINES = 44  # objects on one page
_INK, _EDGE = "#0F172A", "#475569"
_TABLE = (("object", 0.0), ("parts", 0.56), ("symbols", 0.67), ("plates", 0.8))


@dataclass(frozen=True, slots=True)
class SetPart:
    """One part of a set, as its file has it."""

    number: int  #: of its object in the set
    object: str
    name: str
    size_mm: tuple[float, float, float]
    symbols: int
    volume_mm3: float


@dataclass(frozen=True, slots=True)
class SetPlate:
    """One plate, and the parts that its places count: all that its printer prints so."""

    printer: Printer
    settings: SlicerSettings | None
    plate: Plate
    parts: tuple[SetPart, ...]

    @property
    def held(self) -> list[tuple[SetPart, BedPlace]]:
        """The parts that lie on it, those of an object together."""
        return [(self.parts[place.part], place) for place in self.plate.places]


def packing_csv(plates: Sequence[SetPlate]) -> bytes:
    """Return the list, one line for each part."""
    text = io.StringIO(newline="")
    table = csv.writer(text)
    table.writerow(COLUMNS)
    rows = [
        (number, plate, part, place)
        for number, plate in enumerate(plates, 1)
        for part, place in plate.held
    ]
    for number, plate, part, place in sorted(rows, key=lambda row: (row[2].number, row[3].part)):
        lengths = (*_lying_mm(part, place), part.size_mm[2])
        table.writerow(
            [
                part.object, part.name, plate.printer.name, number,
                *(f"{value + 0.0:.1f}" for value in (place.x_mm, place.y_mm)),
                "yes" if place.turned else "no",
                *(f"{value:.1f}" for value in lengths), part.symbols,
                "yes" if plate.plate.fits else "no",
            ]
        )  # fmt: skip
    return text.getvalue().encode()


def _lying_mm(part: SetPart, place: BedPlace) -> tuple[float, float]:
    """Return width and depth of a part as it lies on the bed."""
    width, depth, _ = part.size_mm
    return (depth, width) if place.turned else (width, depth)


def can_draw() -> bool:
    """Tell whether what draws the pages is installed; a plain install leaves it out."""
    return find_spec("matplotlib") is not None


def overview_pdf(title: str, plates: Sequence[SetPlate]) -> bytes:
    """Return the pages: the objects, and the plan of each plate."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import PdfPages

    buffer = io.BytesIO()
    dateless = {"CreationDate": None, "Creator": "encoded-objects", "Producer": None}
    fonts = {"pdf.fonttype": 42, "font.family": "DejaVu Sans"}  # those of matplotlib, embedded
    with rc_context(fonts), PdfPages(buffer, metadata={**dateless, "Title": title}) as pages:
        for page in _object_pages(title, plates):
            pages.savefig(page)
        for number, plate in enumerate(plates, 1):
            pages.savefig(_plate_page(title, number, plate))
    return buffer.getvalue()


def _object_pages(title: str, plates: Sequence[SetPlate]) -> list[Any]:
    of: dict[tuple[int, str], list[tuple[int, SetPart]]] = {}
    for number, plate in enumerate(plates, 1):
        for part, _ in plate.held:
            of.setdefault((part.number, part.object), []).append((number, part))
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
            on = ", ".join(map(str, sorted({number for number, _ in rows})))
            symbols = sum(part.symbols for _, part in rows)
            texts = (transliterate(name), str(len(rows)), str(symbols), on)
            for (_, x), text in zip(_TABLE, texts, strict=True):
                axes.text(x, line + 0.5, text, size=9, color=_INK, va="center")
            axes.plot([0, 1], [line, line], color="#CBD5E1", linewidth=0.4)
        pages.append(page)
    return pages


def _plate_page(title: str, number: int, plate: SetPlate) -> Any:
    """Return the plan of one plate: every part as a rectangle with its name."""
    from matplotlib.patches import Rectangle

    parts = f"{len(plate.held)} parts{'' if plate.plate.fits else '; larger than the bed'}"
    head = f"{transliterate(title)}: plate {number}, {plate.printer.name}, {parts}"
    page, axes = _page(head, (0.08, 0.08, 0.84, 0.8))
    width, depth = plate.printer.bed_mm
    axes.add_patch(Rectangle((0, 0), width, depth, facecolor="#F1F5F9", edgecolor=_EDGE))
    ends = [(width, depth)]
    for part, place in plate.held:
        x, y, (w, d) = place.x_mm, place.y_mm, _lying_mm(part, place)
        axes.add_patch(
            Rectangle((x, y), w, d, facecolor=hexadecimal(BODY_RGB), edgecolor=_EDGE, linewidth=0.6)
        )
        upright = d > 1.5 * w
        text = transliterate(part.name)
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
