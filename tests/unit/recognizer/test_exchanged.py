"""Which answers leave much of a touch over, and what exchanging halves does."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from probe.surface.polygon import polygon
from recognizer.touch.recognise import has_residual
from recognizer.touch.signal import swap_halves
from recognizer.touch.verdict import Evidence

PLAIN = Evidence(log_likelihood_ratio=40.0, explained=0.95, inliers=16, bits=32.0, contradictions=0)
SQUARE = polygon([np.array([(0, 0), (40, 0), (40, 40), (0, 40)], float)])


def first(count, value, other=1.0):
    """One value of the first tactels of 120, and another one of the rest."""
    return np.where(np.arange(120) < count, value, other)


@pytest.mark.parametrize(
    ("changed", "leaves"),
    [
        ({}, False),
        # of 100 pressed tactels so many so far beyond the face
        ({"beyond": 15}, True), ({"beyond": 14}, False), ({"beyond": 15, "mm": 1.51}, True),
        ({"beyond": 15, "mm": 1.5}, False), ({"beyond": 15, "round_": "a cylinder"}, False),
        ({"beyond": 15, "noise": 0.0334}, True),
        # what reads little is not pressed; what is half trusted is pressed half
        ({"beyond": 15, "forces": first(15, 0.2)}, False),
        ({"beyond": 15, "forces": first(15, 0.21)}, True),
        ({"beyond": 15, "trust": first(15, 0.19)}, False),
        ({"beyond": 15, "trust": first(15, 0.21)}, True),
        ({"beyond": 15, "forces": first(12, 2.0), "trust": first(12, 0.25, 0.3)}, True),
        # symbols that explain little leave much, but soft ones explain little for noise
        ({"log_likelihood_ratio": 24.9, "explained": 0.859}, True),
        ({"log_likelihood_ratio": 25.0, "explained": 0.859}, False),
        ({"log_likelihood_ratio": 24.9, "explained": 0.86}, False),
        ({"log_likelihood_ratio": 24.9, "explained": 0.85, "forces": 30.0, "noise": 1.0}, True),
        ({"log_likelihood_ratio": 24.9, "explained": 0.85, "forces": 29.9, "noise": 1.0}, False),
    ],
)  # fmt: skip
def test_which_answers_leave_much_of_a_touch(changed, leaves, monkeypatch):
    given = {"beyond": 0, "mm": 3.0, "forces": 1.0, "round_": None, "noise": 0.0, "trust": 1.0}
    speaks = {name: value for name, value in changed.items() if name not in given}
    at = SimpleNamespace(**(given | changed))
    points = np.full((120, 2), 20.0)
    points[: at.beyond, 0] = 40.0 + at.mm
    points[100:] = 60.0  # not pressed: never counted
    monkeypatch.setattr("recognizer.touch.recognise.points_on_face", lambda *_: points)
    image = SimpleNamespace(
        forces=np.where(np.arange(120) < 100, at.forces, 0.1), trust=np.full(120, at.trust),
        noise=at.noise,
    )  # fmt: skip
    face = SimpleNamespace(round=at.round_, region=SQUARE)
    evidence = replace(PLAIN, **speaks)
    assert has_residual(SimpleNamespace(image=image, face=face, evidence=evidence)) is leaves


@pytest.mark.parametrize("axis", [0, 1])
def test_halves_are_swapped_along_an_axis_and_back(axis):
    forces = np.arange(256.0).reshape(16, 16)
    swapped = swap_halves(forces, axis)
    assert (swap_halves(swapped, axis) == forces).all()
    assert swapped[0, 0] == (forces[8, 0] if axis == 0 else forces[0, 8])
