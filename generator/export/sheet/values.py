"""What a build sheet says, as values; drawings are SVG."""

from __future__ import annotations

from dataclasses import dataclass

Rows = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class PartCard:
    """One part."""

    name: str
    mark: str  #: what its back says, lines with " / " between
    size: str
    front: str  #: drawing; empty for a whole body
    back: str


@dataclass(frozen=True, slots=True)
class GlueStep:
    """One panel that is added."""

    text: str
    drawing: str


@dataclass(frozen=True, slots=True)
class Check:
    """One touch that tells whether the object was put together right."""

    where: str
    answer: str


@dataclass(frozen=True, slots=True)
class BuildSheet:
    """A sheet; parts that do not apply are empty."""

    title: str
    facts: Rows  #: name and value: code, printer, layers, supports, material
    files: tuple[tuple[str, str, str], ...]  #: of plates: file, what is on it, drawing
    cards: tuple[PartCard, ...] = ()
    steps: tuple[GlueStep, ...] = ()
    checks: tuple[Check, ...] = ()
    notes: tuple[str, ...] = ()
    objects: tuple[tuple[str, str, str, str], ...] = ()  #: of a set: name, code, plates, sheet
