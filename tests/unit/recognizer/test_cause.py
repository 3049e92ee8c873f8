"""Why a touch is not answered: each cause from an image made for it."""

import numpy as np
import pytest

from encoded_objects import simulate
from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.simulate.registered import registered_surface
from recognizer.touch import recognition as cause
from recognizer.touch.diagnose import diagnose
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Cause
from recognizer.touch.search_gate import GAPS, gap_share
from recognizer.touch.signal import signal_of
from recognizer.touch.verify import TouchImages

SENSOR = SensorType()
X, Y = np.moveaxis(SENSOR.centres_mm(), -1, 0)


def bars(rng, high=200.0):
    """Readings of strokes, one tactel wide, on a face: noise of 2, a background of 8."""
    image = np.where((np.arange(16) % 4 == 0)[:, None] | (np.arange(16) % 5 == 0), high, 0.0)
    return 8.0 + image * np.exp(rng.normal(0, 0.1, (16, 16))) + rng.normal(0, 2, (16, 16))


@pytest.fixture(scope="module")
def reader(make_lab):
    folder = make_lab("{name: Cube, shape: {cube: 48 mm}, profile: large}")
    return Reader(open_lab(folder / "lab.db"))


def code_of(reader, image):
    signal = signal_of(np.asarray(image, float))
    return diagnose(TouchImages(reader, signal), []).code


def test_what_the_image_shows_by_itself(reader, monkeypatch):
    rng = np.random.default_rng(1)
    image = bars(rng)
    assert code_of(reader, image) == cause.UNCLEAR  # nothing is the matter with it
    assert code_of(reader, np.full((16, 16), 8.0)) == cause.NO_LOAD
    assert code_of(reader, 8 + (image - 8) * np.clip((X + 14) / 26, 0, 1)) == cause.TILTED
    assert code_of(reader, bars(rng, high=18.0)) == cause.SOFT
    even = 100 * np.exp(rng.normal(0, 0.15, (16, 16)))
    even[0, :13] = 8.0
    assert code_of(reader, even) == cause.PLAIN
    smeared = 8 + np.mean([np.roll(image - 8, k, axis=1) for k in range(5)], axis=0)
    signal = signal_of(smeared)
    monkeypatch.setattr("recognizer.touch.diagnose.SMEARED", 1.5)
    found = diagnose(TouchImages(reader, signal), [])
    assert found.code == cause.MOVING
    away = (found.evidence["direction_deg"] + 90) % 180 - 90
    assert away == pytest.approx(0, abs=10)  # along the columns
    hard = diagnose(TouchImages(reader, signal_of(2.0 * smeared)), [])
    assert hard.code == cause.HARD
    assert str(hard).startswith("pressed too hard: readings add up to ")
    assert hard.way_out == "press with 30 to 120 N"
    for share, code in ((1.01, cause.HARD), (0.99, cause.MOVING)):
        newtons = signal_of(smeared * share * 250 / smeared.sum(), floor=0.0, newtons=True)
        assert diagnose(TouchImages(reader, newtons), []).code == code


def test_weak_is_told_in_newtons_where_they_are_known(reader):
    rng = np.random.default_rng(2)
    image = np.where(bars(rng) > 50, rng.uniform(0.99, 1.0, (16, 16)), 0.0)
    for high, code in ((0.14, cause.SOFT), (0.16, cause.UNCLEAR)):
        signal = signal_of(high * image, floor=0.0, newtons=True)
        found = diagnose(TouchImages(reader, signal), [])
        assert found.code == code
        assert str(found).startswith("pressed too softly: readings reach 0.14 N") == (high < 0.15)


@pytest.fixture(scope="module")
def keyed(make_lab):
    """A lab whose symbols are known, so that places can be named where the readings are even."""
    spec = "{name: Cube, shape: {cube: 40 mm}, symbols: {alphabet: dense-4}}"
    return f"{make_lab(spec, lab_key='0123-4567-89AB-CDER')}/lab.db"


def test_symbols_along_the_rows_are_read_however_few_gaps_they_show(keyed):
    reader, at = Reader(open_lab(keyed)), Touch(18.4, 18.4, np.pi / 2, 300.0)
    surface = registered_surface(keyed, "Cube", "F5").surface
    counts = np.rint(100 * press(surface, SENSOR, at).forces_n)
    assert gap_share(signal_of(counts)) < GAPS  # as of a plain plate
    answer = reader.read(counts)
    assert (answer.face, answer.x_mm, answer.y_mm) == (
        "F5", pytest.approx(18.4, abs=0.2), pytest.approx(18.4, abs=0.2),
    )  # fmt: skip


def test_symbols_that_are_plainly_there_are_no_plain_face(keyed):
    touch = simulate(f"{keyed}#Cube/F4", x=17.5, y=16.5, theta=90, force=350)
    refused = Reader(open_lab(keyed)).read(touch.counts)
    assert refused.reason_code == cause.UNCLEAR
    assert refused.cause.evidence["surprise"] > 20


def test_every_cause_has_words_and_a_way_out():
    numbers = dict.fromkeys(
        ("plateau", "signal_to_noise", "newtons", "loaded", "symbols", "direction_deg",
         "sharpness", "silent", "explained", "explained_anywhere", "symbols_anywhere", "slope",
         "width_mm", "variation", "columns", "pitch_mm", "best_mm", "sum", "most", "least_n",
         "most_n"), 0.5
    )  # fmt: skip
    others = {*cause.WAYS_OUT, cause.CHECKED, cause.UNCHECKED}
    others |= {cause.AS_DESIGNED, cause.AS_BUILT, cause.NOT_MEASURED}
    named = [value for name, value in vars(cause).items() if name.isupper() and name[0] != "_"]
    codes = {one for one in named if isinstance(one, str)} - others
    assert len(codes) == 14
    for code in codes:
        assert str(Cause(code, numbers))
        assert Cause(code, numbers).way_out
