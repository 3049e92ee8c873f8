"""Print settings inside a 3MF, as PrusaSlicer and SuperSlicer read them.

Opened plainly, a file without settings is sliced at the slicer's own 0.3 mm. Here stand layers,
nozzle and bed of the printer that the parts were made for, PLA's temperatures, and supports where
the parts need them; objects repeat their layer height, so that it holds under another printer's
settings too. The change of colour is the slicer's own, at the height where the symbols begin.
"""

from __future__ import annotations

from dataclasses import dataclass

from generator.export.bed import Size
from generator.export.colours import SYMBOL_RGB, hexadecimal
from generator.printers import Printer

CONFIG = "Metadata/Slic3r_PE.config"
COLOUR_CHANGE = "Metadata/Prusa_Slicer_custom_gcode_per_print_z.xml"


@dataclass(frozen=True, slots=True)
class SlicerSettings:
    """How one plate is printed in filament; lengths in mm."""

    nozzle_mm: float
    layer_mm: float
    first_layer_mm: float
    bed_mm: Size
    supports: bool = False  #: a whole body hangs over
    colour_change_mm: float = 0.0  #: height at which the filament is changed; 0: nowhere

    def entries(self) -> dict[str, str]:
        """Return the settings under the slicer's own names."""
        width, depth = (f"{side:g}" for side in self.bed_mm)
        return {
            "printer_technology": "FFF",
            "printer_settings_id": "encoded-objects",
            "bed_shape": f"0x0,{width}x0,{width}x{depth},0x{depth}",
            "nozzle_diameter": f"{self.nozzle_mm:g}",
            "filament_diameter": "1.75",
            "filament_density": "1.24",
            "filament_type": "PLA",
            "first_layer_temperature": "215",
            "temperature": "210",
            "first_layer_bed_temperature": "60",
            "bed_temperature": "60",
            "layer_height": f"{self.layer_mm:g}",
            "first_layer_height": f"{self.first_layer_mm:g}",
            "fill_density": "15%",
            "support_material": str(int(self.supports)),
        }

    @property
    def of_object(self) -> dict[str, str]:
        """What an object says itself, over any print settings."""
        return {"layer_height": f"{self.layer_mm:g}", "support_material": str(int(self.supports))}

    def files(self) -> dict[str, list[str]]:
        """Return what is added to a package."""
        lines = [f"; {name} = {value}\n" for name, value in self.entries().items()]
        found = {CONFIG: ["; made by encoded-objects\n\n", *lines]}
        if self.colour_change_mm > 0:
            # The slicer changes before the layer that ends at or above this height.
            z = f"{self.colour_change_mm + self.layer_mm:.6g}"
            change = (
                '<?xml version="1.0" encoding="utf-8"?>\n<custom_gcodes_per_print_z>\n'
                f'<code print_z="{z}" type="0" extruder="1" color="{hexadecimal(SYMBOL_RGB)}" '
                'extra="" gcode="M600"/>\n<mode value="SingleExtruder"/>\n'
                "</custom_gcodes_per_print_z>\n"
            )
            found[COLOUR_CHANGE] = [change]
        return found


def slicer_settings(
    printer: Printer, *, supports: bool, colour_change_mm: float = 0.0
) -> SlicerSettings | None:
    """Return the settings of a plate, or None for a printer without a nozzle."""
    if not printer.nozzle_mm:
        return None
    change = printer.printed_mm(colour_change_mm) if colour_change_mm else 0.0
    return SlicerSettings(
        printer.nozzle_mm,
        printer.layer_mm,
        printer.first_layer_mm,
        printer.bed_mm,
        supports,
        change,
    )
