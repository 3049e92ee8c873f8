"""Simulated touches: recording, picture, and truth, each where it was asked for.

Touch i draws from a generator of (seed, i) alone, so that it is the same in any number of
touches. Its frames follow each other at the board's rate under a steady force; the film was
not loaded before. Truth stands in a file of its own, never beside the frames.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.console import INTERRUPTED
from encoded_objects.console.files import refuse_taken, staged
from encoded_objects.console.interruption import interruption
from encoded_objects.console.output import message, write, write_json
from encoded_objects.console.progress import progress_bar
from probe.circuit import QUIET, Electronics, Noise, fsr_of, read_counts
from probe.command.recorded import check_output
from probe.contact.contract import Contact, Touch
from probe.contact.press import accuracy_of, level_for, press
from probe.errors import SurfaceError
from probe.frame import Frame, frame_from
from probe.recording.record import Recorder
from probe.sensor import Overlay, SensorType
from probe.simulate.scene import Scene
from probe.simulate.touch import Touches, pose_of, random_touches

FORCE_N = 80.0  #: as the thesis pressed its washer
WASHER = "washer"


@dataclass(frozen=True, slots=True)
class Asked:
    """Touches as the command line names them: mm, degrees, N; None where it does not."""

    x_mm: float | None
    y_mm: float | None
    theta_deg: float | None
    force_n: float | None
    tilt_x_deg: float | None
    tilt_y_deg: float | None
    touches: int | None  #: at random; None: one, as asked
    frames: int
    seed: int


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """One touch and its frames."""

    scene: Scene  #: that it met
    touch: Touch
    contact: Contact
    frames: tuple[Frame, ...]


def simulate_touches(
    target: str,
    asked: Asked,
    *,
    overlay: str,
    accuracy: str,
    noise: str,
    output: Path | None,
    png: Path | None,
    truth: Path | None,
    replace: bool,
    as_json: bool,
) -> int:
    """Simulate and write; returns the exit code. What an interruption leaves is complete.

    Raises
    ------
    SurfaceError
        When the target is no surface; exit code 4 if its database cannot be read.
    ContactError
        When a touch has no equilibrium, or the accuracy cannot be had.
    RecordingError, ProbeError
        When a file is there already.
    """
    if output is not None:
        check_output(output, replace=replace)
    for out, suffix in ((png, ".png"), (truth, ".json")):
        if out is not None:
            refuse_taken(out, suffix, replace=replace)
    sensor = SensorType(overlay=Overlay(kind="pad" if overlay == "pad" else "tab"))
    level = level_for(sensor, accuracy_of(accuracy))
    board = Electronics(noise=QUIET if noise == "quiet" else Noise())
    scene = scene_of(target)
    number = asked.touches or 1
    kept: list[dict[str, Any]] = []
    with ExitStack() as stack:
        attributes = {
            "simulated": target, "overlay": overlay, "level": level, "noise": noise,
            "seed": asked.seed, "frames_per_touch": asked.frames,
        }  # fmt: skip
        recorder = None
        if output is not None:
            draft = stack.enter_context(staged(output))  # a refused touch leaves no file
            recorder = stack.enter_context(
                Recorder(draft, sensor=f"simulated/{overlay}", attributes=attributes,
                         roll_over_s=math.inf)
            )  # fmt: skip
        told = stack.enter_context(progress_bar("touching", number))
        interrupted = stack.enter_context(interruption())
        for i, felt in enumerate(_touched(scene, sensor, board, level, asked)):
            if recorder is not None:
                for frame in felt.frames:
                    recorder.append(frame)
            if i == 0:
                first = felt
            kept.append(_told(felt))
            told.show(i + 1, f"{i + 1:,} of {number:,}")
            if interrupted.is_set():
                break
    if png is not None:
        _picture(first, sensor, png, noise)
    result = {
        "target": target, "object": scene.object_name or None, "face": scene.face or None,
        "overlay": overlay, "level": level, "seed": asked.seed,
        "frames_per_touch": asked.frames, "touches": kept,
    }  # fmt: skip
    if truth is not None:
        with staged(truth) as draft:
            draft.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", "utf-8")
    written = [str(out) for out in (output, png, truth) if out is not None]
    _say(result, first, written, as_json=as_json)
    if len(kept) == number:
        return 0
    message(f"probe-sensor: interrupted after {len(kept):,} of {number:,} touches")
    return INTERRUPTED


def scene_of(target: str) -> Scene:
    """Return what a target names: a part, a registered face, or the thesis's washer.

    Raises
    ------
    SurfaceError
        When it names nothing; the message lists what is known.
    """
    if target != WASHER:
        from probe.simulate.target import surface_of

        return surface_of(target)
    from probe.surface.indenters import Washer
    from probe.surface.polygon import polygon

    half = Washer().outer_mm / 2
    square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    return Scene(Washer(), polygon([square]), WASHER)


def _touched(
    scene: Scene, sensor: SensorType, board: Electronics, level: str, asked: Asked
) -> Iterator[Felt]:
    fsr = fsr_of(sensor.rows, sensor.columns)
    for i in range(asked.touches or 1):
        rng = np.random.default_rng([asked.seed, i])
        touch = _touch(scene, asked, rng)
        met = scene.under(touch)
        contact = press(met.surface, sensor, touch, accuracy=level)
        state, frames = None, []
        for beat in range(asked.frames):
            counts, state = read_counts(contact.forces_n, board, fsr, state, rng)
            seq = i * asked.frames + beat
            frames.append(frame_from(counts, t_ns=round(seq * board.frame_s * 1e9), seq=seq))
        yield Felt(met, touch, contact, tuple(frames))


def _touch(scene: Scene, asked: Asked, rng: np.random.Generator) -> Touch:
    """Return the touch that was asked for; what was not is drawn, or has a default."""
    if asked.touches is None:
        x, y = scene.centre_mm()
        drawn = Touch(float(x), float(y), 0.0, FORCE_N)
    else:
        drawn = next(random_touches(scene.region, rng, Touches()))
    touch = Touch(
        _or(asked.x_mm, drawn.x_mm),
        _or(asked.y_mm, drawn.y_mm),
        math.radians(_or(asked.theta_deg, math.degrees(drawn.theta_rad))),
        _or(asked.force_n, drawn.force_n),
        math.radians(_or(asked.tilt_x_deg, math.degrees(drawn.tilt_x_rad))),
        math.radians(_or(asked.tilt_y_deg, math.degrees(drawn.tilt_y_rad))),
        drawn.wrist,
    )
    numbers = (touch.x_mm, touch.y_mm, touch.theta_rad, touch.force_n, touch.tilt_x_rad,
               touch.tilt_y_rad)  # fmt: skip
    if not all(map(math.isfinite, numbers)):
        raise SurfaceError("a touch at what is no finite number", fix="give mm, degrees and N")
    return touch


def _or(given: float | None, drawn: float) -> float:
    return drawn if given is None else given


def _told(felt: Felt) -> dict[str, Any]:
    """Return the truth of one touch."""
    touch, contact = felt.touch, felt.contact
    touching = math.isfinite(contact.z_mm)
    T_face_probe = pose_of(touch, contact) if touching else None
    T_object_probe = None
    T_object_surface = felt.scene.T_object_surface
    if T_face_probe is not None and T_object_surface is not None:
        T_object_probe = T_object_surface @ T_face_probe
    return {
        "seq": felt.frames[0].seq,
        "x_mm": touch.x_mm,
        "y_mm": touch.y_mm,
        "theta_deg": math.degrees(touch.theta_rad),
        "force_n": touch.force_n,
        "tilt_x_deg": math.degrees(touch.tilt_x_rad),
        "tilt_y_deg": math.degrees(touch.tilt_y_rad),
        "felt_n": float(contact.forces_n.sum()),
        "tactels": int((contact.forces_n > 0).sum()),
        "T_face_probe": None if T_face_probe is None else T_face_probe.tolist(),
        "T_object_probe": None if T_object_probe is None else T_object_probe.tolist(),
    }


def _picture(felt: Felt, sensor: SensorType, png: Path, noise: str) -> None:
    from probe.plot.touch import touch_picture

    what = f"{felt.scene.name}, {felt.touch.force_n:g} N, {sensor.overlay.kind} overlay"
    if noise == "quiet":
        what += ", without noise"
    with staged(png) as draft:
        touch_picture(felt.scene.surface, sensor, felt.touch, felt.contact.forces_n,
                      felt.frames[0].counts, draft, title=what)  # fmt: skip


def _say(result: dict[str, Any], first: Felt, written: list[str], *, as_json: bool) -> None:
    kept = result["touches"]
    if as_json:
        summary = {name: value for name, value in result.items() if name != "touches"}
        write_json(summary | {
            "touches": len(kept), "frames": len(kept) * result["frames_per_touch"],
            "first": kept[0] | {"peak_counts": first.frames[0].counts.max()},
            "written": written,
        })  # fmt: skip
        return
    what = "/".join(part for part in (result["object"], result["face"]) if part)
    number = "1 touch" if len(kept) == 1 else f"{len(kept):,} touches"
    write(f"{what or result['target']}: {number}, {result['overlay']} overlay, level "
                 f"{result['level']}")  # fmt: skip
    if len(kept) == 1:
        one, counts = kept[0], first.frames[0].counts
        write(
            f"  at ({one['x_mm']:.2f}, {one['y_mm']:.2f}) mm turned {one['theta_deg']:.1f} "
            f"degrees, {one['force_n']:g} N: {one['tactels']} tactels, peak {counts.max()} counts"
        )
    for name in written:
        write(f"  wrote {name}")
