"""What a touch can show at all, told before symbols are searched for widely.

Signal -> whether strokes show: beside them the sensor hangs over the bare face, so that within a
pitch of the strongest readings lie weak ones. A blank plate presses evenly; so may symbols that
stand along the tactels' rows and are pressed hard, so nothing is refused for it before a search.

Signal and what the first try found -> whether a wider search can change the answer. It hardly can
where the first try is sure; where symbols explain the image and are so few that they stand
elsewhere as well; where fewer tactels are pressed than the symbols would press that it takes to
name a place; where hardly a symbol agrees with the best place, or no strokes show; where the image
speaks for symbols of no registered place; and where symbols of a place are plainly there and most
of the image is something else. Nor is an answer that few places match by chance looked at again
where the image speaks plainly for its symbols. Thesis 6.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.around import mean_of_strongest, quantile
from recognizer.touch.belief import VerifiedHypothesis, symbols_to_name
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, TOO_FEW, Recognition
from recognizer.touch.settings import FirstLookSettings
from recognizer.touch.signal import Signal
from recognizer.touch.verdict import MANY_INLIERS, Evidence

Array = NDArray[np.float64]


def shows_strokes(reader: PreparedLab, signal: Signal) -> bool:
    """Return whether strokes show; true wherever that is not known to be told."""
    settings, sensor = reader.settings.first_look, reader.sensor
    if sensor.overlay.kind != "tab":
        return True  # a pad smears what lies between strokes
    pitches = [each.style.pitch_mm / sensor.pitch_mm for each in reader.lab.arrays]
    finest, coarsest = min(pitches), max(pitches)
    if finest < settings.finest or coarsest > settings.coarsest:
        return True
    return gap_share(signal, settings) >= settings.gaps


def gap_share(signal: Signal, settings: FirstLookSettings) -> float:
    """Return which share of the tactels that lie beside strong ones feel little."""
    forces = signal.forces * signal.trust
    reach = settings.around // 2
    rows, columns = (np.arange(-reach, n + reach).clip(0, n - 1) for n in forces.shape)
    windows = np.lib.stride_tricks.sliding_window_view(
        forces[rows[:, None], columns], (settings.around, settings.around)
    )
    ordered = np.sort(windows.reshape(*forces.shape, -1), axis=-1)
    near = quantile(ordered, settings.high)
    beside = (near > _pressed_from(signal, settings)) & (signal.trust > 0)
    weak = beside & (forces < settings.weak * near)
    return float(weak.sum()) / max(int(beside.sum()), 1)


def may_tell_more(
    reader: PreparedLab,
    signal: Signal,
    answer: Recognition,
    judged: Recognition,
    best: VerifiedHypothesis | None,
    evidence: Evidence | None,
) -> bool:
    """Return whether a wide search may find what the first try has not.

    Parameters
    ----------
    answer, judged
        What the first try says; the same, or refused because few symbols say it.
    best, evidence
        The hypothesis that was judged, and what speaks for it; None: there was none.
    """
    arrays = reader.lab.arrays
    if best is None or evidence is None:
        return True
    if answer and evidence.inliers >= MANY_INLIERS:
        return False
    if reader.sensor.overlay.kind != "tab" or any(each.radii_mm for each in arrays):
        return True  # what few symbols say is confirmed; on a round face few tactels are pressed
    if answer:
        return not judged and _is_nearly_sure(judged, reader.settings.first_look)
    if answer.reason == AMBIGUOUS and evidence.inliers < symbols_to_name(best.embossed):
        return False  # the image is explained, and it shows no more
    if answer.reason == TOO_FEW:
        return False
    return _is_unexplained(reader, signal, evidence)


def may_be_chance(reader: PreparedLab, judged: Recognition, evidence: Evidence) -> bool:
    """Return whether a wide search had better look at an answer again."""
    settings = reader.settings
    if judged.doubt is None or judged.doubt <= settings.belief.looked_at_again:
        return False
    return evidence.log_likelihood_ratio < settings.first_look.plain


def _is_nearly_sure(judged: Recognition, settings: FirstLookSettings) -> bool:
    """Return whether little is missing to the answer that few symbols give."""
    if judged.reason == BY_CHANCE:
        return judged.doubt is not None and judged.doubt <= settings.doubt
    if judged.reason == AMBIGUOUS:
        return judged.margin is not None and judged.margin >= settings.margin
    return False


def _is_unexplained(reader: PreparedLab, signal: Signal, evidence: Evidence) -> bool:
    """Return whether symbols are pressed that are those of a place, or may be under another fit."""
    settings = reader.settings.first_look
    if evidence.inliers < settings.agreed or evidence.log_likelihood_ratio < settings.foreign:
        return False
    if not shows_strokes(reader, signal):
        return False
    least = min(_tactels_to_name(reader, each, settings) for each in reader.lab.arrays)
    if pressed_tactels(signal, settings) < least:
        return False
    return (
        evidence.log_likelihood_ratio < settings.plain or evidence.explained >= settings.explained
    )


def pressed_tactels(signal: Signal, settings: FirstLookSettings) -> int:
    """Return how many tactels are pressed by strokes."""
    return int((signal.forces * signal.trust > _pressed_from(signal, settings)).sum())


def _pressed_from(signal: Signal, settings: FirstLookSettings) -> float:
    return settings.pressed * mean_of_strongest(signal.forces * signal.trust, settings.strongest)


def _tactels_to_name(
    reader: PreparedLab, embossed: EmbossedArray, settings: FirstLookSettings
) -> float:
    """Return how many tactels the symbols press that can name one of the registered cells."""
    cell = (embossed.style.pitch_mm / reader.sensor.pitch_mm) ** 2
    return settings.ink * cell * symbols_to_name(embossed)
