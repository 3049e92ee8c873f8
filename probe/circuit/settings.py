"""Numbers that decide in the circuit of tactels: the film as it is sold, and its solvers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FilmSettings:
    """The usual film: Interlink 400 series, as a tactel of 1.5875 mm has it."""

    gain_s: float = 1e-4  #: at 1 N above the break force: 10 kOhm
    break_n: float = 0.01  #: least force that is felt: 0.4 N/cm^2
    series_ohm: float = 500.0  #: at any force
    leak_s: float = 5e-8  #: 20 MOhm unloaded
    most_n: float = 1e12  #: beyond it nothing changes: the series resistance holds


@dataclass(frozen=True, slots=True)
class FloatingSettings:
    """The network of a board whose rows float."""

    steps: int = 60  #: most steps
    pivots: int = 200  #: of one step
    patience: int = 6  #: block pivots without progress before single ones
    near: float = 1e-3  #: squared Newton decrement; -logdet is self-concordant: full steps converge
    decrease: float = 1e-4  #: share of the promised decrease that a step must keep
    halvings: int = 40  #: of one step


@dataclass(frozen=True, slots=True)
class InverseSettings:
    """Counts back to resistances."""

    steps: int = 30  #: most Newton steps with a row resistance
    tolerance: float = 1e-12  #: relative, of a resistance
    finest: float = 1e-6  #: relative error of a resistance that is never undercut
    edge: float = 1e-9  #: of 1: a column whose currents add up to all that the supply can give


FILM = FilmSettings()
FLOATING = FloatingSettings()
INVERSE = InverseSettings()
