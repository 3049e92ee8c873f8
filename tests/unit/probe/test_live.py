"""The live view: what is shown, what the keys change, in terminals of any size."""

import re
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from probe.calibration import expected_counts, read_calibration
from probe.calibration.load import BIAS_FRAMES
from probe.client import ClientStatistics
from probe.command.live import KEYS, LiveState, render_frame
from probe.frame import frame_from
from probe.protocol import IdentPacket

FILE = Path(__file__).parents[3] / "fixtures/recordings/calibration.json"
COUNTS = ClientStatistics(frames=120, rate=99.9, lost=3, failed=1, reopenings=1)
IDENT = IdentPacket(seq=0, t_us=0, settling_us=10.0, baud=1_000_000, sensor=2, name="FSR-uno")


def frames_of(*images):
    return [frame_from(image, t_ns=i * 10_000_000, seq=i) for i, image in enumerate(images)]


def flat(value):
    return np.full((16, 16), value)


@pytest.fixture
def state(tmp_path):
    return LiveState("sim:", tmp_path)


def shown(state, *, width=100, height=30, colours=False, ident=IDENT):
    console = Console(width=width, height=height, color_system="truecolor" if colours else None,
                      no_color=not colours, force_terminal=True)  # fmt: skip
    with console.capture() as capture:
        console.print(render_frame(state, COUNTS, ident, height=height, colours=colours))
    return capture.get()


def test_the_newest_frame_is_shown_and_pause_holds_it(state):
    assert state.image() is None
    assert "waiting for frames" in shown(state)
    state.take(frames_of(flat(10), flat(20)))
    assert (state.image() == 20).all()
    state.paused = True
    state.take(frames_of(flat(900)))
    assert (state.image() == 20).all()
    assert "PAUSED" in shown(state)
    assert state.scale == 32, "the scale of a sensor at rest does not blow up its noise"


def test_the_bias_is_the_mean_of_frames_and_comes_off_the_image(state):
    state.toggle_bias()
    assert state.taking_bias
    noise = np.random.default_rng(2).integers(0, 5, (BIAS_FRAMES, 16, 16))
    state.take(frames_of(*(100 + noise)))
    assert not state.taking_bias
    assert state.bias == pytest.approx(100 + noise.mean(axis=0))
    state.take(frames_of(flat(150)))
    assert state.image() == pytest.approx(50 - noise.mean(axis=0))
    state.take(frames_of(flat(0)))
    assert not state.image().any(), "no reading below zero"
    state.toggle_bias()
    assert (state.image() == 0).all()
    assert state.notice == "bias off"


def test_newtons_with_a_calibration(state):
    state.calibration = read_calibration(FILE)
    rest, half = (np.rint(expected_counts(flat(f), state.calibration)) for f in (0.0, 0.5))
    state.take(frames_of(half))
    assert np.median(state.image()) == pytest.approx(0.5, rel=0.1)
    text = shown(state)
    assert re.search(r"peak +0\.\d\d N at \(", text)
    assert "days old" in text
    for counts, notice in (
        (rest, "the bias is that of the calibration"),
        (half, "calibrate again"),
    ):
        state.toggle_bias()
        state.take(frames_of(*[counts] * BIAS_FRAMES))
        assert state.bias is None
        assert notice in state.notice


@pytest.mark.parametrize("colours", [True, False])
@pytest.mark.parametrize("height", [8, 15, 50])
def test_the_view_fits_terminals_of_any_size(state, height, colours):
    state.take(frames_of(np.arange(256).reshape(16, 16)))
    state.notice = "the device went away; it is tried again for 30 s; " * 3
    lines = shown(state, width=80, height=height, colours=colours).splitlines()
    plain = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in lines]
    if height >= 15:
        assert len(lines) <= max(height, 18)
    assert max(map(len, plain)) <= 80
    text = "\n".join(plain)
    assert "99.9 frames/s" in text
    assert re.search(r"lost +3", text)
    assert "the device went away" in text
    assert KEYS in text
    assert ("\x1b[" in "".join(lines)) or not colours
