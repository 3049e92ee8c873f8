"""A text on a back as an embossing: grooves with 45 degree walls, a label for each figure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.figures import BAR, FIGURES, figures_of
from generator.alphabet.outline import Tiers, engrave
from generator.solid.emboss import turn
from generator.solid.mark_room import TextBox
from generator.solid.part import Embossing


def groove_embossing(
    box: TextBox,
    depth: float,
    facet: int,
    T_part_facet: NDArray[np.float64],
    tiers: dict[tuple[int, float], Tiers],
) -> Embossing:
    """Return one text as an embossing: a label for each figure, then the bars."""
    pen = box.pen
    step = 2 * pen.unit + pen.stroke + pen.clear
    letters = [k for k, letter in enumerate(box.text) if letter != " "]
    figures = figures_of(box.text.replace(" ", ""))
    x = (np.array(letters) - (len(box.text) - 1) / 2) * step
    y = np.full(len(figures), pen.stroke if box.bar else 0.0)
    local = np.stack([x, y], axis=1)
    names = [f"{box.text} figure {k + 1}" for k in range(len(figures))]
    if box.bar:
        figures = figures + [BAR] * len(figures)
        low = np.stack([x, np.full(len(x), pen.stroke / 2 - box.half[1])], axis=1)
        local = np.concatenate([local, low])
        names += [f"{box.text} bar {k + 1}" for k in range(len(x))]
    used = sorted(set(figures))
    for figure in used:
        if (figure, pen.unit) not in tiers:
            tiers[figure, pen.unit] = engrave(FIGURES[figure], pen.unit, pen.stroke, depth)
    return Embossing(
        facet=facet,
        face=None,
        T_part_facet=T_part_facet,
        rotation_rad=box.angle,
        centres_mm=box.centre + local @ turn(box.angle).T,
        labels=np.array([used.index(figure) for figure in figures], dtype=np.int64),
        names=tuple(names),
        tiers=tuple(tiers[figure, pen.unit] for figure in used),
    )
