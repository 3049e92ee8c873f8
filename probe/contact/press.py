"""Contact of a sensor on a surface by the cheapest model that holds an error. Thesis 4.2.

Error and cost of the `LEVELS`, from cheap to dear, are measured by
`tests/bench/contact_precision.py` on several indenters against finer references, and kept in
`precision.json`. The error of an image is the norm of its deviation over the norm of the reference:
the cost of the level's fineness, not of what the model leaves out (tabs are columns, the layer has
no free sides, see docs/contact.md).

Level "footprint" shares the force by cover alone: the force on a tactel is F times the share of
its tip under which the surface reaches to within a depth of its highest place, over the sum of all
shares. No elasticity, no equilibrium: the plate keeps the wrist's tilt and stands at first touch.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import resources

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch, heights_under, no_contact
from probe.contact.engines import Engine
from probe.contact.plate import PlatePose, check_load
from probe.contact.tabs import tabs
from probe.contact.tips import Tips, tip_points
from probe.errors import ContactError
from probe.surface.contract import HeightMap

AUTO_ERROR = 0.06  #: error that "auto" holds: below what the models leave out, 0.08 ... 0.14
COVER_DEPTH = 0.25  # of the overlay's height, down to which the surface counts as touched


#: "auto", the name of a level, or the largest error of an image.
Accuracy = str | float

LEVELS: dict[str, tuple[str, ...]] = {
    "tab": ("footprint", "tabs-7", "tabs-19", "tabs-61"),
    "pad": ("footprint", "layer-2", "layer-4", "layer-8", "layer-16"),
    "gel": ("gel",),
}
DEFAULTS = {"tabs": "tabs-19", "layer": "layer-4"}  #: a name without its fineness


@dataclass(frozen=True, slots=True)
class LevelAccuracy:
    """A line of the table."""

    level: str
    error: float  #: largest over the indenters
    ms: float  #: CPU time of a touch, median over the indenters


def press(
    surface: HeightMap, sensor: SensorType, touch: Touch, *, accuracy: Accuracy = "auto"
) -> Contact:
    """Press the sensor on a surface.

    `accuracy` "auto" holds `AUTO_ERROR`; a number is the error to hold (0.003: 0.3 %); a name takes
    that level.

    Raises `ContactError` when the level is none of the overlay's, no level holds the error, or the
    touch has no equilibrium.
    """
    level = level_for(sensor, accuracy)
    place = (touch.x_mm, touch.y_mm, touch.theta_rad, touch.tilt_x_rad, touch.tilt_y_rad)
    if not (all(map(math.isfinite, place)) and 0 <= touch.force_n < math.inf):
        raise ContactError(
            f"a touch at x {touch.x_mm:g} mm, y {touch.y_mm:g} mm, turned by {touch.theta_rad:g} "
            f"rad, tilted by {touch.tilt_x_rad:g}, {touch.tilt_y_rad:g} rad, {touch.force_n:g} N",
            fix="give finite numbers, and a force of 0 or more",
        )
    return MODELS[level](surface, sensor, touch)


def level_for(sensor: SensorType, accuracy: Accuracy = "auto") -> str:
    """Return the name of the level that `press` takes; raises `ContactError` as it does."""
    kind = sensor.overlay.kind
    if isinstance(accuracy, str) and accuracy != "auto":
        level = DEFAULTS.get(accuracy, accuracy)
        if level not in LEVELS[kind]:
            raise ContactError(
                f"a {kind} overlay has no level '{accuracy}'",
                fix=f"take auto, an error such as 0.01, or {', '.join(LEVELS[kind])}",
            )
        return level
    if accuracy == "auto" and len(LEVELS[kind]) == 1:
        return LEVELS[kind][0]
    if kind not in table():
        raise ContactError(
            f"the error of a {kind}'s levels is not known", fix=f"take auto, or {LEVELS[kind][0]}"
        )
    error = AUTO_ERROR if accuracy == "auto" else float(accuracy)
    known = [line for line in table()[kind] if line.error <= error]
    if not known:
        best = min(table()[kind], key=lambda line: line.error)
        raise ContactError(
            f"no level holds an error of {error:g} for a {kind} overlay",
            fix=f"ask for {best.error:.1g} or more ({best.level})",
        )
    return min(known, key=lambda line: line.ms).level


def accuracy_of(text: str) -> Accuracy:
    """Read an accuracy from text: a number is an error, everything else a name.

    Raises `ContactError` for a number that is no error.
    """
    try:
        value = float(text)
    except ValueError:
        return text
    if not 0 < value < math.inf:
        raise ContactError(f"an error of {text}", fix="give a number above 0, such as 0.01")
    return value


@lru_cache(maxsize=1)
def table() -> dict[str, tuple[LevelAccuracy, ...]]:
    """Return the measured errors and times of every level, per kind of overlay."""
    text = resources.files("probe.contact").joinpath("precision.json").read_text("utf-8")
    return {
        kind: tuple(LevelAccuracy(line["level"], line["error"], line["ms"]) for line in lines)
        for kind, lines in json.loads(text)["levels"].items()
    }


def press_tips(surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips) -> Contact:
    """Press a sensor whose tabs have defects; pads and gels have no tips and take `press`."""
    if sensor.overlay.kind == "tab":
        return tabs(surface, sensor, touch, tips)
    return press(surface, sensor, touch)


def _tabs(points: int, surface: HeightMap, sensor: SensorType, touch: Touch) -> Contact:
    return tabs(surface, sensor, touch, Tips(points))


def _layer(cells: int, surface: HeightMap, sensor: SensorType, touch: Touch) -> Contact:
    from probe.contact.layer import layer  # loads scipy

    return layer(surface, sensor, touch, cells_per_tactel=cells)


def _gel(surface: HeightMap, sensor: SensorType, touch: Touch) -> Contact:
    from probe.contact.gel import gel

    return gel(surface, sensor, touch)


def footprint(surface: HeightMap, sensor: SensorType, touch: Touch) -> Contact:
    """Share the force by cover; the wrist's stiffness has no effect.

    Tabs are sampled at 19 points of their round tips, a pad at 16 of the tactel's square.

    Raises `ContactError` when nothing lies under the sensor, or a force or a height is no number.
    """
    check_load(touch)
    if touch.force_n == 0:
        return no_contact(sensor, touch, "footprint")
    points, drop = tip_points(sensor, Tips())
    unloaded = PlatePose(0.0, touch.tilt_x_rad, touch.tilt_y_rad)
    level = heights_under(surface, touch, points) - drop - unloaded.heights_mm(points)
    highest = float(level.max())
    cover = (level >= highest - COVER_DEPTH * sensor.overlay.height_mm).mean(axis=1)
    forces = touch.force_n * (cover / cover.sum()).reshape(sensor.shape)
    return Contact(forces, highest, touch.tilt_x_rad, touch.tilt_y_rad, "footprint", iterations=0)


MODELS: dict[str, Callable[[HeightMap, SensorType, Touch], Contact]] = {
    "footprint": footprint,
    **{f"tabs-{points}": partial(_tabs, points) for points in (7, 19, 61)},
    **{f"layer-{cells}": partial(_layer, cells) for cells in (2, 4, 8, 16)},
    "gel": _gel,
}
ENGINE = Engine(press_tips, points=19, overlays=("tab", "pad", "gel"))
