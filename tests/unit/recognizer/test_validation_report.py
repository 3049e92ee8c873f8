"""Pictures whose names do not overlap, faces drawn flat, and worlds of several runs on a page."""

import json
import re
from itertools import combinations

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from probe.contact.engines import ENGINES, engine_table
from recognizer.validation.command import run
from recognizer.validation.flat_faces import FlatFace, draw_flat
from recognizer.validation.pictures import label_points
from recognizer.validation.results import FORMAT, surface_name
from recognizer.validation.statistics import normalised_errors, share_of
from recognizer.validation.studies import contact_study, engine_lines


def test_names_of_crowded_points_do_not_overlap():
    rng = np.random.default_rng(1)
    figure = Figure(figsize=(5.5, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    points = [
        (float(x), float(y), f"more of {k}") for k, (x, y) in enumerate(rng.normal(0, 1, (14, 2)))
    ]
    points += [(0.0, 0.0, "one"), (0.0, 0.0, "its double"), (np.nan, 1.0, "no number")]
    axes.plot(*zip(*[point[:2] for point in points], strict=True), "o")
    axes.margins(0.3)
    texts = label_points(axes, points)
    assert {text.get_text() for text in texts} == {name for *_, name in points} - {"no number"}
    figure.draw_without_rendering()
    boxes, frame = [text.get_window_extent() for text in texts], axes.get_window_extent()
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    assert all(frame.padded(1).containsx(x) for box in boxes for x in box.intervalx)
    assert all(frame.padded(1).containsy(y) for box in boxes for y in box.intervaly)


def test_every_engine_is_in_the_picture_and_says_what_it_leaves_out():
    series = {line["series"] for line in contact_study().counted}
    assert series == {"tab, own engine", "pad, own engine", "tab, mujoco"}
    # Drake takes no points of a tip, so that no image of its own is finer.
    assert {line.engine for line in engine_table()} == set(ENGINES) - {"own", "drake"}
    errors = [line.error for line in engine_table()]
    assert errors == sorted(errors, reverse=True)  # more points err less
    lines = engine_lines()
    assert [line["engine"] for line in lines] == list(ENGINES)
    assert all(len(line["left_out"].split()) > 8 for line in lines)


def square(name, bad=False, **touches):
    by = {verdict: np.array(at, float).reshape(-1, 2) for verdict, at in touches.items()}
    corners = np.array([[0, 0], [40, 0], [40, 40], [0, 40]], float)
    return FlatFace(name, (corners,), np.array([[20.0, 20.0]]), by, bad)


def test_a_face_drawn_flat_has_a_dot_for_each_touch_where_it_was():
    face = square("F<1>", right=[(10, 30)], rejected=[(0, 0), (40, 40)])
    svg = draw_flat([face], 2.0)
    assert "F&lt;1&gt;" in svg
    assert "1 right, 2 refused" in svg
    dots = re.findall(r'd="((?:M[\d.]+ [\d.]+h.01)+)" fill="none" stroke="(#\w+)"', svg)
    at = {colour: re.findall(r"M([\d.]+) ([\d.]+)", path) for path, colour in dots}
    assert at["#c9ced6"] == [("40.0", "70.0")]  # 2 px a mm, 30 px of title, y up
    assert at["#2a7f62"] == [("20.0", "50.0")]
    assert at["#d98c00"] == [("0.0", "110.0"), ("80.0", "30.0")]


def test_many_right_touches_are_thinned_and_no_refused_one():
    many = np.random.default_rng(1).uniform(0, 40, (2000, 2))
    svg = draw_flat([square("F1", right=many, rejected=many[:400])], 2.0)
    assert "2000 right, 400 refused" in svg
    assert svg.count("h.01") == 1 + 150 + 400


def world(sensor, right, wrong, registered=True, rms=0.05):
    share = share_of(right, right)
    return {
        "engine": "own", "surface": "written files", "sensor": sensor, "registered": registered,
        "touches": right + wrong + 3, "right": right, "wrong": wrong, "rejected": 3,
        "answered": share_of(right + wrong, right + wrong + 3), "expected": share_of(0, 0),
        "rms_mm": rms if right else None, "rms_mm_95": [0.04, 0.06 if right else None],
        "rms_deg": 0.2 if right else None, "rms_deg_95": [0.1, 0.25 if right else None],
        "normalised": normalised_errors(np.full(right, 2.4)), "inside_95": share,
        "inside_state": "", "state": "fails" if wrong else "",
        "states": {"expected": "", "rms_mm": "holds", "rms_deg": "holds", "inside_95": "holds"},
    }  # fmt: skip


def finished(command, *worlds):
    versions = {"source, sha256": "0" * 64}
    provenance = {"command": command, "versions": versions, "set": "1" * 64}
    totals = {"touches": sum(line["touches"] for line in worlds)}
    results = {"format": FORMAT, "worlds": list(worlds), "totals": totals, "provenance": provenance}
    spent = [{"drawing": 4.0 + k, "reading": 20.0 + k} for k in range(len(worlds))]
    return results, {"worlds": spent}


def test_worlds_reads_folders_and_writes_a_page_with_json_beside_it(tmp_path, capsys):
    folders = [tmp_path / name for name in ("one", "two")]
    for folder in folders:
        folder.mkdir()
        values = finished(f"validate-set {folder.name}.yaml", world("low", 9, 0))
        for name, value in zip(("results.json", "times.json"), values, strict=True):
            (folder / name).write_text(json.dumps(value))
    page, named = tmp_path / "worlds.html", [*map(str, folders)]
    assert run(["worlds", *named, "-o", str(page), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert json.loads(page.with_suffix(".json").read_text()) == said
    assert "0.80<small>0.80 … 0.80; 0.80, 0.8</small>" in page.read_text()
    assert str(tmp_path) not in page.read_text() + page.with_suffix(".json").read_text()
    assert not re.search(r"""(src|href)\s*=\s*["'](?!#|data:)""", page.read_text())
    assert run(["worlds", named[0], named[0]]) == 2
    assert "stands twice" in capsys.readouterr().err
    old = json.loads((folders[0] / "results.json").read_text())
    del old["format"]
    (folders[0] / "results.json").write_text(json.dumps(old))
    assert run(["compare", *named]) == 2
    assert "validate-set report" in capsys.readouterr().err


def test_a_surface_is_named_as_it_was_made():
    assert surface_name({"surfaces": "files"}) == "written files"
    printed = {"surfaces": "printed", "faults": "usual", "print_profile": "mk4-0.4"}
    assert surface_name(printed) == "printed, faults usual, by mk4-0.4"
