"""Image -> the places that it can be, each with what the database holds there fitted to it.

A place that the symbols read so far allow is looked at again with all symbols that the database
says are in view, then its rivals under that fit, wherever in the database they are. Thesis 6.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.belief import Support, support
from recognizer.touch.lab import Encoding
from recognizer.touch.locate import (
    Place,
    neighbours,
    place_scores,
    places,
    rivals,
    shown_at,
    under_centre,
)
from recognizer.touch.reader import Reader
from recognizer.touch.round import round_places
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.fit import Fit, Settings, fits, scored
from recognizer.touch.symbols.gain import Image, image_of
from recognizer.touch.symbols.pressing import pressing_of
from recognizer.touch.symbols.refine import refined, started
from recognizer.touch.symbols.search import Bank
from recognizer.touch.symbols.template import Template


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """A place that was verified."""

    image: Image
    template: Template
    encoding: Encoding
    place: Place
    fit: Fit
    score: float  #: log-likelihood of the image, nats

    def support(self) -> Support:
        """Return what speaks for it."""
        return support(self.image, self.template, self.encoding, self.fit, self.place, self.score)


def readings(reader: Reader, signal: Signal, settings: Settings) -> list[Reading]:
    """Return the verified places over all encodings, best first."""
    found: list[Reading] = []
    for encoding, template, bank in reader.prepared:
        pressing = pressing_of(reader.sensor, encoding.style.height_mm)
        image = image_of(
            reader.sensor, signal.forces, signal.trust, pressing, newtons=signal.newtons
        )
        seen = fits(image, template, bank, settings)
        found += _verified(reader, image, encoding, template, seen)
        if encoding.radii_mm:
            found += _on_round_faces(reader, image, encoding, template, bank, settings)
    return sorted(found, key=lambda reading: -reading.score)


def _verified(
    reader: Reader, image: Image, encoding: Encoding, template: Template, found: tuple[Fit, ...]
) -> list[Reading]:
    """Return the likeliest places, best first, fitted to what the database holds there."""
    limits = reader.thresholds
    candidates = _flat(encoding, places(encoding, found, limits.places))[: limits.places]
    if not candidates:
        return []
    near = [place.score > candidates[0].score - limits.near for place in candidates]
    candidates = candidates[: max(2, sum(near))]
    verified = _fitted(reader, image, encoding, template, candidates, found)
    best = verified[0]
    others = [
        place
        for place in _flat(
            encoding, rivals(encoding, best.fit, best.place, len(found), limits.places)
        )
        if place.score > best.score - limits.near
    ]
    if others:  # also such as were verified before, under a fit that is not as good
        everything = [replace(best.place, fit=len(found)), *others]
        verified += _fitted(reader, image, encoding, template, everything, (*found, best.fit))
    return sorted(verified, key=lambda reading: -reading.score)


def _flat(encoding: Encoding, found: list[Place]) -> list[Place]:
    """Return the places on flat faces; those on round ones are read with their bend."""
    if not encoding.radii_mm:
        return found
    return [place for place in found if encoding.face(place.face).round is None]


def _on_round_faces(
    reader: Reader,
    image: Image,
    encoding: Encoding,
    template: Template,
    bank: Bank,
    settings: Settings,
) -> list[Reading]:
    limits = reader.thresholds
    return [
        Reading(read.image, template, encoding, read.place, read.fit, read.score)
        for read in round_places(
            image, reader.sensor, encoding, template, bank, settings, reader.settings, limits
        )
    ]


def _fitted(
    reader: Reader,
    image: Image,
    encoding: Encoding,
    template: Template,
    candidates: list[Place],
    found: tuple[Fit, ...],
) -> list[Reading]:
    """Return places with pose and gain fitted to their symbols, best first."""
    starts = [found[place.fit] for place in candidates]
    lattices = started(
        np.array([fit.pose for fit in starts]),
        np.array([fit.gain for fit in starts]),
    )

    def shown(cells: NDArray[np.int64]) -> NDArray[np.int64]:
        labels = np.stack(
            [shown_at(encoding, place, cells[b]) for b, place in enumerate(candidates)]
        )
        return np.where(labels == encoding.array.order, -1, labels)

    fitted = refined(
        image,
        template,
        lattices,
        steps=reader.thresholds.verify_steps,
        shown=shown,
    )
    again = scored(image, template, fitted, reader.settings)
    verified = []
    for place in candidates:
        # a place is as likely as under the best of the fits that began where its own did: what
        # one of them missed of gain and sharpness is no word against the symbols
        fair = [again[b] for b, other in enumerate(candidates) if other.fit == place.fit]
        scores = [place_scores(encoding, fit, place) for fit in fair]
        best = int(np.argmax(scores))
        verified.append(Reading(image, template, encoding, place, fair[best], scores[best]))
    return sorted(verified, key=lambda reading: -reading.score)


def index_of(reading: Reading) -> tuple[int, int]:
    """Return the cell of the array under the sensor's centre."""
    return under_centre(reading.encoding, reading.fit, reading.place)


def same_place(a: Reading, b: Reading) -> bool:
    """Whether two readings say the same place, up to a cell's rounding."""
    if a.encoding is not b.encoding or a.place.face != b.place.face:
        return False
    return neighbours(a.encoding, index_of(a), index_of(b))
