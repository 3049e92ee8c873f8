"""Frame -> Recognition: the stages of reading, one after another. Thesis 6.

    signal     forces and trust
    symbols    a few lattices with the scores of all cells
    locate     the places of the database that they can be
    verify     the best of them again, with the symbols that the database says are there
    pose       where the sensor stands on the face and on the object

The answer is given only if no other place explains the image nearly as well, if it explains
the image better than a surface with symbols of no registered place, and if the sensor's
centre lies on the face.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from probe.sensor import Sensor
from recognizer.belief import Support, Thresholds, naming, support
from recognizer.lab import Encoding, Lab
from recognizer.locate import (
    Place,
    neighbours,
    place_scores,
    places,
    rivals,
    shown_at,
    under_centre,
)
from recognizer.pose import face_covariance, face_pose, inside_mm, pose_on_object
from recognizer.recognition import (
    AMBIGUOUS,
    NO_CONTACT,
    NOT_ENCODED,
    OUTSIDE,
    TOO_FEW,
    Recognition,
    RunnerUp,
    refused,
)
from recognizer.round import round_places
from recognizer.signal import Signal
from recognizer.symbols.fit import Fit, Settings, fits, scored
from recognizer.symbols.gain import Image, image_of
from recognizer.symbols.pressing import pressing_of
from recognizer.symbols.refine import refined, started
from recognizer.symbols.search import Bank, bank_of
from recognizer.symbols.template import Template, template_of

Array = NDArray[np.float64]

#: For touches that the first try does not answer.
THOROUGH = Settings(candidates=12, steps=4, finalists=6, final_steps=6, crossed=3)


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """Everything that is prepared once for a lab and a sensor."""

    lab: Lab
    sensor: Sensor
    settings: Settings = field(default_factory=Settings)
    thorough: Settings = field(default_factory=lambda: THOROUGH)
    thresholds: Thresholds = field(default_factory=Thresholds)
    prepared: tuple[tuple[Encoding, Template, Bank], ...] = ()


def reader_for(
    lab: Lab,
    sensor: Sensor,
    settings: Settings | None = None,
    thresholds: Thresholds | None = None,
) -> Reader:
    """Return a reader with the templates of all encodings of a lab."""
    prepared = []
    for encoding in lab.encodings:
        template = template_of(encoding.alphabet, encoding.style, sensor)
        prepared.append((encoding, template, bank_of(template, sensor)))
    return Reader(
        lab=lab,
        sensor=sensor,
        settings=settings or Settings(),
        thresholds=thresholds or Thresholds(),
        prepared=tuple(prepared),
    )


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


def recognise(reader: Reader, signal: Signal, seq: int = 0) -> Recognition:
    """Return what one touch says."""
    return explained(reader, signal, seq)[0]


def explained(reader: Reader, signal: Signal, seq: int = 0) -> tuple[Recognition, Reading | None]:
    """Return what one touch says, and the reading that was judged; None where there is none."""
    if not signal.contact:
        return refused(seq, NO_CONTACT), None
    found = readings(reader, signal, reader.settings)
    answer, cells = _answer(reader, found, seq)
    if answer and cells >= reader.thresholds.many:
        return answer, found[0]
    # Spend more where it is needed: no answer yet, or one that few cells speak for.
    again = readings(reader, signal, reader.thorough)
    second, cells = _answer(reader, again, seq)
    if answer and second and not _same(found[0], again[0]):
        return refused(seq, AMBIGUOUS, margin=0.0, runner_up=answer.runner_up), again[0]
    if second and cells < reader.thresholds.many:
        second = _by_few(reader.thresholds, again[0].encoding, second, cells)
    return second, again[0] if again else None


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


def _answer(reader: Reader, found: list[Reading], seq: int) -> tuple[Recognition, int]:
    """Return what readings, best first, say together, and how many cells speak for it."""
    if not found:
        return refused(seq, TOO_FEW), 0
    best = found[0]
    other = next((r for r in found[1:] if not _same(best, r)), None)
    margin = math.inf if other is None else best.score - other.score
    runner_up = None
    if other is not None:
        face = other.encoding.face(other.place.face)
        runner_up = RunnerUp(face.object, face.face, _index(other))
    limits, speaks = reader.thresholds, best.support()
    reason = ""
    if not speaks.holds(limits):
        reason = NOT_ENCODED
    elif speaks.cells < limits.cells:
        reason = TOO_FEW
    elif margin < limits.margin:
        reason = AMBIGUOUS
    told = placed(
        best.encoding, best.fit, best.place, limits, seq,
        reason=reason, margin=margin, runner_up=runner_up,
    )  # fmt: skip
    return told, speaks.cells


def _by_few(limits: Thresholds, encoding: Encoding, told: Recognition, cells: int) -> Recognition:
    """Return an answer that few cells speak for, if they can name a place and do so plainly."""
    reason = ""
    if cells < naming(encoding):
        reason = TOO_FEW
    elif told.margin is not None and told.margin < limits.margin_by_few:
        reason = AMBIGUOUS
    if not reason:
        return told
    return refused(told.seq, reason, margin=told.margin, runner_up=told.runner_up)


def placed(
    encoding: Encoding,
    fit: Fit,
    place: Place,
    limits: Thresholds,
    seq: int,
    *,
    reason: str,
    margin: float,
    runner_up: RunnerUp | None,
) -> Recognition:
    """Return the answer at a place, or the refusal where there is a reason or no face."""
    if reason:
        return refused(seq, reason, margin=margin, runner_up=runner_up)
    face = encoding.face(place.face)
    pose = face_pose(encoding, face, place, fit)
    if inside_mm(face, float(pose[0, 3]), float(pose[1, 3])) < -limits.rim_mm:
        return refused(seq, OUTSIDE, margin=margin, runner_up=runner_up)
    return Recognition(
        seq=seq,
        object=face.object,
        face=face.face,
        index=under_centre(encoding, fit, place),
        T_face_probe=pose,
        T_object_probe=pose_on_object(face, pose),
        covariance=face_covariance(face, fit.covariance),
        margin=margin,
        runner_up=runner_up,
        reason="",
        noise=fit.noise,
    )


def _index(reading: Reading) -> tuple[int, int]:
    return under_centre(reading.encoding, reading.fit, reading.place)


def _same(a: Reading, b: Reading) -> bool:
    """Whether two readings say the same place, up to a cell's rounding."""
    if a.encoding is not b.encoding or a.place.face != b.place.face:
        return False
    return neighbours(a.encoding, _index(a), _index(b))
