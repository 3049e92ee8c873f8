"""Which touches are searched for widely, after a first search. Thesis 6.3.

A wide search costs five times the first. It hardly changes the answer where the first one is sure;
where symbols explain the image and are so few that they stand elsewhere as well; where fewer
tactels are pressed than symbols that name a place would press; or where no strokes show. What the
first search found says little of a touch that it got wrong: whether its symbols agree and explain
the image is not asked.

Strokes show where weak readings lie within a pitch of the strongest ones: next to a stroke the
sensor hangs over the bare face. A blank plate presses evenly; but so may symbols along the tactels'
rows that are pressed hard. So a plate is refused at once only where it is far evener than symbols
ever were; between, a wide search is left out.

Chosen on 800 touches of the forty objects with `tactel-8` (own engine, seed 4101: amid faces, soft,
at edges and in corners): a first search answers 616, a wide one is made for 141 and makes 31 right.
"""

from __future__ import annotations

import math

from recognizer.touch.chance import LEAST_SHARE
from recognizer.touch.evidence import VerifiedHypothesis, symbols_to_name
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.prepare import PreparedLab
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, Recognition
from recognizer.touch.signal import Signal, mean_of_strongest, quantile, sorted_around

PRESSED = 0.15  #: share of the strongest readings from which a tactel is pressed
AROUND = 5  #: tactels, side of a square in which strokes and gaps lie
HIGH = 0.85  #: quantile of its readings that stands for strokes
WEAK = 0.35  #: share of that below which a tactel lies over a gap
#: Share of such tactels below which no strokes show: of 30,777 touches of a blank plate nine in ten
#: show fewer than .27 (seed 22), of 682 amid a face, along its rows, at 160 N six fewer than .285
#: (seeds 11 and 12).
GAPS = 0.285
#: Share below which the surface is bare, and nothing is searched: of 4,000 touches of five labs
#: (three alphabets, 5 and 7 mm, along rows, up to 400 N; seed 6262) none shows fewer than .32, of
#: those of a blank plate two in three.
BARE = 0.25
FINEST, COARSEST = 3.1, 5.0  #: tactels, pitches between which gaps were measured
LEAST_BORDERS = LEAST_SHARE**2  #: share of places that a border of two lines leaves
INK = 0.44  #: share of a cell's tactels that its symbol presses, and some around it
DOUBT = 1e-3  #: of an answer that a better fit may bring below the limit
NEARLY_CHANCE = 1e-5  #: doubt above which an answer is confirmed


def may_find_more(
    reader: PreparedLab,
    signal: Signal,
    answer: Recognition,
    judged: Recognition,
    best: VerifiedHypothesis | None,
) -> bool:
    """Return whether a wide search may change the answer of a first one.

    `answer` and `judged` are those of the first search, before and after few symbols and chance
    were judged; `best` is the place of the answer.
    """
    if best is None:
        return True
    if reader.sensor.overlay.kind != "tab" or any(each.radii_mm for each in reader.lab.arrays):
        # a round face presses few tactels; an answer that chance nearly allows needs confirmation
        return not judged or judged.doubt is None or is_nearly_chance(judged)
    if answer:
        return judged.reason == BY_CHANCE and judged.doubt is not None and judged.doubt <= DOUBT
    inliers = best.evidence.inliers
    if answer.reason == AMBIGUOUS and inliers < symbols_to_name(best.embossed):
        return False  # the image is explained, and it shows no more
    return _may_show_symbols(reader, signal)


def is_nearly_chance(judged: Recognition) -> bool:
    """Return whether a wide search has to confirm an answer, as chance nearly allows it."""
    return judged.doubt is not None and judged.doubt > NEARLY_CHANCE


def shows_strokes(reader: PreparedLab, signal: Signal, least: float = GAPS) -> bool:
    """Return whether strokes show; True where the test was never calibrated (pads, pitches)."""
    sensor = reader.sensor
    if sensor.overlay.kind != "tab":
        return True
    pitches = [each.style.pitch_mm / sensor.pitch_mm for each in reader.lab.arrays]
    if min(pitches) < FINEST or max(pitches) > COARSEST:
        return True
    return gap_share(signal) >= least


def gap_share(signal: Signal) -> float:
    """Return the share of the tactels next to strong ones that read little."""
    forces = signal.forces * signal.trust
    near = quantile(sorted_around(forces, AROUND, mode="edge"), HIGH)
    adjacent = (near > _pressed_from(signal)) & (signal.trust > 0)
    weak = adjacent & (forces < WEAK * near)
    return float(weak.sum()) / max(int(adjacent.sum()), 1)


def pressed_tactels(signal: Signal) -> int:
    """Return how many tactels are pressed by strokes."""
    return int((signal.forces * signal.trust > _pressed_from(signal)).sum())


def _may_show_symbols(reader: PreparedLab, signal: Signal) -> bool:
    """Return whether strokes show, and as many tactels are pressed as symbols that name a place."""
    least = min(_tactels_to_name(reader, each) for each in reader.lab.arrays)
    return shows_strokes(reader, signal) and pressed_tactels(signal) >= least


def _pressed_from(signal: Signal) -> float:
    return PRESSED * mean_of_strongest(signal.forces * signal.trust)


def _tactels_to_name(reader: PreparedLab, embossed: EmbossedArray) -> float:
    """Return how many tactels the symbols press that name one of the registered cells surely."""
    matches = len(embossed.keys) / reader.options.doubt * LEAST_BORDERS
    cell = (embossed.style.pitch_mm / reader.sensor.pitch_mm) ** 2
    return INK * cell * math.log(max(matches, 1.0), embossed.array.order)
