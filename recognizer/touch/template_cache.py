"""Templates and banks of lattices, kept between runs (`encoded_objects.base.cache`).

What symbols feel like depends on alphabet, style, sensor and settings alone, and takes longer to
work out than a touch to read: .1 s for tabs, seconds for a pad.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import generator.alphabet
import probe.contact
import recognizer.touch.symbols
from encoded_objects.base.cache import cached_bytes, content_key
from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import Alphabet, SymbolStyle
from recognizer.touch.settings import SearchSettings, TemplateSettings
from recognizer.touch.symbols.search import Bank, bank_of
from recognizer.touch.symbols.template import ResponseTemplate, template_of

KIND = "templates"
CODE = (generator.alphabet, probe.contact, recognizer.touch.symbols)  #: changes what is kept

_NUMBERS = np.dtype("<i8")


@lru_cache(maxsize=16)
def template_and_bank(
    alphabet: Alphabet,
    style: SymbolStyle,
    sensor: SensorType,
    template: TemplateSettings,
    search: SearchSettings,
) -> tuple[ResponseTemplate, Bank]:
    """Return the template of an alphabet as a sensor feels it, and the bank to search by."""
    key = content_key((alphabet, style, sensor, template, search, np.__version__), _sources())

    def made() -> bytes:
        felt = template_of(alphabet, style, sensor, template)
        return _packed(felt, bank_of(felt, sensor, search))

    return _unpacked(cached_bytes(KIND, key, made))


def _sources() -> list[Path]:
    return [file for package in CODE for file in Path(package.__path__[0]).glob("*.py")]


def _packed(template: ResponseTemplate, bank: Bank) -> bytes:
    """Return both as bytes: every array as its number of axes, its shape, its values."""
    numbers = (template.pitch_mm, template.half_mm, template.ink, template.step_mm)
    arrays = (
        np.array(numbers, "<f8"),
        np.array((template.order, *bank.shape, bank.reach, bank.rim), _NUMBERS),
        template.rimmed.astype("<f4"),
        bank.taps.astype("<i4"),
        bank.even.astype("<f4"),
        bank.odd.astype("<f4"),
        bank.lookups.astype("<i4"),
        bank.rotations_rad.astype("<f8"),
        bank.shifts_mm.astype("<f8"),
    )
    return b"".join(
        np.array((one.ndim, *one.shape), _NUMBERS).tobytes()
        + one.tobytes()
        + bytes(-one.nbytes % 8)
        for one in arrays
    )


def _unpacked(content: bytes) -> tuple[ResponseTemplate, Bank]:
    at = 0

    def read(kind: str) -> NDArray[Any]:
        nonlocal at
        axes = int(np.frombuffer(content, _NUMBERS, 1, at)[0])
        shape = np.frombuffer(content, _NUMBERS, axes, at + _NUMBERS.itemsize)
        at += (1 + axes) * _NUMBERS.itemsize
        values = np.frombuffer(content, kind, int(shape.prod()), at).reshape(shape)
        at += values.nbytes + -values.nbytes % 8
        return values

    numbers, counts = read("<f8").tolist(), read(_NUMBERS.str).tolist()
    pitch_mm, half_mm, ink, step_mm = numbers
    order, rows, columns, reach, rim = counts
    template = ResponseTemplate(pitch_mm, order, half_mm, read("<f4"), ink, step_mm)
    bank = Bank(
        (rows, columns), reach, rim, read("<i4"), read("<f4"), read("<f4"), read("<i4"),
        read("<f8"), read("<f8"),
    )  # fmt: skip
    return template, bank
