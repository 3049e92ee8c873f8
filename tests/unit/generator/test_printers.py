"""Printers that people have, their own ones, and the layers that walls and symbols lie on."""

from __future__ import annotations

from pathlib import Path

import pytest

from generator.pipeline.plan import plan_object
from generator.spec import ObjectSpec, SpecError, read_specs

CUBE = "name: Cube\nshape: {cube: 60 mm}\n"


def spec_of(folder: Path, printer: str) -> ObjectSpec:
    path = folder / "c.yaml"
    path.write_text(f"{CUBE}print: {{printer: {printer}}}\n")
    return read_specs([path])[0]


@pytest.mark.parametrize(
    ("text", "bed", "nozzle", "layer", "stroke"),
    [
        ("{like: ender-3, layer: 0.15 mm, bed: 300 x 310 mm}", (300, 310), 0.4, 0.15, 0.8),
        ("{bed: [10 in, 200 mm], stroke: 0.9 mm}", (254, 200), 0.4, 0.2, 0.9),
        ("{like: ender-3, nozzle: 0.25 mm}", (220, 220), 0.25, 0.1, 0.5),
        ("mine.yaml", (300, 300), 0.4, 0.12, 0.8),
    ],
)
def test_a_spec_names_or_describes_its_printer(tmp_path, text, bed, nozzle, layer, stroke) -> None:
    (tmp_path / "mine.yaml").write_text("like: voron-300\nlayer: 0.12 mm\n")
    printer = spec_of(tmp_path, text).printer
    assert (printer.bed_mm, printer.nozzle_mm, printer.layer_mm) == (bed, nozzle, layer)
    assert printer.stroke_min_mm == stroke


def test_own_printers_count_by_their_values_known_ones_by_their_names(tmp_path) -> None:
    def meaning(text: str) -> object:
        return spec_of(tmp_path, text).meaning["printer"]

    assert meaning("fdm-0.4") == meaning("{like: fdm-0.4}") == "fdm-0.4"
    assert meaning("{layer: 0.15 mm}") == meaning("{layer: 0.15}") != meaning("{layer: 0.16}")


@pytest.mark.parametrize(
    ("text", "place", "fix"),
    [
        ("{like: ender-3, layers: 1}", "c.yaml:3:34", "did you mean 'layer'?"),
        ("{bed: 300 mm}", "c.yaml:3:24", "write bed: 250 x 210 mm"),
        ("mine.yaml", "mine.yaml:1:1", "did you mean 'layer'?"),
        ("none.yaml", "none.yaml", "did you mean"),
        ("{like: ender-3, layer: 0.5 mm}", "c.yaml:3:41", "set layer to 0.3 mm or less"),
    ],
)
def test_what_is_wrong_with_a_printer_is_said_where_it_stands(tmp_path, text, place, fix) -> None:
    (tmp_path / "mine.yaml").write_text("layr: 0.12 mm\n")
    with pytest.raises(SpecError) as caught:
        spec_of(tmp_path, text)
    (problem,) = caught.value.problems
    assert problem.place.endswith(place)
    assert fix in problem.fix


@pytest.mark.parametrize(
    ("printer", "wall", "height"),
    [("fdm-0.4", 3.0, 1.0), ("{layer: 0.3 mm}", 3.0, 0.9), ("{layer: 0.28 mm}", 3.08, 1.12),
     ("resin", 3.0, 1.0), ("{layer: 0.3 mm, nozzle: 1.0 mm, stroke: 1.9 mm}", 3.9, 0.9)],
)  # fmt: skip
def test_walls_and_symbols_are_whole_layers(tmp_path, printer, wall, height) -> None:
    spec = spec_of(tmp_path, printer)
    assert (spec.wall_mm, spec.style.height_mm) == (wall, height)
    assert spec.wall_mm >= 2 * spec.printer.stroke_min_mm
    layers = (spec.wall_mm - spec.printer.first_layer_mm) / spec.printer.layer_mm
    assert layers == pytest.approx(round(layers))


def test_layers_that_do_not_divide_what_was_asked_for_are_told(tmp_path) -> None:
    (note,) = plan_object(spec_of(tmp_path, "{layer: 0.3 mm}, wall: 3.5 mm")).notes
    assert note == (
        "walls of 3.5 mm print 3.6 mm, symbols of 0.9 mm print 0.9 mm high at layers of 0.3 mm: "
        "wall 3.6 mm and height 0.9 mm are whole layers"
    )
    assert plan_object(spec_of(tmp_path, "resin, wall: 3.5 mm")).notes == ()
