"""Stiff and extreme scenes and images: a finite answer in balance, or a refusal by name.

The scenes for the contact models are `probe.simulate.world.extremes`; an image passes if the
reader answers nothing, and raises nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.simulate.world.extremes import FINITE, SCENES, press_scene
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.validation.statistics import round_digits

NO_ANSWER = "no answer"


def press_scenes() -> Iterator[dict[str, Any]]:
    """Press every scene with both overlays; yield what came of it, and whether it passes."""
    for kind in ("tab", "pad"):
        for scene in SCENES:
            found = press_scene(scene, kind)
            yield {
                "part": f"contact, {kind}",
                "case": scene.name,
                "expected": scene.expected,
                "outcome": found.outcome,
                "told": found.told,
                "out_of_balance": None if found.balanced else round_digits(found.balance or 0.0, 2),
                "passes": found.outcome in scene.expected and found.balanced,
            }


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


def read_images(reader: Reader) -> Iterator[dict[str, Any]]:
    """Show the reader strange images; yield what came of each, and whether it passes."""
    shape = (reader.sensor.rows, reader.sensor.columns)
    for name, image in _images(shape):
        answer = recognise(reader, reader.signal(image))
        outcome = FINITE if answer else NO_ANSWER
        told = f"{answer.object}/{answer.face}" if answer else answer.reason
        yield {
            "part": "reader",
            "case": name,
            "expected": NO_ANSWER,
            "outcome": outcome,
            "told": told,
            "out_of_balance": None,
            "passes": not answer,
        }


def extremes(reader: Reader) -> list[dict[str, Any]]:
    """Return the table of stiff and extreme cases."""
    return [*press_scenes(), *read_images(reader)]
