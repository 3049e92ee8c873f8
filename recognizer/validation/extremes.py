"""Stiff and extreme scenes and images: a finite answer in balance, or a refusal by name.

An answer of a contact model passes if every force is finite and not negative and their sum is the
load to within `BALANCE`; an image passes if the reader answers nothing, and raises nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.press import press
from probe.errors import ProbeError
from probe.surface.contract import HeightMap
from probe.surface.indenters import Cross, FlatPlate, RaisedStrip, RoughSurface, TiltedPlane
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.validation.statistics import round_digits

BALANCE = 1e-6  #: of the load
FINITE, REFUSED, NO_ANSWER = "finite", "refused", "no answer"
EITHER = "finite or refused"

_HERE = Touch(x_mm=0.0, y_mm=0.0, theta_rad=0.3, force_n=80.0)
_FREE = WristStiffness(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ExtremeScene:
    """A scene that is pressed, and the outcomes that pass."""

    name: str
    surface: HeightMap
    touch: Touch = _HERE
    expected: str = FINITE
    overlay: dict[str, Any] = field(default_factory=dict)  #: what of it is changed


class _NoNumber:
    top_mm = 0.0

    def heights_mm(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return no number anywhere."""
        return np.full(len(points_mm), math.nan)


_CROSS = Cross(floor_mm=-1.0)
SCENES: tuple[ExtremeScene, ...] = (
    ExtremeScene("no force: an image of zeros", _CROSS, replace(_HERE, force_n=0.0)),
    ExtremeScene("force 1e-9 N", _CROSS, replace(_HERE, force_n=1e-9)),
    ExtremeScene("force 10,000 N", _CROSS, replace(_HERE, force_n=1e4), EITHER),
    ExtremeScene("incompressible, nu = 0.5", _CROSS, overlay={"poisson": 0.5}),
    ExtremeScene("nu = 0.3", _CROSS, overlay={"poisson": 0.3}),
    ExtremeScene("soft, E = 0.001 MPa", _CROSS, replace(_HERE, force_n=0.05),
                 overlay={"young_mpa": 1e-3}),
    ExtremeScene("hard, E = 10,000 MPa", _CROSS, overlay={"young_mpa": 1e4}),
    ExtremeScene("overlay 0.2 mm thin", _CROSS, overlay={"height_mm": 0.2}),
    ExtremeScene("overlay 20 mm thick", _CROSS, overlay={"height_mm": 20.0}),
    ExtremeScene("wrist free to turn", _CROSS, replace(_HERE, wrist=_FREE)),
    ExtremeScene("wrist 1e9 N mm/rad", _CROSS, replace(_HERE, wrist=WristStiffness(1e9, 1e9))),
    ExtremeScene("tilt 20 degrees on a plate", FlatPlate(),
                 replace(_HERE, tilt_x_rad=math.radians(20))),
    ExtremeScene("plane that rises 1 mm a mm", TiltedPlane(1.0, 0.0), expected=EITHER),
    ExtremeScene("stroke of 0.02 mm", RaisedStrip(0.02), replace(_HERE, force_n=1.0)),
    ExtremeScene("cliff through the centre", RaisedStrip(200.0), replace(_HERE, x_mm=100.0)),
    ExtremeScene("rough, 0.5 mm", RoughSurface(1, 0.5, 4.0)),
    ExtremeScene("1,000 km away", FlatPlate(), replace(_HERE, x_mm=1e9)),
    ExtremeScene("tips: centre beyond the edge, wrist free", RaisedStrip(200.0),
          replace(_HERE, x_mm=110.0, wrist=_FREE), REFUSED),
    ExtremeScene("nothing under the sensor", RaisedStrip(2.0), replace(_HERE, x_mm=100.0), REFUSED),
    ExtremeScene("heights that are no numbers", _NoNumber(), expected=REFUSED),
    ExtremeScene("force that is no number", _CROSS, replace(_HERE, force_n=math.nan), REFUSED),
    ExtremeScene("negative force", _CROSS, replace(_HERE, force_n=-1.0), REFUSED),
    ExtremeScene("place that is no number", _CROSS, replace(_HERE, x_mm=math.inf), REFUSED),
)  # fmt: skip


def extremes(reader: Reader) -> list[dict[str, Any]]:
    """Return the table of stiff and extreme cases: the outcome of each, and whether it passes."""
    return [*press_scenes(), *_read_images(reader)]


def press_scenes() -> Iterator[dict[str, Any]]:
    """Press every scene with both overlays."""
    for kind in ("tab", "pad"):
        for scene in SCENES:
            overlay = replace(Overlay(kind=kind), **scene.overlay)
            outcome, detail, off = _press(scene, SensorType(overlay=overlay))
            yield _line(f"contact, {kind}", scene.name, scene.expected, outcome, detail, off)


def _line(
    part: str, case: str, expected: str, outcome: str, told: str, off: float = 0.0
) -> dict[str, Any]:
    balanced = off <= BALANCE
    return {
        "part": part,
        "case": case,
        "expected": expected,
        "outcome": outcome,
        "told": told,
        "out_of_balance": None if balanced else round_digits(off, 2),
        "passes": outcome in expected and balanced,
    }


def _press(scene: ExtremeScene, sensor: SensorType) -> tuple[str, str, float]:
    """Return the outcome, the contact level or the cause of a refusal, and the imbalance."""
    try:
        contact = press(scene.surface, sensor, scene.touch)
    except ProbeError as error:
        return REFUSED, error.cause, 0.0
    forces, load = contact.forces_n, scene.touch.force_n
    if not np.isfinite(forces).all() or forces.min() < -BALANCE * load:
        return "no finite answer", "", 0.0
    return FINITE, contact.level, abs(float(forces.sum()) - load) / max(load, 1e-30)


def _images(shape: tuple[int, int]) -> Iterator[tuple[str, NDArray[np.float64]]]:
    rng = np.random.default_rng(1)
    image = np.zeros(shape)
    yield "reads nothing", image
    yield "every tactel at its limit", np.full(shape, 1023.0)
    yield "noise alone, 3 counts", 8 + 3 * rng.standard_normal(shape)
    spike = image.copy()
    spike[5, 7] = 1023
    yield "one tactel alone", spike
    yield "gradient", np.add.outer(np.arange(shape[0]), np.arange(shape[1])) * 30.0
    rows = image.copy()
    rows[::2] = 800
    yield "every other row dead", rows
    yield "random counts", rng.uniform(0, 1023, shape)
    yield "counts of 1e12", rng.uniform(0, 1e12, shape)


def _read_images(reader: Reader) -> Iterator[dict[str, Any]]:
    """Show the reader strange images."""
    for name, image in _images((reader.sensor.rows, reader.sensor.columns)):
        answer = recognise(reader, reader.signal(image))
        outcome = FINITE if answer else NO_ANSWER
        told = f"{answer.object}/{answer.face}" if answer else answer.reason
        yield _line("reader", name, NO_ANSWER, outcome, told)
