"""Numbers that decide what is drawn, how it is judged, and what a campaign must reach.

One frozen value a stage. What a person may change stands in `campaign.Campaign`; what is
wrong with simulated sensors, in `probe.simulate.world.levels`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DrawSettings:
    """Where and how touches are drawn."""

    force_n: tuple[float, float] = (20.0, 120.0)  #: as a hand or an arm presses
    tilt_rad: float = math.radians(2.0)  #: at most, of the wrist
    worn: float = 0.2  #: probability that a symbol of a worn face is gone
    inside_mm: float = 9.0
    """A touch inside a face keeps so far from its edges: a sensor of 25 mm then shows most of
    its window; nearer ones are of the kind `edge`, or `corner` about a corner."""
    unrest: tuple[tuple[str, str], ...] = (
        ("tips", "the plate tips"),
        ("under the", "nothing bears it"),
        ("too thin", "strokes too thin"),
        ("finds no rest", "no rest in the engine"),
        ("does not settle", "no rest in the engine"),
    )
    """A touch without a rest is drawn again: words of the cause, and the reason that is counted."""

    def why_resampled(self, cause: str) -> str:
        """Return the reason that is counted for a cause of the contact."""
        return next((reason for words, reason in self.unrest if words in cause), "other")


@dataclass(frozen=True, slots=True)
class PolicySettings:
    """How touches follow each other where one is not enough."""

    most: int = 3  #: touches until one is answered
    off_mm: float = 0.3  #: standard deviation of an arm's step, along x and along y
    off_rad: float = math.radians(0.2)  #: of its turn
    force: float = 0.1  #: of the logarithm of the force
    tries: int = 4  #: tilts of the wrist that are drawn until the plate finds a rest
    stream: int = 7  #: of random numbers, apart from those that draw the first touch


@dataclass(frozen=True, slots=True)
class MakeSettings:
    """What is made for kinds of touches that need objects of their own."""

    block_mm: tuple[float, float, float] = (45.0, 35.0, 28.0)  #: of copies and near ones
    copies: int = 12  #: of one block; as many near ones
    near_mm: float = 0.5  #: from one near block to the next
    small_pitches: tuple[float, ...] = (3.15, 3.3, 3.45, 3.6)
    """Sides of small cubes: 22 ... 25.2 mm at 7 mm, less than the sensor's 25.4 mm, with room for
    nine symbols; smaller ones have no place that could be told, and are refused when made."""
    labs: int = 2  #: that have made parts with the same profile
    lab_objects: int = 8  #: of each
    lab_mm: tuple[float, float] = (35.0, 75.0)  #: their sizes


@dataclass(frozen=True, slots=True)
class JudgeSettings:
    """When an answer is right, and when one is expected."""

    near_mm: float = 2.0
    """An answer farther from the truth is wrong: under half of the finest pitch (4.5 mm), so
    that the next cell is never taken for the true one."""
    near_deg: float = 10.0
    """An answer turned farther is wrong: a mounting a quarter turn off, or a symbol that looks
    alike when turned; right ones are within 3 degrees."""
    enough: float = 1.5
    """Symbols in view over those of a window, from which an answer is expected: as many
    as a window has need not stand as a window."""


@dataclass(frozen=True, slots=True)
class AcceptanceLimits:
    """What a campaign must reach (design, section 4); no answer may be wrong."""

    answered: float = 0.995  #: of the touches that show enough symbols
    rms_mm: float = 0.1  #: place, at the level `hardest`
    rms_deg: float = 0.3  #: turn, same
    inside: tuple[float, float] = (0.90, 0.98)  #: of the errors inside the 95 % ellipsoid
    face_answered: float = 0.5  #: of all touches of a face; with less, the face is no use
    hardest: str = "mismatch"  #: wrong in everything at once


@dataclass(frozen=True, slots=True)
class StudySettings:
    """How much the pictures of error against run time rest on."""

    touches: int = 200
    """Of faces, for every reader: the interval of 99.5 % is then 2 % wide. Six readers take 1,200
    touches, so a run of fewer than this has no study unless one is asked for."""
    windows: int = 200  #: damaged ones for each decoder
    wrong_symbols: float = 0.05  #: of these windows
    beyond: int = 2  #: rows and columns of a view beyond the window, so that errors show
    largest_serial: int = 1 << 13  #: places up to which the serial method ends in time
    objects: int = 20  #: read to know what reading all would take
    repeats: int = 5  #: of what is timed; the median counts

    def touches_of(self, touches: int) -> int:
        """Return how many touches every reader gets in a campaign of so many."""
        return self.touches if touches >= self.touches else 0


@dataclass(frozen=True, slots=True)
class SharingSettings:
    """How touches are shared among workers; changes no result."""

    shard: int = 1000  #: touches in a file, lost at most with a run
    batch: int = 25  #: touches that a worker takes at once, 1/8 s: calls cost nothing then
    losses: int = 3  #: pools in a row that break before they have done anything
    cluster_wait_s: float = 20.0  #: for the scheduler, and for its first worker


DRAWING, JUDGING, LIMITS = DrawSettings(), JudgeSettings(), AcceptanceLimits()
STUDIES, SHARING, MAKING = StudySettings(), SharingSettings(), MakeSettings()
POLICIES = PolicySettings()
