"""Touches that a search cannot help are refused before it; no others are."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import Overlay, SensorType
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, NOT_ENCODED, TOO_FEW, refusal
from recognizer.touch.search_gate import (
    GAPS,
    gap_share,
    may_find_more,
    pressed_tactels,
    shows_strokes,
)
from recognizer.touch.signal import signal_of
from recognizer.touch.verdict import Evidence

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
        sensor=sensor, options=ReaderOptions(), lab=SimpleNamespace(arrays=(embossed,))
    )


def plate(spread, seed=3):
    gains = np.exp(spread * np.random.default_rng(seed).standard_normal((16, 16)))
    return signal_of(200 * gains + 8)


def test_a_plate_shows_no_strokes_and_symbols_do(small):
    symbols = signal_of(np.where(STROKES, 200.0, 8.0))
    for spread in (0.05, 0.15):
        assert not shows_strokes(reader(small), plate(spread))
    assert gap_share(symbols) == pytest.approx(64 / 256, abs=0.05)
    symbols = signal_of(np.where(STROKES & (np.indices((16, 16)).sum(axis=0) % 4 > 0), 200.0, 8.0))
    assert gap_share(symbols) > 0.3
    assert shows_strokes(reader(small), symbols)


@pytest.mark.parametrize("given", [{"kind": "pad"}, {"pitch": 4.5}, {"pitch": 12.0}])
def test_where_gaps_were_not_measured_nothing_is_refused(small, given):
    assert shows_strokes(reader(small, **given), plate(0.05))


def test_an_edge_of_a_plate_is_no_stroke(small):
    half = signal_of(np.where(np.indices((16, 16))[1] < 8, 200.0, 8.0))
    assert gap_share(half) < GAPS


def touch_of(tactels):
    """A touch in which so many tactels are pressed."""
    counts = np.full(256, 8.0)
    counts[np.linspace(0, 255, tactels).round().astype(int)] = 200.0
    return signal_of(counts.reshape(16, 16))


@pytest.fixture
def asked(small):
    """Ask for a wide search after a first try; four symbols and 48 cells: three name one."""

    def ask(*, tactels=160, reason=NOT_ENCODED, judged=None, lab=None, **speaks):
        answer = refusal(0, reason)
        if not reason:
            answer = replace(answer, object="Thing")
        found = SimpleNamespace(
            embossed=small.two_faces().embossed,
            evidence=replace(Evidence(5.0, 5, 0, explained=0.9), **speaks),
        )
        given = answer if judged is None else judged
        return may_find_more(reader(small, **(lab or {})), touch_of(tactels), answer, given, found)

    return ask


LABS = ({}, {"radii": (20.0,)}, {"kind": "pad"})


def test_few_pressed_tactels_can_name_no_place(asked):
    # 0.44 of the 19.4 tactels of a cell, three times: 25.7
    assert pressed_tactels(touch_of(25)) == 25
    assert not asked(tactels=25)
    assert asked(tactels=26)
    assert asked(tactels=25, lab={"radii": (20.0,)})  # a strip of a round face


def test_symbols_of_no_registered_place_are_not_sought_further(asked):
    assert asked(log_likelihood_ratio=3.0)
    assert not asked(log_likelihood_ratio=2.9)


def test_where_no_stroke_shows_none_are_sought_further(asked):
    assert asked(tactels=160)
    assert not asked(tactels=256)
    assert asked(tactels=256, lab={"kind": "pad"})


def test_where_hardly_a_symbol_agrees_no_place_is_found(asked):
    assert asked(inliers=3)
    assert not asked(inliers=2)
    assert asked(inliers=0, lab={"kind": "pad"})


def test_plain_symbols_that_explain_little_stand_beside_something_else(asked):
    assert asked(log_likelihood_ratio=19.9, explained=0.1)
    assert not asked(log_likelihood_ratio=20.0, explained=0.59)
    assert asked(log_likelihood_ratio=20.0, explained=0.6)


def test_an_image_that_is_explained_shows_no_more(asked):
    assert not asked(reason=AMBIGUOUS, inliers=2)
    assert asked(reason=AMBIGUOUS, inliers=3)
    assert not asked(reason=TOO_FEW, inliers=3)


@pytest.mark.parametrize("lab", LABS)
def test_what_many_symbols_say_is_sure_anywhere(asked, lab):
    assert not asked(reason="", inliers=11, lab=lab)
    assert not asked(reason="", inliers=11, judged=refusal(0, BY_CHANCE, doubt=1e-4), lab=lab)


@pytest.mark.parametrize(("lab", "confirmed"), list(zip(LABS, (False, True, True), strict=True)))
def test_what_few_symbols_say_is_confirmed_where_that_was_not_measured(asked, lab, confirmed):
    assert asked(reason="", inliers=10, lab=lab) == confirmed


@pytest.mark.parametrize(
    ("judged", "again"),
    [
        (refusal(0, BY_CHANCE, doubt=1.0e-3), True),
        (refusal(0, BY_CHANCE, doubt=1.1e-3), False),
        (refusal(0, AMBIGUOUS, margin=12.0), True),
        (refusal(0, AMBIGUOUS, margin=11.9), False),
        (refusal(0, TOO_FEW, margin=30.0), False),
    ],
)
def test_an_answer_that_is_refused_is_sought_again_where_little_is_missing(asked, judged, again):
    assert asked(reason="", inliers=10, judged=judged) == again
    assert asked(reason="", inliers=10, judged=judged, lab={"radii": (20.0,)})


def test_without_a_hypothesis_the_search_goes_on(small):
    nothing = refusal(0, NOT_ENCODED)
    assert may_find_more(reader(small), touch_of(10), nothing, nothing, None)
