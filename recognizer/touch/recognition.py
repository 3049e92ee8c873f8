"""The answer: which object, which face, where, and how sure; or why not. Thesis 6.3.

Frames: `T_face_probe` takes the sensor frame to the face frame (origin at the face's first vertex,
x along its first edge, z outward), `T_object_probe` to the object frame; mm. Both frames are those
of the design; on a part whose print is known (`touch.as_built`) poses are those on the printed
part, whose place is that of its file's middle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

NO_CONTACT = "no contact"
TOO_FEW = "too few symbols"
AMBIGUOUS = "ambiguous"
BY_CHANCE = "ambiguous by chance"
NOT_ENCODED = "not an encoded surface"
OUTSIDE = "outside every face"

# Codes of causes.
NO_LOAD = "no_contact"
SOFT = "soft"
HARD = "hard"
TILTED = "tilted"
MOVING = "moving"
EDGE = "edge"
ONE_ROW = "one_row"
DEAD_TACTELS = "dead_tactels"
EXCHANGED = "halves_exchanged"
NOT_REGISTERED = "not_registered"
TOO_FINE = "too_fine"
OTHER_PATTERN = "other_pattern"
PLAIN = "not_encoded"
UNCLEAR = "unclear"

# Whether a touch placed by hand has shown how the sensor is mounted.
UNCHECKED, CHECKED = "unchecked", "checked"

# What the covariance allows for beyond the image: nothing, what `as-built` measured, a usual print.
AS_DESIGNED, AS_BUILT, NOT_MEASURED = "as designed", "as built", "not measured"

Numbers = Mapping[str, float]

#: What a person does about a reason.
WAYS_OUT = {
    NO_CONTACT: "press the probe onto the object",
    TOO_FEW: "press harder, or where more symbols are: away from edges and holes",
    AMBIGUOUS: "touch again a few mm beside",
    BY_CHANCE: "touch amid the face or press harder, or read several touches as one (--scan)",
    NOT_ENCODED: "touch again more evenly, away from edges; is the object in this database, and "
    "the overlay the right one (--overlay)?",
    OUTSIDE: "move the probe onto the face",
}


@dataclass(frozen=True, slots=True)
class Cause:
    """What of a touch made it fail: `Recognition.reason` names the test that it failed.

    Lengths in mm, angles in degrees, shares 0 ... 1; readings in newtons where the sensor is
    calibrated, otherwise in counts.

    Examples
    --------
    >>> print(Cause(EDGE, {"loaded": 0.531, "symbols": 4.0}))
    at an edge: 53 % of the sensor is loaded, 4 symbols are read
    """

    code: str  #: one of this module's
    evidence: Numbers  #: the numbers behind it, exact

    def __str__(self) -> str:
        return _CAUSES[self.code][0](self.evidence)

    @property
    def way_out(self) -> str:
        """What a person does about it."""
        return _CAUSES[self.code][1].format(**self.evidence)


@dataclass(frozen=True, slots=True, eq=False)
class RunnerUp:
    """The best other place, the one that the margin is measured against."""

    object: str
    face: str
    index: tuple[int, int]


@dataclass(frozen=True, slots=True)
class NextTouch:
    """Where the next touch promises most, in the sensor's frame of this one."""

    dx_mm: float  #: step of the sensor's centre
    dy_mm: float
    turn_deg: float  #: of the sensor, about z
    force_n: float  #: to press with
    why: str

    def __str__(self) -> str:
        steps = [f"{step:g} mm along {axis}"
                 for step, axis in ((self.dx_mm, "x"), (self.dy_mm, "y")) if step]  # fmt: skip
        turn = [f"turned by {self.turn_deg:g} degrees"] if self.turn_deg else []
        return f"{', '.join([*(steps or ['here']), *turn])}, {self.force_n:g} N ({self.why})"


@dataclass(frozen=True, slots=True, eq=False)
class Recognition:
    """The answer of one touch, or several: true if it is one; prints as a line.

    Examples
    --------
    >>> print(refusal(0, AMBIGUOUS))
    not recognised: ambiguous; touch again a few mm beside
    """

    seq: int
    object: str | None  #: None where it does not answer
    face: str | None
    index: tuple[int, int] | None  #: row and column of the array's cell under the sensor's centre
    T_face_probe: NDArray[np.float64] | None  #: (4, 4)
    T_object_probe: NDArray[np.float64] | None  #: (4, 4)
    covariance: NDArray[np.float64] | None  #: (3, 3) of x, y (mm) and the turn about z (rad), face
    margin: float | None  #: log-likelihood ratio to the runner-up, nats
    runner_up: RunnerUp | None
    reason: str  #: "" where it answers
    noise: float | None = None  #: standard deviation of psi that the symbols leave unexplained
    scale: float | None = None  #: of the print by this touch: 1 is as designed
    stroke_mm: float | None = None  #: width of the strokes of the print
    doubt: float | None = None
    """Expected number of registered places that a foreign surface (other symbols than any that
    are registered) would match as well by chance; None where another reason refuses, and where the
    thesis's way is read."""
    bits: float | None = None
    """What symbols and outline say about the place, bits: `doubt` is 2^-bits times the number of
    registered places on arrays of that alphabet and style. Known where `doubt` is."""
    bits_missing: float | None = None
    """Bits more that the doubt would need to be at the reader's limit; None where none miss."""
    next: NextTouch | None = None  #: where it does not answer or is unsure
    cause: Cause | None = None  #: what of the touch made it fail; None where it answers
    inside_mm: float | None = None
    """How far the sensor's centre lies inside the face's outline; negative outside; None where it
    does not answer, on a round face, and where the thesis's way is read."""
    mounting: str = UNCHECKED
    """`CHECKED` where `recognize-object check` has found how the sensor is mounted: a sensor that
    is turned by quarters gives poses that are turned, and no touch by itself shows it."""

    part: str = ""
    """What the pose and its covariance take the part for: `AS_DESIGNED` (a simulated one, and every
    round face), `AS_BUILT` (its print or its printer was measured), `NOT_MEASURED` (a print within
    the usual spread); empty where it does not answer."""

    def __bool__(self) -> bool:
        return self.object is not None

    def __str__(self) -> str:
        """Return what and where, or why not and what to do."""
        if not self:
            others = ""
            if self.runner_up is not None and self.reason == AMBIGUOUS:
                others = f", {self.runner_up.object}/{self.runner_up.face} among others"
            if self.bits_missing is not None:
                others = f", {math.ceil(self.bits_missing)} bits short of naming one place"
            said = self.reason if self.cause is None else str(self.cause)
            if self.cause is not None and self.reason not in (NO_CONTACT, TOO_FEW, NOT_ENCODED):
                said = f"{self.reason}: {said}"
            way_out = f"; {self.way_out}" if self.way_out else ""
            step = f"; next: {self.next}" if self.next is not None else ""
            return f"not recognised: {said}{others}{way_out}{step}"
        margin = "no other place comes near"
        if self.margin is not None and math.isfinite(self.margin):
            margin = f"{self.margin / math.log(2.0):.0f} bits over the next place"
        given = "" if math.isnan(self.spread_mm) else f" +- {self.spread_mm:.2f}"
        return (
            f"{self.object}/{self.face} at ({self.x_mm:.2f}, {self.y_mm:.2f}) mm{given}"
            f" turned {self.theta_deg:.1f} degrees; array {self.index or (0, 0)}; {margin}"
            + (f"; part {self.part}" if self.part else "")
        )

    @property
    def x_mm(self) -> float:
        """Of the probe on the face; NaN where it does not answer."""
        return math.nan if self.T_face_probe is None else float(self.T_face_probe[0, 3])

    @property
    def y_mm(self) -> float:
        """Of the probe on the face; NaN where it does not answer."""
        return math.nan if self.T_face_probe is None else float(self.T_face_probe[1, 3])

    @property
    def theta_deg(self) -> float:
        """Turn of the probe on the face, degrees; NaN where it does not answer."""
        T = self.T_face_probe
        return math.nan if T is None else math.degrees(math.atan2(T[1, 0], T[0, 0]))

    @property
    def spread_mm(self) -> float:
        """Standard deviation of the place, mm; NaN where it is not known."""
        if self.covariance is None:
            return math.nan
        return math.sqrt(max(float(self.covariance[:2, :2].trace()), 0.0))

    @property
    def way_out(self) -> str:
        """What a person does about the reason; empty where it answers."""
        if self.cause is not None and (
            self.reason in (TOO_FEW, NOT_ENCODED) or self.cause.code == EXCHANGED
        ):
            return self.cause.way_out
        return WAYS_OUT.get(self.reason, "")

    @property
    def reason_code(self) -> str:
        """Why it failed, for programs: a code of `cause`, else the reason in small letters."""
        return self.reason.replace(" ", "_") if self.cause is None else self.cause.code

    def as_json(self) -> dict[str, Any]:
        """Return the plain values that `recognize-object --json` prints."""
        runner_up = self.runner_up
        return {
            "seq": self.seq,
            "object": self.object,
            "face": self.face,
            "index": None if self.index is None else list(self.index),
            "T_face_probe": _as_lists(self.T_face_probe),
            "T_object_probe": _as_lists(self.T_object_probe),
            "covariance": _as_lists(self.covariance),
            "margin": None if self.margin is None else round(self.margin, 4),
            "runner_up": None
            if runner_up is None
            else {
                "object": runner_up.object,
                "face": runner_up.face,
                "index": list(runner_up.index),
            },
            "reason": self.reason,
            "reason_code": self.reason_code,
            "evidence": None if self.cause is None else dict(self.cause.evidence),
            "doubt": self.doubt,
            "bits": None if self.bits is None else round(self.bits, 2),
            "bits_missing": None if self.bits_missing is None else round(self.bits_missing, 2),
            "scale": self.scale,
            "stroke_mm": self.stroke_mm,
            "next": None if self.next is None else asdict(self.next),
            "mounting": self.mounting,
            "part": self.part or None,
        }


def refusal(
    seq: int,
    reason: str,
    *,
    margin: float | None = None,
    runner_up: RunnerUp | None = None,
    doubt: float | None = None,
) -> Recognition:
    """Return the value of a touch that is not answered."""
    none = None, None, None, None, None, None
    return Recognition(seq, *none, margin, runner_up, reason, doubt=doubt)


def _as_lists(matrix: NDArray[np.float64] | None) -> list[list[float]] | None:
    return None if matrix is None else matrix.tolist()


def _percent(share: float) -> str:
    return f"{100 * max(share, 0.0):.0f} %"


def _symbols_read(count: float) -> str:
    return "1 symbol is read" if round(count) == 1 else f"{count:.0f} symbols are read"


#: Of each code: what is said of the numbers behind it, and what a person does about it.
_CAUSES: dict[str, tuple[Callable[[Numbers], str], str]] = {
    NO_LOAD: (lambda _: "no contact", "press the probe onto the object"),
    SOFT: (
        lambda n: (
            "pressed too softly: readings reach "
            + (f"{n['plateau']:.2g} N" if n["newtons"] else f"{n['plateau']:.0f} counts")
            + f", {n['signal_to_noise']:.0f} times their noise"
        ),
        "press harder",
    ),
    HARD: (
        lambda n: (
            "pressed too hard: readings add up to "
            + (f"{n['sum']:.0f} N" if n["newtons"] else f"{n['sum']:.0f} counts")
            + f" where {n['most']:.0f} are usual, and gaps read nearly as much as strokes"
        ),
        "press with {least_n:.2g} to {most_n:.3g} N",
    ),
    TILTED: (
        lambda n: f"tilted: the load falls by {_percent(n['slope'])} across the sensor",
        "hold the probe flat on the face",
    ),
    MOVING: (
        lambda n: (
            f"the sensor moved while it was read: along {n['direction_deg']:.0f} degrees contours "
            f"are {_percent(n['sharpness'])} as sharp as across"
        ),
        "hold the probe still",
    ),
    EDGE: (
        lambda n: (
            f"at an edge: {_percent(n['loaded'])} of the sensor is loaded, "
            f"{_symbols_read(n['symbols'])}"
        ),
        "move towards the loaded part",
    ),
    ONE_ROW: (
        lambda n: f"one row of symbols: what is loaded is {n['width_mm']:.0f} mm wide",
        "one row tells no place: touch another face, or several places as one (--scan)",
    ),
    DEAD_TACTELS: (
        lambda n: (
            f"dead tactels: {_percent(n['silent'])} of those that symbols should press read nothing"
        ),
        "learn the sensor: recognize-object --learn FILE, from 25 touches or more",
    ),
    EXCHANGED: (
        lambda n: (
            "all of the touch lies on one face if the halves of the sensor's "
            f"{'columns' if n['columns'] else 'rows'} are exchanged"
        ),
        "is the sensor wired as drawn? recognize-object check tells",
    ),
    TOO_FINE: (
        lambda n: (
            f"symbols of {n['pitch_mm']:g} mm are too fine for this type of sensor, which reads "
            f"{n['best_mm']:g} mm best"
        ),
        "make parts for it: sensor_type: NAME in their spec; or take a finer sensor",
    ),
    NOT_REGISTERED: (
        lambda n: (
            f"{_symbols_read(n['symbols_anywhere'])} and explain "
            f"{_percent(n['explained_anywhere'])} of the image, but stand so nowhere in this "
            "database"
        ),
        "is the object in this database, or of another lab?",
    ),
    OTHER_PATTERN: (
        lambda n: (
            "raised, but not by symbols of this database: they explain "
            f"{_percent(n['explained_anywhere'])} of the image"
        ),
        "another profile, another overlay (--overlay), or an object of no lab?",
    ),
    PLAIN: (
        lambda n: (
            "not an encoded surface: no strokes are felt, readings vary by "
            f"{_percent(n['variation'])}"
        ),
        "is the object in this database?",
    ),
    UNCLEAR: (
        lambda n: (
            f"symbols are read poorly: {n['symbols']:.0f} of them, which explain "
            f"{_percent(n['explained'])} of the image"
        ),
        "touch again more evenly, a few mm beside",
    ),
}
