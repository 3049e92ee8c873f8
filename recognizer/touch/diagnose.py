"""Image and best hypothesis of a touch that is not answered -> its cause.

The image by itself comes first (smeared, even, soft, falling off to one side, loaded in part), then
the residual of the best hypothesis: tactels that read nothing where symbols press, symbols that
contradict every place, a pattern that no symbols explain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import LEAST_TACTELS, SensorType, force_share
from recognizer.touch import recognition as cause
from recognizer.touch.evidence import VerifiedHypothesis
from recognizer.touch.recognition import Cause
from recognizer.touch.search_gate import shows_strokes
from recognizer.touch.signal import Signal, combine_around, quantile
from recognizer.touch.symbols.linearize import project_symbols
from recognizer.touch.symbols.posterior import explained_share
from recognizer.touch.verdict import Evidence
from recognizer.touch.verify import TouchImages

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


# Chosen on 40 touches of each cause, own engine, `typical`, seed 61 (`docs/recognizer.md`).
FULL_LOAD = 90.0  #: percentile of the envelope that counts as loaded in full
PLATEAU = 95.0  #: percentile of the readings that stands for a symbol's
PART = 0.2  #: of the full load, from which a place is loaded ...
SIGMAS = 5.0  #: ... and deviations of the noise
EVEN = 0.75  #: variation of the readings (deviation over mean) of a face without relief
PLAIN = 0.2  #: variation of the pressed tactels alone, of a plain face ...
FILLED = 0.9  #: ... where these fill so much of the box around them
SMEARED = 0.85  #: variation below which contours may be smeared ...
SHARP = 0.6  #: ... if they are so much less sharp one way than across
SOFT = 16.0  #: signal to noise below which a touch is soft
SOFT_N = 0.15  #: plateau below which it is, where readings are newtons
PRESS_N = (30.0, 120.0)  #: that `fsr-16` reads well
#: Sum of the readings from which contrast is lost, on `fsr-16`, where they are newtons ...
HARD_N = 250.0
HARD = 0.08  #: ... or share of all that they can read: 120 N .071, 250 N .080, 1000 N .097
FALLING = 0.42  #: share of the load by which it falls from the middle to the rim ...
LYING = 0.65  #: ... of a plate that lies on so much of the sensor: less is an edge
NARROW_MM = 7.5  #: width of one row of symbols
LONGER = 1.8  #: times as long as wide
LOADED = 0.85  #: share of the sensor below which it hangs over an edge
PRESSED = 0.6  #: psi of a symbol that presses
SILENT = 0.15  #: psi below which a tactel reads nothing
DEAD = 0.1  #: share of the pressed tactels that read nothing, of a faulty sensor
GHOSTS = 0.08  #: share of the free ones that read a symbol, of another pattern
KNOWN = -2.0  #: nats over symbols of no registered place, least where one is right
THERE = 20.0  #: nats from which its symbols are there beyond doubt; a plain face has 11
EXPLAINED = 0.8  #: share of the image that symbols of this size explain, wherever
CLEAR = 6.0  #: nats by which a symbol is read
PATTERN = 0.35  #: share below which they are other ones


@dataclass(frozen=True, slots=True)
class ImageFeatures:
    """Features of an image before any symbol is read."""

    plateau: float  #: reading on a symbol
    signal_to_noise: float
    loaded: float  #: share of the sensor
    slope: float  #: of the load, from the middle to the rim over its mean
    variation: float  #: deviation over mean
    sharpness: float  #: of contours one way, over that across
    direction_deg: float  #: the way that they are less sharp, sensor frame
    width_mm: float  #: of what is loaded
    length_mm: float


def image_features(sensor: SensorType, signal: Signal, pitch_mm: float) -> ImageFeatures:
    """Return the features of an image of symbols of a pitch."""
    good = signal.trust > 0
    forces = np.where(good, signal.forces, 0.0)
    noise = signal.noise
    reach = max(1, round(pitch_mm / max(sensor.step_mm)) // 2)
    envelope = combine_around(forces, reach, np.maximum)
    top = max(_percentile(envelope, FULL_LOAD), 1e-300)
    plateau = _percentile(forces[good], PLATEAU)
    points = sensor.centres_mm().reshape(-1, 2)
    basis = np.column_stack([np.ones(len(points)), points / np.array(sensor.half_mm)])
    plane = np.linalg.lstsq(basis, envelope.ravel() / top, rcond=None)[0]
    down, across = np.gradient(forces)
    tensor = np.cov(np.stack([across.ravel(), -down.ravel()]))
    least, vectors = np.linalg.eigh(tensor)
    spread = np.cov(points.T, aweights=np.maximum(forces.ravel(), 1e-12 * top))
    width, length = np.sqrt(12 * np.maximum(np.linalg.eigvalsh(spread), 0.0)).tolist()
    return ImageFeatures(
        plateau=plateau,
        signal_to_noise=plateau / max(noise, 1e-300),
        loaded=float((envelope > max(PART * top, SIGMAS * noise)).mean()),
        slope=math.hypot(*plane[1:]),
        variation=float(forces[good].std() / max(forces[good].mean(), 1e-300)),
        sharpness=float(least[0] / max(least[1], 1e-300)),
        direction_deg=math.degrees(math.atan2(vectors[1, 0], vectors[0, 0])) % 180.0,
        width_mm=width,
        length_mm=length,
    )


def _percentile(values: Array, percent: float) -> float:
    return float(quantile(np.sort(values, axis=None), percent / 100.0))


def _is_plain(image: ImageFeatures, signal: Signal) -> bool:
    """Whether one area without gaps is pressed evenly, up to an edge or not."""
    good, top = signal.trust > 0, image.plateau
    pressed = good & (signal.forces > PART * top)
    rows, columns = np.flatnonzero(pressed.any(axis=1)), np.flatnonzero(pressed.any(axis=0))
    if not len(rows):
        return False
    inside = np.ix_(range(rows[0], rows[-1] + 1), range(columns[0], columns[-1] + 1))
    filled = float(pressed[inside].sum()) / max(int(good[inside].sum()), 1)
    forces = signal.forces[pressed]
    return filled > FILLED and bool(forces.std() < PLAIN * forces.mean())


def _is_there(evidence: Evidence | None) -> bool:
    """Whether the symbols of a place are plainly there: hard pressed ones, not a plain face."""
    return evidence is not None and evidence.log_likelihood_ratio >= THERE


def diagnose(touch: TouchImages, found: list[VerifiedHypothesis]) -> Cause:
    """Return why a touch is not answered.

    `found` are the hypotheses that were judged, best first; none where nothing could be fitted.
    """
    reader, signal = touch.reader, touch.signal
    if not signal.contact:
        return Cause(cause.NO_LOAD, {})
    pitch = min(each.style.pitch_mm for each in reader.lab.arrays)
    coarsest = max(each.style.pitch_mm for each in reader.lab.arrays)
    if coarsest < LEAST_TACTELS * max(reader.sensor.step_mm):
        best_mm = reader.sensor.symbol_pitch_mm
        return Cause(cause.TOO_FINE, {"pitch_mm": pitch, "best_mm": best_mm})
    image = image_features(reader.sensor, signal, pitch)
    evidence = found[0].evidence if found else None
    seen = _by_image(reader.sensor, image, signal)
    if seen is not None and not (seen.code == cause.PLAIN and _is_there(evidence)):
        return seen
    symbols = 0 if evidence is None else evidence.inliers
    if image.width_mm < NARROW_MM and image.length_mm > LONGER * image.width_mm:
        return Cause(cause.ONE_ROW, {"width_mm": image.width_mm, "symbols": float(symbols)})
    bare = not shows_strokes(reader, signal) or _is_plain(image, signal)
    if bare and not _is_there(evidence):
        return Cause(cause.PLAIN, {"variation": image.variation, "plateau": image.plateau})
    if evidence is None:
        code = cause.EDGE if image.loaded < LOADED else cause.UNCLEAR
        return Cause(code, {"symbols": 0.0, "explained": 0.0, "loaded": image.loaded})
    numbers = {
        "symbols": float(symbols),
        "explained": evidence.explained,
        "loaded": image.loaded,
        "surprise": evidence.log_likelihood_ratio,
        "against": float(evidence.contradictions),
    }
    silent, ghosts = _disagreement(found[0])
    placed = evidence.log_likelihood_ratio > KNOWN and image.loaded > LYING
    if placed and silent > DEAD and ghosts < GHOSTS:
        return Cause(cause.DEAD_TACTELS, {**numbers, "silent": silent})
    if image.loaded < LOADED:
        return Cause(cause.EDGE, numbers)
    explained, read = _read_anywhere(touch)
    numbers |= {"explained_anywhere": explained, "symbols_anywhere": float(read)}
    if evidence.log_likelihood_ratio < KNOWN and explained > EXPLAINED:
        return Cause(cause.NOT_REGISTERED, numbers)
    if max(evidence.explained, explained) < PATTERN:
        return Cause(cause.OTHER_PATTERN, numbers)
    return Cause(cause.UNCLEAR, numbers)


def _hard_from(sensor: SensorType, signal: Signal) -> float:
    """Return the sum of readings from which a sensor is pressed too hard, inf if not known."""
    if signal.newtons:
        return HARD_N * force_share(sensor)
    return HARD * sensor.full * signal.forces.size if sensor.exponent == 1.0 else math.inf


def _by_image(sensor: SensorType, image: ImageFeatures, signal: Signal) -> Cause | None:
    """Return the cause that the image shows by itself; None if none."""
    if image.variation < SMEARED and image.sharpness < SHARP:
        total, most = float(signal.forces.sum()), _hard_from(sensor, signal)
        if total > most:
            low, high = (force * force_share(sensor) for force in PRESS_N)
            numbers = {"sum": total, "most": most, "newtons": float(signal.newtons)}
            return Cause(cause.HARD, numbers | {"least_n": low, "most_n": high})
        return Cause(cause.MOVING, {"sharpness": image.sharpness,
                                    "direction_deg": image.direction_deg})  # fmt: skip
    if image.variation < EVEN:
        return Cause(cause.PLAIN, {"variation": image.variation, "plateau": image.plateau})
    weak = image.plateau < SOFT_N
    if weak if signal.newtons else image.signal_to_noise < SOFT:
        return Cause(cause.SOFT, {"plateau": image.plateau, "newtons": float(signal.newtons),
                                  "signal_to_noise": image.signal_to_noise})  # fmt: skip
    if image.slope > FALLING and image.loaded > LYING:
        return Cause(cause.TILTED, {"slope": image.slope, "loaded": image.loaded})
    return None


def _read_anywhere(touch: TouchImages) -> tuple[float, int]:
    """Return the share of the image that symbols explain wherever they stand, and their number.

    Each cell shows its best symbol, whether such a window is registered or not.
    """
    best, read = -math.inf, 0
    for one in touch.arrays:
        for fit in one.fits(touch.reader.options.first)[:1]:
            order = fit.scores.shape[1] - 1
            likeliest = fit.scores.argmax(axis=1)
            shows = np.where(likeliest == order, -1, likeliest).tolist()
            held = dict(zip(map(tuple, fit.cells.tolist()), shows, strict=True))

            def labels_at(cells: Ints, held: dict[tuple[int, ...], int] = held) -> Ints:
                found = [held.get(tuple(cell), -1) for cell in cells.reshape(-1, 2).tolist()]
                return np.array(found, np.int64).reshape(cells.shape[:-1])

            explained = explained_share(one.image, fit.pose, fit.gain, labels_at)
            if explained > best:
                ranked = np.sort(fit.scores, axis=1)
                clear = ranked[:, -1] - ranked[:, -2] > CLEAR
                best, read = explained, int((clear & (likeliest < order)).sum())
    return best if math.isfinite(best) else 0.0, read


def _disagreement(best: VerifiedHypothesis) -> tuple[float, float]:
    """Return the share of pressed tactels that read nothing, and of free ones that read much."""
    image, fit = best.image, best.fit
    under, labels, shows = project_symbols(image, fit.pose[None], fit.gain[None], best.labels_at)
    value, measured = shows[0, :, 0], under.psi[0]
    known = image.trust > 0
    pressed = known & (labels[0] >= 0) & (value > PRESSED)
    free = known & (value < SILENT)
    return (
        float((measured[pressed] < SILENT).sum() / max(pressed.sum(), 1)),
        float((measured[free] > PRESSED).sum() / max(free.sum(), 1)),
    )
