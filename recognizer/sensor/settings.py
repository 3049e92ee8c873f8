"""Every number that decides what is learned of a sensor: one frozen value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LearningSettings:
    """Chosen on the levels `dead-20`, `places-08` and `typical` of the own engine, seed 41."""

    least: int = 16  #: touches from which on tactels are told from each other
    around: int = 7  #: tactels, side of the square that a tactel is compared with
    usual: float = 70.0  #: percentile of the square that stands for a sound tactel
    answers: float = 0.25  #: of what sound ones around it rise to, from which one answers
    raised: float = 0.6  #: the same of one that reads high: its column's load moves it as well
    hot: float = (
        0.15  #: of a plateau, that a tactel reads with nothing on it: more is no background
    )
    strong: float = 90.0  #: percentile of an image that stands for its plateau
    margin: float = 20.0  #: nats of an answer from which gains and places are learned
    rounds: int = 2  #: of reading and learning
    readable: float = 0.2  #: share of touches answered, below which wirings are tried
    tried: int = 6  #: touches under each
    agree: int = 3  #: of them that must be answered


LEARNING = LearningSettings()
