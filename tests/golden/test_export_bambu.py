"""Projects for Bambu Studio and OrcaSlicer, as lib3mf and a reader of their rules read them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reference.bambu_project import read_project
from reference.cube_panels import cube_panels

from generator.command import run as run_command
from generator.command.made_report import next_step
from generator.errors import WriteError
from generator.export.bambu import PLATES_MAX, plate_origins_mm, project_3mf, project_names
from generator.export.threemf import PrintFile, SlicerSettings, print_files
from generator.pipeline import encode
from generator.printers import printer_named
from generator.spec.read import read_specs

A1 = printer_named("bambu-a1-mini")


def plates_of(bed: float, settings: SlicerSettings | None = None) -> tuple[PrintFile, ...]:
    """Return the plates of a cube of 40 mm for a bed of this side, mm."""
    settings = settings or SlicerSettings(replace(A1, bed_mm=(bed, bed)))
    parts = [replace(part, name=f'{part.name} & "<ü>') for part in cube_panels(40.0)]
    return print_files("Cube", parts, (bed, bed), settings)


@pytest.fixture(scope="module", params=[60.0, 100.0, 180.0])
def plates(request: pytest.FixtureRequest) -> tuple[PrintFile, ...]:
    """Six, two and one of them."""
    return plates_of(request.param)


def test_a_project_passes_the_strict_reader_of_lib3mf(
    plates: tuple[PrintFile, ...], tmp_path: Path
) -> None:
    import lib3mf

    path = tmp_path / "project.3mf"
    path.write_bytes(project_3mf("Cube", plates))
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    meshes, items = model.GetMeshObjects(), model.GetBuildItems()
    names = []
    while meshes.MoveNext():
        mesh = meshes.GetCurrentMeshObject()
        names.append(mesh.GetName())
        assert mesh.IsManifoldAndOriented()
    parts = [part for plate in plates for part in plate.parts]
    wanted = [f"{part.name} {kind}" for part in parts for kind in ("body", "symbols")]
    assert sorted(names) == sorted(wanted)
    bed = plates[0].settings.printer.bed_mm
    origins = plate_origins_mm(len(plates), bed)
    cells = [cell for cell, plate in zip(origins, plates, strict=True) for _ in plate.parts]
    for part, (x, y) in zip(parts, cells, strict=True):
        assert items.MoveNext()
        item = items.GetCurrent()
        box, shift = item.GetObjectResource().GetOutbox(), item.GetObjectTransform().Fields[3]
        low, high = (np.array(c) + shift for c in (box.MinCoordinate, box.MaxCoordinate))
        assert item.GetObjectResource().GetName() == part.name
        assert (low[:2] >= (x, y)).all()
        assert (high[:2] <= (x + bed[0], y + bed[1])).all()
        np.testing.assert_allclose([low[2], high[2]], [0.0, 4.0], atol=1e-5)
    assert not items.MoveNext()


def test_plates_hold_what_they_say_where_it_lies_on_them(plates: tuple[PrintFile, ...]) -> None:
    content = project_3mf("Cube", plates)
    project = read_project(content)
    assert project.application == "BambuStudio-02.00.00.00"
    assert content == project_3mf("Cube", plates_of(plates[0].settings.printer.bed_mm[0]))
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


def test_plates_stand_in_a_grid_whose_next_row_is_in_front() -> None:
    assert plate_origins_mm(1, (180.0, 180.0)) == [(0.0, 0.0)]
    corners = [(0, 0), (120, 0), (240, 0), (0, -60), (120, -60)]
    assert plate_origins_mm(5, (100.0, 50.0)) == [pytest.approx(corner) for corner in corners]
    for count, columns in ((2, 2), (4, 2), (6, 3), (7, 3), (9, 3), (10, 4), (36, 6)):
        rows = [y for _, y in plate_origins_mm(count, (100.0, 50.0))]
        assert rows.count(0.0) == columns


@pytest.mark.parametrize(
    ("name", "printer", "process", "plastic"),
    [
        ("bambu-x1c", "Bambu Lab X1 Carbon 0.4", "0.20mm Standard @BBL X1C", "@BBL X1C"),
        ("bambu-p1s-0.6", "Bambu Lab P1S 0.6", "0.30mm Standard @BBL X1C 0.6 nozzle", "@BBL X1C"),
        ("bambu-a1-0.2", "Bambu Lab A1 0.2", "0.10mm Standard @BBL A1 0.2 nozzle",
         "@BBL A1 0.2 nozzle"),
    ],
)  # fmt: skip
def test_presets_are_named_as_the_slicer_names_them(name, printer, process, plastic) -> None:
    known = printer_named(name)
    settings = SlicerSettings(known, supports=True, symbols_apart=False)
    files = print_files("Cube", cube_panels(40.0)[:1], known.bed_mm, settings)
    project = read_project(project_3mf("Cube", files))
    assert project.settings["printer_settings_id"] == f"{printer} nozzle"
    assert project.settings["print_settings_id"] == process
    assert project.settings["filament_settings_id"] == [f"Bambu PLA Basic {plastic}"] * 2
    assert project.settings["enable_support"] == "1"
    assert (project.plates[0][0].filaments, project.plates[0][0].supports) == ((1, 1), True)


def test_a_printer_of_another_maker_names_no_presets() -> None:
    settings = SlicerSettings(printer_named("voron-250"))
    files = print_files("Cube", cube_panels(40.0)[:1], (250.0, 250.0), settings)
    found = read_project(project_3mf("Cube", files)).settings
    assert not [name for name in found if name.endswith("_settings_id") or "model" in name]
    assert (found["printable_area"][2], found["nozzle_diameter"]) == ("250x250", ["0.4"])


def test_resin_is_refused_and_many_plates_are_several_projects() -> None:
    files = print_files("Cube", cube_panels(40.0)[:1], (140.0, 85.0))
    with pytest.raises(WriteError, match="print filament") as caught:
        project_3mf("Cube", files)
    assert "leave bambu out of formats" in caught.value.fix
    assert project_names("A", 1) == ["A-bambu.3mf"]
    assert project_names("A", 2) == ["A-bambu-1.3mf", "A-bambu-2.3mf"]
    assert PLATES_MAX == 36


def test_owners_of_such_a_printer_get_a_project_unasked(tmp_path: Path, capsys) -> None:
    spec, files = tmp_path / "a.yaml", ["-o", str(tmp_path), "--database", f"{tmp_path}/l.db"]
    spec.write_text("name: A\nshape: {cube: 30 mm}\nprint: {printer: {like: bambu-a1}}\n")
    assert read_specs([spec])[0].formats == ("step", "stl", "3mf", "bambu")
    assert run_command([str(spec), *files]) == 0
    said = capsys.readouterr().out
    assert re.search(r"print \S+A-bambu.3mf \(in Bambu Studio or OrcaSlicer\) as it lies", said)
    project = read_project((tmp_path / "A-bambu.3mf").read_bytes())
    assert [len(plate) for plate in project.plates] == [6]
    assert "A-bambu.3mf, plate 1" in (tmp_path / "A-build.html").read_text()
    spec.write_text("name: A\nshape: {cube: 30 mm}\nprint: {printer: ender-3}\n")
    assert "bambu" not in read_specs([spec])[0].formats
    spec.write_text(
        "name: A\nshape: {cube: 30 mm}\nprint: {printer: {like: bambu-a1, bed: 9 cm x 9 cm}}\n"
    )
    assert "bambu" not in read_specs([spec])[0].formats  # another machine


def test_a_set_has_a_project_for_each_of_its_printers(tmp_path: Path) -> None:
    spec = tmp_path / "lab.yaml"
    spec.write_text(
        "name: lab\nprofile: one-touch\nobjects:\n"
        "  - {name: A, shape: {cube: 24 mm}, print: {printer: bambu-a1-mini}}\n"
        "  - {name: B, shape: {cylinder: {diameter: 24 mm, height: 24 mm}}, "
        "print: {printer: bambu-a1-mini}}\n"
        "  - {name: C, shape: {cube: 24 mm}, print: {printer: bambu-a1}}\n"
        "  - {name: D, shape: {cube: 24 mm}, print: {printer: ender-3}, output: {formats: 3mf}}\n"
    )
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
    assert [[one.name for one in plate] for plate in second.plates] == [
        [f"C-F{k}" for k in range(1, 7)]
    ]
    page = (tmp_path / "lab-build.html").read_text()
    assert "lab-bambu-1.3mf, plate 2" in page
    assert "lab-plate-4.3mf" in page
