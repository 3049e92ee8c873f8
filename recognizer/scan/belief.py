"""What the touches of one face say together, and what it rests on. Thesis 6.3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.answer import (
    LocatedComposite,
)
from recognizer.scan.lattice import (
    PlaneLattice,
)
from recognizer.scan.mosaic.planar import PlacedTouch
from recognizer.scan.settings import ScanSettings
from recognizer.scan.views import (
    LatticeView,
    TouchPoses,
)
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import (
    TOO_FEW,
    Recognition,
    refusal,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ScanBelief:
    """The touches of one face so far and what they say together; `extend_scan` returns the next."""

    reader: Reader
    settings: ScanSettings
    touches: tuple[PlacedTouch, ...]  #: those with contact
    touch_poses: TouchPoses | None
    views: tuple[tuple[tuple[LatticeView, ...], ...], ...]  #: of each encoding, of each touch
    lattices: tuple[tuple[PlaneLattice, ...], ...]  #: of each encoding, best first
    astray: int  #: touches in a row that agree with nothing that the others say
    told: tuple[str | None, str | None] | None  #: object and face by a touch that agreed
    leading: LocatedComposite | None  #: the likeliest place, whether it is the answer or not
    recognition: Recognition  #: of the probe's pose at the last touch
    places: tuple[LocatedComposite, ...] = ()  #: that the face may be touched at, best first
    begun: int = 0  #: how often a new belief began, because touches did not belong together


def begin_scan(reader: Reader, settings: ScanSettings | None = None) -> ScanBelief:
    """Return a scan without touches."""
    none = tuple(() for _ in reader.prepared)
    limits = settings or ScanSettings()
    return ScanBelief(reader, limits, (), None, none, none, 0, None, None, refusal(0, TOO_FEW))
