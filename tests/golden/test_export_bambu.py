"""Projects for Bambu Studio and OrcaSlicer, as lib3mf and a reader of their rules read them."""

from dataclasses import replace

import numpy as np
import pytest
from reference.bambu_project import read_project
from reference.cube_panels import cube_panels
from reference.strict_3mf import read_strictly

from generator.command.made_report import next_step
from generator.errors import WriteError
from generator.export.bambu import PLATES_MAX, plate_origins_mm, project_3mf, project_names
from generator.export.threemf import SlicerSettings, print_files
from generator.pipeline import encode
from generator.printers import printer_named
from generator.spec.read import read_specs, tree_from


@pytest.fixture(scope="module")
def panels():
    return cube_panels(40.0)


@pytest.mark.parametrize("bed", [60.0, 100.0, 180.0])  # six, two plates, and one
def test_a_project_holds_what_it_says_where_it_lies(bed, panels, tmp_path):
    settings = SlicerSettings(replace(printer_named("bambu-a1-mini"), bed_mm=(bed, bed)))
    parts = [replace(part, name=f'{part.name} & "<ü>') for part in panels]
    plates = print_files("Cube", parts, (bed, bed), settings)
    content = project_3mf("Cube", plates)
    (tmp_path / "project.3mf").write_bytes(content)
    meshes, built = read_strictly(tmp_path / "project.3mf")
    kinds = ("body", "symbols")
    assert sorted(meshes) == sorted(f"{part.name} {kind}" for part in parts for kind in kinds)
    cells = plate_origins_mm(len(plates), (bed, bed))
    cells = [cell for cell, plate in zip(cells, plates, strict=True) for _ in plate.parts]
    assert [name for name, *_ in built] == [part.name for one in plates for part in one.parts]
    for (_, low, high), cell in zip(built, cells, strict=True):
        assert (low[:2] >= cell).all()
        assert (high[:2] <= np.add(cell, bed)).all()
        np.testing.assert_allclose([low[2], high[2]], [0.0, 4.0], atol=1e-5)
    project = read_project(content)
    assert project.application == "BambuStudio-02.00.00.00"
    for found, plate in zip(project.plates, plates, strict=True):
        assert [one.name for one in found] == [part.name for part in plate.parts]
        for one, place in zip(found, plate.plate.places, strict=True):
            assert one.parts == (f"{one.name} body", f"{one.name} symbols")
            assert (one.filaments, one.supports) == ((1, 2), False)
            np.testing.assert_allclose(one.low, (place.x_mm, place.y_mm, 0.0), atol=2e-6)
    settings = project.settings
    assert len(settings["filament_colour"]) == len(settings["filament_settings_id"]) == 2
    assert settings["printer_settings_id"] == "Bambu Lab A1 mini 0.4 nozzle"
    kept = settings["different_settings_to_system"]
    assert len(kept) == len(settings["inherits_group"]) == 2 + 2  # print, filaments, printer
    assert {"layer_height", "enable_support"} <= set(kept[0].split(";")) <= set(settings)


def test_plates_stand_in_a_grid_whose_next_row_is_in_front():
    corners = [(0, 0), (120, 0), (240, 0), (0, -60), (120, -60)]
    assert plate_origins_mm(5, (100.0, 50.0)) == [pytest.approx(corner) for corner in corners]
    for count, columns in ((1, 1), (2, 2), (4, 2), (6, 3), (7, 3), (9, 3), (10, 4), (36, 6)):
        rows = [y for _, y in plate_origins_mm(count, (100.0, 50.0))]
        assert rows.count(0.0) == columns


@pytest.mark.parametrize(("name", "said"), [
    ("bambu-x1c", ("Bambu Lab X1 Carbon 0.4 nozzle", "0.20mm Standard @BBL X1C", "@BBL X1C")),
    ("bambu-p1s-0.6",
     ("Bambu Lab P1S 0.6 nozzle", "0.30mm Standard @BBL X1C 0.6 nozzle", "@BBL X1C")),
    ("bambu-a1-0.2",
     ("Bambu Lab A1 0.2 nozzle", "0.10mm Standard @BBL A1 0.2 nozzle", "@BBL A1 0.2 nozzle")),
    ("voron-250", None),
])  # fmt: skip
def test_presets_are_named_as_the_slicer_names_them(name, said, panels):
    known = printer_named(name)
    settings = SlicerSettings(known, supports=True, symbols_apart=False)
    plates = print_files("C", panels[:1], known.bed_mm, settings)
    project = read_project(project_3mf("Cube", plates))
    found = project.settings
    assert (project.plates[0][0].filaments, project.plates[0][0].supports) == ((1, 1), True)
    assert found["enable_support"] == "1"
    if said is None:  # of another maker, whose presets the slicer may not have
        assert not [key for key in found if key.endswith("_settings_id") or "model" in key]
        assert (found["printable_area"][2], found["nozzle_diameter"]) == ("250x250", ["0.4"])
        return
    printer, process, plastic = said
    assert found["printer_settings_id"] == printer
    assert found["print_settings_id"] == process
    assert found["filament_settings_id"] == [f"Bambu PLA Basic {plastic}"] * 2


def test_resin_is_refused_and_many_plates_are_several_projects(panels):
    with pytest.raises(WriteError, match="print filament") as caught:
        project_3mf("Cube", print_files("Cube", panels[:1], (140.0, 85.0)))
    assert "leave bambu out of formats" in caught.value.fix
    assert project_names("A", 1) == ["A-bambu.3mf"]
    assert project_names("A", 2) == ["A-bambu-1.3mf", "A-bambu-2.3mf"]
    assert PLATES_MAX == 36


def test_owners_of_such_a_printer_get_a_project_unasked():
    for printer, asked in (
        ({"like": "bambu-a1"}, True),
        ("ender-3", False),
        ({"like": "bambu-a1", "bed": "9 cm x 9 cm"}, False),  # another machine
    ):
        spec = {"name": "A", "shape": {"cube": 30}, "print": {"printer": printer}}
        assert ("bambu" in read_specs([tree_from(spec)])[0].formats) == asked


SET = """name: lab
profile: one-touch
output: {formats: [3mf, bambu]}
objects:
  - {name: A, shape: {cube: 24 mm}, print: {printer: bambu-a1-mini}}
  - {name: B, shape: {cube: 25 mm}, print: {printer: bambu-a1-mini, parts: whole}}
  - {name: C, shape: {cube: 24 mm}, print: {printer: bambu-a1, parts: whole}}
  - name: D
    shape: {cube: 24 mm}
    print: {printer: ender-3, parts: whole}
    output: {formats: 3mf}
"""


def test_a_set_has_a_project_for_each_of_its_printers(tmp_path):
    spec = tmp_path / "lab.yaml"
    spec.write_text(SET)
    url = f"sqlite:///{tmp_path}/l.db"
    made = encode(read_specs([spec]), folder=tmp_path, database=url, jobs=1)
    names = sorted(path.name for path in made.set_files if "-bambu" in path.name)
    assert names == ["lab-bambu-1.3mf", "lab-bambu-2.3mf"]
    assert [path.name for path in made.to_print] == [*names, "lab-plate-4.3mf"]
    said = next_step(made)
    assert f"lab-bambu-1.3mf ... lab-bambu-2.3mf in {tmp_path} (in Bambu Studio or OrcaS" in said
    assert f"and lab-plate-4.3mf in {tmp_path} (in PrusaSlicer lab-plate-4-prusaslicer.3mf)" in said
    first, second = (read_project((tmp_path / name).read_bytes()) for name in names)
    held = [{one.name.split("-F")[0] for one in plate} for plate in first.plates]
    assert held == [{"A"}, {"B"}]
    assert [one.filaments for one in first.plates[1]] == [(1, 1)]
    assert [[one.name for one in plate] for plate in second.plates] == [["C"]]
    page = (tmp_path / "lab-build.html").read_text()
    assert "lab-bambu-1.3mf, plate 2" in page
    assert "lab-plate-4.3mf" in page
