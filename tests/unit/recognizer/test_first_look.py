"""Touches that a search cannot help are refused before it; no others are."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import recognizer.touch.first_look as first_look
from probe.sensor import Overlay, SensorType
from recognizer.touch.first_look import gap_share, may_tell_more, pressed_tactels, shows_strokes
from recognizer.touch.recognition import AMBIGUOUS, NOT_ENCODED, refusal
from recognizer.touch.settings import ReaderSettings
from recognizer.touch.signal import signal_of

SETTINGS = ReaderSettings()
STROKES = ((np.indices((16, 16)) % 4) < 2).any(axis=0)


def reader(small, pitch=7.0, kind="tab", radii=()):
    embossed = small.two_faces().embossed
    embossed = replace(
        embossed,
        style=SimpleNamespace(pitch_mm=pitch, height_mm=1.0, stroke_mm=1.4),
        radii_mm=radii,
    )
    sensor = SensorType(overlay=Overlay(kind=kind))
    return SimpleNamespace(
        sensor=sensor, settings=SETTINGS, lab=SimpleNamespace(arrays=(embossed,))
    )


def plate(spread, seed=3):
    gains = np.exp(spread * np.random.default_rng(seed).standard_normal((16, 16)))
    return signal_of(200 * gains + 8)


def test_a_plate_shows_no_strokes_and_symbols_do(small):
    symbols = signal_of(np.where(STROKES, 200.0, 8.0))
    for spread in (0.05, 0.15):
        assert not shows_strokes(reader(small), plate(spread))
    assert gap_share(symbols, SETTINGS.first_look) == pytest.approx(64 / 256, abs=0.05)
    symbols = signal_of(np.where(STROKES & (np.indices((16, 16)).sum(axis=0) % 4 > 0), 200.0, 8.0))
    assert gap_share(symbols, SETTINGS.first_look) > 0.3
    assert shows_strokes(reader(small), symbols)


@pytest.mark.parametrize("given", [{"kind": "pad"}, {"pitch": 4.5}, {"pitch": 12.0}])
def test_where_gaps_were_not_measured_nothing_is_refused(small, given):
    assert shows_strokes(reader(small, **given), plate(0.05))


def test_an_edge_of_a_plate_is_no_stroke(small):
    half = signal_of(np.where(np.indices((16, 16))[1] < 8, 200.0, 8.0))
    assert gap_share(half, SETTINGS.first_look) < SETTINGS.first_look.gaps


def touch_of(tactels):
    """A touch in which so many tactels are pressed."""
    counts = np.full(256, 8.0)
    counts[np.linspace(0, 255, tactels).round().astype(int)] = 200.0
    return signal_of(counts.reshape(16, 16))


@pytest.fixture
def first(small, monkeypatch):
    """A hypothesis so many nats over symbols of no registered place; four symbols name a cell."""
    monkeypatch.setattr(first_look, "null_log_likelihood", lambda embossed, fit: -50.0)
    embossed = small.two_faces().embossed  # 48 cells of four symbols: three name one

    def one(surprise):
        return SimpleNamespace(embossed=embossed, fit=None, score=surprise - 50.0)

    return one


def asked(small, first, *, tactels=200, surprise=5.0, reason=NOT_ENCODED, inliers=5, **lab):
    answer = refusal(0, reason)
    if not reason:
        answer = replace(answer, object="Thing")
    return may_tell_more(reader(small, **lab), touch_of(tactels), answer, first(surprise), inliers)


def test_few_pressed_tactels_can_name_no_place(small, first):
    # 0.44 of the 19.4 tactels of a cell, three times: 25.7
    assert pressed_tactels(touch_of(25), SETTINGS.first_look) == 25
    assert not asked(small, first, tactels=25)
    assert asked(small, first, tactels=26)
    assert asked(small, first, tactels=25, radii=(20.0,))  # a strip of a round face


def test_symbols_of_no_registered_place_are_not_sought_further(small, first):
    assert asked(small, first, surprise=-3.9)
    assert not asked(small, first, surprise=-4.1)


def test_an_image_that_is_explained_shows_no_more(small, first):
    assert not asked(small, first, reason=AMBIGUOUS, inliers=2)
    assert asked(small, first, reason=AMBIGUOUS, inliers=3)


def test_an_answer_is_always_confirmed(small, first):
    assert asked(small, first, reason="", inliers=1, tactels=10, surprise=-9.0)


def test_without_a_hypothesis_the_search_goes_on(small):
    assert may_tell_more(reader(small), touch_of(10), refusal(0, NOT_ENCODED), None, 0)
