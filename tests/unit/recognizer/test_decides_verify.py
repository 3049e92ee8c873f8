"""Which places are fitted again, and under which fit each is judged."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import recognizer.touch.verify
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.options import ReaderOptions
from recognizer.touch.prepare import Prepared
from recognizer.touch.verify import TouchImages, verify_hypotheses

OPTIONS = ReaderOptions()
FOURTEEN = 14.0 - 1e-4  #: nats within which places are verified


class Stages:
    """What `verify_hypotheses` calls, by tables; `asked` keeps what it was asked."""

    def __init__(self, small, monkeypatch):
        self.embossed = small.two_faces().embossed
        self.fits = tuple(
            small.fit_of([(0, 0)], [[0.0] * 5], x_mm=float(n), gain=np.full(4, 10.0 * n))
            for n in range(3)
        )
        self.hypotheses, self.others = [], []
        self.better = {}  # row of a place, number of the fit among those refined -> score
        self.asked = SimpleNamespace(
            images=[], searches=[], efforts=[], refined=[], rivals=[], round=[]
        )
        self.on_round, self.balanced = [], None
        for name in (
            "search_image", "fit_lattices", "find_hypotheses", "find_rivals", "refine_lattices",
            "score_cells", "log_likelihoods_at", "verify_on_round_faces", "balanced_gain",
        ):  # fmt: skip
            monkeypatch.setattr(recognizer.touch.verify, name, getattr(self, "_" + name))

    def run(self, *arrays):
        return verify_hypotheses(self.touch(*arrays), OPTIONS.first)

    def touch(self, *arrays):
        return TouchImages(self.reader(*arrays), "signal")

    def reader(self, *arrays):
        prepared = tuple(Prepared(one, "template", "bank") for one in arrays or (self.embossed,))
        return SimpleNamespace(
            prepared=prepared, sensor="sensor", options=OPTIONS, image=self._image
        )

    def _image(self, signal, prepared):
        assert signal == "signal"
        image = SimpleNamespace(embossed=prepared.embossed)
        self.asked.images.append(image)
        return image

    def _search_image(self, image, bank, gains=None):
        assert bank == "bank"
        self.asked.searches.append(image)
        return ("coarse", image) if gains is None else (gains,)

    def _balanced_gain(self, image):
        return self.balanced

    def _fit_lattices(self, image, bank, effort, searches, *, with_covariance):
        more = ([self.balanced],) if effort.again and self.balanced else ()
        assert (bank, searches, with_covariance) == ("bank", ("coarse", image, *more), False)
        self.asked.efforts.append(effort)
        return self.fits

    def _find_hypotheses(self, embossed, fits):
        assert fits is self.fits
        return list(self.hypotheses)

    def _find_rivals(self, embossed, fit, best, number):
        self.asked.rivals.append((fit, best, number))
        return list(self.others)

    def _refine_lattices(self, image, pose, gain, *, steps, labels_at):
        assert steps == recognizer.touch.verify.STEPS
        self.asked.refined.append((pose[:, 0].tolist(), gain[:, 0].tolist(), labels_at))
        return len(pose)

    def _score_cells(self, image, count):
        moved = replace(self.fits[0], x_mm=7.0, gain=np.full(4, 70.0))
        return tuple(replace(moved, noise=float(n)) for n in range(count))

    def _log_likelihoods_at(self, embossed, fit, places):
        return [self.better.get((one.row, int(fit.noise)), one.score - 100.0) for one in places]

    def _verify_on_round_faces(self, touch, effort):
        self.asked.round.append((touch.prepared.embossed, effort))
        return list(self.on_round)


@pytest.fixture
def stages(small, monkeypatch):
    return Stages(small, monkeypatch)


def placed(*scores, fit=0, face=0, first=0):
    """Hypotheses in rows 0, 1, ... of these scores."""
    return [Hypothesis(fit, first + n, 0, face, score) for n, score in enumerate(scores)]


def rows(found):
    return [one.hypothesis.row for one in found]


def test_a_touch_is_fitted_once(stages):
    touch, asked = stages.touch(), stages.asked
    for _ in range(2):
        verify_hypotheses(touch, OPTIONS.first)
    assert (len(asked.images), len(asked.searches)) == (1, 1)
    assert asked.efforts == [OPTIONS.first]
    verify_hypotheses(touch, OPTIONS.thorough)  # from the searches of the first
    assert (len(asked.images), len(asked.searches)) == (1, 1)
    assert asked.efforts == [OPTIONS.first, OPTIONS.thorough]
    (one,) = touch.arrays
    assert one.fits(OPTIONS.first) is stages.fits  # what explains a refusal reads these
    stages.run()  # another touch
    assert (len(asked.images), len(asked.searches)) == (2, 2)
    assert asked.efforts == [OPTIONS.first, OPTIONS.thorough, OPTIONS.first]


def test_a_wide_search_near_an_edge_begins_with_a_balanced_plate_too(stages):
    touch, stages.balanced = stages.touch(), "balanced"
    verify_hypotheses(touch, OPTIONS.first)
    assert len(stages.asked.searches) == 1
    verify_hypotheses(touch, OPTIONS.thorough)
    assert len(stages.asked.searches) == 2


@pytest.mark.parametrize(
    ("scores", "count"),
    [
        ((0.0, -5.0, -13.99, -FOURTEEN), 3),
        ((0.0, -5.0, -13.9998, -14.0), 3),
        ((0.0, -FOURTEEN, -20.0), 2),  # two at least
        ((0.0, -30.0, -40.0), 2),
        ((0.0,), 1),
        ((0.0, -1.0, -2.0, -3.0, -4.0, -5.0, -6.0, -7.0, -8.0, -9.0), 8),  # eight at most
    ],
)
def test_places_within_fourteen_nats_of_the_best_are_verified(stages, scores, count):
    stages.hypotheses = placed(*scores)
    found = stages.run()
    assert sorted(rows(found)) == list(range(count))
    assert [one.score for one in found] == [score - 100.0 for score in scores[:count]]
    (image,) = stages.asked.images
    assert all(one.embossed is stages.embossed and one.image is image for one in found)


def test_nothing_is_verified_where_no_place_is_found(stages):
    assert stages.run() == []
    assert stages.asked.refined == []


def test_each_place_begins_where_its_own_fit_did(stages):
    one, two, three = placed(0.0, -1.0, -2.0)
    stages.hypotheses = [replace(one, fit=2), replace(two, fit=0), replace(three, fit=1)]
    stages.run()
    poses, gains, labels_at = stages.asked.refined[0]
    assert poses == [2.0, 0.0, 1.0]
    assert gains == [20.0, 0.0, 10.0]
    held = stages.embossed
    # cell (3, -2) of a lattice at (row, 0) is the array's cell (row + 2, 3)
    labels = held.at(np.array([2, 3, 4]), np.array([3, 3, 3]))[1].tolist()
    assert -1 not in labels
    cells = np.array([[(3, -2), (9, 9)]] * 3)
    assert labels_at(cells).tolist() == [[label, -1] for label in labels]


def test_a_place_is_judged_by_the_best_fit_that_began_where_its_own_did(stages):
    first, second, third = placed(0.0, -1.0, -2.0)
    stages.hypotheses = [first, replace(second, fit=1), replace(third, fit=0)]
    # place 0 is likelier under the fit of place 2, and would be likeliest under that of place 1
    stages.better = {(0, 0): -60.0, (0, 1): -1.0, (0, 2): -50.0, (1, 1): -55.0, (2, 0): -70.0}
    found = stages.run()
    assert [(one.hypothesis.row, one.score) for one in found] == [
        (0, -50.0),
        (1, -55.0),
        (2, -70.0),
    ]
    assert [one.fit.noise for one in found] == [2.0, 1.0, 0.0]


def test_rivals_of_the_best_are_verified_from_its_fit_with_itself(stages):
    stages.hypotheses = placed(0.0, -1.0)
    stages.better = {(0, 0): -52.0, (1, 1): -50.0, (1, 0): -90.0, (0, 1): -95.0}
    stages.others = placed(-60.0, -63.99, -50.0 - FOURTEEN, fit=3, first=5)
    found = stages.run()
    ((fit, best, number),) = stages.asked.rivals
    assert (best.row, fit.noise, number) == (1, 1.0, 3)
    assert len(stages.asked.refined) == 2
    poses, gains, _ = stages.asked.refined[1]
    assert (poses, gains) == ([7.0] * 3, [70.0] * 3)  # all from the fit of the best one
    assert sorted(rows(found)) == [0, 1, 1, 5, 6]  # -64 is fourteen below
    again = next(one for one in found[1:] if one.hypothesis.row == 1)
    assert again.hypothesis.fit == 3
    assert [one.score for one in found] == sorted((one.score for one in found), reverse=True)


def test_without_rivals_nothing_is_verified_again(stages):
    stages.hypotheses = placed(0.0, -1.0)
    stages.others = placed(-150.0, fit=3, first=5)
    assert len(stages.run()) == 2
    assert len(stages.asked.refined) == 1


def test_places_on_round_faces_are_left_to_those_who_know_their_bend(stages):
    bent = replace(stages.embossed, radii_mm=(20.0,))
    bent.known[0] = SimpleNamespace(round="bend")
    bent.known[1] = SimpleNamespace(round=None)
    flat = placed(-1.0, -2.0, face=1, first=20)
    stages.hypotheses = [*placed(0.0, -0.5), *flat]
    stages.others = [*placed(-101.0, fit=3, first=5), *placed(-101.0, fit=3, first=25, face=1)]
    stages.on_round = [SimpleNamespace(score=-40.0, hypothesis=SimpleNamespace(row=99))]
    assert rows(stages.run(bent)) == [99, 20, 20, 21, 25]
    assert stages.asked.round == [(bent, OPTIONS.first)]
    del stages.asked.round[:]
    assert sorted(rows(stages.run())) == [0, 0, 1, 5, 20, 21, 25]
    assert stages.asked.round == []


def test_the_best_of_all_arrays_comes_first(stages):
    other = replace(stages.embossed, style=SimpleNamespace(pitch_mm=7.0, height_mm=0.6))
    stages.hypotheses = placed(0.0, -1.0)
    found = stages.run(stages.embossed, other)
    assert [image.embossed is other for image in stages.asked.images] == [False, True]
    assert rows(found) == [0, 0, 1, 1]
    assert [one.embossed is other for one in found] == [False, True, False, True]
    assert all(one.image.embossed is one.embossed for one in found)
