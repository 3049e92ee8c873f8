"""Answers as ROS 2 messages: what they say."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from recognizer.command.answers import Answer
from recognizer.command.ros import object_message, recognition_message
from recognizer.touch.recognition import AMBIGUOUS, Recognition, refusal
from recognizer.touch.robot import ObjectPose, Seating


def turned(angle, at):
    c, s = np.cos(angle), np.sin(angle)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = at
    return T


@pytest.fixture
def found():
    T = turned(0.5, [20, 30, 0])
    covariance = np.diag([0.04, 0.05, 0.003]) ** 2
    return Recognition(7, "Cube", "F1", (3, 4), T, T, covariance, 40.0, None, "", doubt=1e-6)


def test_without_a_base_the_object_is_told_in_the_sensors_frame(found):
    message = object_message(found, None, 2_000_000_001)
    assert message["header"] == {
        "stamp": {"sec": 2, "nanosec": 1},
        "frame_id": "sensor",
    }
    expected = -turned(0.5, [0, 0, 0])[:3, :3].T @ [0.02, 0.03, 0]
    expected[2] = Seating().depth_mm(found.inside_mm) / 1000
    at = message["pose"]["pose"]["position"]
    assert np.allclose([at["x"], at["y"], at["z"]], expected)
    turn = message["pose"]["pose"]["orientation"]
    assert np.allclose([turn["z"], turn["w"]], [-np.sin(0.25), np.cos(0.25)])
    spread = np.array(message["pose"]["covariance"]).reshape(6, 6)
    assert np.allclose(spread, spread.T)
    # The turn of the probe, 3 mrad, moves the object's origin, 36 mm away, by .108 mm; tilts move
    # it by as much as the probe is pressed in.
    tips = Seating().spread_rad(None) * Seating().depth_mm(None)
    assert np.sqrt(np.trace(spread[:2, :2])) == pytest.approx(
        1e-3 * np.sqrt(0.04**2 + 0.05**2 + (0.003 * np.hypot(20, 30)) ** 2 + 2 * tips**2), rel=1e-6
    )


def test_with_a_base_it_is_told_there(found):
    placed = ObjectPose(turned(1.0, [300, 0, 50]), np.eye(6))
    message = object_message(found, placed, 0)
    assert message["header"]["frame_id"] == "base"
    assert message["pose"]["pose"]["position"] == {"x": 0.3, "y": 0.0, "z": 0.05}


def test_a_refusal_names_no_object_and_says_why(found):
    none = refusal(9, AMBIGUOUS, doubt=0.5)
    assert object_message(none, None, 0) is None
    touch = SimpleNamespace(t_ns=5, seq=9, frames=1)
    message = recognition_message(Answer(touch, none, None))
    assert (message["object"], message["row"], message["reason"]) == ("", -1, AMBIGUOUS)
    assert np.isnan(message["margin"])
    assert message["doubt"] == 0.5
    assert json.loads(message["json"])["object"] is None
