"""Steps for other sensor types: as long for their size, as strong for their area or their gel."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import GEL_IMPRINT_MM, Overlay, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from recognizer.touch.next_touch import NextLimits, next_limits, propose_next
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import TOO_FEW, refusal
from recognizer.touch.signal import signal_of

USUAL = next_limits(SensorType())


def test_the_usual_sensor_keeps_every_number():
    assert NextLimits(
        lengths_mm=(4.0, 7.0, 10.0, 14.0), clear_mm=2.5, force_n=80.0,
        least_counts=16.0, soft_counts=40.0, gap=5,
    ) == USUAL  # fmt: skip
    stiff = replace(SensorType(), overlay=replace(Overlay(), young_mpa=3.0))
    assert next_limits(stiff) == USUAL  # of a gel alone the material counts


@pytest.mark.parametrize("name", shipped_names())
def test_steps_are_no_longer_for_the_sensor_and_the_pressure_is_the_same(name):
    sensor = sensor_type_named(name)
    limits = next_limits(sensor)
    area = 4 * math.prod(sensor.half_mm)
    size = min(1.0, math.sqrt(area) / 25.4)
    assert limits.lengths_mm == pytest.approx([size * length for length in USUAL.lengths_mm])
    assert limits.clear_mm == pytest.approx(size * USUAL.clear_mm)
    if sensor.overlay.kind == "tab":
        assert limits.force_n / area == pytest.approx(80.0 / 25.4**2, rel=1e-3)


def test_a_gel_is_imprinted_as_deep_whatever_it_is_made_of():
    gel = sensor_type_named("gel-24x32")
    force_n = next_limits(gel).force_n
    area = 4 * math.prod(gel.half_mm)
    assert force_n / (gel.overlay.young_mpa / gel.overlay.height_mm * area) == pytest.approx(
        GEL_IMPRINT_MM, rel=0.01
    )
    stiff = replace(gel, overlay=replace(gel.overlay, young_mpa=0.6))
    assert next_limits(stiff).force_n == pytest.approx(2 * force_n, abs=0.1)
    thick = replace(gel, overlay=replace(gel.overlay, height_mm=6.0))
    assert next_limits(thick).force_n == pytest.approx(force_n / 2, abs=0.1)


def test_noise_and_full_scale_say_what_is_felt():
    gel, narrow = sensor_type_named("gel-24x32"), sensor_type_named("flexitac-12x32")
    assert next_limits(gel).least_counts == max(USUAL.least_counts * 4095 / 1023, 4 * gel.noise)
    assert next_limits(replace(gel, noise=100.0)).least_counts == 400.0
    assert next_limits(narrow).least_counts == USUAL.least_counts * 255 / 1023
    assert next_limits(narrow).soft_counts == USUAL.soft_counts * 255 / 1023


@pytest.mark.parametrize(("pitch_mm", "gap"), [(0.5, 5), (1.5875, 5), (2.0, 5), (3.0, 3), (6.0, 3)])
def test_gaps_are_closed_no_wider_where_tactels_are_coarse(pitch_mm, gap):
    assert next_limits(replace(SensorType(), pitch_mm=pitch_mm)).gap == gap


def test_a_gel_at_an_edge_is_led_inwards_within_its_size(small):
    gel = sensor_type_named("gel-24x32")
    x, _ = gel.centres_mm().transpose(2, 0, 1)
    strokes = ((np.indices(gel.shape) % 5) < 2).any(axis=0)
    noise = np.random.default_rng(4).normal(0.0, gel.noise, gel.shape)
    counts = np.clip(np.where((x > 2.0) & strokes, 500.0, 0.0) + noise, 0, 4095)
    signal = signal_of(np.rint(counts), sensor=gel)
    reader = SimpleNamespace(
        sensor=gel,
        options=ReaderOptions(),
        lab=SimpleNamespace(arrays=(small.two_faces().embossed,)),
    )
    found = propose_next(reader, signal, refusal(0, TOO_FEW), ())
    assert 3.0 < found.dx_mm < gel.half_mm[0]
    assert "towards the loaded part" in found.why
    assert found.force_n == next_limits(gel).force_n < 10.0
