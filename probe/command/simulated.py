"""`probe-sensor simulate`: touches of a part, as a recording, a picture, and their truth.

Truth stands in a file of its own, never among the frames.
"""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from encoded_objects.base.console import INTERRUPTED, interruption
from encoded_objects.base.errors import require
from encoded_objects.base.files import refuse_taken, staged_file
from encoded_objects.base.output import count_of, message, progress_bar, write, write_json
from probe.command.options import SimulateOptions
from probe.command.recorded import check_output
from probe.simulate.simulation import SimulatedProbe, SimulatedTouch, TouchOptions

if TYPE_CHECKING:
    from probe.simulate.scan import ScanKind


def simulate_touches(options: SimulateOptions) -> int:
    """Simulate and write; returns the exit code. The files of an interrupted run are complete.

    Raises ContactError: a touch has no equilibrium; RecordingError, EncodedObjectsError: a file is
    there already, or its name is wrong.
    """
    output, png, truth = options.output, options.png, options.truth
    _check_outputs(options)
    touches = TouchOptions(
        options.x, options.y, options.theta, options.force, options.tilt_x, options.tilt_y,
        options.touches, options.frames, options.seed, cast("ScanKind | None", options.scan)
    )  # fmt: skip
    probe = SimulatedProbe(
        options.target, touches, sensor_type=options.sensor_type, overlay=options.overlay,
        accuracy=options.accuracy, noise="quiet" if options.noise == "quiet" else "typical"
    )  # fmt: skip
    number = len(probe)
    kept: list[dict[str, Any]] = []
    with ExitStack() as stack:
        recorder = None
        if output is not None:
            recorder = stack.enter_context(probe.recorder(output))
        bar = stack.enter_context(progress_bar("touching", number))
        interrupted = stack.enter_context(interruption())
        for i, one in enumerate(probe.touches()):
            if recorder is not None:
                for frame in one.frames:
                    recorder.append(frame)
            if i == 0:
                first = one
            kept.append(one.truth())
            bar.show(i + 1, f"{i + 1:,} of {number:,}")
            if interrupted.is_set():
                break
    if png is not None:
        _picture(first, probe, png)
    result = probe.truth(kept)
    if truth is not None:
        with staged_file(truth) as draft:
            draft.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", "utf-8")
    written = [str(out) for out in (output, png, truth) if out is not None]
    _say(result, first, written, as_json=options.as_json)
    blocked = [one["T_face_probe"][2][3] for one in kept if "met_another_face" in one]
    if blocked:
        met = count_of(len(blocked), "touch")
        message(f"{met} met another face of the part, {max(blocked):.1f} mm over this one")
    if probe.drawn_again:
        again = count_of(probe.drawn_again, "touch")
        message(f"{again} drawn again, where the plate found no rest")
    if len(kept) == number:
        return 0
    message(f"probe-sensor: interrupted after {len(kept):,} of {number:,} touches")
    return INTERRUPTED


def _check_outputs(options: SimulateOptions) -> None:
    """Refuse names that are taken or wrong, before anything else is done."""
    output, png, truth, replace = options.output, options.png, options.truth, options.replace
    if output is not None:
        check_output(output, replace=replace)
    for out, suffix in ((png, ".png"), (truth, ".json")):
        if out is not None:
            refuse_taken(out, suffix, replace=replace)
    if png is not None:
        require("matplotlib", extra="report", purpose="--png")


def _picture(one: SimulatedTouch, probe: SimulatedProbe, png: Path) -> None:
    from probe.plot.touch import touch_picture

    what = f"{one.scene.name}, {one.touch.force_n:g} N, {probe.overlay} overlay"
    if probe.noise == "quiet":
        what += ", without noise"
    with staged_file(png) as draft:
        touch_picture(one.scene.surface, probe.sensor, one.touch, one.contact.forces_n,
                      one.frames[0].counts, draft, title=what)  # fmt: skip


def _say(
    result: dict[str, Any], first: SimulatedTouch, written: list[str], *, as_json: bool
) -> None:
    kept = result["touches"]
    if as_json:
        summary = {name: value for name, value in result.items() if name != "touches"}
        write_json(summary | {
            "touches": len(kept), "frames": len(kept) * result["frames_per_touch"],
            "first": kept[0] | {"peak_counts": first.frames[0].counts.max()},
            "written": written
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
