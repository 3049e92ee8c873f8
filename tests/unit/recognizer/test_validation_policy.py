"""Touches that follow where one is not answered: on the same surface, by the same sensor."""

import math
from dataclasses import replace

import numpy as np
import pytest

from recognizer.scan.session import Scan
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import AMBIGUOUS, NextTouch, refusal
from recognizer.validation.draw import draw_again, draw_touch
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import NEXT, touch_until_answered, trial

PLAN = TouchPlan("", 5, "typical", "corner", policy=NEXT)


@pytest.fixture(scope="module")
def url(make_lab):
    return f"sqlite:///{make_lab('{name: Cube, shape: {cube: 60 mm}}') / 'lab.db'}"


@pytest.fixture(scope="module")
def reader(url):
    return Reader(open_lab(url))


def test_corners_are_answered_within_three_touches_and_never_wrong(url, reader):
    found = [trial(replace(PLAN, database=url), number, reader) for number in range(4)]
    assert {one.verdict for one in found} <= {"right", "rejected"}
    assert sum(one.verdict == "right" for one in found) >= 3
    assert any(1 < one.touches <= 3 for one in found)
    alone = [trial(replace(PLAN, database=url, policy="one"), n, reader) for n in range(4)]
    for one, other in zip(found, alone, strict=True):  # where and how the first touch was made
        assert (one.x_mm, one.y_mm, one.force_n) == (other.x_mm, other.y_mm, other.force_n)
        assert (one.touches == 1) == (other.verdict == "right")


def test_steps_are_made_from_the_sensor_s_frame_by_the_same_sensor(url, reader, monkeypatch):
    plan = replace(PLAN, database=url, kind="face", level="dead-40")
    step = NextTouch(4.0, 2.0, 30.0, 60.0, "told")
    refused = replace(refusal(3, AMBIGUOUS), next=step)
    monkeypatch.setattr(Scan, "add", lambda *_arguments, **_named: refused)
    made = list(touch_until_answered(plan, 3, reader, 2))
    first, second = (one.found.touch for one in made)
    c, s = math.cos(first.theta_rad), math.sin(first.theta_rad)
    at = first.x_mm + 4 * c - 2 * s, first.y_mm + 4 * s + 2 * c
    assert math.dist(at, (second.x_mm, second.y_mm)) < 1.5  # the arm errs by .3 mm each way
    assert second.theta_rad - first.theta_rad == pytest.approx(math.radians(30), abs=0.02)
    assert second.force_n == pytest.approx(60, rel=0.4)
    dead = [one.found.counts < 40 for one in made]
    assert np.logical_and(*dead).sum() >= 90  # a third of them would be by chance
    assert len(made) == 2


def test_a_worn_face_has_lost_the_same_symbols_elsewhere(url, reader):
    plan = replace(PLAN, database=url, kind="worn", level="low")
    first = draw_touch(plan, 1, reader)
    again = draw_again(plan, first, first.touch, reader, np.random.default_rng(0))
    points = np.random.default_rng(1).uniform(0, 60, (400, 2))
    assert np.array_equal(
        again.contact.scene.surface.heights_mm(points),
        first.contact.scene.surface.heights_mm(points),
    )
    assert (np.abs(again.counts.astype(int) - first.counts) < 40).all()  # the noise is another
