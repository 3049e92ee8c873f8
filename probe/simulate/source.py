"""Frames of a probe that keeps touching a surface: the source of `sim:` ports.

Target + options -> frames without end. The sensor comes down, holds, and lifts, again and
again; the film remembers (hysteresis, creep). Without a place it wanders from touch to touch
by a step in a random direction. Options, all optional:

    x, y        mm, surface frame: stay at this place
    theta       degrees; any without it
    force       N, 80 on fsr-16: on another type as hard
    tilt        degrees, largest tilt of a touch: 0
    step        mm from touch to touch while wandering, 5
    period      s from touch to touch, 2
    rate        frames per second, 100
    sensor_type name or file of the sensor: fsr-16
    overlay     tab or pad: that of the type
    accuracy    auto, a level, or the largest error of an image: auto
    noise       typical or quiet: typical
    seed        whole number, 0
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import choose_sensor_type, usual_force_n
from probe.contact.contract import Touch
from probe.contact.press import accuracy_of, level_for
from probe.errors import ContactError, SurfaceError
from probe.frame import MOST_HZ, Frame
from probe.simulate.scene import Scene
from probe.simulate.sensor import SimulatedSensor, simulated_sensor
from probe.simulate.target import surface_of

Image = NDArray[np.float64]

LEVELS = 16  #: of the force while it rises and falls: each is one contact
TRIES = 64  #: directions tried for the next step, places tried that hold no sensor
DOWN, HELD, UP = 0.15, 0.65, 0.80  #: shares of a period: full force, begin to lift, off
_DEFAULTS = {"tilt": 0.0, "step": 5.0, "period": 2.0, "rate": 100.0, "seed": 0.0}
#: least and most of each number: mm, degrees, N, s, Hz
_RANGES = {
    "x": (-1e4, 1e4), "y": (-1e4, 1e4), "theta": (-360.0, 360.0), "force": (0.0, 1e4),
    "tilt": (0.0, 45.0), "step": (0.0, 1e4), "period": (0.01, 3600.0), "rate": (0.1, MOST_HZ),
    "seed": (0.0, 2.0**53),
}  # fmt: skip
_CHOICES = {"overlay": ("tab", "pad"), "noise": ("typical", "quiet")}
_WORDS = ("accuracy", "sensor_type")
NAMES = ("x", "y", "theta", "force", *_DEFAULTS, *_CHOICES, *_WORDS)


def frames_of(target: str, options: Mapping[str, str] | None = None) -> Iterator[Frame]:
    """Yield frames of a probe over a surface, numbered and timed from 0.

    `options` are those above, text as it stands in a port's URL; read before the first frame.

    Raises `SurfaceError` when the target or an option cannot be read; `ContactError` when the
    accuracy is no level, or no touch has an equilibrium.
    """
    numbers, sensor = options_of(options or {}, place=target)
    rng = np.random.default_rng(int(numbers["seed"]))
    return sensor.frames(_forces(surface_of(target), numbers, sensor, rng), rng)


def options_of(
    values: Mapping[str, str], *, place: str = ""
) -> tuple[dict[str, float], SimulatedSensor]:
    """Read options from text: the numbers (x, y, theta only where given) and the sensor.

    Raises SurfaceError: naming what is unknown or no number, and what is allowed; ContactError:
    when the accuracy is none of the overlay's levels.
    """
    numbers = dict(_DEFAULTS)
    for name, text in values.items():
        if name not in NAMES:
            raise SurfaceError(
                f"a simulated probe has no option '{name}'",
                fix=f"its options are {', '.join(NAMES)}",
                place=place,
            )
        if name in _CHOICES and text not in _CHOICES[name]:
            raise SurfaceError(
                f"{name}={text!r}", fix=f"write {' or '.join(_CHOICES[name])}", place=place
            )
        if name not in _CHOICES and name not in _WORDS:
            numbers[name] = _number(name, text, place)
    chosen = choose_sensor_type(values.get("sensor_type"), "", None, place)
    sensor = chosen.with_overlay(values.get("overlay", ""))
    numbers.setdefault("force", usual_force_n(sensor))
    quiet = values.get("noise") == "quiet"
    accuracy = accuracy_of(values.get("accuracy", "auto"))
    level_for(sensor, accuracy)
    return numbers, simulated_sensor(
        sensor, accuracy=accuracy, quiet=quiet, frame_s=1 / numbers["rate"]
    )


def _number(name: str, text: str, place: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    least, most = _RANGES[name]
    if not least <= value <= most:
        fix = f"write a number from {least:g} to {most:g}"
        raise SurfaceError(f"{name}={text!r}", fix=fix, place=place)
    return value


def _forces(
    scene: Scene, numbers: dict[str, float], sensor: SimulatedSensor, rng: np.random.Generator
) -> Iterator[Image]:
    """Yield the forces (rows, columns) of touch after touch, frame by frame."""
    beats = max(1, round(numbers["period"] * numbers["rate"]))
    for touch in _random_walk(scene, numbers, sensor, rng):
        images: dict[float, Image] = {}
        for beat in range(beats):
            share = round(load(beat / beats) * LEVELS) / LEVELS
            if share not in images:
                pressed = replace(touch, force_n=touch.force_n * share)
                images[share] = sensor.press(scene, pressed).forces_n
            yield images[share]


def load(share: float) -> float:
    """Return the force at a share of the period, over the full force: down, hold, up, off."""
    if share < DOWN:
        return (1 - math.cos(math.pi * share / DOWN)) / 2
    if share < HELD:
        return 1.0
    if share < UP:
        return (1 + math.cos(math.pi * (share - HELD) / (UP - HELD))) / 2
    return 0.0


def _random_walk(
    scene: Scene, numbers: dict[str, float], sensor: SimulatedSensor, rng: np.random.Generator
) -> Iterator[Touch]:
    """Yield touches that have an equilibrium: at the given place, or step after step."""
    fixed = "x" in numbers or "y" in numbers
    middle = scene.centre_mm()
    at = np.array([numbers.get("x", middle[0]), numbers.get("y", middle[1])])
    refused = 0
    while True:
        towards, theta = rng.uniform(-math.pi, math.pi, 2)
        tilt = math.radians(numbers["tilt"]) * math.sqrt(rng.random())
        touch = Touch(
            x_mm=float(at[0]),
            y_mm=float(at[1]),
            theta_rad=math.radians(numbers["theta"]) if "theta" in numbers else float(theta),
            force_n=numbers["force"],
            tilt_x_rad=tilt * math.cos(towards),
            tilt_y_rad=tilt * math.sin(towards),
        )
        try:
            sensor.press(scene, touch)
        except ContactError:
            refused += 1
            if fixed or refused > TRIES:
                raise
        else:
            refused = 0
            yield touch
        if not fixed:
            at = _next_place(scene, at, numbers["step"], rng)


def _next_place(scene: Scene, at: Image, step_mm: float, rng: np.random.Generator) -> Image:
    """Return a place one step further inside the region; the middle where there is none."""
    for angle in rng.uniform(-math.pi, math.pi, TRIES):
        onward = at + step_mm * np.array([math.cos(angle), math.sin(angle)])
        if scene.region.contains(onward[None])[0]:
            return onward
    return scene.centre_mm()
