"""What a touch can say at best: the bound by finite differences, rows and figure of a small run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from recognizer.touch.hypothesis import labels_at
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.symbols.linearize import (
    force_jacobian,
    prior_precision,
    project_symbols,
)
from recognizer.validation.campaign import LIMIT_CLASSES, series_of
from recognizer.validation.draw import draw_touch
from recognizer.validation.files import LIMITS, columns_of, read_series
from recognizer.validation.limits import (
    PLACES,
    ReadingErrors,
    least_covariance,
    limit_of,
    line_of_limits,
    true_lattice,
)
from recognizer.validation.pipeline import report_again, validate
from recognizer.validation.run import read_record

CUBE = Path(__file__).parents[3] / "fixtures" / "cube.yaml"
GAIN = np.array([math.log(4000.0), 0.3, 0.02, -0.01])  #: of a plate that stands on symbols alone


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    validate(CUBE, folder=folder, touches=1, surfaces="database", seed=7, study=0, limits=3)
    return folder


@pytest.fixture(scope="module")
def work(made):
    return read_record(made)


@pytest.fixture(scope="module")
def reader(work):
    return Reader(open_lab(work.database))


@pytest.fixture
def known(work, reader):
    """An image amid a face, the true pose, and the labels there."""
    touch = draw_touch(work.plan(series_of(work.campaign)[1], 0), 0, reader)
    prepared = reader.prepared[0]
    names = [prepared.embossed.face(n).face for n in range(6)]
    place, pose = true_lattice(
        prepared.embossed, names.index(touch.contact.scene.face), touch.touch
    )
    image = reader.image(reader.signal(touch.counts), prepared)
    return image, np.append(pose, np.zeros(4)), labels_at(prepared.embossed, [place])


def forces_at(image, unknowns, labels):
    pose, gain = unknowns[None, :7], unknowns[None, 7:]
    measured, _, values = project_symbols(image, pose, gain, labels)
    return force_jacobian(image, pose, gain, values, measured)[1][0]


def test_the_bound_is_that_of_finite_differences(known):
    image, pose, labels = known
    true = np.concatenate([pose, GAIN])
    # templates are tables of .05 mm: steps of place, turn and scale span some of them
    steps = np.array([0.1, 0.1, 0.01, *[1e-2] * 3, 0.01, *[1e-4] * 4])
    by = np.stack(
        [
            (forces_at(image, true + step, labels) - forces_at(image, true - step, labels))
            / (2 * step.max())
            for step in np.diag(steps)
        ],
        axis=1,
    )
    noise = 20.0
    information = by.T @ (by * image.trust[:, None]) / noise**2 + np.diag(prior_precision(image))
    found = least_covariance(image, pose, GAIN, labels, ReadingErrors(noise, 0.0))
    wanted = np.linalg.inv(information)[:3, :3]
    assert np.sqrt(np.diag(found)) == pytest.approx(np.sqrt(np.diag(wanted)), rel=0.1)


def test_the_bound_grows_with_every_error(known):
    image, pose, labels = known
    one, two, *more = (
        least_covariance(image, pose, GAIN, labels, errors)
        for errors in (
            ReadingErrors(0.01, 0.0),
            ReadingErrors(0.02, 0.0),
            ReadingErrors(0.01, 0.1),
            ReadingErrors(0.01, 0.0, depth=0.05),
            ReadingErrors(0.01, 0.0, shift_mm=0.08),
        )
    )
    assert two == pytest.approx(4 * one, rel=1e-3)  # of noise alone it is in proportion
    assert all((np.diag(each) > 10 * np.diag(one)).all() for each in more)


def test_variances_of_a_tactel_by_hand():
    errors = ReadingErrors(noise=2.0, gain=0.1, depth=0.05, shift_mm=0.1)
    found = errors.variance(np.array([100.0]), np.array([[30.0, 40.0]]), np.array([200.0]))
    assert found == pytest.approx([2**2 + 10**2 + 10**2 + 5**2])
    square = ReadingErrors(noise=2.0, gain=0.1, exponent=2.0)  # readings are squares of forces
    assert square.variance(np.array([10.0]), np.zeros((1, 2)), np.zeros(1)) == pytest.approx(
        [(2 / 20) ** 2 + 0.5**2]
    )


def test_a_line_counts_what_can_be_named_and_what_is_answered():
    nan = float("nan")
    rows = {
        "number": np.arange(4),
        "likeliest": np.array([True, True, True, False]),
        "doubt": np.array([1e-6, 1e-4, 2e-4, nan]),
        "bits": np.array([30.0, 24.0, 23.0, nan]),
        "bound_mm": np.array([0.03, 0.04, 1.0, nan]),
        "bound_deg": np.array([0.1, 0.1, 1.0, nan]),
    }
    trials = {
        "verdict": np.array(["right", "right", "rejected", "wrong"], object),
        "error_mm": np.array([0.06, 0.08, nan, nan]),
        "error_deg": np.array([0.1, -0.1, nan, nan]),
    }
    line = line_of_limits("edge", rows, trials, 1e-4)
    assert (line["bits"], line["wrong"]) == (23.5, 1)
    assert [line[name]["count"] for name in ("likeliest", "best", "right")] == [3, 2, 2]
    # 10^3 places take 23.25 bits, 10^4 26.6, 10^5 29.9
    assert [one["count"] for one in line["named"]] == [2, 1, 1, 0, 0]
    assert [one["places"] for one in line["named"]] == list(PLACES)
    assert (line["ratio_mm"], line["ratio_deg"]) == (pytest.approx(2.0), pytest.approx(1.0))


def test_a_run_shows_limits_and_its_rows_repeat(made, work, reader):
    before = (made / "results.json").read_bytes()
    found = json.loads(before)["limits"]
    assert [line["class"] for line in found["classes"]] == list(LIMIT_CLASSES)
    assert found["arrays"][0]["places"] == len(reader.lab.arrays[0].keys)
    face = found["classes"][0]
    assert (face["touches"], face["likeliest"]["count"], face["wrong"]) == (3, 3, 0)
    assert face["ratio_mm"] > 0.3
    assert "What a touch can say at best" in (made / "report.html").read_text()
    series = series_of(work.campaign)[2]
    rows = columns_of(read_series(made, series, LIMITS))
    again = limit_of(work.plan(series, 1), 1, reader)
    assert {name: rows[name][1] for name in again} == pytest.approx(again, nan_ok=True)
    report_again(made)
    assert (made / "results.json").read_bytes() == before
