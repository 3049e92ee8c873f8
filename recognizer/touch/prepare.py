"""What is prepared once for a lab, a sensor and settings: templates and banks of lattices."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.lab import EmbossedArray, Lab
from recognizer.touch.settings import DEFAULTS, ReaderSettings
from recognizer.touch.symbols.search import Bank
from recognizer.touch.symbols.template import ResponseTemplate
from recognizer.touch.template_cache import template_and_bank

Prepared = tuple[EmbossedArray, ResponseTemplate, Bank]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PreparedLab:
    """A lab as a sensor feels it, with the numbers that decide; `Reader` is one."""

    lab: Lab
    sensor: SensorType = field(default_factory=SensorType)
    settings: ReaderSettings = DEFAULTS
    prepared: tuple[Prepared, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "settings", settings_for(self.lab, self.sensor, self.settings))
        settings = self.settings.template, self.settings.search
        made = tuple(
            (each, *template_and_bank(each.alphabet, each.style, self.sensor, *settings))
            for each in self.lab.arrays
        )
        object.__setattr__(self, "prepared", made)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.lab}; {self.sensor.name}, {self.sensor.overlay.kind})"


def settings_for(lab: Lab, sensor: SensorType, settings: ReaderSettings) -> ReaderSettings:
    """Return settings whose numbers of tactels suit a sensor that has few of them on a symbol.

    As they are where the smallest symbols of the lab lie under `BeliefSettings.coarse` tactels or
    more, as all do on `fsr-16`.
    """
    few = min((each.style.pitch_mm for each in lab.arrays), default=math.inf) / sensor.pitch_mm
    share = min(1.0, few**2 / settings.belief.coarse) ** 2
    if share == 1.0:
        return settings
    belief, hypotheses = settings.belief, settings.hypotheses
    return replace(
        settings,
        belief=replace(belief, whole=share * belief.whole, coarse=few**2),
        hypotheses=replace(
            hypotheses, corner=share * hypotheses.corner, heavy=share * hypotheses.heavy
        ),
    )
