"""Image -> the places that it can be, each with what the database holds there fitted to it.

A place that the symbols read so far allow is looked at again with all symbols that the database
says are in view, then its rivals under that fit, wherever in the database they are. Thesis 6.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.belief import Support, support
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import (
    Hypothesis,
    find_hypotheses,
    find_rivals,
    labels_at,
    log_likelihood,
    neighbours,
    under_centre,
)
from recognizer.touch.reader import Reader
from recognizer.touch.round import verify_on_round_faces
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.fit import Fit, FitSettings, fit_lattices, score_cells
from recognizer.touch.symbols.gain import Image, image_of
from recognizer.touch.symbols.pressing import pressing_of
from recognizer.touch.symbols.refine import initial_lattices, refine_lattices
from recognizer.touch.symbols.search import Bank
from recognizer.touch.symbols.template import ResponseTemplate


@dataclass(frozen=True, slots=True, eq=False)
class VerifiedHypothesis:
    """A place that was verified."""

    image: Image
    template: ResponseTemplate
    embossed: EmbossedArray
    hypothesis: Hypothesis
    fit: Fit
    score: float  #: log-likelihood of the image, nats

    def support(self) -> Support:
        """Return what speaks for it."""
        return support(
            self.image, self.template, self.embossed, self.fit, self.hypothesis, self.score
        )


def verify_hypotheses(
    reader: Reader, signal: Signal, settings: FitSettings
) -> list[VerifiedHypothesis]:
    """Return the verified places over all encodings, best first."""
    found: list[VerifiedHypothesis] = []
    for embossed, template, bank in reader.prepared:
        pressing = pressing_of(reader.sensor, embossed.style.height_mm)
        image = image_of(
            reader.sensor, signal.forces, signal.trust, pressing, newtons=signal.newtons
        )
        seen = fit_lattices(image, template, bank, settings)
        found += _verify_on_flat_faces(reader, image, embossed, template, seen)
        if embossed.radii_mm:
            found += _verify_on_round_faces(reader, image, embossed, template, bank, settings)
    return sorted(found, key=lambda reading: -reading.score)


def _verify_on_flat_faces(
    reader: Reader,
    image: Image,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    found: tuple[Fit, ...],
) -> list[VerifiedHypothesis]:
    """Return the likeliest places, best first, fitted to what the database holds there."""
    limits = reader.thresholds
    candidates = _on_flat_faces(embossed, find_hypotheses(embossed, found, limits.places))[
        : limits.places
    ]
    if not candidates:
        return []
    near = [hypothesis.score > candidates[0].score - limits.near for hypothesis in candidates]
    candidates = candidates[: max(2, sum(near))]
    verified = _fit_hypotheses(reader, image, embossed, template, candidates, found)
    best = verified[0]
    others = [
        hypothesis
        for hypothesis in _on_flat_faces(
            embossed, find_rivals(embossed, best.fit, best.hypothesis, len(found), limits.places)
        )
        if hypothesis.score > best.score - limits.near
    ]
    if others:  # also such as were verified before, under a fit that is not as good
        everything = [replace(best.hypothesis, fit=len(found)), *others]
        verified += _fit_hypotheses(
            reader, image, embossed, template, everything, (*found, best.fit)
        )
    return sorted(verified, key=lambda reading: -reading.score)


def _on_flat_faces(embossed: EmbossedArray, found: list[Hypothesis]) -> list[Hypothesis]:
    """Return the places on flat faces; those on round ones are read with their bend."""
    if not embossed.radii_mm:
        return found
    return [hypothesis for hypothesis in found if embossed.face(hypothesis.face).round is None]


def _verify_on_round_faces(
    reader: Reader,
    image: Image,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    bank: Bank,
    settings: FitSettings,
) -> list[VerifiedHypothesis]:
    limits = reader.thresholds
    return [
        VerifiedHypothesis(read.image, template, embossed, read.hypothesis, read.fit, read.score)
        for read in verify_on_round_faces(
            image, reader.sensor, embossed, template, bank, settings, reader.settings, limits
        )
    ]


def _fit_hypotheses(
    reader: Reader,
    image: Image,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    candidates: list[Hypothesis],
    found: tuple[Fit, ...],
) -> list[VerifiedHypothesis]:
    """Return places with pose and gain fitted to their symbols, best first."""
    starts = [found[hypothesis.fit] for hypothesis in candidates]
    lattices = initial_lattices(
        np.array([fit.pose for fit in starts]),
        np.array([fit.gain for fit in starts]),
    )

    def shown(cells: NDArray[np.int64]) -> NDArray[np.int64]:
        labels = np.stack(
            [labels_at(embossed, hypothesis, cells[b]) for b, hypothesis in enumerate(candidates)]
        )
        return np.where(labels == embossed.array.order, -1, labels)

    fitted = refine_lattices(
        image,
        template,
        lattices,
        steps=reader.thresholds.verify_steps,
        shown=shown,
    )
    again = score_cells(image, template, fitted, reader.settings)
    verified = []
    for hypothesis in candidates:
        # a place is as likely as under the best of the fits that began where its own did: what
        # one of them missed of gain and sharpness is no word against the symbols
        fair = [again[b] for b, other in enumerate(candidates) if other.fit == hypothesis.fit]
        scores = [log_likelihood(embossed, fit, hypothesis) for fit in fair]
        best = int(np.argmax(scores))
        verified.append(
            VerifiedHypothesis(image, template, embossed, hypothesis, fair[best], scores[best])
        )
    return sorted(verified, key=lambda reading: -reading.score)


def index_of(reading: VerifiedHypothesis) -> tuple[int, int]:
    """Return the cell of the array under the sensor's centre."""
    return under_centre(reading.embossed, reading.fit, reading.hypothesis)


def same_place(a: VerifiedHypothesis, b: VerifiedHypothesis) -> bool:
    """Whether two readings say the same place, up to a cell's rounding."""
    if a.embossed is not b.embossed or a.hypothesis.face != b.hypothesis.face:
        return False
    return neighbours(a.embossed, index_of(a), index_of(b))
