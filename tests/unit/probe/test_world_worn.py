"""Symbols worn down to the face around them, which on a print is not at 0."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from probe.simulate.scene import bare_scene
from probe.simulate.world.surfaces import worn_scene

TURN = 0.4  # of the face's x axis into the array's
CENTRES = (
    np.array([(i, j) for i in range(3) for j in range(3)])
    * 7.0
    @ np.array([[math.cos(TURN), -math.sin(TURN)], [math.sin(TURN), math.cos(TURN)]])
)


@dataclass(frozen=True)
class Dots:
    """Round dots of 2 mm at CENTRES, 1 mm high, on a face that stands .25 mm too high or low."""

    base_mm: float
    top_mm: float = 1.5

    def heights_mm(self, points_mm: np.ndarray) -> np.ndarray:
        away = np.linalg.norm(points_mm[:, None] - CENTRES, axis=2).min(axis=1)
        return self.base_mm + np.where(away < 2.0, 1.0, 0.0)


def worn_surface(surface, share, seed=1):
    rng = np.random.default_rng(seed)
    return worn_scene(bare_scene(surface), CENTRES, TURN, 7.0, share, rng).surface


@pytest.mark.parametrize("base", [0.0, 0.25, -0.25])
def test_a_worn_symbol_lies_level_with_the_face_around_it(base: float) -> None:
    surface = Dots(base)
    points = np.random.default_rng(1).uniform(-3.0, 14.0, (4000, 2))
    worn = worn_surface(surface, 1.0)
    assert worn.heights_mm(points) == pytest.approx(np.full(4000, base))
    whole = worn_surface(surface, 0.0)
    assert (whole.heights_mm(points) == surface.heights_mm(points)).all()


def test_only_what_is_drawn_is_worn() -> None:
    some = worn_surface(Dots(0.25), 0.5, seed=2)
    assert 0 < len(some.centres_mm) < len(CENTRES)
    left = some.heights_mm(CENTRES)
    gone = (np.abs(CENTRES[:, None] - some.centres_mm).max(axis=2) < 1e-9).any(axis=1)
    assert left == pytest.approx(np.where(gone, 0.25, 1.25))
