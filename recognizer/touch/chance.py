"""How many registered places a foreign surface would match as well by chance.

Fit + hypothesis + lab -> doubt, the E-value of sequence databases: the number of places times the
probability that random symbols (equally likely, independent) reach at least the hypothesis's score.
A clear cell contributes 1 / q, a soft one the share of symbols that score as well, a bare one 1. Of
bare cells only the places count whose own border agrees: a place with symbols where the face is
bare falls behind farther than the hypothesis. The probability is summed over all symbols of all
cells on a grid of nats, scores rounded up: it is too small only by what fitting pose and gain to
the registered symbols adds.

Where that leaves too large a doubt, the border of the face has to match as well
(`expected_by_border`). A foreign face that bears symbols of this pitch ends somewhere: it shows an
outline in whole cells and a distance from its end to the last symbols. With places p, their
outlines o(p), and the ways w that the border runs,

    doubt = sum over p of P(symbols of o(p) score as well) x product over w of share(w),

share(w) the share of ends within half a pitch that fit as well (`share_of_borders`). Between two
labs whose parts have the same sizes the shares are no evidence: doubt is then too small, at most by
the 16 that two ways of a quarter each give. A bare cell costs others only as far as a symbol there
would surely be pressed.

A plate over the edge of a face tips and comes down on the bare face up to its very end; tactels
beyond read nothing. Each line of the registered outline under the sensor is shifted to and fro, and
the readings near it are compared with those that the bare face would give. Only tactels count that
the plate surely presses; without any the share is 1. Lattices stand in the middle of their faces
(`generator.layout`), so opposite borders end equally far from the lattice: of parallel lines one
counts. Sizes are round numbers more often than not, so no line counts less than `LEAST_SHARE`.
Sensor frame and face frame, mm. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.evidence import VerifiedHypothesis
from recognizer.touch.hypothesis import (
    LARGE_LAB,
    Hypothesis,
    bounded_scores,
    count_places,
    labels_of,
)
from recognizer.touch.lab import EmbossedArray, EncodedFace
from recognizer.touch.pose import face_pose
from recognizer.touch.signal import mean_of_strongest
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.image import Image
from recognizer.touch.symbols.template import psi

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

GRAIN = 0.25  #: nats to which scores are rounded

# Of borders. Tuned on touches near edges and corners of the forty objects: own engine, seeds 501
# and 502, MuJoCo, seeds 900 and 902.
SIGMAS = 5.0  #: deviations of the noise of readings ...
PRESSED = 0.08  #: ... and share of the strongest from which the bare face is pressed
SYMBOL = 0.15  #: and a symbol, for a bare cell to be one
BARE = 0.1  #: psi of a symbol from which a tactel feels it
REACH_MM = 3.2  #: from a line within which tactels count
ENDS_MM = 1.0  #: at the ends of a line that are left out
APART_MM = 1.5  #: from any other line
FEW = 3  #: tactels, at least
SHIFT_MM = 0.1  #: step of shifts
GAINS = 5  #: factors that the force on the bare face may be off by, evenly spread ...
GAIN_SD = 0.5  #: ... over 1.5 of this deviation of their logarithm, both ways
NOISE = 0.12  #: least deviation of psi on a covered tactel ...
QUIET = 0.8  #: ... and that where nothing is felt, against it
MOST_NATS = 4.0  #: that one tactel can cost
SLACK = 0.25  #: nats by which a shift may be less likely that fits as well
LEAST_SHARE = 0.25  #: that a line leaves at least
PARALLEL_RAD = 0.2  #: by which parallel lines differ at most


def expected_matches(
    arrays: Iterable[EmbossedArray], embossed: EmbossedArray, fit: Fit, hypothesis: Hypothesis
) -> float:
    """Return how many registered places random symbols would match as well as a hypothesis.

    Only arrays of the same alphabet and style count, and places whose own borders agree with the
    bare cells.
    """
    scores = bounded_scores(fit)
    held = labels_of(embossed, hypothesis, fit.cells)
    shown = held < embossed.array.order
    chance = chance_of_match(scores[shown, :-1], held[shown])
    # the bare cells, dearest first: nats by which another place with a symbol there falls behind
    price = np.where(shown, 0.0, scores[:, -1] - scores[:, :-1].max(axis=1))
    dear = np.argsort(-price, kind="stable")[: int((price > 0).sum())]
    own = scores[np.arange(len(held)), held]
    slack = float((scores.max(axis=1) - own).sum())  # by which the hypothesis itself does
    cells = (fit.cells - fit.cells[_anchor(fit, shown)])[dear]
    return chance * sum(
        count_places(one, cells, price[dear], slack)
        if len(one.keys) <= LARGE_LAB
        else len(one.keys)
        for one in _embossed_alike(arrays, embossed)
    )


def place_bits(arrays: Iterable[EmbossedArray], embossed: EmbossedArray, doubt: float) -> float:
    """Return what a touch says about its place, bits: doubt = places x 2^-bits.

    Of random symbols a share of 2^-bits matches one place as well, so the number does not depend on
    the size of the lab: n places are named with a doubt of d by log2(n / d) bits. The places are
    those that the doubt counts, of the same alphabet and style.
    """
    places = sum(len(one.keys) for one in _embossed_alike(arrays, embossed))
    return math.log2(places / doubt) if doubt > 0 else math.inf


def _embossed_alike(
    arrays: Iterable[EmbossedArray], embossed: EmbossedArray
) -> list[EmbossedArray]:
    kind = embossed.alphabet, embossed.style
    return [one for one in arrays if (one.alphabet, one.style) == kind]


def _anchor(fit: Fit, shown: Flags) -> int:
    """Return the number of the cell with a symbol that is seen best."""
    return int(np.argmax(np.where(shown, fit.seen, -1.0)))


def expected_by_border(
    arrays: Iterable[EmbossedArray], found: VerifiedHypothesis, tip_mm: float
) -> float:
    """Return how many registered places a foreign face matches as well, border included.

    Infinite in a lab that is too large for places to be counted one by one. `tip_mm` is the
    diameter of a tactel's tip.
    """
    embossed, fit = found.embossed, found.fit
    alike = _embossed_alike(arrays, embossed)
    if sum(len(one.keys) for one in alike) > LARGE_LAB:
        return math.inf
    scores = bounded_scores(fit)
    held = labels_of(embossed, found.hypothesis, fit.cells)
    shown = held < embossed.array.order
    ahead = scores[np.arange(len(held)), held][:, None] - scores
    sure = np.where(shown, 1.0, _pressed_share(found))
    ahead = np.where(ahead > 0, ahead * sure[:, None], ahead)
    behind = np.floor(ahead / GRAIN).astype(np.int64)
    cells = fit.cells - fit.cells[_anchor(fit, shown)]
    places = sum(_expect_matches(one, cells, behind) for one in alike)
    return places * share_of_borders(found, tip_mm)


def _pressed_share(found: VerifiedHypothesis) -> Array:
    """Return (m,) the share of each cell's tactels that a symbol there would surely press."""
    image, fit = found.image, found.fit
    pressed = surely_pressed(image, fit.gain, SYMBOL)
    at = np.floor(points_on_lattice(image, fit) / image.template.pitch_mm).astype(np.int64)
    on = (at[None] == fit.cells[:, None]).all(axis=2)
    return np.asarray((on & pressed).sum(axis=1) / np.maximum(on.sum(axis=1), 1))


def chance_of_match(scores: Array, held: Ints) -> float:
    """Return the probability that random symbols score as well as those held (m,).

    `scores` (m, q) are nats, rounded by `GRAIN` towards a larger probability.
    """
    behind = np.floor((scores[np.arange(len(held)), held][:, None] - scores) / GRAIN)
    return _share_within(behind.astype(np.int64), 0)


def _share_within(behind: Ints, most: int) -> float:
    """Return the probability that random symbols of cells (m, q) fall behind by `most` or less."""
    if len(behind) == 0:
        return float(most >= 0)
    ahead = behind.min(axis=1)
    slack = int(most - ahead.sum())  # by which all but the likeliest may fall behind
    if slack < 0:
        return 0.0
    reached = np.zeros(slack + 1)
    reached[0] = 1.0
    for cell in (behind - ahead[:, None]).tolist():
        before, reached = reached, np.zeros(slack + 1)
        for step in cell:
            if step <= slack:
                reached[step:] += before[: slack + 1 - step]
        reached /= len(cell)
    return float(reached.sum())


def _expect_matches(embossed: EmbossedArray, cells: Ints, behind: Ints) -> float:
    """Return how many places random symbols match, outlines included.

    `cells` (m, 2) are counted from a cell that the place holds; `behind` (m, q + 1) says by how
    much each symbol, and none, falls behind the hypothesis there.
    """
    symbol, none = behind[:, :-1], behind[:, -1]
    least = symbol.min(axis=1)
    tell = np.flatnonzero((symbol != none[:, None]).any(axis=1))
    tell = tell[np.argsort(-np.abs(none - least)[tell], kind="stable")]
    # by how much all cells to come make up for the others at most
    rest = np.append(np.cumsum(np.minimum(least, none)[tell][::-1])[::-1], 0)
    rest = rest + none.sum() - none[tell].sum()
    array, owners = embossed.array, embossed.owners[:-1]
    row, column = (
        part.astype(np.int64) for part in np.divmod(embossed.keys, np.uint64(array.columns))
    )
    total = np.zeros(len(row), np.int64)
    for done, n in enumerate(tell.tolist(), 1):
        total += np.where(_bears(embossed, row, column, owners, cells[n]), least[n], none[n])
        kept = total + rest[done] <= 0
        if not kept.all():
            row, column, owners, total = row[kept], column[kept], owners[kept], total[kept]
    at = row[:, None], column[:, None], owners[:, None]
    bears = _bears(embossed, *at, cells[tell].T)
    outlines, count = np.unique(np.packbits(bears, axis=1), axis=0, return_counts=True)
    bears = np.unpackbits(outlines, axis=1, count=len(tell)).astype(np.bool_)
    bare = int(none.sum())
    return float(
        sum(
            number * _share_within(symbol[tell[one]], int(none[tell[one]].sum()) - bare)
            for one, number in zip(bears, count.tolist(), strict=True)
        )
    )


def _bears(
    embossed: EmbossedArray, row: Ints, column: Ints, owners: NDArray[np.int32], cell: Ints
) -> NDArray[np.bool_]:
    """Return whether places hold symbols of their own face at cells (2, ...) counted from them."""
    array = embossed.array
    held_by, _ = embossed.at((row - cell[1]) % array.rows, (column + cell[0]) % array.columns)
    return np.asarray(held_by == owners)


def share_of_borders(found: VerifiedHypothesis, tip_mm: float) -> float:
    """Return the share of foreign borders that the image fits as well as the registered one."""
    face = found.face
    if face.round is not None or tip_mm <= 0.0:
        return 1.0
    pressed, top, bare = _free_tactels(found)
    points = points_on_face(found, face)
    readings = psi(found.image.forces / np.maximum(top, 1e-300))
    pitch, unit = found.embossed.style.pitch_mm, max(NOISE, found.fit.noise)
    shares: list[tuple[float, float]] = []
    for inside, away, direction in _lines(face, points):
        asked = pressed & away
        if asked.sum() < FEW:
            continue
        expected = bare[asked] / np.maximum(top[asked], 1e-300)
        share = fitting_share(inside[asked], readings[asked], expected, tip_mm, pitch, unit)
        shares.append((direction, max(share, LEAST_SHARE)))
    return joint_share(shares)


def surely_pressed(image: Image, gain: Array, share: float) -> Flags:
    """Return which tactels (n,) would read a symbol by at least a share of the strongest readings.

    `gain` (4,) is that of the plate.
    """
    depth = image.plane @ gain[1:]
    force = math.exp(float(gain[0])) * image.pressing.force(depth)
    return _plain(image, force, share)


def _plain(image: Image, force: Array, share: float) -> Flags:
    strongest = mean_of_strongest(image.forces * image.trust)
    least = max(share * strongest, SIGMAS * image.noise)
    return np.asarray((image.trust > 0) & (force > least))


def points_on_lattice(image: Image, fit: Fit) -> Array:
    """Return the tactels (n, 2) in the lattice frame of a fit."""
    c, s = math.cos(fit.theta_rad), math.sin(fit.theta_rad)
    x, y = image.points_mm.T * (1.0 + float(fit.nuisance[3]))
    return np.stack([fit.x_mm + c * x - s * y, fit.y_mm + s * x + c * y], axis=-1)


def _free_tactels(found: VerifiedHypothesis) -> tuple[Flags, Array, Array]:
    """Return which tactels touch the bare face alone; forces (n,) on symbols and on the face."""
    image, fit = found.image, found.fit
    template = image.template
    depth, scale = image.plane @ fit.gain[1:], math.exp(float(fit.gain[0]))
    top = scale * image.pressing.force(depth)
    bare = scale * image.pressing.force(depth - image.pressing.symbol)
    at = points_on_lattice(image, fit)
    cells = np.floor(at / template.pitch_mm).astype(np.int64)
    labels = labels_of(found.embossed, found.hypothesis, cells)
    expected_psi = template.at(at - (cells + 0.5) * template.pitch_mm)[..., 0]
    held = labels < template.order
    on_symbol = held & (expected_psi[np.arange(len(at)), labels * held] > BARE)
    return ~on_symbol & _plain(image, bare, PRESSED), top, bare


def points_on_face(found: VerifiedHypothesis, face: EncodedFace) -> Array:
    """Return the tactels (n, 2) in the face frame, lengths as designed."""
    T = face_pose(found.embossed, face, found.hypothesis, found.fit)
    points = found.image.points_mm * (1.0 + float(found.fit.nuisance[3]))
    return np.asarray(points @ T[:2, :2].T + T[:2, 3])


def _lines(face: EncodedFace, points: Array) -> Iterator[tuple[Array, Flags, float]]:
    """Yield of each line how far inside points lie (n,), which are its own, its direction."""
    starts = np.concatenate(face.polygon_mm)
    ends = np.concatenate([np.roll(loop, -1, axis=0) for loop in face.polygon_mm])
    length = np.linalg.norm(ends - starts, axis=1)
    along = (ends - starts) / length[:, None]
    rest = points - starts[:, None]
    t = (rest * along[:, None]).sum(axis=2)
    inside = (
        along[:, :1] * rest[..., 1] - along[:, 1:] * rest[..., 0]
    )  # outlines run around the left
    beyond = np.maximum(np.maximum(-t, t - length[:, None]), 0.0)
    away = np.hypot(inside, beyond)
    ordered = np.sort(away, axis=0)
    for n in range(len(starts)):
        own = (away[n] <= ordered[0]) & (ordered[min(1, len(ordered) - 1)] > APART_MM)
        own &= (t[n] > ENDS_MM) & (t[n] < length[n] - ENDS_MM)
        own &= np.abs(inside[n]) < REACH_MM
        yield inside[n], own, math.atan2(along[n, 1], along[n, 0])


def fitting_share(
    inside: Array, readings: Array, bare: Array, tip_mm: float, pitch: float, unit: float
) -> float:
    """Return the share of half a pitch by which a border may be shifted and fit as well.

    `inside` (n,) is mm from the line, `readings` psi of what is read, `bare` the bare face's force
    over a symbol's.
    """
    step = SHIFT_MM
    count = max(1, round(pitch / 2 / step))
    shifts = step * np.arange(-count, count + 1)
    share = tip_share((inside + np.append(shifts, shifts[-1] + step)[:, None]) / (tip_mm / 2))
    factors = np.exp(GAIN_SD * np.linspace(-1.5, 1.5, GAINS))
    expected = psi(
        np.minimum(bare * factors[:, None], 1.0)[:, None] * share
    )  # (gains, shifts + 1, n)
    slope, expected = np.diff(expected, axis=1) / step, expected[:, :-1]
    width = unit * np.sqrt(QUIET**2 + expected**2 + slope**2)
    away = (readings - expected) / width
    each = -np.minimum(0.5 * away**2, MOST_NATS) - np.log(width)
    known = 0.5 * (np.log(factors) / GAIN_SD) ** 2
    likelihood = (each.sum(axis=2) - known[:, None]).max(axis=0)
    as_well = likelihood >= likelihood[count] - SLACK
    return min(1.0, float(as_well.sum()) * step / (pitch / 2))


def tip_share(inside: Array) -> Array:
    """Return the share of a round tip on one side of a line that its centre lies radii inside."""
    x = np.clip(inside, -1.0, 1.0)
    return np.asarray(0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / math.pi)


def joint_share(shares: list[tuple[float, float]]) -> float:
    """Return the product of shares (direction, share); of parallel lines the least one."""
    total, known = 1.0, list[float]()
    for direction, share in sorted(shares, key=lambda one: one[1]):
        if all(abs(math.remainder(direction - other, math.pi)) > PARALLEL_RAD for other in known):
            total *= share
            known.append(direction)
    return total
