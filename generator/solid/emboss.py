"""Make the symbols of a face an embossing of a part's facet.

The symbols' x axis runs along the array's columns: it stands at minus the placement's rotation
in the face. Thesis 5.5, 6.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.errors import SolidError
from generator.layout.placement import FaceLayout
from generator.solid.part import Embossing


def embossing_of(
    layout: FaceLayout,
    tiers: tuple[Tiers, ...],
    facet: int,
    T_part_face: NDArray[np.float64],
    pitch_mm: float,
) -> Embossing:
    """Return the embossing of one face on a facet of the part; T_part_face (4, 4).

    Raises `SolidError` if a label has no outline.
    """
    labels = layout.labels
    if len(labels) and not (labels.min() >= 0 and labels.max() < len(tiers)):
        raise SolidError(
            f"symbol {int(labels.max())} on an alphabet of {len(tiers)} symbols",
            fix="take an alphabet of the array's order",
            place=f"face {layout.face + 1}",
        )
    cells = zip(layout.rows.tolist(), layout.columns.tolist(), strict=True)
    return Embossing(
        facet=facet,
        face=layout.face,
        T_part_facet=T_part_face,
        rotation_rad=-layout.placement.rotation_rad,
        centres_mm=layout.centres_mm,
        labels=labels,
        names=tuple(f"r{row}c{column}" for row, column in cells),
        tiers=tiers,
        pitch_mm=pitch_mm,
    )


def to_part(embossing: Embossing, points: NDArray[np.float64], z_mm: float) -> NDArray[np.float64]:
    """Return (n, 3) part points of (n, 2) points in the facet frame at height `z_mm`."""
    T = embossing.T_part_facet
    flat: NDArray[np.float64] = points @ T[:3, :2].T + (T[:3, 3] + z_mm * T[:3, 2])
    return flat


def turn(angle_rad: float) -> NDArray[np.float64]:
    """Return the (2, 2) rotation by an angle; exact at quarter turns."""
    quarters = angle_rad / (np.pi / 2)
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    if abs(quarters - round(quarters)) < 1e-15:
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[round(quarters) % 4]
    return np.array([[c, -s], [s, c]], dtype=np.float64)
