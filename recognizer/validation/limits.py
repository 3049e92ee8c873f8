"""What a touch can say at best: bits about its place, and the least error of its pose.

TouchPlan + number -> row of `COLUMNS`: whether the true place is the likeliest of all by the widest
search, its doubt and its bits (`recognizer.touch.chance`), and the Cramer-Rao bound of place and
turn. A touch can be named if its true place is the likeliest and its doubt low enough; whatever
else a reader asks of an answer can only refuse more.

The bound follows from the true pose, not from an estimate: with J (n, 11) the derivatives of the
forces by pose, form and gain at the truth, S (n,) the deviations of the readings of the simulated
sensor there, and P what is known beforehand of form and scale,

    covariance >= (J^T diag(S^-2) J + P)^-1,

its block of x, y (mm) and turn (rad). S holds what is drawn for each tactel alone: noise, gain,
length and place of its tip. Errors that many tactels share (law of the film, cross-talk, bleeding,
dead tactels) are left out: they make it harder, so the bound holds. C. R. Rao, 1945; with what is
known beforehand: H. L. Van Trees, Detection, Estimation and Modulation Theory, 1968, 2.4.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.simulate.world.levels import TYPICAL, Level
from probe.simulate.world.sensor import COUNTS_PER_N, FULL
from recognizer.touch.chance import expected_by_border, expected_matches, place_bits
from recognizer.touch.hypothesis import Hypothesis, labels_at
from recognizer.touch.lab import EmbossedArray, find_face
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import answer_at
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.fit import invert_normal, refine_lattices
from recognizer.touch.symbols.image import Image, bend_image, deep_gain, first_gain, tilted_gain
from recognizer.touch.symbols.kernels import POSE
from recognizer.touch.symbols.linearize import (
    LabelsAt,
    force_jacobian,
    prior_precision,
    project_symbols,
)
from recognizer.touch.verify import TouchImages, verify_hypotheses
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.statistics import rms, round_digits, share_of
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import RIGHT, WRONG, Row, judge

Array = NDArray[np.float64]

#: Of a row; `doubt` and `bits` are those of the true place, NaN where it is not the likeliest.
COLUMNS = {
    "number": "int", "likeliest": "bool", "doubt": "float", "bits": "float",
    "bound_mm": "float", "bound_deg": "float",
}  # fmt: skip
STEPS = 8  #: of damped least squares, of the gain at the true place
PLACES = tuple(10**k for k in range(3, 8))  #: for which the share that can be named is given


@dataclass(frozen=True, slots=True)
class ReadingErrors:
    """Standard deviations of what is drawn for each tactel alone."""

    noise: float  #: of readings, in their unit
    gain: float  #: share of the reading
    exponent: float = 1.0  #: readings rise with this power of the force
    depth: float = 0.0  #: of a tip's length, heights of the overlay
    shift_mm: float = 0.0  #: of a tip's place, each way

    def variance(self, force: Array, by_place: Array, by_depth: Array) -> Array:
        """Return the variance (n,) of forces (n,), with their slopes by place (n, 2) and depth."""
        power = self.exponent
        noise = self.noise * np.maximum(force, self.noise) ** (1 - power) / power
        places = self.shift_mm**2 * (by_place**2).sum(axis=1)
        gain = self.gain * force / power
        return np.asarray(noise**2 + gain**2 + places + (self.depth * by_depth) ** 2)


def errors_of(sensor: SensorType, level: Level) -> ReadingErrors:
    """Return the errors of a sensor of a level, readings in counts (`probe.simulate.world`)."""
    rounding = 1 / 12
    if sensor.value == "depth":  # shades of a gel change slowly: no error of one tactel
        noise = sensor.noise * level.noise_n / TYPICAL.noise_n
        return ReadingErrors(math.sqrt(noise**2 + rounding), 0.0, sensor.exponent)
    noise = sensor.full / FULL * COUNTS_PER_N * level.noise_n
    tab = sensor.overlay.kind == "tab"
    return ReadingErrors(
        math.sqrt(noise**2 + rounding),
        level.gain,
        sensor.exponent,
        level.length_mm / sensor.overlay.height_mm if tab else 0.0,
        level.shift_mm if tab else 0.0,
    )


def least_covariance(
    image: Image, pose: Array, gain: Array, labels: LabelsAt, errors: ReadingErrors
) -> Array:
    """Return the Cramer-Rao bound (3, 3) of x, y (mm) and turn (rad) of known symbols.

    `pose` (7,) and `gain` (4,) are true. Wide where the image does not show the pose.
    """
    measured, _, values = project_symbols(image, pose[None], gain[None], labels)
    jacobian, force = (one[0] for one in force_jacobian(image, pose[None], gain[None], values,
                                                        measured))  # fmt: skip
    variance = errors.variance(force, jacobian[:, :2], jacobian[:, POSE + 1])
    information = jacobian.T @ (jacobian * (image.trust / variance)[:, None])
    information += np.diag(prior_precision(image))
    return invert_normal(information)[:3, :3]


def true_lattice(
    embossed: EmbossedArray, face_number: int, touch: Touch
) -> tuple[Hypothesis, Array]:
    """Return where a touch lies: cell (0, 0) is the symbol next to it; pose (3,) there."""
    face = embossed.face(face_number)
    away = np.array([touch.x_mm, touch.y_mm]) - face.centres_mm
    near = int(np.argmin((away**2).sum(axis=1)))
    c, s = math.cos(face.rotation_rad), math.sin(face.rotation_rad)
    x, y = away[near].tolist()
    half = embossed.style.pitch_mm / 2
    pose = np.array([half + c * x - s * y, half + s * x + c * y, touch.theta_rad])
    pose[2] += face.rotation_rad
    row, column = int(face.rows[near]), int(face.columns[near])
    return Hypothesis(0, row, column, face_number, 0.0), pose


def bound_of_touch(
    reader: Reader, signal: Signal, found: DrawnTouch, errors: ReadingErrors
) -> Array | None:
    """Return the Cramer-Rao bound (3, 3) of a touch; None where nothing presses."""
    scene, touch = found.contact.scene, found.touch
    held = find_face(reader.lab, scene.object_name, scene.face)
    if held is None:
        return None
    prepared, number = reader.prepared[held[0]], held[1]
    embossed = prepared.embossed
    place, pose = true_lattice(embossed, number, touch)
    image, face = reader.image(signal, prepared), embossed.face(number)
    gains = [one for one in (first_gain(image), tilted_gain(image), deep_gain(image))
             if one is not None]  # fmt: skip
    if face.round is not None and not face.round.surface.concave:
        bend = face.round.bend(touch.x_mm, touch.y_mm).turned(touch.theta_rad)
        image = bend_image(image, reader.sensor, bend)
    if not gains:
        return None
    # gain and form are those that fit at the true place; place and turn are the true ones
    lattices = refine_lattices(
        image, np.tile(pose, (len(gains), 1)), np.array(gains),
        steps=STEPS, labels_at=labels_at(embossed, [place] * len(gains)), with_normal=False,
    )  # fmt: skip
    best = int(np.argmax(lattices.value))
    true = np.append(pose, lattices.pose[best, 3:])
    return least_covariance(image, true, lattices.gain[best], labels_at(embossed, [place]), errors)


def limit_of(plan: TouchPlan, number: int, reader: Reader) -> Row:
    """Return the row of a touch, as the trial of that number makes it."""
    reader = plan.knowing(reader)
    found = draw_touch(plan, number, reader)
    signal = reader.signal(found.counts)
    row: Row = dict.fromkeys(COLUMNS, math.nan) | {"number": number, "likeliest": False}
    if not signal.contact:
        return row
    bound = bound_of_touch(reader, signal, found, errors_of(reader.sensor, plan.noise))
    if bound is not None:
        row["bound_mm"] = round(math.sqrt(bound[0, 0] + bound[1, 1]), 6)
        row["bound_deg"] = round(math.degrees(math.sqrt(bound[2, 2])), 6)
    ranked = verify_hypotheses(TouchImages(reader, signal), reader.options.thorough)
    if not ranked:
        return row
    best, arrays = ranked[0], reader.lab.arrays
    answer = answer_at(
        best.embossed, best.last_fit(), best.hypothesis, reader.options, number,
        reason="", margin=0.0, runner_up=None,
    )  # fmt: skip
    if judge(plan, number, found, answer, reader).verdict != RIGHT:
        return row
    doubt = expected_matches(arrays, best.embossed, best.fit, best.hypothesis)
    if reader.sensor.overlay.kind == "tab":
        tip_mm = reader.sensor.overlay.tab_diameter_mm
        doubt = min(doubt, expected_by_border(arrays, best, tip_mm))
    bits = place_bits(arrays, best.embossed, doubt)
    return row | {"likeliest": True, "doubt": float(f"{doubt:.6g}"), "bits": round(bits, 4)}


def line_of_limits(
    name: str, rows: Mapping[str, Any], trials: Mapping[str, Any], doubt: float
) -> dict[str, Any]:
    """Return what a class of touches can say at best, and what is answered.

    `rows` are columns of `COLUMNS`, `trials` those of the touches. Bits count 0 where the true
    place is not the likeliest; `named` is the share that can be named among so many places, of
    touches whose true place is the likeliest in this set. Errors and bounds are those of the right
    answers, rms.
    """
    count = len(rows["number"])
    bits = np.where(rows["likeliest"], np.nan_to_num(rows["bits"]), 0.0)
    right = (trials["verdict"] == RIGHT) & np.isfinite(rows["bound_mm"])
    line: dict[str, Any] = {
        "class": name,
        "touches": count,
        "bits": round_digits(float(np.median(bits))),
        "likeliest": share_of(int(rows["likeliest"].sum()), count),
        "best": share_of(int((rows["likeliest"] & (rows["doubt"] <= doubt)).sum()), count),
        "right": share_of(int((trials["verdict"] == RIGHT).sum()), count),
        "wrong": int((trials["verdict"] == WRONG).sum()),
        "named": [
            {"places": n, **share_of(int((bits >= math.log2(n / doubt)).sum()), count)}
            for n in PLACES
        ],
    }
    for unit in ("mm", "deg"):
        error, bound = rms(trials[f"error_{unit}"][right]), rms(rows[f"bound_{unit}"][right])
        ratio = round_digits(error / bound) if error is not None and bound else None
        line |= {f"rms_{unit}": error, f"bound_{unit}": bound, f"ratio_{unit}": ratio}
    return line


def alphabets_of(arrays: Iterable[EmbossedArray]) -> list[dict[str, Any]]:
    """Return of each array its alphabet, bits a symbol, pitch, and registered places."""
    return [
        {
            "alphabet": one.alphabet.name,
            "bits": round_digits(math.log2(one.array.order)),
            "pitch_mm": one.style.pitch_mm,
            "places": len(one.keys),
        }
        for one in arrays
    ]
