"""What is prepared once for a lab and a sensor: templates, banks of lattices, and limits."""

from __future__ import annotations

from dataclasses import dataclass, field

from probe.sensor import SensorType
from recognizer.touch.belief import BeliefSettings
from recognizer.touch.lab import EmbossedArray, Lab
from recognizer.touch.symbols.fit import FitSettings
from recognizer.touch.symbols.search import Bank, bank_of
from recognizer.touch.symbols.template import ResponseTemplate, template_of

#: For touches that the first try does not answer.
THOROUGH = FitSettings(candidates=12, steps=4, finalists=6, final_steps=6, crossed=3)


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """Everything that is prepared once for a lab and a sensor."""

    lab: Lab
    sensor: SensorType
    settings: FitSettings = field(default_factory=FitSettings)
    thorough: FitSettings = field(default_factory=lambda: THOROUGH)
    thresholds: BeliefSettings = field(default_factory=BeliefSettings)
    prepared: tuple[tuple[EmbossedArray, ResponseTemplate, Bank], ...] = ()


def reader_for(
    lab: Lab,
    sensor: SensorType,
    settings: FitSettings | None = None,
    thresholds: BeliefSettings | None = None,
) -> Reader:
    """Return a reader with the templates of all encodings of a lab."""
    prepared = []
    for embossed in lab.arrays:
        template = template_of(embossed.alphabet, embossed.style, sensor)
        prepared.append((embossed, template, bank_of(template, sensor)))
    return Reader(
        lab=lab,
        sensor=sensor,
        settings=settings or FitSettings(),
        thresholds=thresholds or BeliefSettings(),
        prepared=tuple(prepared),
    )
