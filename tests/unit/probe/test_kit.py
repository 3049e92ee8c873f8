"""The kit: volumes by hand, wires against the firmware's pin map, a coupon that is read."""

import json
import math
import re
from pathlib import Path

import pytest

from encoded_objects import Reader, open_lab
from encoded_objects.base.sensor_type import SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.kit import model
from probe.kit.board import connections, has_board, wiring_svg
from probe.kit.command import run
from probe.kit.sizes import CLEARANCE_MM, HEAD_MM, PIN_MM, WALL_BETWEEN_MM, kit_sizes
from probe.simulate.registered import registered_surface

YAML = "name: small\nrows: 8\ncolumns: 8\npitch: 2 mm\noverlay: {tip: 1.6 mm}\n"


@pytest.mark.parametrize("name", shipped_names())
def test_what_must_fit_fits(name):
    sensor = sensor_type_named(name)
    k = kit_sizes(sensor, 5.0)
    if k.tip_mm:
        assert k.tip_mm <= k.foot_mm <= min(sensor.step_mm) - WALL_BETWEEN_MM + 1e-9
        assert 0 < k.vent_mm < sensor.pitch_mm - k.tip_mm  # between two lines of tips
        assert k.thickness_mm - k.thickness_skin_mm - k.lip_mm == pytest.approx(0.8)
    (x, y), *_ = k.posts_mm
    assert x - PIN_MM / 2 > k.film_mm[0] / 2
    assert y - PIN_MM / 2 > k.film_mm[1] / 2
    screw, _ = k.screws_mm[0]
    inside = k.skin_mm[0] / 2 + CLEARANCE_MM
    assert screw - HEAD_MM[0] / 2 > inside  # a screw's head beside the platform
    assert k.coupon_mm > 2 * max(sensor.half_mm)


def test_wires_are_those_of_the_firmware():
    readme = (Path(model.__file__).parents[1] / "firmware" / "README.md").read_text()
    (rows,) = re.findall(r"\| rows, grounded: SER SRCLK RCLK \| [^|]*\((D\d+)-(D\d+)\)", readme)
    (columns,) = re.findall(r"\| column address S0 S1 S2 S3 \| [^|]*\((D\d+)-(D\d+)\)", readme)
    wires = connections(SensorType())
    assert {("Uno", rows[0], "U1", "SER"), ("Uno", rows[1], "U2", "RCLK")} <= set(wires)
    assert ("Uno", columns[0], "MUX", "S0") in wires
    assert ("Uno", columns[1], "MUX", "S3") in wires
    film = [end for a, p, b, q in wires for end in ((a, p), (b, q)) if end[0] == "film"]
    assert sorted(film) == sorted(
        [("film", f"row {k}") for k in range(16)] + [("film", f"column {k}") for k in range(16)]
    )
    drawn = wiring_svg(SensorType())
    signals = [w for w in wires if w[1] not in ("5V", "GND")]
    assert drawn.count("<title>") == len(signals)
    assert not has_board(sensor_type_named("flexitac-12x32"))


def test_a_kit_is_made_verified_and_its_coupon_read(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(YAML)
    folder = tmp_path / "kit"
    given = [str(tmp_path / "small.yaml"), "-o", str(folder), "--verify", "--json"]
    assert run(given) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["verified"] == 7
    sensor = sensor_type_named(str(tmp_path / "small.yaml"))
    database, face = str(folder / "coupon.db"), made["coupon"]["face"].removeprefix("Coupon-")
    scene = registered_surface(database, "Coupon", face)
    x, y = scene.centre_mm()
    forces = press(scene.surface, sensor, Touch(x, y, 0.3, 30.0)).forces_n
    answer = Reader(open_lab(database), sensor).read(1000 * forces)
    assert (answer.object, answer.face) == ("Coupon", face)
    assert math.hypot(answer.x_mm - x, answer.y_mm - y) < 0.2
