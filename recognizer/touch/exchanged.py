"""Answers that may be those of a sensor whose halves are exchanged: a face read eight columns off.

Verified hypothesis -> whether a good part of the touch is left over: tactels are pressed where the
face has ended, or its symbols explain the image poorly. Another part may stand there, symbols may
be worn, the touch soft; or one half of the sensor shows what the other feels
(`recognizer.sensor.wiring`), and with the halves exchanged all of it lies on one face. Face
frame, mm.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.around import mean_of_strongest
from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.border import points_on_face
from recognizer.touch.pose import outline_of
from recognizer.touch.settings import ExchangedSettings
from recognizer.touch.signal import Signal

Scalar = TypeVar("Scalar", bound=np.generic)


def leaves_much(found: VerifiedHypothesis, settings: ExchangedSettings) -> bool:
    """Return whether a good part of a touch is left over by a hypothesis, and not for noise."""
    evidence, image = found.evidence(), found.image
    strongest = mean_of_strongest(image.forces * image.trust, settings.strongest)
    poorly = (
        evidence.log_likelihood_ratio < settings.surprise
        and evidence.explained < settings.explained
    )
    if poorly and strongest >= settings.soft * image.noise:
        return True
    return _lies_beside(found, settings.pressed * strongest, settings)


def exchange_halves(signal: Signal, axis: int) -> Signal:
    """Return a signal with the halves of its rows (axis 0) or of its columns (1) exchanged."""
    return replace(
        signal,
        forces=exchange_image(signal.forces, axis),
        trust=exchange_image(signal.trust, axis),
    )


def exchange_image(image: NDArray[Scalar], axis: int) -> NDArray[Scalar]:
    """Return an image (rows, columns) likewise."""
    return np.roll(image, image.shape[axis] // 2, axis)


def _lies_beside(found: VerifiedHypothesis, pressed: float, settings: ExchangedSettings) -> bool:
    """Return whether much of what is pressed so hard lies beyond the flat face of a hypothesis."""
    face, image = found.embossed.face(found.hypothesis.face), found.image
    if face.round is not None:
        return False
    points = points_on_face(found, face)[image.forces * image.trust > pressed]
    region = outline_of(face)
    outside = points[~region.contains(points)]
    least = settings.beside * len(points)
    if len(outside) < least:
        return False
    return bool((region.distance_mm(outside) > settings.beyond_mm).sum() >= least)
