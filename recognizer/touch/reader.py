"""What is prepared once for a lab and a sensor: templates, banks of lattices, and limits."""

from __future__ import annotations

from dataclasses import dataclass, field

from probe.sensor import SensorType
from recognizer.touch.belief import Thresholds
from recognizer.touch.lab import Encoding, Lab
from recognizer.touch.symbols.fit import Settings
from recognizer.touch.symbols.search import Bank, bank_of
from recognizer.touch.symbols.template import Template, template_of

#: For touches that the first try does not answer.
THOROUGH = Settings(candidates=12, steps=4, finalists=6, final_steps=6, crossed=3)


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """Everything that is prepared once for a lab and a sensor."""

    lab: Lab
    sensor: SensorType
    settings: Settings = field(default_factory=Settings)
    thorough: Settings = field(default_factory=lambda: THOROUGH)
    thresholds: Thresholds = field(default_factory=Thresholds)
    prepared: tuple[tuple[Encoding, Template, Bank], ...] = ()


def reader_for(
    lab: Lab,
    sensor: SensorType,
    settings: Settings | None = None,
    thresholds: Thresholds | None = None,
) -> Reader:
    """Return a reader with the templates of all encodings of a lab."""
    prepared = []
    for encoding in lab.encodings:
        template = template_of(encoding.alphabet, encoding.style, sensor)
        prepared.append((encoding, template, bank_of(template, sensor)))
    return Reader(
        lab=lab,
        sensor=sensor,
        settings=settings or Settings(),
        thresholds=thresholds or Thresholds(),
        prepared=tuple(prepared),
    )
