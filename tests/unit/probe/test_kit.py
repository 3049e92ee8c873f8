"""The kit: volumes by hand, wires against the firmware's pin map, a coupon that is read."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from encoded_objects import Reader, open_lab
from encoded_objects.base.sensor_type import Overlay, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.kit import model
from probe.kit.board import connections, has_board, shore_a, wiring_svg
from probe.kit.command import run
from probe.kit.make import bed_for
from probe.kit.model import mesh_of
from probe.kit.sheet import PrintedPart
from probe.kit.sizes import CLEARANCE_MM, HEAD_MM, PIN_MM, WALL_BETWEEN_MM, frustum_mm3, kit_sizes
from probe.simulate.registered import registered_surface

SMALL = SensorType(rows=4, columns=5, pitch_mm=3.0, name="small",
                   overlay=Overlay(tab_diameter_mm=2.4), missing=((0, 0),))  # fmt: skip
YAML = """name: small
rows: 8
columns: 8
pitch: 2 mm
overlay: {tip: 1.6 mm}
"""


def rod(diameter, high):
    return math.pi * diameter**2 / 4 * high


def holes(k, high):
    return 2 * rod(3.15, high) + 4 * rod(3.4, high)


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


def test_volumes_are_those_of_a_calculation_by_hand():
    k = kit_sizes(SMALL, 7.0)
    base = math.prod(k.mould_mm)
    skin = math.prod(k.skin_mm)
    tabs = 19 * frustum_mm3(2.4, k.foot_mm, 2.0)
    by_hand = {
        "mould-base": 4 * base - holes(k, 4) - 4 * k.vent_mm * k.mould_mm[1] * 0.15,
        "mould-plate": 6 * base - 4 * skin - holes(k, 6) - tabs + 4 * rod(3.0, 4),
        "mould-lid": 4 * base + 3.6 * (k.skin_mm[0] - 0.3) * (k.skin_mm[1] - 0.3)
        - 4 * rod(3.3, 7.6) - 4 * rod(1.5, 7.6) - holes(k, 4),
        "flange-adapter": 10 * math.prod(k.side_mm) - 4 * rod(6.6, 10)
        - 4 * (rod(11.0, 6.8) - rod(6.6, 6.8)) - rod(31.5, 3.0) - 4 * rod(3.4, 10),
    }  # fmt: skip
    for name, expected in by_hand.items():
        solid = model.PARTS[name][1](k)
        assert len(solid.solids()) == 1
        assert solid.volume == pytest.approx(expected, rel=1e-9)
    assert k.silicone_mm3 == pytest.approx(0.4 * skin + tabs)


def test_tabs_of_the_mould_stand_where_tactels_are():
    k = kit_sizes(SMALL, 7.0)
    solid = model.mould_plate(k)
    mesh = mesh_of(solid)
    tips = mesh.vertices[np.abs(mesh.vertices[:, 2]) < 1e-9]
    around = [p for p in tips if np.abs(p[:2]).max() < 8]
    for row, column in np.ndindex(4, 5):
        x, y = SMALL.centres_mm()[row, column]
        near = [p for p in around if math.hypot(p[0] - x, p[1] - y) < 1.4]
        assert bool(near) == ((row, column) != (0, 0))
        for p in near:
            assert math.hypot(p[0] - x, p[1] - y) == pytest.approx(1.2, abs=1e-6)


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


def test_hardness_of_silicone_after_gent():
    for shore in (10, 30, 60):
        young = 0.0981 * (56 + 7.62336 * shore) / (0.137505 * (254 - 2.54 * shore))
        assert shore_a(young) == pytest.approx(shore)


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


@pytest.mark.parametrize("kind", ["pad", "gel"])
def test_layers_have_a_closed_mould(kind):
    layer = sensor_type_named("gel-24x32") if kind == "gel" else SMALL.with_overlay("pad")
    k = kit_sizes(replace(layer, missing=()), 5.0)
    solid = model.mould_plate(k)
    high = 4 + k.thickness_mm + 3.6
    expected = high * math.prod(k.mould_mm) - (high - 4) * math.prod(k.skin_mm)
    assert solid.volume == pytest.approx(expected - holes(k, high) + 4 * rod(3, high - 4))


def test_a_part_that_the_usual_bed_does_not_hold_says_so_and_lies_on_a_larger_one():
    small = PrintedPart("lid", "presses", (84.9, 139.0, 7.0), 1.0, resin=True)
    assert small.bed_hint == ""
    assert replace(small, size_mm=(249.0, 209.0, 7.0), resin=False).bed_hint == ""
    large = replace(small, size_mm=(108.0, 86.0, 7.0))
    assert large.bed_hint == "wants a bed of 108 x 86 mm, more than the usual 140 x 85"
    box = mesh_of(model.PARTS["mould-lid"][1](kit_sizes(sensor_type_named("mat-32x32"), 6.0)))
    wide, deep = bed_for([box], (140.0, 85.0))
    assert wide == 140.0
    assert deep == pytest.approx(np.ptp(box.vertices[:, 1]))
    assert bed_for([box], (140.0, 110.0)) == (140.0, 110.0)
