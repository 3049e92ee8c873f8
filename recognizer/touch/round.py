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
from recognizer.touch.belief import Thresholds
from recognizer.touch.lab import Encoding
from recognizer.touch.locate import Place, place_scores, places, rivals, shown_at
from recognizer.touch.pose import face_pose
from recognizer.touch.symbols.bent import bends_of
from recognizer.touch.symbols.fit import Fit, Settings, fits, scored
from recognizer.touch.symbols.gain import Image, bent
from recognizer.touch.symbols.refine import refined, started
from recognizer.touch.symbols.search import Bank
from recognizer.touch.symbols.template import Template

Ints = NDArray[np.int64]

BENDS, THOROUGH_BENDS = 2, 5  #: that an image is read under
#: Several bends see to what several gains do for a flat face.
EACH_BEND = Settings(candidates=8, steps=3, finalists=3, final_steps=4)
#: Factors by which a face is taken to fall away less: a force law that rises less than the one
#: that is taken makes a strip look so.
SHARES = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
#: Of the rounds of verifying a place: its fit moves the bend, and the bend the fit.
ROUNDS = ((0.65, 0.8, 1.0), SHARES)
TURNED_RAD = 0.5  #: by which the lines at a place may differ from those that the image shows
RADII = 2.5  #: factor by which radii may
SAME_RAD, SAME_RADII = 0.05, 1.1  #: within which two bends are taken as one


@dataclass(frozen=True, slots=True, eq=False)
class RoundPlace:
    """A place on a round face that was verified."""

    image: Image  #: under the bend at the place
    bend: Bend  #: in the axes of the sensor
    place: Place
    fit: Fit
    score: float  #: log-likelihood of the image, nats


def round_places(
    image: Image,
    sensor: SensorType,
    encoding: Encoding,
    template: Template,
    bank: Bank,
    settings: Settings,
    final: Settings,
    limits: Thresholds,
) -> list[RoundPlace]:
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
    for guess in bends_of(image, sensor, encoding.radii_mm, template.ink, keep):
        seen = fits(bent(image, sensor, guess.bend), template, bank, settings, [guess.gain])
        shown += seen
        under += [guess.bend] * len(seen)
    candidates = [
        place
        for place in places(encoding, tuple(shown), limits.places)
        if _may_be(encoding, place, shown[place.fit], under[place.fit])
    ][: limits.places]
    near = [place.score > candidates[0].score - limits.near for place in candidates]

    def verified(place: Place, fit: Fit) -> list[RoundPlace]:
        one = _verified(image, sensor, encoding, template, place, fit, final, limits)
        return [] if one is None else [one]

    found: list[RoundPlace] = []
    for place in candidates[: max(2, sum(near))]:
        found += verified(place, shown[place.fit])
    found = [_fair(encoding, one, found) for one in found]
    if found:
        best = max(found, key=lambda one: one.score)
        for place in rivals(encoding, best.fit, best.place, len(shown), limits.places):
            if place.score > best.score - limits.near and _may_be(
                encoding, place, best.fit, best.bend
            ):
                found.append(RoundPlace(best.image, best.bend, place, best.fit, place.score))
                found += verified(place, best.fit)
    return found


def bend_at(encoding: Encoding, place: Place, fit: Fit) -> Bend | None:
    """Return the bend of the face at a place, in the axes of the sensor; None on a flat face."""
    if not encoding.radii_mm:
        return None
    face = encoding.face(place.face)
    if face.round is None or face.round.surface.concave:
        return None
    pose = face_pose(encoding, face, place, fit)
    turn = math.atan2(pose[1, 0], pose[0, 0])
    return face.round.bend(float(pose[0, 3]), float(pose[1, 3])).turned(turn)


def _may_be(encoding: Encoding, place: Place, fit: Fit, under: Bend) -> bool:
    """Whether a place has about the bend under which its symbols were read."""
    bend = bend_at(encoding, place, fit)
    return bend is not None and _near(bend, under, TURNED_RAD, RADII)


def _near(a: Bend, b: Bend, turn_rad: float, factor: float) -> bool:
    turn = abs(math.remainder(a.towards_rad - b.towards_rad, math.pi))
    return turn < turn_rad and 1 / factor < a.radius_mm / b.radius_mm < factor


def _verified(
    image: Image,
    sensor: SensorType,
    encoding: Encoding,
    template: Template,
    place: Place,
    fit: Fit,
    final: Settings,
    limits: Thresholds,
) -> RoundPlace | None:
    """Return a place with pose and gain fitted to its symbols under its bend; None if flat."""

    def shown(cells: Ints) -> Ints:
        labels = np.stack([shown_at(encoding, place, one) for one in cells])
        return np.where(labels == encoding.array.order, -1, labels)

    found = None
    for shares in ROUNDS:
        bend = bend_at(encoding, place, fit)
        if bend is None:
            return None
        several = bent(image, sensor, bend, shares)
        start = started(np.tile(fit.pose, (len(shares), 1)), np.tile(fit.gain, (len(shares), 1)))
        lattices = refined(several, template, start, steps=limits.verify_steps, shown=shown)
        each = scored(several, template, lattices, final)
        values = [place_scores(encoding, one, place) for one in each]
        best = int(np.argmax(values))
        fit = each[best]
        seen = bent(image, sensor, bend, shares[best : best + 1])
        found = RoundPlace(seen, bend, place, fit, values[best])
    return found


def _fair(encoding: Encoding, one: RoundPlace, found: list[RoundPlace]) -> RoundPlace:
    """Return a place under the best of the fits that began where its own did, and bend as it does.

    What one of them missed of gain and sharpness is no word against the symbols.
    """
    best = one
    for other in found:
        if other.place.fit != one.place.fit:
            continue
        if not _near(other.bend, one.bend, SAME_RAD, SAME_RADII):
            continue
        score = place_scores(encoding, other.fit, one.place)
        if score > best.score:
            best = RoundPlace(other.image, other.bend, one.place, other.fit, score)
    return best
