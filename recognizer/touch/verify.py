"""Image -> the places that it can be, each with what the database holds there fitted to it.

A place that the symbols read so far allow is looked at again with all symbols that the database
says are in view, then its rivals under that fit, wherever in the database they are. Thesis 6.3.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.hypothesis import Hypothesis, log_likelihoods_at, shown_at
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import find_hypotheses, find_rivals
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.round import verify_on_round_faces
from recognizer.touch.settings import FitSettings
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.fit import Fit, fit_lattices, score_cells
from recognizer.touch.symbols.gain import Image, image_of_signal
from recognizer.touch.symbols.kernels import kernels_in_use
from recognizer.touch.symbols.refine import refine_lattices
from recognizer.touch.symbols.template import ResponseTemplate

Fitted = tuple[tuple[Image, tuple[Fit, ...]], ...]


def verify_hypotheses(
    reader: PreparedLab, signal: Signal, effort: FitSettings
) -> list[VerifiedHypothesis]:
    """Return the verified places over all arrays of the lab, best first."""
    found: list[VerifiedHypothesis] = []
    fitted = fit_touch(reader, signal, effort)
    for (embossed, template, bank), (image, fits) in zip(reader.prepared, fitted, strict=True):
        found += _verify_on_flat_faces(image, embossed, template, fits)
        if embossed.radii_mm:
            found += verify_on_round_faces(image, reader.sensor, embossed, template, bank, effort)
    return sorted(found, key=lambda verified: -verified.score)


def fit_touch(reader: PreparedLab, signal: Signal, effort: FitSettings) -> Fitted:
    """Return for each array of a lab the image of a touch, and the lattices in it, best first.

    How sure these are is not told. What a try has fitted serves `diagnose`.
    """
    return _fit_images(reader, signal, effort, kernels_in_use())


@lru_cache(maxsize=2)
def _fit_images(reader: PreparedLab, signal: Signal, effort: FitSettings, _kernels: str) -> Fitted:
    return tuple(
        (image, fit_lattices(image, template, bank, effort, told=False))
        for image, (_, template, bank) in zip(
            _images_of(reader, signal), reader.prepared, strict=True
        )
    )


@lru_cache(maxsize=2)
def _images_of(reader: PreparedLab, signal: Signal) -> tuple[Image, ...]:
    return tuple(
        image_of_signal(reader.sensor, signal, embossed.style.height_mm, reader.settings)
        for embossed, _, _ in reader.prepared
    )


def _verify_on_flat_faces(
    image: Image, embossed: EmbossedArray, template: ResponseTemplate, fits: tuple[Fit, ...]
) -> list[VerifiedHypothesis]:
    """Return the likeliest places, best first, fitted to what the database holds there."""
    settings = image.settings.hypotheses
    candidates = _on_flat_faces(embossed, find_hypotheses(embossed, fits, settings))
    candidates = candidates[: settings.kept]
    if not candidates:
        return []
    near = [place.score > candidates[0].score - settings.near for place in candidates]
    candidates = candidates[: max(2, sum(near))]
    verified = _fit_hypotheses(image, embossed, template, candidates, fits)
    best = verified[0]
    rivals = find_rivals(embossed, best.fit, best.hypothesis, len(fits), settings)
    others = [
        place
        for place in _on_flat_faces(embossed, rivals)
        if place.score > best.score - settings.near
    ]
    if others:  # also such as were verified before, under a fit that is not as good
        everything = [replace(best.hypothesis, fit=len(fits)), *others]
        verified += _fit_hypotheses(image, embossed, template, everything, (*fits, best.fit))
    return sorted(verified, key=lambda one: -one.score)


def _on_flat_faces(embossed: EmbossedArray, found: list[Hypothesis]) -> list[Hypothesis]:
    """Return the places on flat faces; those on round ones are read with their bend."""
    if not embossed.radii_mm:
        return found
    return [place for place in found if embossed.face(place.face).round is None]


def _fit_hypotheses(
    image: Image,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    candidates: list[Hypothesis],
    fits: tuple[Fit, ...],
) -> list[VerifiedHypothesis]:
    """Return places with pose and gain fitted to their symbols, best first."""
    settings = image.settings.hypotheses
    starts = [fits[place.fit] for place in candidates]
    lattices = refine_lattices(
        image,
        template,
        np.array([fit.pose for fit in starts]),
        np.array([fit.gain for fit in starts]),
        steps=settings.steps,
        shown=shown_at(embossed, candidates),
    )
    again = score_cells(image, template, lattices)
    verified = []
    # a place is as likely as under the best of the fits that began where its own did: what one of
    # them missed of gain and sharpness is no word against the symbols
    own = np.array([place.fit for place in candidates])
    scores = np.full((len(candidates), len(candidates)), -np.inf)
    for n, fit in enumerate(again):
        alike = np.flatnonzero(own == own[n])
        places = [candidates[k] for k in alike.tolist()]
        scores[n, alike] = log_likelihoods_at(embossed, fit, places, settings)
    for n, (place, best) in enumerate(zip(candidates, scores.argmax(axis=0), strict=True)):
        score = float(scores[best, n])
        verified.append(VerifiedHypothesis(image, template, embossed, place, again[best], score))
    return sorted(verified, key=lambda one: -one.score)
