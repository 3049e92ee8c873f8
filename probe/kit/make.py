"""A sensor type -> the folder of a kit: parts, coupon and its database, parts list, wiring, sheet.

All files appear together, or none. The same type gives the same bytes.
"""

from __future__ import annotations

import csv
import io
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from encoded_objects.base.errors import require
from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from generator.export.atomic import Staging
from generator.export.meshes import stl_chunks
from generator.export.step import step_chunks
from generator.export.threemf import SlicerSettings, print_files
from generator.printers import printer_named
from generator.solid import Mesh, triangles
from probe.kit.board import connections, electric_items, has_board, mechanical_items, wiring_svg
from probe.kit.coupon import DATABASE, Coupon, make_coupon
from probe.kit.model import PARTS, check_part, mesh_of, step_text
from probe.kit.sheet import FILAMENT, RESIN, PrintedPart, sheet_html
from probe.kit.sizes import KitSizes, kit_sizes

FINE_MM = 4.0  #: pitch below which the coupon is printed in resin
Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class Kit:
    """What was made."""

    folder: Path
    files: tuple[Path, ...]
    parts: tuple[PrintedPart, ...]
    coupon: Coupon
    verified: int  #: parts that were read back


def make_kit(
    sensor: SensorType,
    folder: Path,
    *,
    verify: bool = False,
    progress: Progress = lambda _what, _share: None,
) -> Kit:
    """Make the parts of a probe and everything that is said of them.

    Files of these names are replaced. `verify` reads every STEP and STL back by the CAD kernel and
    the mesh library before they stay; `progress` takes the part in work and the share that is done.

    Raises
    ------
    MissingExtraError
        The CAD kernel is not installed.
    SolidError
        A part that cannot be made, or did not pass its check.
    WriteError
        The folder cannot be written.
    """
    require("build123d", extra="cad", purpose="probe-kit")
    pitch = sensor.symbol_pitch_mm
    k = kit_sizes(sensor, pitch)
    parts, meshes = [], []
    with Staging(folder) as staging, tempfile.TemporaryDirectory() as scratch:
        for number, (name, (what, model, resin)) in enumerate(PARTS.items()):
            progress(name, number / (len(PARTS) + 1))
            if not _is_needed(name, k):
                continue
            solid = model(k)
            mesh = mesh_of(solid)
            step = staging.write(f"{name}.step", step_text(solid, name))
            stl = staging.write(f"{name}.stl", stl_chunks(mesh))
            if verify:
                check_part(name, solid, step.staged, stl.staged)
            x, y, z = np.ptp(mesh.vertices, axis=0).tolist()
            parts.append(PrintedPart(name, what, (x, y, z), float(solid.volume), resin))
            meshes.append((name, mesh, resin))
        progress("coupon", len(PARTS) / (len(PARTS) + 1))
        database = Path(scratch) / DATABASE
        coupon = make_coupon(k, sensor, RESIN if pitch < FINE_MM else FILAMENT, database)
        staging.write("coupon.step", step_chunks(coupon.part))
        staging.write("coupon.stl", stl_chunks(triangles(coupon.part)))
        staging.write(DATABASE, database.read_bytes())
        for name, content in _plates(sensor.name, meshes, coupon):
            staging.write(name, content)
        items = [*mechanical_items(k), *electric_items(sensor)]
        wiring = wiring_svg(sensor) if has_board(sensor) else ""
        staging.write("parts-list.csv", _csv(("part", "value", "quantity", "for"), items))
        if wiring:
            staging.write("wiring.svg", wiring.encode())
            wires = connections(sensor)
            staging.write("wiring.csv", _csv(("from", "pin", "to", "pin"), wires))
        staging.write("sensor.yaml", sensor_type_text(sensor).encode())
        staging.write("sheet.html", sheet_html(k, parts, items, coupon, wiring).encode())
        files = tuple(file.path for file in staging.commit())
    return Kit(folder, files, tuple(parts), coupon, len(parts) if verify else 0)


def _is_needed(name: str, k: KitSizes) -> bool:
    """Whether a part serves a type: layers have a closed mould, images need no weights."""
    if name == "mould-base":
        return bool(k.tip_mm)
    return name != "calibration-cap" or k.sensor.value != "depth"


def _plates(
    title: str, meshes: list[tuple[str, Mesh, bool]], coupon: Coupon
) -> Iterator[tuple[str, bytes]]:
    """Yield the plates as 3MF, in PrusaSlicer's dialect: filament, resin, and the coupon."""
    for printer_name in (FILAMENT, RESIN):
        printer = printer_named(printer_name)
        settings = SlicerSettings(printer) if printer.nozzle_mm else None
        some = [(n, mesh) for n, mesh, resin in meshes if resin == (printer_name == RESIN)]
        bed = bed_for([mesh for _, mesh in some], printer.bed_mm)
        plates = print_files(title, some, bed, settings) if some else ()
        for number, file in enumerate(plates):
            more = f"-{number + 1}" if len(plates) > 1 else ""
            yield f"{printer_name}{more}.3mf", file.prusaslicer
    printer = printer_named(coupon.printer)
    settings = SlicerSettings(printer) if printer.nozzle_mm else None
    (file,) = print_files("coupon", [coupon.part], printer.bed_mm, settings)
    yield "coupon.3mf", file.prusaslicer


def bed_for(meshes: list[Mesh], usual_mm: tuple[float, float]) -> tuple[float, float]:
    """Return the usual bed, or one that the largest part lies on as well."""
    wide, deep = usual_mm
    for mesh in meshes:
        x, y = np.ptp(mesh.vertices[:, :2], axis=0).tolist()
        if max(x, y) > max(wide, deep) or min(x, y) > min(wide, deep):
            wide, deep = max(wide, x), max(deep, y)
    return wide, deep


def _csv(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> bytes:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([head, *rows])
    return out.getvalue().encode()
