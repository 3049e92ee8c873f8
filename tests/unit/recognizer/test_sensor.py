"""A sensor is learned: dead and hot tactels, gains, tip places, floating rows, and its file."""

import json
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.press import ENGINE, press
from probe.contact.tips import Tips
from probe.simulate.registered import registered_surface
from recognizer.errors import SensorStateError, WiringError
from recognizer.scan.session import Scan
from recognizer.sensor import learn
from recognizer.sensor.file import read_state, state_words, write_state
from recognizer.sensor.learn import LEAST_TOUCHES, answering_of, learn_folds, learn_sensor
from recognizer.sensor.wiring import find_mounting, wiring_hint, wiring_named
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.touch.sensor_state import unknown_state

SENSOR = SensorType()
DEAD = [(0, 0), (3, 4), (7, 15), (9, 9), (12, 2)]
HOT = [(5, 11), (14, 6)]


def pressed(n=40, seed=2):
    """Readings of touches: half of the tactels pressed, at random."""
    rng = np.random.default_rng(seed)
    images = rng.uniform(60.0, 100.0, (n, 16, 16)) * (rng.random((n, 16, 16)) < 0.5)
    images *= np.exp(rng.uniform(-0.7, 0.7, (n, 1, 1)))  # soft and hard touches
    for at in DEAD:
        images[:, *at] = 0.0
    for at in HOT:
        images[:, *at] = 70.0
    return images


def places_of(flags):
    return sorted(map(tuple, np.argwhere(flags).tolist()))


def test_dead_tactels_never_rise_hot_ones_never_fall_and_raised_ones_keep_an_offset():
    images = pressed()
    images[:, 8, 3] += 50.0
    found = answering_of(images)
    assert (places_of(found.dead), places_of(found.hot)) == (DEAD, HOT)
    assert places_of(found.offset) == [(8, 3)]
    assert found.offset[8, 3] == pytest.approx(50.0, rel=0.15)
    few, enough = (answering_of(pressed(count)) for count in (LEAST_TOUCHES - 1, LEAST_TOUCHES))
    assert not (few.dead | few.hot).any()
    assert enough.dead[3, 4]
    images[:, :, 8:] = 0.0  # every touch hung over an edge
    assert not answering_of(images).dead[:, 12:].any()


def state_of(**changed):
    rng = np.random.default_rng(3)
    dead, hot = np.zeros((2, 16, 16), bool)
    dead[1, 2], hot[3, 4] = True, True
    return replace(
        unknown_state(SENSOR, name="left finger"), touches=50, dead=dead, hot=hot,
        gain=np.exp(rng.normal(0, 0.1, (16, 16))), aside_mm=rng.normal(0, 0.08, (16, 16, 2)),
        aside_deviation_mm=np.full((16, 16, 2), 0.03), drift=-3.5, **changed,
    )  # fmt: skip


def test_a_state_corrects_readings_of_its_unit_alone():
    gain, offset = np.ones((16, 16)), np.zeros((16, 16))
    gain[2, 3], offset[4, 5] = 2.0, 7.0
    state = replace(unknown_state(SENSOR), gain=gain, offset=offset)
    readings = np.full((16, 16), 10.0)
    for newtons, corrected, level in ((False, 3.0, 5.0), (True, 10.0, 10.0)):
        assert state.correct(readings, newtons=newtons)[4, 5] == corrected
        assert state.level(readings, newtons=newtons)[2, 3] == level
    with pytest.raises(SensorStateError, match="gain of a sensor"):
        replace(state, gain=np.ones((4, 4)))


def test_a_state_is_read_as_it_was_written(tmp_path):
    path, again = tmp_path / "left.json", tmp_path / "again.json"
    state = state_of(floating=True)
    write_state(state, path)
    found = read_state(path, sensors=("left finger", "fsr-16"))
    assert (found.sensor, found.touches, found.floating, found.drift) == (
        "left finger", 50, True, -3.5)  # fmt: skip
    assert np.array_equal(found.dead, state.dead)
    assert np.array_equal(found.hot, state.hot)
    assert found.aside_mm == pytest.approx(state.aside_mm, rel=1e-6)
    write_state(found, again)
    assert again.read_bytes() == path.read_bytes()
    assert sorted(tmp_path.iterdir()) == [again, path]
    for changes in (None, (), ("quarter",), ("transpose", "quarter", "quarter")):
        write_state(replace(state, mounting=changes), path)
        assert read_state(path).mounting == changes
    with pytest.raises(SensorStateError, match="cannot be written"):
        write_state(state, tmp_path / "no" / "folder.json")
    for part in (
        "left finger, 50 touches", "1 of 256 tactels never answer", "1 of 256 tactels read high",
        "the network is inverted", "0.08 mm aside", "drifted by -3.5 counts",
    ):  # fmt: skip
        assert part in state_words(state)
    assert "too few" in state_words(unknown_state(SENSOR))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "version 2"),
        ({"format": "x"}, "no state of a sensor"),
        ({"gain": [[1.0]]}, "damaged"),
        ({"gain": [[0.0] * 16] * 16}, "damaged"),
        ({"aside_mm": [[[1e9, 0.0]] * 16] * 16}, "damaged"),
        ({"gain_deviation": [[-1.0] * 16] * 16}, "damaged"),
        ({"drift": 10**400}, "damaged"),
        ({"tactels": ["x" * 16] * 16}, "damaged"),
        ({"sensor": "right finger"}, "not of 'left finger'"),
        *(
            ({"mounting": wrong}, "is damaged")
            for wrong in (["sideways"], "columns", [["rows"]], 3, ["quarter"] * 4)
        ),
        ("text", "is no JSON"),
        (None, "cannot be read"),
    ],
)
def test_what_is_no_state_of_this_sensor_is_refused(tmp_path, change, words):
    path = tmp_path / "left.json"
    write_state(state_of(), path)
    if change is None:
        path.unlink()
    else:
        known = json.loads(path.read_text())
        path.write_text(change if change == "text" else json.dumps(known | change))
    with pytest.raises(SensorStateError, match=words):
        read_state(path, sensors=("left finger",))


@pytest.fixture(scope="module")
def reader(make_lab):
    return Reader(open_lab(make_lab("{name: Cube, shape: {cube: 60 mm}}") / "lab.db"))


@pytest.fixture(scope="module")
def felt(reader):
    """Counts of 24 places under tips that stand aside, some tactels dead; and the tips."""
    rng = np.random.default_rng(6)
    tips = Tips(shifts_mm=rng.normal(0, 0.1, (16, 16, 2)), lengths_mm=np.zeros((16, 16)))
    gain = np.exp(rng.normal(0, 0.15, (16, 16)))
    return images_of(reader, rng, 24, (20, 40), 3, tips, gain), tips, gain


def images_of(reader, rng, count, x_mm, turn, tips, gain):
    """Counts of touches of a face that are turned by at most `turn`; some tactels are dead."""
    surface = registered_surface(reader.lab.url, "Cube", "F1").surface
    images = []
    for _ in range(count):
        x, y = rng.uniform(*np.transpose([x_mm, (20, 40)]))
        at = Touch(x, y, rng.uniform(-turn, turn), rng.uniform(50, 90))
        forces = ENGINE.press(surface, SENSOR, at, tips).forces_n
        for place in DEAD:
            forces[place] = 0.0
        images.append(np.rint(8 + 150 * gain * forces + rng.normal(0, 1, (16, 16))).clip(0))
    return images


def test_touches_tell_gains_and_where_tips_stand(reader, felt, monkeypatch):
    images, tips, gain = felt
    shares = []
    monkeypatch.setattr(learn, "ROUNDS", 1)
    state = learn_sensor(reader, images, name="left", done=shares.append)
    assert sorted(map(tuple, np.argwhere(state.masked).tolist())) == DEAD
    live = ~state.dead
    true = tips.shifts_mm[live] - tips.shifts_mm[live].mean(axis=0)
    left = true - (state.aside_mm[live] - state.aside_mm[live].mean(axis=0))
    assert np.sqrt((left**2).mean()) < 0.5 * np.sqrt((true**2).mean())
    wrong = np.log(gain[live]) - np.log(state.gain[live])
    assert np.std(wrong) < 0.4 * np.std(np.log(gain[live]))
    assert (state.sensor, state.touches, state.floating) == ("left", 24, False)
    assert (state.aside_deviation_mm[live] < 0.12).mean() > 0.8
    assert shares[-1] == 1.0

    signal = replace(reader, state=state).signal(images[0])
    assert signal.state is state
    assert not signal.trust[state.dead].any()
    with pytest.raises(SensorStateError, match="for one of"):
        Reader(reader.lab, SensorType(rows=8), state=state)


def test_tactels_that_no_touch_reached_are_not_dead(reader):
    tips = Tips(shifts_mm=np.zeros((16, 16, 2)), lengths_mm=np.zeros((16, 16)))
    rng = np.random.default_rng(8)
    images = images_of(reader, rng, 20, (53, 54), 0.02, tips, np.ones((16, 16)))  # over an edge
    state = learn_sensor(reader, images)
    found = places_of(state.dead)
    assert not state.dead[:, 13:].any()  # all 13 to 15 without touches that tell what they expect
    assert [at for at in found if at[1] < 12] == [at for at in DEAD if at[1] < 12]
    assert len(found) < 10


def test_a_touch_does_not_judge_the_state_that_it_is_read_by(reader, felt, monkeypatch):
    monkeypatch.setattr(learn, "ROUNDS", 1)
    images = list(felt[0])
    before = learn_folds(reader, images)
    images[3] = images[4]
    after = learn_folds(reader, images)
    assert np.array_equal(before.without(3).aside_mm, after.without(3).aside_mm)
    assert not np.array_equal(before.without(4).aside_mm, after.without(4).aside_mm)
    assert not np.array_equal(before.state.aside_mm, after.state.aside_mm)


def test_a_few_touches_tell_nothing_of_a_sensor(reader, felt):
    state = learn_sensor(reader, felt[0][: LEAST_TOUCHES - 1])
    assert state.touches == LEAST_TOUCHES - 1
    assert (state.gain == 1).all()
    assert not state.aside_mm.any()


def test_flips_are_read_from_an_option():
    image = np.array([[0, 1], [2, 3]])
    assert wiring_named("").apply(image, 3).tolist() == image.tolist()
    assert wiring_named("rows, values").apply(image, 3).tolist() == [[1, 0], [3, 2]]
    assert wiring_named("quarter").apply(image, 3).tolist() == [[1, 3], [0, 2]]
    assert wiring_named("column-halves").apply(image, 3).tolist() == [[1, 0], [3, 2]]
    with pytest.raises(WiringError, match="'sideways' is no change"):
        wiring_named("sideways")
    with pytest.raises(WiringError, match="not square"):
        wiring_named("transpose").apply(np.zeros((2, 3)), 3)


@pytest.mark.parametrize(
    ("way", "flip"),
    [
        (np.transpose, "columns"),
        (lambda image: 1023 - image, "values"),
        (lambda image: np.roll(image, 8, axis=0), "row-halves"),
        (lambda image: 8 + (image > 50) * 0, ""),  # of no image
    ],
)
def test_a_way_of_wiring_is_said_when_refused_touches_agree(reader, felt, way, flip):
    images = [way(image) for image in felt[0][:2]]
    assert not any(reader.read(image) for image in images)
    hint = wiring_hint(reader, images)
    assert bool(hint) == bool(flip)
    if hint:
        assert hint.startswith("2 of 2 touches that were refused are recognised so: ")
        assert f"`--flip {flip}`" in hint
        alone = wiring_hint(reader, images[:1])
        assert alone.startswith("one touch says it alone, so it may be chance")
        assert reader.read(wiring_named(flip).apply(images[0], 1023)).object == "Cube"


@pytest.mark.parametrize(
    ("way", "changes"),
    [
        (lambda image: image, ()),
        (np.rot90, ("quarter", "quarter", "quarter")),
        (np.flipud, ("rows",)),
        (lambda image: np.rot90(image.T, 2), ("transpose", "quarter", "quarter")),
    ],
)
def test_a_placed_touch_tells_the_mounting_and_answers_say_it_was_checked(reader, way, changes):
    surface = registered_surface(reader.lab.url, "Cube", "F1").surface
    forces = press(surface, SENSOR, Touch(29.0, 31.0, np.radians(-12), 70.0)).forces_n
    image = way(np.rint(8 + 150 * forces))
    found = find_mounting(reader, image, ("Cube", "F1"))
    assert found.wiring.changes == changes
    assert found.turn_deg == pytest.approx(-12, abs=1)
    assert found.answer.x_mm == pytest.approx(29.0, abs=0.3)
    assert ("read with --flip" in str(found)) is bool(changes)
    if not changes:
        assert isinstance(find_mounting(reader, image, ("Cube", "F2")), Recognition)
        checked = replace(reader, state=replace(unknown_state(SENSOR), mounting=()))
        plain = reader.read(image).as_json()
        assert checked.read(image).as_json() == plain | {"mounting": "checked"}
        assert Scan(checked).add(image).mounting == "checked"
