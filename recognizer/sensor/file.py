"""The state of a sensor in a file: JSON that a person can read, the same bytes for the same state.

It lies next to the calibration. Dead and hot tactels are letters (`.` sound, `D`, `H`), a row a
line, as in a calibration; numbers have seven digits. A staged file replaces it as a whole.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.base.errors import exit_code_of_write
from encoded_objects.base.files import staged_file
from encoded_objects.base.foreign import DAMAGE, foreign_json
from recognizer.errors import SensorStateError
from recognizer.sensor.learn import LEAST_TOUCHES
from recognizer.sensor.wiring import WORDS
from recognizer.touch.sensor_state import ASIDE_SD_MM, SensorState

FORMAT = "tactile sensor state"
VERSION = 1
DIGITS = 7  #: significant digits of every number
#: least and most of each array that can be learned: counts or N, shares, mm
_RANGES = {
    "offset": (-1e5, 1e5), "gain": (1e-3, 1e3), "gain_deviation": (0.0, 1e3),
    "aside_mm": (-10.0, 10.0), "aside_deviation_mm": (0.0, 10.0),
}  # fmt: skip
_ARRAYS = tuple(_RANGES)


def write_state(state: SensorState, path: str | os.PathLike[str]) -> None:
    """Write a state, whole or not at all, over what is there.

    Raises
    ------
    SensorStateError
        The file cannot be written.
    """
    letters = np.where(state.hot, "H", np.where(state.dead, "D", "."))
    document: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "sensor": state.sensor,
        "touches": state.touches,
        "unit": "N" if state.newtons else "counts",
        "floating": state.floating,
        "drift": float(f"{state.drift:.{DIGITS}g}"),
        "tactels": ["".join(row) for row in letters],
    }
    if state.mounting is not None:
        document["mounting"] = list(state.mounting)
    document |= {name: _round_digits(getattr(state, name).tolist()) for name in _ARRAYS}
    lines = ",\n".join(f"  {json.dumps(key)}: {_text(value)}" for key, value in document.items())
    try:
        with staged_file(Path(path)) as staged:
            staged.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    except OSError as error:
        raise SensorStateError(
            f"cannot be written: {error.strerror}",
            fix="choose another folder",
            exit_code=exit_code_of_write(error),
            place=str(path),
        ) from error


def read_state(path: str | os.PathLike[str], *, sensors: tuple[str, ...] = ()) -> SensorState:
    """Read a state; `sensors` are names that it may have: the sensor's and its type's; none: any.

    Raises
    ------
    SensorStateError
        The file is none, of a newer version, damaged, or another sensor's.
    """
    place, again = str(path), "learn the sensor again: recognize-object --learn FILE"
    document = foreign_json(path, SensorStateError, fix=again)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise SensorStateError("is no state of a sensor", fix=again, place=place)
    if document.get("version") != VERSION:
        raise SensorStateError(
            f"is of version {document.get('version')}, this program reads {VERSION}",
            fix=f"update the program, or {again}", place=place,
        )  # fmt: skip
    try:
        letters = np.array([list(row) for row in document["tactels"]])
        if not np.isin(letters, [".", "D", "H"]).all():
            raise ValueError("tactels are . D H")
        state = SensorState(
            sensor=str(document["sensor"]),
            touches=int(document["touches"]),
            newtons={"N": True, "counts": False}[document["unit"]],
            dead=letters == "D",
            hot=letters == "H",
            floating=bool(document["floating"]),
            drift=float(document["drift"]),
            mounting=_mounting(document.get("mounting")),
            **{name: np.array(document[name], np.float64) for name in _ARRAYS},
        )
        for name, (least, most) in _RANGES.items():
            values = getattr(state, name)
            if not ((values >= least) & (values <= most)).all():
                raise ValueError(f"{name} from {least:g} to {most:g}")
    except (*DAMAGE, SensorStateError) as error:
        raise SensorStateError(f"is damaged: {error!r}", fix=again, place=place) from error
    if sensors and state.sensor not in sensors:
        raise SensorStateError(
            f"is of sensor {state.sensor!r}, not of {sensors[0]!r}",
            fix="give what was learned of this sensor, or another file to learn it anew",
            place=place,
        )
    return state


def state_entry(state: SensorState) -> dict[str, Any]:
    """Return a state for `--json`: tactels, spreads, and the number of touches."""
    sound = ~state.masked
    known = sound & (state.aside_deviation_mm.max(axis=-1) < ASIDE_SD_MM / 2)
    return {
        "sensor": state.sensor,
        "touches": state.touches,
        "dead": np.argwhere(state.dead),
        "hot": np.argwhere(state.hot),
        "raised": np.argwhere(sound & (state.offset != 0)),
        "floating": state.floating,
        "gain_spread": float(np.std(np.log(state.gain[sound]))) if sound.any() else 0.0,
        "tips_known": int(known.sum()),
        "tips_aside_mm": float(np.sqrt(np.mean(state.aside_mm[known] ** 2)))
        if known.any()
        else 0.0,
        "drift": state.drift,
        "mounting": None if state.mounting is None else WORDS[state.mounting],
    }


def state_words(state: SensorState) -> str:
    """Return a state in one line."""
    entry = state_entry(state)
    many = "1 touch" if state.touches == 1 else f"{state.touches:,} touches"
    if state.touches < LEAST_TOUCHES:
        few = f"{many}, too few to learn from; touch {LEAST_TOUCHES} places or more"
        known = "" if state.mounting is None else f"mounted {WORDS[state.mounting]}; "
        return f"{state.sensor}: {known}{few}"
    parts = [] if state.mounting is None else [f"mounted {WORDS[state.mounting]}"]
    for name, what in (("dead", "never answer"), ("hot", "read high with nothing on them")):
        if len(entry[name]):
            parts.append(f"{len(entry[name])} of {state.dead.size} tactels {what}")
    if state.floating:
        parts.append("rows float while another is read: the network is inverted")
    parts.append(f"gains differ by {100 * entry['gain_spread']:.0f} %")
    if entry["tips_known"]:
        parts.append(f"tips stand {entry['tips_aside_mm']:.2f} mm aside (of {entry['tips_known']})")
    unit = "N" if state.newtons else "counts"
    if abs(state.drift) >= (0.05 if state.newtons else 2.0):
        parts.append(f"the background drifted by {state.drift:+.2g} {unit}")
    return f"{state.sensor}, {many}: {'; '.join(parts)}"


def _mounting(stored: list[str] | None) -> tuple[str, ...] | None:
    found = None if stored is None else tuple(stored)
    if found is not None and found not in WORDS:
        raise ValueError(f"mounting is one of {[list(known) for known in WORDS]}")
    return found


def _round_digits(value: Any) -> Any:
    if isinstance(value, list):
        return [_round_digits(one) for one in value]
    return float(f"{value:.{DIGITS}g}")


def _text(value: Any) -> str:
    """Return JSON, a row of an array a line."""
    if not isinstance(value, list):
        return json.dumps(value)
    return "[\n" + ",\n".join(f"    {json.dumps(row)}" for row in value) + "\n  ]"
