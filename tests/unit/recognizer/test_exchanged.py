"""Which answers leave much of a touch over, and what exchanging halves does."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.surface.polygon import polygon
from recognizer.touch import recognise
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognise import has_residual, read_touch
from recognizer.touch.recognition import refusal
from recognizer.touch.signal import Signal, swap_halves
from recognizer.touch.verdict import Evidence

PLAIN = Evidence(
    log_likelihood_ratio=40.0,
    explained=0.95,
    inliers=16,
    contradictions=0,
    strong_contradictions=0,
    stroke_excess=0.0,
    worn=0,
)
SQUARE = (np.array([(0, 0), (40, 0), (40, 40), (0, 40)], float),)


class Face:
    region = polygon(list(SQUARE))

    def __init__(self, round_):
        self.round = round_


@pytest.fixture
def leaves(small, monkeypatch):
    """Ask of a touch with so many of 100 pressed tactels so far beyond the face."""

    def ask(*, beyond=0, mm=3.0, forces=1.0, round_=None, noise=0.0, trust=1.0, **speaks):
        points = np.full((120, 2), 20.0)
        points[:beyond, 0] = 40.0 + mm
        points[100:] = 60.0  # not pressed: never counted
        monkeypatch.setattr("recognizer.touch.recognise.points_on_face", lambda *_: points)
        felt = np.where(np.arange(120) < 100, forces, 0.1)
        image = SimpleNamespace(forces=felt, trust=np.full(120, trust), noise=noise)
        face = Face(round_)
        found = SimpleNamespace(
            image=image, embossed=SimpleNamespace(face=lambda _: face),
            hypothesis=SimpleNamespace(face=0), evidence=replace(PLAIN, **speaks),
        )  # fmt: skip
        return has_residual(found)

    return ask


def test_what_lies_on_the_face_leaves_nothing(leaves):
    assert not leaves()


def test_pressed_tactels_beyond_the_face_are_left_over(leaves):
    assert leaves(beyond=15)
    assert not leaves(beyond=14)
    assert leaves(beyond=15, mm=1.51)
    assert not leaves(beyond=15, mm=1.5)
    assert not leaves(beyond=15, round_="a cylinder")


def test_what_reads_little_is_not_pressed(leaves):
    forces = np.where(np.arange(120) < 15, 0.19, 1.0)
    assert not leaves(beyond=15, forces=forces)
    assert not leaves(beyond=15, forces=np.where(np.arange(120) < 15, 0.2, 1.0))
    assert leaves(beyond=15, forces=np.where(np.arange(120) < 15, 0.21, 1.0))


def test_what_is_half_trusted_is_pressed_half(leaves):
    assert not leaves(beyond=15, trust=np.where(np.arange(120) < 15, 0.19, 1.0))
    assert leaves(beyond=15, trust=np.where(np.arange(120) < 15, 0.21, 1.0))
    weak = np.where(np.arange(120) < 12, 0.25, 0.3)
    assert leaves(beyond=15, forces=np.where(np.arange(120) < 12, 2.0, 1.0), trust=weak)


def test_symbols_that_explain_little_leave_much(leaves):
    assert leaves(log_likelihood_ratio=24.9, explained=0.859)
    assert not leaves(log_likelihood_ratio=25.0, explained=0.859)
    assert not leaves(log_likelihood_ratio=24.9, explained=0.86)


def test_soft_symbols_explain_little_for_noise(leaves):
    assert leaves(log_likelihood_ratio=24.9, explained=0.85, forces=30.0, noise=1.0)
    assert not leaves(log_likelihood_ratio=24.9, explained=0.85, forces=29.9, noise=1.0)
    assert leaves(beyond=15, noise=0.0334)


@pytest.mark.parametrize("axis", [0, 1])
def test_halves_are_swapped_along_an_axis_and_back(axis):
    forces = np.arange(256.0).reshape(16, 16)
    swapped = swap_halves(forces, axis)
    assert (swap_halves(swapped, axis) == forces).all()
    assert swapped[0, 0] == (forces[8, 0] if axis == 0 else forces[0, 8])


def test_readings_and_trust_are_swapped_together(monkeypatch):
    forces = np.arange(256.0).reshape(16, 16)
    trust = (forces % 7 > 0).astype(float)
    answer, tried = replace(refusal(0, ""), object="Thing"), []
    monkeypatch.setattr(recognise, "_search_twice", lambda *_: (answer, [None]))
    monkeypatch.setattr(recognise, "has_residual", lambda _: True)
    monkeypatch.setattr(
        recognise, "verify_hypotheses", lambda touch, _: tried.append(touch.signal) or []
    )
    reader = SimpleNamespace(sensor=SensorType(), options=ReaderOptions())
    signal = Signal(forces, trust, contact=True, newtons=False)
    assert read_touch(reader, signal).answer is answer  # no other halves are read better
    assert [one.forces[0, 0] for one in tried] == [forces[8, 0], forces[0, 8]]
    for axis, one in enumerate(tried):
        assert (one.trust == (one.forces % 7 > 0)).all()
        assert (swap_halves(one.forces, axis) == forces).all()
