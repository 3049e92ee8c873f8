"""Sensor types: shipped ones, files with their errors, which one images are of."""

from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import (
    Overlay,
    SensorType,
    SensorTypeError,
    choose_sensor_type,
    force_share,
    sensor_type_text,
)
from encoded_objects.base.sensor_type_file import (
    parse_sensor_type,
    sensor_type_named,
    shipped_names,
)
from probe.errors import RecordingError
from probe.frame import frame_from
from probe.recording.read import Recording
from probe.recording.record import Recorder

LEAST = "name: mine\nrows: 4\ncolumns: 6\npitch: 2 mm\n"


def test_a_type_comes_back_from_its_text():
    assert shipped_names()[0] == "fsr-16"
    assert sensor_type_named("fsr-16") == SensorType()
    for name in shipped_names():
        sensor = sensor_type_named(name)
        assert sensor.name == name
        assert parse_sensor_type(sensor_type_text(sensor), "text") == sensor
    present = sensor_type_named("mat-32x32").present()
    assert present.sum() == 32 * 32 - 4 * 25 - 2 * 4
    assert (present[0, 0], present[31, 28], present[5, 5]) == (False, False, True)


def test_everything_that_a_file_says_is_kept():
    text = LEAST + (
        "overlay: {kind: pad, height: 1.5 mm, young: 0.8, poisson: 0.45}\n"
        "bits: 12\nexponent: 0.9\nwiring: floating\nnoise: 2\n"
        "missing: [{rows: 0-1, columns: 5}, {rows: 3, columns: 0}]\n"
    )
    assert parse_sensor_type(text, "a.yaml") == SensorType(
        4, 6, 2.0, Overlay("pad", 1.5, young_mpa=0.8, poisson=0.45), "mine", bits=12,
        exponent=0.9, wiring="floating", noise=2.0, missing=((0, 5), (1, 5), (3, 0)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (LEAST.replace("4", "1"), "a.yaml:2:7: error: rows and columns must be 2 to 255, not 1"),
        (LEAST.replace("2 mm", "2 furlong"), "a.yaml:4:8: error: unknown unit 'furlong'"),
        (LEAST.replace("mine", "My sensor"), "a.yaml:1:7: error: 'My sensor' is no name"),
        (LEAST + "overlay: {poisson: 0.6}", "poisson must be 0 or more and at most 0.5, not 0.6"),
        (LEAST + "value: depth", "a.yaml:5:8: error: value depth with a tab overlay"),
        (LEAST + "overlay: {kind: gel}", "a.yaml:5:17: error: value counts with a gel overlay"),
        (LEAST + "missing:\n  - {rows: 4, columns: 0}", "a.yaml:6:5: error: a missing tactel in"),
        (LEAST + "missing: [{rows: 3-1, columns: 0}]", "the range 3-1 runs backwards"),
        (LEAST + "missing: [{rows: -1, columns: 0}]", "is no line or range of lines"),
        (LEAST + "bits: 17", "bits must be 4 to 16, not 17"),
    ],
)
def test_what_is_wrong_stands_at_its_line_and_column(text, says):
    with pytest.raises(SensorTypeError) as refused:
        parse_sensor_type(text, "a.yaml")
    assert says in str(refused.value)
    assert refused.value.exit_code == 2


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: SensorType(rows=-3), "rows -3(?s:.*)a whole number from 2 to 255"),
        (lambda: SensorType(rows="16"), "rows '16'"),
        (lambda: SensorType(columns=16.0), "columns 16.0"),
        (lambda: SensorType(pitch_mm=np.nan), "pitch_mm nan(?s:.*)above 0, at most 10000"),
        (lambda: SensorType(pitch_mm="2 mm"), "pitch_mm '2 mm'"),
        (lambda: SensorType(row_pitch_mm=-2), "row_pitch_mm -2"),
        (lambda: SensorType(overlay="pad"), r"overlay 'pad'(?s:.*)Overlay\(kind=\"pad\"\)"),
        (lambda: SensorType(name="My sensor"), "'My sensor' is no name"),
        (
            lambda: SensorType(value="volts"),
            "value 'volts'(?s:.*)counts or conductance or force or depth",
        ),
        (lambda: SensorType(value="depth"), "value depth with a tab overlay"),
        (lambda: SensorType(wiring="loose"), "wiring 'loose'"),
        (lambda: SensorType(bits=99, exponent=0), "bits 99(?s:.*)exponent 0"),
        (lambda: SensorType(missing=((99, 99),)), "a missing tactel in row 99, column 99"),
        (lambda: SensorType(missing=[(1, 2)]), "give a tuple of pairs"),
        (lambda: SensorType(missing=(3,)), "give a tuple of pairs"),
        (lambda: Overlay(kind="glove"), "kind"),
        (lambda: Overlay(height_mm=0.0), "height_mm"),
        (lambda: Overlay(young_mpa=np.nan), "young_mpa"),
        (lambda: Overlay(poisson=0.51), "poisson"),
        (lambda: sensor_type_named("gel-24x32").with_overlay("tab"), "depth with a tab overlay"),
    ],
)
def test_python_is_refused_what_a_file_may_not_say(call, says):
    with pytest.raises(SensorTypeError, match=says):
        call()


def test_numbers_of_numpy_stay_readable_in_a_text():
    given = SensorType(np.int64(8), 8, np.float64(2.5))
    assert parse_sensor_type(sensor_type_text(given), "text") == given


def test_which_type_images_are_of():
    text = sensor_type_text(sensor_type_named("fsr-8x8"))
    assert choose_sensor_type(None, "", None, "x") == SensorType()
    assert choose_sensor_type("", text, (8, 8), "x").name == "fsr-8x8"
    assert choose_sensor_type("mat-32x32", text, (32, 32), "x").name == "mat-32x32"
    with pytest.raises(SensorTypeError, match=r"12 x 32.*nothing tells(?s:.*)flexitac-12x32"):
        choose_sensor_type("", "", (12, 32), "touch.h5")
    with pytest.raises(SensorTypeError, match="images of 16 x 16 readings, fsr-8x8 has 8 x 8"):
        choose_sensor_type("fsr-8x8", "", (16, 16), "touch.h5")


def test_the_pitch_that_is_proposed():
    assert SensorType().symbol_pitch_mm == 5.0
    assert SensorType().with_overlay("pad").symbol_pitch_mm == 7.0
    assert sensor_type_named("flexitac-12x32").symbol_pitch_mm == 6.0
    assert sensor_type_named("gel-24x32").symbol_pitch_mm == 3.0
    few = tuple((row, column) for row in range(16) for column in range(16) if column % 8)
    small, sparse = SensorType(8, 8, 1.5875), SensorType(missing=few)
    assert small.symbol_pitch_mm < SensorType().symbol_pitch_mm
    assert sparse.symbol_pitch_mm < SensorType().symbol_pitch_mm
    assert SensorType(4, 4, 6.0).symbol_pitch_mm == 12.0  # two tactels, though few are seen whole


def test_frames_of_another_shape_are_not_recorded(tmp_path):
    with Recorder(tmp_path / "a.h5") as recorder:
        recorder.append(frame_from(np.zeros((8, 8)), t_ns=0, seq=0))
        with pytest.raises(RecordingError, match="16 x 16 readings in a recording of 8 x 8"):
            recorder.append(frame_from(np.zeros((16, 16)), t_ns=1, seq=1))
    with pytest.raises(SensorTypeError, match="--sensor-type fsr-8x8"):
        Recording(tmp_path / "a.h5").sensor_type()


UNEQUAL = "name: cloth\nrows: 14\ncolumns: 20\npitch: 1.5 mm\nrow_pitch: 2.1 mm\n"


def test_rows_may_stand_farther_apart_than_columns():
    cloth = parse_sensor_type(UNEQUAL, "cloth.yaml")
    assert cloth.half_mm == pytest.approx((15.0, 14.7))
    centres = cloth.centres_mm()
    assert centres[0, 1, 0] - centres[0, 0, 0] == pytest.approx(1.5)
    assert centres[0, 0, 1] - centres[1, 0, 1] == pytest.approx(2.1)
    assert parse_sensor_type(sensor_type_text(cloth), "text") == cloth
    assert cloth.symbol_pitch_mm == 6.5
    same = parse_sensor_type(UNEQUAL.replace("2.1", "1.5"), "cloth.yaml")
    assert same.row_pitch_mm == 0
    with pytest.raises(SensorTypeError, match=r"cloth.yaml:5:12(?s:.*)under a pad"):
        parse_sensor_type(UNEQUAL + "overlay: {kind: pad}\n", "cloth.yaml")
    with pytest.raises(SensorTypeError, match=r"rows 2\.1 mm and columns 1\.5 mm apart"):
        cloth.with_overlay("pad")


def test_a_type_is_pressed_as_hard_for_its_area_and_a_gel_as_deep():
    assert force_share(SensorType()) == 1.0
    assert force_share(replace(SensorType(), rows=32)) == 2.0
    stiff = replace(SensorType(), overlay=replace(SensorType().overlay, young_mpa=3.0))
    assert force_share(stiff) == 1.0
    gel = sensor_type_named("gel-24x32")
    area, bed = 18.56 * 13.92, 0.3 / 3.0  # mm^2; N/mm^3
    assert 80 * force_share(gel) == pytest.approx(0.3 * bed * area)
    soft = replace(gel, overlay=replace(gel.overlay, young_mpa=0.15))
    assert force_share(soft) == pytest.approx(force_share(gel) / 2)
