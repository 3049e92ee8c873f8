"""The thesis's own way of reading, from image to answer. Thesis 4.3, 6.1-6.3.

    filters     bias, median
    skeleton    ink, thinning, end-points and vertices -> symbols
    grid        expected neighbours -> window of labels
    decoder     window -> index, with the cells that the database registers as prior
    pose        index -> face, object and the probe's place on them

The image is one touch or a mosaic of any resolution, and the answer the same value as that of
the joint fit (`pipeline`), which it is there to be compared with: it sees whole symbols only,
needs strokes that stand apart in the image, and knows a symbol or does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from decoder import (
    Decoded,
    Decodings,
    Likelihood,
    MethodError,
    WindowError,
    decode_exact,
    decode_good_tuple,
)
from generator.array import ProductArray
from recognizer.thesis.filters import median, subtract_bias
from recognizer.thesis.grid import Grid, grid
from recognizer.thesis.settings import ThesisSettings
from recognizer.thesis.skeleton.symbols import Symbol, symbols
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.lab import EmbossedArray, Lab
from recognizer.touch.pose import face_covariance, face_pose, inside_mm, pose_on_object
from recognizer.touch.recognition import (
    AMBIGUOUS,
    NO_CONTACT,
    NOT_ENCODED,
    OUTSIDE,
    TOO_FEW,
    Recognition,
    RunnerUp,
    refusal,
)
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.tactile_image import TactileImage

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class ClassicalReading:
    """The answer and how it came about."""

    recognition: Recognition
    encoding: EmbossedArray | None  #: the one that was read
    symbols: tuple[Symbol, ...]  #: of that encoding, rejected ones among them
    grid: Grid | None


def read_classically(
    lab: Lab,
    image: TactileImage,
    settings: ThesisSettings | None = None,
    *,
    T_image_probe: Array | None = None,
    seq: int = 0,
) -> ClassicalReading:
    """Read an image the thesis's way.

    Parameters
    ----------
    lab
        What can be touched.
    image
        Readings of one touch (`filters.touch_image`) or of a mosaic, with its bias.
    settings
        Of the stages.
    T_image_probe
        (4, 4) where the probe stands in the image frame; by default at its origin, as for an
        image of one touch.
    seq
        Number of the answer.

    Returns
    -------
    ClassicalReading
        Its margin is the decoder's, in nats; None with conversions that weigh nothing.
    """
    chosen = settings or ThesisSettings()
    over = subtract_bias(image)
    if not over.values.any():
        return ClassicalReading(refusal(seq, NO_CONTACT), None, (), None)
    T = np.eye(4) if T_image_probe is None else T_image_probe
    readings = [_read_encoding(encoding, over, chosen, T, seq) for encoding in lab.arrays]
    answers = [reading for reading in readings if reading.recognition]
    if len(answers) > 1:  # two ways of embossing explain the image
        first = answers[0].recognition
        other = answers[1].recognition
        if other.object is not None and other.face is not None and other.index is not None:
            runner_up = RunnerUp(other.object, other.face, other.index)
            value = refusal(seq, AMBIGUOUS, margin=first.margin, runner_up=runner_up)
            return ClassicalReading(value, answers[0].encoding, answers[0].symbols, answers[0].grid)
    return answers[0] if answers else max(readings, key=_symbol_count)


def _symbol_count(reading: ClassicalReading) -> int:
    return 0 if reading.grid is None else len(reading.grid.members)


def _read_encoding(
    encoding: EmbossedArray,
    image: TactileImage,
    settings: ThesisSettings,
    T_image_probe: Array,
    seq: int,
) -> ClassicalReading:
    style = encoding.style
    filtered = image
    if settings.median and style.stroke_mm >= 2 * image.step_mm:
        filtered = median(image, style.stroke_mm)
    found = tuple(symbols(filtered, encoding.alphabet, style, settings.symbols))
    laid = grid(found, style.pitch_mm, settings.acceptance)
    if laid is None:
        return ClassicalReading(refusal(seq, TOO_FEW), encoding, found, None)
    decoded = _convert_window(encoding, laid, settings)
    answer = _answer_of(encoding, laid, decoded, settings, T_image_probe, seq)
    return ClassicalReading(answer, encoding, found, laid)


def _convert_window(encoding: EmbossedArray, laid: Grid, settings: ThesisSettings) -> Decoded:
    """Return the place of a window by the conversion that is asked for."""
    array = encoding.array
    if settings.conversion == "exact":
        return decode_exact(array, laid.window)[0]
    if settings.conversion == "good tuple" and not isinstance(array, ProductArray):
        try:
            return decode_good_tuple(array, laid.window)[0]
        except MethodError:  # a window smaller than the tuple
            return decode_exact(array, laid.window)[0]
    return _decode_likeliest(encoding, laid, settings.error)[0]


def _decode_likeliest(encoding: EmbossedArray, laid: Grid, error: float) -> Decodings:
    """Decode with the prior that the first member lies on a registered cell, if it can be held."""
    array = encoding.array
    i, j = laid.cells[0].tolist()
    rows, columns = np.divmod(encoding.keys, np.uint64(array.columns))
    down, along = laid.first[1] - j, i - laid.first[0]
    prior = np.stack(
        [_step_back(rows, down, array.rows), _step_back(columns, along, array.columns)], axis=1
    )
    try:
        return Likelihood(array, prior=prior, error=error).decode(laid.window)
    except WindowError:  # more places than it holds at a time
        return Likelihood(array, error=error).decode(laid.window)


def _step_back(places: NDArray[np.uint64], steps: int, cycle: int) -> NDArray[np.uint64]:
    """Return places - steps on a cycle."""
    return np.asarray((places + np.uint64(-steps % cycle)) % np.uint64(cycle))


def _answer_of(
    encoding: EmbossedArray,
    laid: Grid,
    decoded: Decoded,
    settings: ThesisSettings,
    T_image_probe: Array,
    seq: int,
) -> Recognition:
    pitch, array = encoding.style.pitch_mm, encoding.array
    fit = _as_fit(laid)
    at_mm = _probe_on_lattice(fit, T_image_probe)  # the probe's centre on the lattice
    under = (math.floor(at_mm[0] / pitch), math.floor(at_mm[1] / pitch))

    def index(place: Hypothesis) -> tuple[int, int]:
        return (place.row - under[1]) % array.rows, (place.column + under[0]) % array.columns

    runner_up = None
    if decoded.runner_up is not None:
        place, _ = _place_of_window(encoding, laid, decoded.runner_up.row, decoded.runner_up.column)
        if place.face >= 0:
            other = encoding.face(place.face)
            runner_up = RunnerUp(other.object, other.face, index(place))
    if decoded.row is None or decoded.column is None:
        return refusal(seq, decoded.reason, margin=decoded.margin, runner_up=runner_up)
    place, held = _place_of_window(encoding, laid, decoded.row, decoded.column)
    if place.face < 0 or held < 1 - settings.strangers:
        return refusal(seq, NOT_ENCODED, margin=decoded.margin, runner_up=runner_up)
    face = encoding.face(place.face)
    pose = face_pose(encoding, face, place, fit) @ T_image_probe
    if inside_mm(face, float(pose[0, 3]), float(pose[1, 3])) < -settings.rim_mm:
        return refusal(seq, OUTSIDE, margin=decoded.margin, runner_up=runner_up)
    lever = np.eye(3)  # the image's turn moves a probe that is away from its origin
    lever[:2, 2] = fit.y_mm - at_mm[1], at_mm[0] - fit.x_mm
    covariance = face_covariance(face, lever @ fit.covariance @ lever.T)
    if face.printed is not None:
        pose, covariance = face.printed.pose(pose, covariance)
    return Recognition(
        seq=seq,
        object=face.object,
        face=face.face,
        index=index(place),
        T_face_probe=pose,
        T_object_probe=pose_on_object(face, pose),
        covariance=covariance,
        margin=decoded.margin,
        runner_up=runner_up,
        reason="",
    )


def _place_of_window(
    encoding: EmbossedArray, laid: Grid, row: int, column: int
) -> tuple[Hypothesis, float]:
    """Return a window's place and the share of its symbols that one face holds."""
    array = encoding.array
    i, j = laid.first
    start_row, start_column = (row + j) % array.rows, (column - i) % array.columns
    owners, _ = encoding.at(
        (start_row - laid.cells[:, 1]) % array.rows,
        (start_column + laid.cells[:, 0]) % array.columns,
    )
    held = owners[owners >= 0]
    if len(held) == 0:
        return Hypothesis(0, start_row, start_column, -1, 0.0), 0.0
    faces, number = np.unique(held, return_counts=True)
    face = int(faces[number.argmax()])
    return Hypothesis(0, start_row, start_column, face, 0.0), float(number.max()) / len(owners)


def _as_fit(laid: Grid) -> Fit:
    """Return a grid as the value that the joint fit makes: sure of each symbol, or blind."""
    return Fit(
        x_mm=laid.x_mm,
        y_mm=laid.y_mm,
        theta_rad=laid.theta_rad,
        nuisance=np.zeros(3),
        gain=np.zeros(4),
        cells=laid.cells,
        scores=np.zeros((len(laid.cells), 0)),
        seen=np.ones(len(laid.cells)),
        noise=math.nan,
        value=0.0,
        covariance=laid.covariance,
    )


def _probe_on_lattice(fit: Fit, T_image_probe: Array) -> tuple[float, float]:
    """Return where the probe's centre lies on the lattice, mm."""
    c, s = math.cos(fit.theta_rad), math.sin(fit.theta_rad)
    x, y = float(T_image_probe[0, 3]), float(T_image_probe[1, 3])
    return fit.x_mm + c * x - s * y, fit.y_mm + s * x + c * y
