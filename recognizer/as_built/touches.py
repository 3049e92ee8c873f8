"""Touches of a recording -> strain and stroke width of the print under each."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from probe.calibration import Calibration
from recognizer.as_built.estimate import MeasuredPrint
from recognizer.errors import AsBuiltError
from recognizer.touch.evidence import VerifiedHypothesis
from recognizer.touch.lab import EncodedFace
from recognizer.touch.options import ReaderOptions
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch
from recognizer.touch.source import TouchImage
from recognizer.touch.symbols.stretch import fit_stretch

Array = NDArray[np.float64]

#: Options of a reader that accepts prints farther off than usual.
WIDE_SCALE = ReaderOptions(scale_sd=0.04, scale_most=0.12)


def measure_prints(
    reader: Reader,
    touches: Iterable[TouchImage],
    *,
    calibration: Calibration | None = None,
    place: str = "",
) -> tuple[MeasuredPrint, ...]:
    """Return the print under every touch that is recognised by a reader with `WIDE_SCALE`.

    `place` is that of the touches, for messages.

    Raises
    ------
    AsBuiltError
        Nothing is recognised, or several objects are; or only round faces, whose strain cannot be
        separated from their curvature.
    """
    found: list[MeasuredPrint] = []
    reasons: Counter[str] = Counter()
    for touch in touches:
        signal = reader.signal(touch.counts, calibration=calibration)
        reading = read_touch(reader, signal, touch.seq)
        answer, verified = reading.answer, reading.best
        if not answer or verified is None:
            reasons[answer.reason] += 1
            continue
        face = verified.embossed.face(verified.hypothesis.face)
        if face.round is not None:
            reasons["on a round face"] += 1
        elif face.T_part_face is None:
            reasons["of an object without a registered part"] += 1
        else:
            found.append(_fit_print(verified, face, face.T_part_face, touch.seq))
    if not found:
        number = sum(reasons.values())
        why = ", ".join(f"{count} {reason}" for reason, count in reasons.most_common())
        raise AsBuiltError(
            f"none of {number} touches tells of a print: {why}" if number else "no touch",
            fix="record 25-50 touches of flat faces of one part that is in this database; what is "
            "more than 10 % off cannot be read",
            place=place,
        )
    objects = Counter(one.object for one in found)
    if len(objects) > 1:
        names = ", ".join(f"{name} ({count})" for name, count in objects.most_common())
        raise AsBuiltError(
            f"touches of {len(objects)} objects: {names}",
            fix="give a recording of one object at a time",
            place=place,
        )
    return tuple(found)


def _fit_print(
    verified: VerifiedHypothesis, face: EncodedFace, T_part_face: Array, seq: int
) -> MeasuredPrint:
    fit = verified.fit
    lattice = fit_stretch(verified.image, fit.pose, fit.gain, verified.labels_at)
    c, s = math.cos(face.rotation_rad), math.sin(face.rotation_rad)
    # the lattice's axes are the face's, turned by `rotation_rad`
    by = np.eye(4)
    by[:3, :3] = [
        [c * c, s * s, 2 * c * s],
        [s * s, c * c, -2 * c * s],
        [-c * s, c * s, c * c - s * s],
    ]
    return MeasuredPrint(
        seq=seq,
        object=face.object,
        face=face.face,
        part=face.part,
        axes=T_part_face[:2, :2],
        strain=by[:3, :3] @ lattice.strain,
        stroke_mm=verified.embossed.style.stroke_mm + lattice.wider_mm,
        covariance=by @ lattice.covariance @ by.T,
    )
