"""Numbers of the image before any symbol is sought: contact, background, dead lines, places known.

Units as in `recognizer.touch.settings`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SignalSettings:
    """What of a frame is contact, background, or a dead line."""

    contact_counts: float = 8.0  #: over the background by which the strongest tactels rise
    quiet_sigmas: float = 6.0  #: and standard deviations of the type's noise, where that is more
    contact_n: float = 0.05  #: the same where readings are newtons
    contact_sigmas: float = 7.0  #: the same where they are on another scale: deviations of noise
    strongest: int = 6  #: tactels that must; a spike is one
    background: float = 0.05  #: share of the tactels below the reading that a contact rises over
    lowest: float = 0.6  #: share of the tactels among which the background is sought ...
    densest: float = 0.4  #: ... where so many of them read most alike, and ...
    fifth: float = 0.2  #: ... no higher over the reading that `background` names ...
    above: float = 1.4  #: ... than so many times as this share of the tactels is
    strong: float = 0.95  #: share of the tactels below the reading that stands for strokes ...
    tail: float = 1.6  #: ... that rise over the middle so many times as this does over the
    #: lowest, unless a bare plate is felt: .9-1.6 at 20-120 N; symbols 1.6-3 from 4 N on
    dead: float = 0.02  #: of the median row (column): one below it is dead ...
    beside: float = 0.3  #: ... if both its neighbours are above this share


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """When frames are one touch, and when it is read."""

    alike: float = 0.6  #: correlation of images of one touch; of two places it is below 0.3
    steady: float = 0.05  #: share by which sums may be off that of the first frame averaged
    still: float = 0.9  #: correlation with it
    few: int = 5  #: frames that make a touch steady
    enough: int = 22  #: frames that are averaged, 0.1 s at 220 frames a second
    fragments: int = 64  #: unlike images without a steady one from which each is a touch


@dataclass(frozen=True, slots=True)
class LabSettings:
    """How the registered cells are kept, and which radii of round faces are told apart."""

    dense: int = 1 << 22  #: arrays of at most so many cells are looked up in a table (16 MB)
    least_mm: float = 15.0  #: smallest radius that is looked for
    most_mm: float = 400.0  #: largest: it falls 0.2 mm away at the sensor's rim
    finer: float = 1.35  #: from one radius to the next
