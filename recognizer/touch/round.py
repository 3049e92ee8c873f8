"""Touches of cylinders and cones: what a flat plate feels of a round face, and where it stands.

Image + encoding -> places on round faces, verified. A plate touches a round face along a line
and the face falls away to both sides. Three things differ from a flat face: the depth of the
plate (`symbols.gain.bent`), where in the unrolled plane a tactel looks, and how the place tells
the bend. The image tells roughly along which line and under which radius it lies
(`symbols.bent`); symbols are read under that, and each place that they can be is verified under
the bend that the face has there. Thesis 6.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import Bend
from probe.sensor import SensorType
from recognizer.touch.belief import BeliefSettings
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import (
    Hypothesis,
    find_hypotheses,
    find_rivals,
    labels_at,
    log_likelihood,
)
from recognizer.touch.pose import face_pose
from recognizer.touch.symbols.bends import guess_bends
from recognizer.touch.symbols.fit import Fit, FitSettings, fit_lattices, score_cells
from recognizer.touch.symbols.gain import Image, bend_image
from recognizer.touch.symbols.refine import initial_lattices, refine_lattices
from recognizer.touch.symbols.search import Bank
from recognizer.touch.symbols.template import ResponseTemplate

Ints = NDArray[np.int64]

BENDS, THOROUGH_BENDS = 2, 5  #: that an image is read under
#: Several bends see to what several gains do for a flat face.
EACH_BEND = FitSettings(candidates=8, steps=3, finalists=3, final_steps=4)
#: Factors by which a face is taken to fall away less: a force law that rises less than the one
#: that is taken makes a strip look so.
SHARES = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
#: Of the rounds of verifying a place: its fit moves the bend, and the bend the fit.
ROUNDS = ((0.65, 0.8, 1.0), SHARES)
TURNED_RAD = 0.5  #: by which the lines at a place may differ from those that the image shows
RADII = 2.5  #: factor by which radii may
SAME_RAD, SAME_RADII = 0.05, 1.1  #: within which two bends are taken as one


@dataclass(frozen=True, slots=True, eq=False)
class RoundHypothesis:
    """A place on a round face that was verified."""

    image: Image  #: under the bend at the place
    bend: Bend  #: in the axes of the sensor
    hypothesis: Hypothesis
    fit: Fit
    score: float  #: log-likelihood of the image, nats


def verify_on_round_faces(
    image: Image,
    sensor: SensorType,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    bank: Bank,
    settings: FitSettings,
    final: FitSettings,
    limits: BeliefSettings,
) -> list[RoundHypothesis]:
    """Return the likeliest places on round faces.

    Parameters
    ----------
    image
        As of a flat face.
    settings, final
        Of the fits, and of scoring what was verified.
    limits
        How many places are verified.
    """
    keep = BENDS
    if settings.crossed:
        keep, settings = THOROUGH_BENDS, EACH_BEND
    shown: list[Fit] = []
    under: list[Bend] = []
    for guess in guess_bends(image, sensor, embossed.radii_mm, template.ink, keep):
        seen = fit_lattices(
            bend_image(image, sensor, guess.bend), template, bank, settings, [guess.gain]
        )
        shown += seen
        under += [guess.bend] * len(seen)
    candidates = [
        hypothesis
        for hypothesis in find_hypotheses(embossed, tuple(shown), limits.places)
        if _is_compatible(embossed, hypothesis, shown[hypothesis.fit], under[hypothesis.fit])
    ][: limits.places]
    near = [hypothesis.score > candidates[0].score - limits.near for hypothesis in candidates]

    def verified(hypothesis: Hypothesis, fit: Fit) -> list[RoundHypothesis]:
        one = _verify(image, sensor, embossed, template, hypothesis, fit, final, limits)
        return [] if one is None else [one]

    found: list[RoundHypothesis] = []
    for hypothesis in candidates[: max(2, sum(near))]:
        found += verified(hypothesis, shown[hypothesis.fit])
    found = [_under_best_fit(embossed, one, found) for one in found]
    if found:
        best = max(found, key=lambda one: one.score)
        for hypothesis in find_rivals(
            embossed, best.fit, best.hypothesis, len(shown), limits.places
        ):
            if hypothesis.score > best.score - limits.near and _is_compatible(
                embossed, hypothesis, best.fit, best.bend
            ):
                found.append(
                    RoundHypothesis(best.image, best.bend, hypothesis, best.fit, hypothesis.score)
                )
                found += verified(hypothesis, best.fit)
    return found


def bend_at(embossed: EmbossedArray, hypothesis: Hypothesis, fit: Fit) -> Bend | None:
    """Return the bend of the face at a place, in the axes of the sensor; None on a flat face."""
    if not embossed.radii_mm:
        return None
    face = embossed.face(hypothesis.face)
    if face.round is None or face.round.surface.concave:
        return None
    pose = face_pose(embossed, face, hypothesis, fit)
    turn = math.atan2(pose[1, 0], pose[0, 0])
    return face.round.bend(float(pose[0, 3]), float(pose[1, 3])).turned(turn)


def _is_compatible(embossed: EmbossedArray, hypothesis: Hypothesis, fit: Fit, under: Bend) -> bool:
    """Whether a place has about the bend under which its symbols were read."""
    bend = bend_at(embossed, hypothesis, fit)
    return bend is not None and _alike(bend, under, TURNED_RAD, RADII)


def _alike(a: Bend, b: Bend, turn_rad: float, factor: float) -> bool:
    turn = abs(math.remainder(a.towards_rad - b.towards_rad, math.pi))
    return turn < turn_rad and 1 / factor < a.radius_mm / b.radius_mm < factor


def _verify(
    image: Image,
    sensor: SensorType,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    hypothesis: Hypothesis,
    fit: Fit,
    final: FitSettings,
    limits: BeliefSettings,
) -> RoundHypothesis | None:
    """Return a place with pose and gain fitted to its symbols under its bend; None if flat."""

    def shown(cells: Ints) -> Ints:
        labels = np.stack([labels_at(embossed, hypothesis, one) for one in cells])
        return np.where(labels == embossed.array.order, -1, labels)

    found = None
    for shares in ROUNDS:
        bend = bend_at(embossed, hypothesis, fit)
        if bend is None:
            return None
        several = bend_image(image, sensor, bend, shares)
        start = initial_lattices(
            np.tile(fit.pose, (len(shares), 1)), np.tile(fit.gain, (len(shares), 1))
        )
        lattices = refine_lattices(several, template, start, steps=limits.verify_steps, shown=shown)
        each = score_cells(several, template, lattices, final)
        values = [log_likelihood(embossed, one, hypothesis) for one in each]
        best = int(np.argmax(values))
        fit = each[best]
        seen = bend_image(image, sensor, bend, shares[best : best + 1])
        found = RoundHypothesis(seen, bend, hypothesis, fit, values[best])
    return found


def _under_best_fit(
    embossed: EmbossedArray, one: RoundHypothesis, found: list[RoundHypothesis]
) -> RoundHypothesis:
    """Return a place under the best of the fits that began where its own did, and bend as it does.

    What one of them missed of gain and sharpness is no word against the symbols.
    """
    best = one
    for other in found:
        if other.hypothesis.fit != one.hypothesis.fit:
            continue
        if not _alike(other.bend, one.bend, SAME_RAD, SAME_RADII):
            continue
        score = log_likelihood(embossed, other.fit, one.hypothesis)
        if score > best.score:
            best = RoundHypothesis(other.image, other.bend, one.hypothesis, other.fit, score)
    return best
