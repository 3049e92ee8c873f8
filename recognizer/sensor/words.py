"""What was learned of a sensor, in words and as JSON has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from recognizer.sensor.settings import LEARNING
from recognizer.touch.sensor_state import PRIOR, SensorState


def state_entry(state: SensorState) -> dict[str, Any]:
    """Return what `--json` gives: numbers of tactels, spreads, and what they rest on."""
    sound = ~state.masked
    known = sound & (state.aside_deviation_mm.max(axis=-1) < PRIOR.aside_mm / 2)
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
    }


def state_words(state: SensorState) -> str:
    """Return in a line what a person should know."""
    told, many = state_entry(state), _touches(state.touches)
    if state.touches < LEARNING.least:
        return (
            f"{state.sensor}: {many}, too few to learn from; touch {LEARNING.least} places or more"
        )
    said = []
    for name, what in (("dead", "never answer"), ("hot", "read high with nothing on them")):
        if len(told[name]):
            said.append(f"{len(told[name])} of {state.dead.size} tactels {what}")
    if state.floating:
        said.append("rows float while another is read: the network is inverted")
    said.append(f"gains differ by {100 * told['gain_spread']:.0f} %")
    if told["tips_known"]:
        said.append(f"tips stand {told['tips_aside_mm']:.2f} mm aside (of {told['tips_known']})")
    unit = "N" if state.newtons else "counts"
    if abs(state.drift) >= (0.05 if state.newtons else 2.0):
        said.append(f"the background drifted by {state.drift:+.2g} {unit}")
    return f"{state.sensor}, {many}: {'; '.join(said)}"


def _touches(count: int) -> str:
    return "1 touch" if count == 1 else f"{count:,} touches"
