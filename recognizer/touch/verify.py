"""Image -> its possible places, each with the registered symbols fitted to it. Thesis 6.3.

A place that the symbols allow is fitted again with all registered symbols in view, then its rivals
under that fit, wherever in the database they are.

A plate touches a round face along a line, and the face falls away to both sides. Three things
differ from a flat face: the depth of the plate (`image.bend_image`), the point of the unrolled
plane under a tactel, and that the place decides the curvature. The image shows roughly along which
line and under which radius it lies (`symbols.curvature`); symbols are read under that, and each
place is verified under the curvature that the face has there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.evidence import VerifiedHypothesis
from recognizer.touch.hypothesis import (
    KEPT,
    NEAR,
    Hypothesis,
    find_hypotheses,
    find_rivals,
    labels_at,
    log_likelihood,
    log_likelihoods_at,
)
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.options import Effort
from recognizer.touch.pose import face_pose
from recognizer.touch.prepare import Prepared, PreparedLab
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.curvature import CurvatureGuess, guess_curvatures
from recognizer.touch.symbols.fit import (
    CoarseSearch,
    Fit,
    fit_lattices,
    refine_lattices,
    score_cells,
    search_image,
)
from recognizer.touch.symbols.image import Image, balanced_gain, bend_image

STEPS = 4  #: of damped least squares, of a place with known symbols

# Of round faces; docs/recognizer.md has what they read.
CURVATURES = 2  #: curvatures that an image is read under
THOROUGH_CURVATURES = 5  #: in the second search, ...
#: ... each with this effort: several curvatures do what several gains do on a flat face
EACH_CURVATURE = Effort(candidates=8, steps=3, finalists=3, final_steps=4)
#: Factors by which a face is taken to fall away less: a force law that rises less than the one that
#: is taken makes a strip look so.
SHARES = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
FIRST_SHARES = (0.65, 0.8, 1.0)  #: of the first round of verifying
TURNED_RAD = 0.5  #: by which lines at a place may differ from those that the image shows
RADIUS_FACTOR = 2.5  #: by which radii may
SAME_RAD = 0.05  #: within which two curvatures are one
SAME_FACTOR = 1.1


@dataclass(frozen=True, eq=False)
class ArrayImage:
    """One touch against one array; coarse searches and first fits serve all stages."""

    reader: PreparedLab
    prepared: Prepared
    signal: Signal
    _fits: dict[Effort, tuple[Fit, ...]] = field(default_factory=dict)
    _curved: list[tuple[Image, CoarseSearch]] = field(default_factory=list)

    @cached_property
    def image(self) -> Image:
        """The image, its face taken as flat."""
        return self.reader.image(self.signal, self.prepared)

    @cached_property
    def searches(self) -> tuple[CoarseSearch, ...]:
        """Its coarse searches."""
        return search_image(self.image, self.prepared.bank)

    def fits(self, effort: Effort) -> tuple[Fit, ...]:
        """Return the lattices in the image, best first; without covariances."""
        if effort not in self._fits:
            bank, searches = self.prepared.bank, self.searches
            balanced = balanced_gain(self.image) if effort.again else None
            if balanced is not None:
                searches += search_image(self.image, bank, [balanced])
            self._fits[effort] = fit_lattices(
                self.image, bank, effort, searches, with_covariance=False
            )
        return self._fits[effort]

    @cached_property
    def curvatures(self) -> list[CurvatureGuess]:
        """Possible curvatures of the touch, likeliest first."""
        embossed = self.prepared.embossed
        return guess_curvatures(
            self.image, self.reader.sensor, embossed.radii_mm, THOROUGH_CURVATURES
        )

    def curved(self, number: int) -> tuple[Image, CoarseSearch]:
        """Return the image under a curvature, and its coarse search."""
        while len(self._curved) <= number:
            guess = self.curvatures[len(self._curved)]
            bent = bend_image(self.image, self.reader.sensor, guess.bend)
            (coarse,) = search_image(bent, self.prepared.bank, [guess.gain])
            self._curved.append((bent, coarse))
        return self._curved[number]


@dataclass(frozen=True, eq=False)
class TouchImages:
    """One touch against all arrays of a lab."""

    reader: PreparedLab
    signal: Signal

    @cached_property
    def arrays(self) -> tuple[ArrayImage, ...]:
        """One image for each array."""
        return tuple(
            ArrayImage(self.reader, prepared, self.signal) for prepared in self.reader.prepared
        )


def verify_hypotheses(touch: TouchImages, effort: Effort) -> list[VerifiedHypothesis]:
    """Return the verified places over all arrays of the lab, best first."""
    found: list[VerifiedHypothesis] = []
    for one in touch.arrays:
        found += _verify_on_flat_faces(one.image, one.prepared.embossed, one.fits(effort))
        if one.prepared.embossed.radii_mm:
            found += verify_on_round_faces(one, effort)
    return sorted(found, key=lambda verified: -verified.score)


def _verify_on_flat_faces(
    image: Image, embossed: EmbossedArray, fits: tuple[Fit, ...]
) -> list[VerifiedHypothesis]:
    """Return the likeliest places, fitted to the registered symbols."""
    candidates = _near_best(_on_flat_faces(embossed, find_hypotheses(embossed, fits)))
    if not candidates:
        return []
    verified = _fit_hypotheses(image, embossed, candidates, fits)
    best = verified[0]
    rivals = find_rivals(embossed, best.fit, best.hypothesis, len(fits))
    others = [
        place for place in _on_flat_faces(embossed, rivals) if place.score > best.score - NEAR
    ]
    if others:  # also places that were verified before, under a fit that is not as good
        everything = [replace(best.hypothesis, fit=len(fits)), *others]
        verified += _fit_hypotheses(image, embossed, everything, (*fits, best.fit))
    return verified


def _near_best(candidates: list[Hypothesis]) -> list[Hypothesis]:
    """Return the candidates, best first, that are verified: two at least."""
    kept = candidates[:KEPT]
    return kept[: max(2, sum(place.score > kept[0].score - NEAR for place in kept))]


def _on_flat_faces(embossed: EmbossedArray, found: list[Hypothesis]) -> list[Hypothesis]:
    """Return the places on flat faces; those on round ones are read with their curvature."""
    if not embossed.radii_mm:
        return found
    return [place for place in found if embossed.face(place.face).round is None]


def _fit_hypotheses(
    image: Image, embossed: EmbossedArray, candidates: list[Hypothesis], fits: tuple[Fit, ...]
) -> list[VerifiedHypothesis]:
    """Return places with pose and gain fitted to their symbols, best first."""
    starts = [fits[place.fit] for place in candidates]
    lattices = refine_lattices(
        image,
        np.array([fit.pose for fit in starts]),
        np.array([fit.gain for fit in starts]),
        steps=STEPS,
        labels_at=labels_at(embossed, candidates),
    )
    again = score_cells(image, lattices)
    verified = []
    # a place is as likely as under the best of the fits that began where its own did: a fit that
    # misses gain and sharpness does not speak against the symbols
    own = np.array([place.fit for place in candidates])
    scores = np.full((len(candidates), len(candidates)), -np.inf)
    for n, fit in enumerate(again):
        alike = np.flatnonzero(own == own[n])
        places = [candidates[k] for k in alike.tolist()]
        scores[n, alike] = log_likelihoods_at(embossed, fit, places)
    for n, (place, best) in enumerate(zip(candidates, scores.argmax(axis=0), strict=True)):
        score = float(scores[best, n])
        verified.append(VerifiedHypothesis(embossed, place, again[best], score, image))
    return sorted(verified, key=lambda one: -one.score)


def verify_on_round_faces(touch: ArrayImage, effort: Effort) -> list[VerifiedHypothesis]:
    """Return the likeliest places on round faces."""
    image, sensor, embossed = touch.image, touch.reader.sensor, touch.prepared.embossed
    keep = CURVATURES
    if effort.again:
        keep, effort = THOROUGH_CURVATURES, EACH_CURVATURE
    fits: list[Fit] = []
    under: list[Bend] = []
    for number, guess in enumerate(touch.curvatures[:keep]):
        bent, coarse = touch.curved(number)
        seen = fit_lattices(bent, touch.prepared.bank, effort, [coarse], with_covariance=False)
        fits += seen
        under += [guess.bend] * len(seen)
    candidates = [
        place
        for place in find_hypotheses(embossed, tuple(fits))
        if _is_compatible(embossed, place, fits[place.fit], under[place.fit])
    ]

    def verified(place: Hypothesis, fit: Fit) -> list[VerifiedHypothesis]:
        one = _verify_under_curvature(image, sensor, embossed, place, fit)
        return [] if one is None else [one]

    found: list[VerifiedHypothesis] = []
    for place in _near_best(candidates):
        found += verified(place, fits[place.fit])
    found = [_under_best_fit(one, found) for one in found]
    if found:
        best = max(found, key=lambda one: one.score)
        for place in find_rivals(embossed, best.fit, best.hypothesis, len(fits)):
            if place.score > best.score - NEAR and _is_compatible(
                embossed, place, best.fit, best.bend
            ):
                found.append(replace(best, hypothesis=place, score=place.score))
                found += verified(place, best.fit)
    return found


def curvature_at(embossed: EmbossedArray, hypothesis: Hypothesis, fit: Fit) -> Bend | None:
    """Return the curvature of the face at a place, in the axes of the sensor; None if flat."""
    if not embossed.radii_mm:
        return None
    face = embossed.face(hypothesis.face)
    if face.round is None or face.round.surface.concave:
        return None
    pose = face_pose(embossed, face, hypothesis, fit)
    turn = math.atan2(pose[1, 0], pose[0, 0])
    return face.round.bend(float(pose[0, 3]), float(pose[1, 3])).turned(turn)


def _is_compatible(
    embossed: EmbossedArray, hypothesis: Hypothesis, fit: Fit, under: Bend | None
) -> bool:
    """Whether a place has about the curvature under which its symbols were read."""
    return _same_curvature(
        curvature_at(embossed, hypothesis, fit), under, TURNED_RAD, RADIUS_FACTOR
    )


def _same_curvature(a: Bend | None, b: Bend | None, turn_rad: float, factor: float) -> bool:
    if a is None or b is None:
        return False
    turn = abs(math.remainder(a.towards_rad - b.towards_rad, math.pi))
    return turn < turn_rad and 1 / factor < a.radius_mm / b.radius_mm < factor


def _verify_under_curvature(
    image: Image, sensor: SensorType, embossed: EmbossedArray, hypothesis: Hypothesis, fit: Fit
) -> VerifiedHypothesis | None:
    """Return a place with pose and gain fitted to its symbols under its curvature; None if flat.

    In two rounds: the fit moves the curvature, and the curvature the fit.
    """
    found = None
    for shares in (FIRST_SHARES, SHARES):
        bend = curvature_at(embossed, hypothesis, fit)
        if bend is None:
            return None
        several = bend_image(image, sensor, bend, shares)
        lattices = refine_lattices(
            several,
            np.tile(fit.pose, (len(shares), 1)),
            np.tile(fit.gain, (len(shares), 1)),
            steps=STEPS,
            labels_at=labels_at(embossed, [hypothesis] * len(shares)),
        )
        each = score_cells(several, lattices)
        scores = [log_likelihood(embossed, one, hypothesis) for one in each]
        best = int(np.argmax(scores))
        fit = each[best]
        seen = bend_image(image, sensor, bend, shares[best : best + 1])
        found = VerifiedHypothesis(embossed, hypothesis, fit, scores[best], seen, bend)
    return found


def _under_best_fit(one: VerifiedHypothesis, found: list[VerifiedHypothesis]) -> VerifiedHypothesis:
    """Return a place under the best of the fits that began where its own did, with its curvature.

    A fit that misses gain and sharpness does not speak against the symbols.
    """
    best = one
    for other in found:
        if other.hypothesis.fit != one.hypothesis.fit:
            continue
        if not _same_curvature(other.bend, one.bend, SAME_RAD, SAME_FACTOR):
            continue
        score = log_likelihood(one.embossed, other.fit, one.hypothesis)
        if score > best.score:
            best = replace(other, hypothesis=one.hypothesis, score=score)
    return best
