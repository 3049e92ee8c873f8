"""How one tab answers to what lies under its tip, covered wholly, in part, or at two heights.

A skin of independent columns over a common column, of the same solid (`neo_hooke`). The skin
takes the share s = 1/(1 + beta) of the height, the column the rest.

- Covered wholly at one height, both bear the same stress: the tab is exactly the neo-Hookean
  column of its whole height.
- Covered in part (share c, a step's edge), the skin works alone there while the column works
  as a whole: F(c)/F(1) = c (1 + beta)/(1 + beta c) at small strain. An edge presses harder
  than its share, as elements show (0.65 at c = 0.5, 0.34 at 0.25), by beta = 0.75 within 0.03,
  and within 0.02 of c [1 + 0.59 (1 - c)].
- Two heights, slopes, and domed ends are presses of different depth on the skin's points.

The law is the least energy over the column's compression: convex and C1 in the plate's pose;
no point pulls, and a tab's force grows with every point's depth. Thesis 3.3, 4.2.
"""

from __future__ import annotations

import math
from functools import lru_cache

from encoded_objects.base.sensor_type import Overlay
from probe.contact.neo_hooke import NeoHooke
from probe.contact.settings import TABS
from probe.errors import ContactError


@lru_cache(maxsize=16)
def tip_laws(overlay: Overlay, points: int) -> tuple[NeoHooke, NeoHooke]:
    """Return the laws of one point of the skin and of the column behind it."""
    area = math.pi * overlay.tab_diameter_mm**2 / 4
    skin_mm = overlay.height_mm / (1 + TABS.skin)
    column_mm = overlay.height_mm - skin_mm
    return (
        NeoHooke(overlay.young_mpa * area / points / skin_mm, skin_mm),
        NeoHooke(overlay.young_mpa * area / column_mm, column_mm),
    )


def checked_tabs(overlay: Overlay) -> None:
    """Refuse an overlay that is no tabs, or of no size."""
    if overlay.kind != "tab":
        raise ContactError(
            f"the overlay is a {overlay.kind}; this level knows tabs alone",
            fix='take the level "layer" or "elements" for a pad',
        )
    sizes = (overlay.height_mm, overlay.tab_diameter_mm, overlay.young_mpa)
    if not (min(sizes) > 0 and max(sizes) < math.inf):
        raise ContactError(
            f"tabs of height {sizes[0]:g} mm, diameter {sizes[1]:g} mm, modulus {sizes[2]:g} MPa",
            fix="give finite values > 0",
        )
