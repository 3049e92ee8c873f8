"""When touches of a scan agree, and how much each of them may say."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ScanSettings:
    """Limits of a scan; nats are log-likelihoods."""

    left_out: float = 10.0  #: nats that a touch costs which agrees with no lattice
    plainly: float = 250.0  #: nats by which another lattice must not explain an image better
    agreement: float = 7.0  #: nats that it says if a view lies on a lattice to which nothing led it
    shift_margin: float = 6.0  #: nats between the likeliest integer shift of a touch and the next
    look: float = 10.0  #: nats that one touch can say about one cell
    alike: float = 0.25  #: correlation of what touches say about one cell: at most 1/alike looks
    contradicts: float = 20.0  #: nats that a touch may contradict all others before it is left out
    noise: float = 0.4  #: standard deviation of psi beyond which a touch shows no symbols
    clean: float = 0.15  #: noise of a touch whose symbols are where the answer says: not searched
    #: registered places that a foreign surface may match as well by chance; a lab holds fewer
    #: symbols of a profile that takes a scan than a touch of another can tell apart
    doubt: float = 2e-2
    wrong: float = 0.05  #: share of the cells that may clearly speak for another symbol
    floor_mm: float = 0.25  #: of places, beyond what is believed of them
    floor_rad: float = 0.01  #: of turns
    scale: float = 0.01  #: of the print, less 1: places drift apart with their distance
    loose: float = (
        0.25  #: pitches of uncertainty from which the mosaic is asked where touches stand
    )
    lattices: int = 6  #: of the plane that are followed
    hopeless: float = 40.0  #: nats by which they may be worse than the best of them
    located: int = 3  #: of them that are looked up
    guided: int = 2  #: of them that a touch is fitted with if its own fits do not agree
    telling: int = 16  #: cells by which places are listed
    places: int = 6  #: of every lattice that are compared by all cells
    loose_mm: float = 0.6  #: largest standard deviation of a place that is given as an answer
    patience: int = 3  #: touches in a row that may agree with nothing while others are believed
    #: between touches of two faces of one object: an edge, and what plate and arm err by
    facing_rad: float = math.radians(20)  #: turned further against a face, a touch is of another
    above_mm: float = 6.0  #: as far above or below it as well
    changed: float = 20.0  #: nats that another face can say at most: the object may be another now
    object_mm: float = 6.0  #: by which one object may seem to lie apart as two faces have it
    object_rad: float = math.radians(6)
    verify_steps: int = 3  #: of the last touch's pose, with the symbols that the database holds
    #: standard deviations of x, y (mm) and the turn (rad) of the first touch against itself,
    #: where nothing is known
    first: tuple[float, float, float] = (0.01, 0.01, 0.001)
    #: of a recorded pose that comes without
    by_arm: tuple[float, float, float] = (0.4, 0.4, 0.004)
    #: of a step from touch to touch that nobody measured. Wide: one of 14 mm must not look less
    #: likely than one of 2 mm, a pitch beside it
    by_hand: tuple[float, float, float] = (8.0, 8.0, math.radians(2))
    #: nats over symbols of no registered place that touches must tell whose steps nobody measured
    surprise_by_hand: float = 8.0


@dataclass(frozen=True, slots=True)
class LatticeAgreementSettings:
    """How a lattice is moved to where its views want it."""

    rounds: int = 2  #: of choosing views and moving the lattice
    settled_mm: float = 0.05  #: by which a lattice moves at no touch
    tie: float = 1e-6
    """Share of a view's loss that counts: of two views that both say nothing for a lattice the
    likelier one is taken."""
    least: float = 1e-12  #: of a variance, mm^2 or rad^2


@dataclass(frozen=True, slots=True)
class LatticeViewSettings:
    """Which fits of a touch are views, and which of them are one."""

    least_rad: float = 1e-5  #: standard deviation of poses that are believed, at least
    most_mm: float = 3.0  #: the same, at most
    same_mm: float = 0.3  #: by which two fits of a touch are one
    same_rad: float = 0.03  #: the same, of their turns
    most: int = 6  #: fits of a touch by itself that are views


@dataclass(frozen=True, slots=True)
class PathSettings:
    """How touches are followed whose motion nobody measured."""

    places: int = 200  #: that each of them may be at by itself, at most
    skipped: int = 3  #: touches in a row that may be left out
    shifts: int = 3  #: pitches, each way, by which a touch might lie beside
    #: standard deviations of x, y (mm) and the turn (rad) of a touch whose place is followed
    sure: tuple[float, float, float] = (0.4, 0.4, 0.01)


LATTICES, VIEWS, PATHS = LatticeAgreementSettings(), LatticeViewSettings(), PathSettings()
