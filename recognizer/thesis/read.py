"""The thesis's own way of reading, from image to answer. Thesis 4.3, 6.1-6.3.

    filters     bias, median
    symbols     ink, thinning, end-points and vertices -> symbols
    grid        predicted neighbours -> window of labels
    decoder     window -> index, with the registered cells of the database as prior
    pose        index -> face, object and the probe's place on them

The image is one touch or a mosaic of any resolution, and the answer has the type of the joint fit
(`recognizer.touch`), to compare the two. The thesis's way sees whole symbols only, needs strokes
that are separate in the image, and knows a symbol or does not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from decoder import Decoded, Likelihood, WindowError
from recognizer.thesis.filters import median, subtract_bias
from recognizer.thesis.grid import Grid, grid
from recognizer.thesis.symbols import Symbol, symbols
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.lab import EmbossedArray, Lab
from recognizer.touch.pose import face_covariance, face_pose, inside_mm, pose_on_object
from recognizer.touch.recognition import (
    AMBIGUOUS,
    AS_DESIGNED,
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

ERROR = 0.02  #: probability that a symbol is read wrong (likelihood)
STRANGERS = 0.1  #: most symbols that the face does not hold, share
OUTSIDE_MM = 2.0  #: how far the probe's centre may lie beyond the face


@dataclass(frozen=True, slots=True, eq=False)
class ClassicalReading:
    """The answer with its intermediate results."""

    recognition: Recognition
    symbols: tuple[Symbol, ...]  #: of the array that was read, rejected ones included
    grid: Grid | None


def read_classically(
    lab: Lab, image: TactileImage, *, T_image_probe: Array | None = None, seq: int = 0
) -> ClassicalReading:
    """Read an image the thesis's way; the answer's margin is the decoder's, in nats.

    Parameters
    ----------
    image
        Readings of one touch (`touch_image`) or of a mosaic, with its bias.
    T_image_probe
        (4, 4) pose of the probe in the image frame; by default the origin.
    """
    over = subtract_bias(image)
    if not over.values.any():
        return ClassicalReading(refusal(seq, NO_CONTACT), (), None)
    T = np.eye(4) if T_image_probe is None else T_image_probe
    readings = [_read_array(embossed, over, T, seq) for embossed in lab.arrays]
    answers = [reading for reading in readings if reading.recognition]
    if len(answers) > 1:  # two ways of embossing explain the image
        first, other = (answer.recognition for answer in answers[:2])
        if other.object is not None and other.face is not None and other.index is not None:
            runner_up = RunnerUp(other.object, other.face, other.index)
            value = refusal(seq, AMBIGUOUS, margin=first.margin, runner_up=runner_up)
            return ClassicalReading(value, answers[0].symbols, answers[0].grid)
    if answers:
        return answers[0]
    return max(readings, key=lambda each: 0 if each.grid is None else len(each.grid.members))


def _read_array(
    embossed: EmbossedArray, image: TactileImage, T_image_probe: Array, seq: int
) -> ClassicalReading:
    style = embossed.style
    if style.stroke_mm >= 2 * image.step_mm:
        image = median(image, style.stroke_mm)
    found = tuple(symbols(image, embossed.alphabet, style))
    window = grid(found, style.pitch_mm)
    if window is None:
        return ClassicalReading(refusal(seq, TOO_FEW), found, None)
    answer = _answer_of(embossed, window, _decode(embossed, window), T_image_probe, seq)
    return ClassicalReading(answer, found, window)


def _decode(embossed: EmbossedArray, found: Grid) -> Decoded:
    """Decode with the prior that the first member lies on a registered cell, if it can be held."""
    array = embossed.array
    i, j = found.cells[0].tolist()
    rows, columns = np.divmod(embossed.keys, np.uint64(array.columns))
    down, along = found.first[1] - j, i - found.first[0]
    prior = np.stack(
        [_step_back(rows, down, array.rows), _step_back(columns, along, array.columns)], axis=1
    )
    try:
        return Likelihood(array, prior=prior, error=ERROR).decode(found.window)[0]
    except WindowError:  # more places than it holds at a time
        return Likelihood(array, error=ERROR).decode(found.window)[0]


def _answer_of(
    embossed: EmbossedArray, found: Grid, decoded: Decoded, T_image_probe: Array, seq: int
) -> Recognition:
    pitch, array = embossed.style.pitch_mm, embossed.array
    fit = _as_fit(found)
    at_mm = _probe_on_lattice(fit, T_image_probe)  # the probe's centre on the lattice
    under = (math.floor(at_mm[0] / pitch), math.floor(at_mm[1] / pitch))

    def index(place: Hypothesis) -> tuple[int, int]:
        return (place.row - under[1]) % array.rows, (place.column + under[0]) % array.columns

    runner_up = None
    if decoded.runner_up is not None:
        second = decoded.runner_up
        place, _ = _place_of_window(embossed, found, second.row, second.column)
        if place.face >= 0:
            other = embossed.face(place.face)
            runner_up = RunnerUp(other.object, other.face, index(place))
    if decoded.row is None or decoded.column is None:
        return refusal(seq, decoded.reason, margin=decoded.margin, runner_up=runner_up)
    place, held = _place_of_window(embossed, found, decoded.row, decoded.column)
    if place.face < 0 or held < 1 - STRANGERS:
        return refusal(seq, NOT_ENCODED, margin=decoded.margin, runner_up=runner_up)
    face = embossed.face(place.face)
    pose = face_pose(embossed, face, place, fit) @ T_image_probe
    if inside_mm(face, float(pose[0, 3]), float(pose[1, 3])) < -OUTSIDE_MM:
        return refusal(seq, OUTSIDE, margin=decoded.margin, runner_up=runner_up)
    lever = np.eye(3)  # the image's turn moves a probe that is away from its origin
    lever[:2, 2] = fit.y_mm - at_mm[1], at_mm[0] - fit.x_mm
    covariance = face_covariance(face, lever @ fit.covariance @ lever.T)
    if face.printed is not None:
        pose, covariance = face.printed.pose(pose, covariance)
    return Recognition(
        seq=seq, object=face.object, face=face.face, index=index(place), T_face_probe=pose,
        T_object_probe=pose_on_object(face, pose), covariance=covariance,
        margin=decoded.margin, runner_up=runner_up, reason="",
        part=AS_DESIGNED if face.printed is None else face.printed.part,
    )  # fmt: skip


def _place_of_window(
    embossed: EmbossedArray, found: Grid, row: int, column: int
) -> tuple[Hypothesis, float]:
    """Return a window's place and the share of its symbols that one face holds."""
    array = embossed.array
    i, j = found.first
    start_row, start_column = (row + j) % array.rows, (column - i) % array.columns
    owners, _ = embossed.at(
        (start_row - found.cells[:, 1]) % array.rows,
        (start_column + found.cells[:, 0]) % array.columns,
    )
    held = owners[owners >= 0]
    if len(held) == 0:
        return Hypothesis(0, start_row, start_column, -1, 0.0), 0.0
    faces, number = np.unique(held, return_counts=True)
    face = int(faces[number.argmax()])
    return Hypothesis(0, start_row, start_column, face, 0.0), float(number.max()) / len(owners)


def _as_fit(found: Grid) -> Fit:
    """Return a grid as a joint fit that is certain of each symbol."""
    number = len(found.cells)
    return Fit(
        x_mm=found.x_mm, y_mm=found.y_mm, theta_rad=found.theta_rad, nuisance=np.zeros(3),
        gain=np.zeros(4), cells=found.cells, scores=np.zeros((number, 0)), seen=np.ones(number),
        noise=math.nan, value=0.0, covariance=found.covariance,
    )  # fmt: skip


def _probe_on_lattice(fit: Fit, T_image_probe: Array) -> tuple[float, float]:
    """Return the probe's centre (x, y) on the lattice, mm."""
    c, s = math.cos(fit.theta_rad), math.sin(fit.theta_rad)
    x, y = float(T_image_probe[0, 3]), float(T_image_probe[1, 3])
    return fit.x_mm + c * x - s * y, fit.y_mm + s * x + c * y


def _step_back(places: NDArray[np.uint64], steps: int, cycle: int) -> NDArray[np.uint64]:
    return np.asarray((places + np.uint64(-steps % cycle)) % np.uint64(cycle))
