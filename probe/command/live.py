"""`probe-sensor live`: on a terminal by `rich.live` and keys, elsewhere a line a second."""

from __future__ import annotations

import os
import select
import sys
import termios
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from threading import Event

from rich.console import Console
from rich.live import Live

from encoded_objects.base.console import INTERRUPTED, interruption
from encoded_objects.base.output import message, write, write_json
from probe.calibration import read_calibration
from probe.client.stream import Stream, name_of
from probe.command.app import LiveOptions
from probe.command.live_state import LiveState
from probe.command.live_view import line_of, render_frame
from probe.port.url import typed_port

_PICTURES_HZ = 15
KeyReader = Callable[[float], str]
"""Returns what was typed within so many seconds, as soon as something was; else nothing."""


def watch(options: LiveOptions) -> int:
    """Show a probe until the operator quits, a recording ends, or the time is over.

    Raises
    ------
    PortError
        The probe is not there, or went away for good.
    CalibrationError
        The calibration is none, or another sensor's.
    SensorTypeError
        No such type, or frames of another shape.
    """
    url, calibration, seconds = options.url, options.calibration, options.seconds
    known = None if calibration is None else read_calibration(calibration)
    port, kind = typed_port(url, options.sensor_type)
    state = LiveState(url, options.folder, known, kind)
    with interruption() as interrupted, Stream(port, sensor=options.sensor) as stream:
        try:
            if known is not None and calibration is not None:
                read_calibration(calibration, sensor=name_of(stream.ident(), url) or None)
            until_s = time.monotonic() + (float("inf") if seconds is None else seconds)
            if sys.stdout.isatty() and not options.as_json:
                return _on_terminal(state, stream, interrupted, until_s)
            return _in_lines(state, stream, interrupted, until_s, as_json=options.as_json)
        finally:
            state.end_recording()


def _on_terminal(state: LiveState, stream: Stream, interrupted: Event, until_s: float) -> int:
    console = Console(highlight=False)
    colours = console.color_system is not None and not console.no_color
    with _keys() as pressed, Live(console=console, screen=True, auto_refresh=False) as view:
        while not (interrupted.is_set() or stream.ended) and time.monotonic() < until_s:
            state.take(stream.take(0.0))
            if notices := stream.client.notices():
                state.notice = "; ".join(notices[-3:])
            counts, ident = stream.client.statistics(), stream.client.ident
            height = console.size.height
            picture = render_frame(state, counts, ident, height=height, colours=colours)
            view.update(picture, refresh=True)
            if not _obey(state, stream, pressed):
                break
    return 0


def _obey(state: LiveState, stream: Stream, pressed: KeyReader) -> bool:
    """Wait for the next picture's time, do what the keys say; False to quit."""
    actions: dict[str, Callable[[], None]] = {
        "b": state.toggle_bias,
        "s": state.save,
        "r": lambda: state.toggle_recording(name_of(stream.client.ident, state.url)),
    }
    for key in pressed(1 / _PICTURES_HZ):
        if key == "q":
            return False
        if key == " ":
            state.paused = not state.paused
        elif key == "m":
            state.median = not state.median
        elif key in "01234567":
            stream.client.select_sensor(int(key))
            state.drop_bias()
            state.notice = f"sensor {key}"
        elif key in actions:
            actions[key]()
    return True


def _in_lines(
    state: LiveState, stream: Stream, interrupted: Event, until_s: float, *, as_json: bool
) -> int:
    due_s = time.monotonic() + 1.0
    while True:
        state.take(stream.take(0.1))
        for notice in stream.client.notices():
            message(notice)
        now_s = time.monotonic()
        over = interrupted.is_set() or stream.ended or now_s >= until_s
        if over or now_s >= due_s:
            due_s += 1.0
            _report(state, stream, as_json=as_json)
        if over:
            return INTERRUPTED if interrupted.is_set() else 0


def _report(state: LiveState, stream: Stream, *, as_json: bool) -> None:
    counts, image = stream.client.statistics(), state.image()
    if as_json:
        values = {
            "seq": None if state.frame is None else state.frame.seq,
            "peak": None if image is None else float(image.max()),
            "unit": state.unit,
            **asdict(counts),
        }
        write_json(values, line=True)
    else:
        write(line_of(state, counts))
    sys.stdout.flush()


@contextmanager
def _keys() -> Iterator[KeyReader]:
    """Yield a function that returns what is typed; the terminal is put back at the end."""
    if not sys.stdin.isatty():
        yield _no_keys
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)

    def pressed(timeout_s: float) -> str:
        ready, _, _ = select.select([descriptor], [], [], max(timeout_s, 0.0))
        return os.read(descriptor, 64).decode(errors="ignore") if ready else ""

    tty.setcbreak(descriptor)  # Ctrl-C still interrupts
    try:
        yield pressed
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _no_keys(timeout_s: float) -> str:
    select.select([], [], [], max(timeout_s, 0.0))
    return ""
