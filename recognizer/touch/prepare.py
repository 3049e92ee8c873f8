"""What is prepared once for a lab and a sensor: templates, and banks of lattices to search by.

Both depend on alphabet, style and sensor alone, and take longer to compute than a touch to read: .1
s for tabs, seconds for a pad. They are kept between runs (`encoded_objects.base.cache`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import generator.alphabet
import probe.contact
import recognizer.touch.symbols
from encoded_objects.base.cache import cached_bytes, content_key
from encoded_objects.base.errors import UsageError
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from generator.alphabet import Alphabet, SymbolStyle
from recognizer.errors import LabError
from recognizer.touch.lab import EmbossedArray, Lab
from recognizer.touch.options import DEFAULTS, ReaderOptions
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.image import Image, image_of_signal
from recognizer.touch.symbols.search import Bank, bank_of
from recognizer.touch.symbols.template import ResponseTemplate, template_of

KIND = "templates"  #: of cached files
CODE = (generator.alphabet, probe.contact, recognizer.touch.symbols)  #: changes what is kept

#: Tactels to a symbol below which numbers of tactels shrink with the square of the share: 8x8 at
#: 3 mm, 7 mm symbols, 40 typical touches mid-face, 0 wrong: 38 answered, 0 without it.
COARSE = 8.0

_NUMBERS = np.dtype("<i8")


class Prepared(NamedTuple):
    """One array of a lab with its responses on a sensor."""

    embossed: EmbossedArray
    template: ResponseTemplate
    bank: Bank


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PreparedLab:
    """A lab, a sensor and options; `Reader` is one."""

    lab: Lab
    sensor: SensorType = field(default_factory=SensorType)
    options: ReaderOptions = DEFAULTS
    prepared: tuple[Prepared, ...] = field(init=False)

    def __post_init__(self) -> None:
        if not isinstance(self.lab, Lab):
            raise LabError(
                f"{self.lab!r} is no open lab", fix=f"open it first: open_lab({str(self.lab)!r})"
            )
        if not isinstance(self.options, ReaderOptions):
            raise UsageError(f"options {self.options!r}", fix="give ReaderOptions(...)")
        object.__setattr__(self, "sensor", choose_sensor_type(self.sensor, "", None, "Reader"))
        made = tuple(
            Prepared(each, *template_and_bank(each.alphabet, each.style, self.sensor))
            for each in self.lab.arrays
        )
        object.__setattr__(self, "prepared", made)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.lab}; {self.sensor.name}, {self.sensor.overlay.kind})"

    def image(self, signal: Signal, prepared: Prepared) -> Image:
        """Return a touch as it is fitted to one array."""
        height_mm, share = prepared.embossed.style.height_mm, cell_share(self.lab, self.sensor)
        return image_of_signal(
            self.sensor, signal, prepared.template, height_mm, self.options, share
        )


def cell_share(lab: Lab, sensor: SensorType) -> float:
    """Return by how much numbers of tactels on a cell shrink, on a sensor with few on a symbol.

    1 where the smallest symbols of the lab lie under `COARSE` tactels or more, as on `fsr-16`.
    """
    few = min((each.style.pitch_mm for each in lab.arrays), default=math.inf) / sensor.pitch_mm
    return min(1.0, few**2 / COARSE) ** 2


@lru_cache(maxsize=16)
def template_and_bank(
    alphabet: Alphabet, style: SymbolStyle, sensor: SensorType
) -> tuple[ResponseTemplate, Bank]:
    """Return the template of an alphabet on a sensor, and the bank to search by."""
    key = content_key((alphabet, style, sensor, np.__version__), _sources())

    def made() -> bytes:
        template = template_of(alphabet, style, sensor)
        return _packed(template, bank_of(template, sensor))

    return _unpacked(cached_bytes(KIND, key, made))


def _sources() -> list[Path]:
    return [file for package in CODE for file in Path(package.__path__[0]).glob("*.py")]


#: Arrays of a template and a bank, in the order in which they are kept.
_KEPT = {
    "numbers": "<f8", "counts": "<i8", "rimmed": "<f4", "taps": "<i4", "even": "<f4",
    "odd": "<f4", "lookups": "<i4", "rotations_rad": "<f8", "shifts_mm": "<f8",
}  # fmt: skip


def _packed(template: ResponseTemplate, bank: Bank) -> bytes:
    """Return both as bytes: every array as its number of axes, its shape, its values."""
    given = {
        "numbers": (template.pitch_mm, template.half_mm, template.ink, template.step_mm),
        "counts": (template.order, *bank.shape, bank.reach, bank.rim),
        "rimmed": template.rimmed,
    }
    packed = []
    for name, kind in _KEPT.items():
        one = np.asarray(given[name] if name in given else getattr(bank, name), kind)
        shape = np.array((one.ndim, *one.shape), _NUMBERS)
        packed += [shape.tobytes(), one.tobytes(), bytes(-one.nbytes % 8)]
    return b"".join(packed)


def _unpacked(content: bytes) -> tuple[ResponseTemplate, Bank]:
    at, found = 0, dict[str, NDArray[Any]]()
    for name, kind in _KEPT.items():
        axes = int(np.frombuffer(content, _NUMBERS, 1, at)[0])
        shape = np.frombuffer(content, _NUMBERS, axes, at + _NUMBERS.itemsize)
        at += (1 + axes) * _NUMBERS.itemsize
        found[name] = np.frombuffer(content, kind, int(shape.prod()), at).reshape(shape)
        at += found[name].nbytes + -found[name].nbytes % 8
    pitch_mm, half_mm, ink, step_mm = found.pop("numbers").tolist()
    order, rows, columns, reach, rim = found.pop("counts").tolist()
    template = ResponseTemplate(pitch_mm, order, half_mm, found.pop("rimmed"), ink, step_mm)
    return template, Bank((rows, columns), reach, rim, **found)
