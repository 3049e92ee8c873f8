"""Where on a face, or on a surface without edges, a campaign puts the sensor."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from probe.contact.contract import Touch
from probe.simulate.scene import Scene
from probe.simulate.touch import TouchRanges, random_touches
from recognizer.validation.settings import DRAWING
from recognizer.validation.touch_plan import scene_of


def draw_on_face(
    scene: Scene, kind: str, most: float, rng: np.random.Generator, ranges: TouchRanges
) -> Touch:
    """Draw a touch of a face; where a face is too small for its kind, anywhere on it."""
    inside = DRAWING.inside_mm
    if kind == "corner":
        touch = next(random_touches(scene.region, rng, ranges))
        corner = scene.region.starts[int(rng.integers(len(scene.region.starts)))]
        towards = np.array([touch.x_mm, touch.y_mm]) - corner
        by = inside * rng.random() / max(float(np.hypot(*towards)), inside)
        at = corner + towards * by
        return replace(touch, x_mm=float(at[0]), y_mm=float(at[1]))
    if kind == "edge":
        for touch in random_touches(scene.region, rng, ranges):
            if scene.region.distance_mm(np.array([[touch.x_mm, touch.y_mm]]))[0] < inside:
                return touch
    margin = 0.0 if kind == "anywhere" else min(inside, 0.8 * most)
    return next(random_touches(scene.region, rng, replace(ranges, margin_mm=margin)))


@lru_cache(maxsize=512)
def inradius_mm(database: str, object_name: str, face: str, files: bool, prints: str = "") -> float:
    """Return how far the inmost point of a face lies from its edges, mm, nearly."""
    return scene_of(database, object_name, face, files, prints).inradius_mm()


def draw_anywhere(rng: np.random.Generator, ranges: TouchRanges) -> Touch:
    """Draw a touch of a surface that has no edges near, within 100 mm of its origin."""
    low, high = ranges.force_n
    theta, towards = rng.uniform(-math.pi, math.pi, 2)
    tilt = ranges.tilt_rad * math.sqrt(rng.random())
    x, y = rng.uniform(0, 100, 2)
    return Touch(
        x_mm=float(x),
        y_mm=float(y),
        theta_rad=float(theta),
        force_n=float(rng.uniform(low, high)),
        tilt_x_rad=tilt * math.cos(towards),
        tilt_y_rad=tilt * math.sin(towards),
    )
