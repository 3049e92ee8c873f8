"""Touches of cylinders and cones: what a flat plate feels of a round face, and where it stands.

Image + array -> hypotheses on round faces, verified. A plate touches a round face along a line
and the face falls away to both sides. Three things differ from a flat face: the depth of the
plate (`symbols.gain.bend_image`), where in the unrolled plane a tactel looks, and how the place
tells the bend. The image tells roughly along which line and under which radius it lies
(`symbols.bends`); symbols are read under that, and each place that they can be is verified under
the bend that the face has there. Thesis 6.3.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.hypothesis import Hypothesis, log_likelihood, shown_at
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.locate import find_hypotheses, find_rivals
from recognizer.touch.pose import face_pose
from recognizer.touch.settings import FitSettings, RoundSettings
from recognizer.touch.symbols.bends import guess_bends
from recognizer.touch.symbols.fit import Fit, fit_lattices, score_cells
from recognizer.touch.symbols.gain import Image, bend_image
from recognizer.touch.symbols.refine import refine_lattices
from recognizer.touch.symbols.search import Bank
from recognizer.touch.symbols.template import ResponseTemplate


def verify_on_round_faces(
    image: Image,
    sensor: SensorType,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    bank: Bank,
    effort: FitSettings,
) -> list[VerifiedHypothesis]:
    """Return the likeliest places on round faces.

    Parameters
    ----------
    image
        As of a flat face.
    effort
        Of the fits.
    """
    settings, limits = image.settings.round, image.settings.hypotheses
    keep = settings.bends
    if effort.crossed:
        keep, effort = settings.thorough_bends, settings.each_bend
    fits: list[Fit] = []
    under: list[Bend] = []
    for guess in guess_bends(image, sensor, embossed.radii_mm, template.ink, keep):
        bent = bend_image(image, sensor, guess.bend)
        seen = fit_lattices(bent, template, bank, effort, [guess.gain])
        fits += seen
        under += [guess.bend] * len(seen)
    candidates = [
        place
        for place in find_hypotheses(embossed, tuple(fits), limits)
        if _is_compatible(embossed, place, fits[place.fit], under[place.fit], settings)
    ][: limits.kept]
    near = [place.score > candidates[0].score - limits.near for place in candidates]

    def verified(place: Hypothesis, fit: Fit) -> list[VerifiedHypothesis]:
        one = _verify(image, sensor, embossed, template, place, fit)
        return [] if one is None else [one]

    found: list[VerifiedHypothesis] = []
    for place in candidates[: max(2, sum(near))]:
        found += verified(place, fits[place.fit])
    found = [_under_best_fit(one, found) for one in found]
    if found:
        best = max(found, key=lambda one: one.score)
        rivals = find_rivals(embossed, best.fit, best.hypothesis, len(fits), limits)
        for place in rivals:
            if place.score > best.score - limits.near and _is_compatible(
                embossed, place, best.fit, best.bend, settings
            ):
                found.append(replace(best, hypothesis=place, score=place.score))
                found += verified(place, best.fit)
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


def _is_compatible(
    embossed: EmbossedArray,
    hypothesis: Hypothesis,
    fit: Fit,
    under: Bend | None,
    settings: RoundSettings,
) -> bool:
    """Whether a place has about the bend under which its symbols were read."""
    bend = bend_at(embossed, hypothesis, fit)
    return _same_bend(bend, under, settings.turned_rad, settings.radii)


def _same_bend(a: Bend | None, b: Bend | None, turn_rad: float, factor: float) -> bool:
    if a is None or b is None:
        return False
    turn = abs(math.remainder(a.towards_rad - b.towards_rad, math.pi))
    return turn < turn_rad and 1 / factor < a.radius_mm / b.radius_mm < factor


def _verify(
    image: Image,
    sensor: SensorType,
    embossed: EmbossedArray,
    template: ResponseTemplate,
    hypothesis: Hypothesis,
    fit: Fit,
) -> VerifiedHypothesis | None:
    """Return a place with pose and gain fitted to its symbols under its bend; None if flat.

    In two rounds: the fit moves the bend, and the bend the fit.
    """
    settings, limits = image.settings.round, image.settings.hypotheses
    found = None
    for shares in (settings.first_shares, settings.shares):
        bend = bend_at(embossed, hypothesis, fit)
        if bend is None:
            return None
        several = bend_image(image, sensor, bend, shares)
        lattices = refine_lattices(
            several,
            template,
            np.tile(fit.pose, (len(shares), 1)),
            np.tile(fit.gain, (len(shares), 1)),
            steps=limits.steps,
            shown=shown_at(embossed, [hypothesis] * len(shares)),
        )
        each = score_cells(several, template, lattices)
        scores = [log_likelihood(embossed, one, hypothesis, limits) for one in each]
        best = int(np.argmax(scores))
        fit = each[best]
        seen = bend_image(image, sensor, bend, shares[best : best + 1])
        found = VerifiedHypothesis(seen, template, embossed, hypothesis, fit, scores[best], bend)
    return found


def _under_best_fit(one: VerifiedHypothesis, found: list[VerifiedHypothesis]) -> VerifiedHypothesis:
    """Return a place under the best of the fits that began where its own did, and bend as it does.

    What one of them missed of gain and sharpness is no word against the symbols.
    """
    settings, limits = one.image.settings.round, one.image.settings.hypotheses
    best = one
    for other in found:
        if other.hypothesis.fit != one.hypothesis.fit:
            continue
        if not _same_bend(other.bend, one.bend, settings.same_rad, settings.same_radii):
            continue
        score = log_likelihood(one.embossed, other.fit, one.hypothesis, limits)
        if score > best.score:
            best = replace(other, hypothesis=one.hypothesis, score=score)
    return best
