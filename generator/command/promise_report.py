"""What is said of the share of touches that each face promises to answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from generator.layout.recognition_rate import LOW, NOT_READABLE, RecognitionRate
from generator.pipeline.faces import FaceReport

NAMED = 3  #: kinds of faces that are named one by one


def promise_lines(faces: Sequence[FaceReport]) -> list[str]:
    """Return a line on an object, and one on each kind of face that answers too little."""
    promised = [(face, face.promise) for face in faces if face.promise is not None]
    if not promised:
        return []
    area = sum(face.area_mm2 for face, _ in promised)
    share = sum(face.area_mm2 * promise.at_once for face, promise in promised) / area
    later = [face.area_mm2 * promise.within_three for face, promise in promised
             if promise.within_three is not None]  # fmt: skip
    within = f", {_percent(sum(later) / area)} within three" if later else ""
    lines = [f"  {_percent(share)} of touches are answered at once{within}"]
    alike: dict[tuple[str, ...], list[FaceReport]] = {}
    for face, promise in sorted(promised, key=lambda one: one[1].at_once):
        if promise.at_once < LOW:
            key = f"{min(face.size_mm):.3g}", _why(face, promise), promise.remedy
            alike.setdefault(key, []).append(face)
    lines += [_low_text(key[1], key[2], some) for key, some in list(alike.items())[:NAMED]]
    if rest := [face.name for some in list(alike.values())[NAMED:] for face in some]:
        lines.append(f"  fewer than half of the touches on {', '.join(rest)} too")
    return lines


def _why(face: FaceReport, promise: RecognitionRate) -> str:
    """Return why a face answers less than half of its touches."""
    if not face.symbols:
        return "not readable: it is blank"
    if promise.one_row:
        return "not readable by single touches: one row of symbols"
    return "not readable by single touches" if promise.at_once < NOT_READABLE else ""


def _low_text(why: str, remedy: str, faces: Sequence[FaceReport]) -> str:
    """Return what is said of faces as narrow as the first of them."""
    promises = [face.promise for face in faces if face.promise is not None]
    shares = [promise.at_once for promise in promises]
    share = f"{_range(shares)} of touches are answered at once"
    later = [one.within_three for one in promises if one.within_three is not None]
    share += f", {_range(later)} within three" if later else ""
    others = f" (and {', '.join(f.name for f in faces[1:])}, as narrow)" if faces[1:] else ""
    said = why if not max(shares) else f"{why}; {share}" if why else share
    help_ = f"; would help: {remedy}" if remedy else ""
    return f"  {faces[0].name}, {faces[0].place}{others}: {said}{help_}"


def face_values(face: FaceReport) -> dict[str, Any]:
    """Return what is known of a face as plain values."""
    values = asdict(face)
    if face.promise is not None:
        values["promise"] = {
            "at_once": face.promise.at_once,
            "within_three": face.promise.within_three,
            "one_row": face.promise.one_row,
            "remedy": face.promise.remedy,
        }
    return values


def _range(shares: Sequence[float]) -> str:
    low, high = _percent(min(shares)), _percent(max(shares))
    return high if low == high else f"{low} to {high}"


def _percent(share: float) -> str:
    """Return a share in per cent, never as all or none where it is not."""
    if 0 < share < 0.01:
        return "under 1 %"
    return "over 99 %" if 0.99 < share < 1 else f"{share:.0%}".replace("%", " %")
