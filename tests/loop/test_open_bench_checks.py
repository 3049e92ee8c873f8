"""Work on the page of `open-bench`: objects, scan, mounting, learning, print check, tour, panes."""

import io
import random
import re

import httpx
import numpy as np
import pytest
from bench_page import PATIENCE_MS, answered, opened, rest, shown, touched, until, until_redrawn
from PIL import Image
from playwright.sync_api import expect

from generator.database.as_built import read_as_built
from generator.database.open import open_database
from generator.database.read import object_entry
from generator.database.transaction import read_transaction
from probe.recording.read import Recording


@pytest.fixture(scope="module")
def bench(served):
    with served("--port", "touch:?hold=0.4&rate=60") as address:
        yield address


def test_the_gallery_is_searched_and_chosen_from_by_keys_alone(page):
    page.get_by_test_id("gallery-open").focus()
    page.keyboard.press("Enter")
    count, buttons = page.get_by_test_id("gallery-count"), page.locator("#gallery-list button")
    expect(count).to_have_text("2 of 2 objects")
    expect(page.get_by_test_id("gallery-search")).to_be_focused()
    expect(buttons.first).to_have_attribute("aria-current", "true")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowRight")
    expect(buttons.nth(1)).to_be_focused()
    page.keyboard.press("ArrowUp")
    expect(page.get_by_test_id("gallery-search")).to_be_focused()
    page.keyboard.type("FACES cyl")
    expect(count).to_have_text("1 of 2 objects")
    expect(page.locator("#gallery-list button:visible")).to_have_text(re.compile("^Cylinder"))
    until(page, "[...document.querySelectorAll('#gallery-list img')].every((i) => i.complete)")
    drawn = page.locator("#gallery-list img").evaluate_all("all => all.map((i) => i.naturalWidth)")
    assert min(drawn) > 0
    page.keyboard.press("Enter")
    until(page, "bench.shown === 'Cylinder'")
    expect(page.locator("#gallery")).to_be_hidden()
    page.get_by_test_id("gallery-open").click()
    page.get_by_test_id("gallery-search").fill("6")  # a part of a name, not of other numbers
    expect(count).to_have_text("0 of 2 objects")
    page.keyboard.press("Escape")
    expect(page.locator("#gallery")).to_be_hidden()
    assert page.evaluate("bench.shown") == "Cylinder"


def test_what_was_felt_and_its_mosaic_are_on_the_part(page, bench):
    part, faces = page.get_by_test_id("part"), page.get_by_test_id("face-list")
    page.get_by_test_id("tint").select_option("coverage")
    expect(faces.locator("li")).to_have_count(6)
    expect(faces).to_contain_text("F2: 0 % felt by 0 touches")
    assert touched(page, 0.42, 0.55).startswith("Cube F2")
    rest(page)
    expect(faces).to_contain_text(re.compile("F2: 1[78] % felt by 1 touch"))  # (25.4 of 60 mm)^2
    felt = part.screenshot()
    page.get_by_test_id("tint").select_option("mosaic")
    expect(faces).to_contain_text("F2: mosaic of 1 touch")
    expect(faces).to_contain_text("F1: not touched yet")
    until_redrawn(part, felt)
    page.get_by_test_id("touch-list").locator("button").last.click()
    page.get_by_test_id("touch-delete").click()
    page.get_by_test_id("tint").select_option("coverage")
    expect(faces).to_contain_text("F2: 0 % felt by 0 touches")
    page.get_by_test_id("tint").select_option("plain")
    expect(faces).to_be_hidden()
    assert httpx.get(f"{bench}api/mosaics/Cube").json() == {"faces": {"F2": 1}}
    assert httpx.get(f"{bench}api/mosaics/Cube/F2").content[:1] == b"M"
    assert httpx.get(f"{bench}api/mosaics/Cube/F1").status_code == 404


def test_what_is_promised_colours_the_faces_and_is_said(page, bench):
    plain = page.get_by_test_id("part").screenshot()
    page.get_by_test_id("tint").select_option("promise")
    faces = page.get_by_test_id("face-list")
    expect(faces).to_contain_text(
        re.compile(r"F1: \d+ % of touches answered at once, \d+ % within three")
    )
    told = httpx.get(f"{bench}api/promise/Cube").json()["faces"]
    assert len(told) == 6
    expect(faces).to_contain_text(f"F1: {told['F1']['at_once']:.0%}".replace("%", " %"))
    until_redrawn(page.get_by_test_id("part"), plain)
    with Image.open(io.BytesIO(page.get_by_test_id("part").screenshot())) as picture:
        _, green, blue = np.moveaxis(np.asarray(picture.convert("RGB"), int), 2, 0)
    assert np.mean(green - blue > 80) > 0.05  # 92 % are nearly yellow
    shown(page, "Cylinder")
    round_face = re.compile(r"F2: \d+ % of touches answered at once")
    expect(faces).to_contain_text(round_face)
    page.get_by_test_id("tint").select_option("plain")
    assert httpx.get(f"{bench}api/promise/Nobody").status_code == 400


def at(page, x, y, theta=15, face="F1"):
    """Touch a place of a face of the cube by the form; returns what the page then says."""
    page.get_by_test_id("touch-face").select_option(face)
    for name, value in (("x", x), ("y", y), ("theta", theta)):
        page.locator(f"#touch-{name}").fill(str(value))
    said = answered(page, page.get_by_test_id("touch-go").click)
    rest(page)
    return said


def test_touches_are_fused_and_the_belief_shrinks(page):
    scan = page.get_by_test_id("scan")
    scan.click()
    expect(scan).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("scan-text")).to_contain_text("Touch the same object")
    steps = page.get_by_test_id("scan-steps").locator("li")
    at(page, 24.0, 28.0)
    expect(steps).to_have_count(1)
    one = float(re.search(r"by chance (\S+)", steps.nth(0).inner_text()).group(1))
    for x in (28.0, 32.0):
        at(page, x, 30.0)
    expect(steps).to_have_count(3)
    expect(page.get_by_test_id("scan-text")).to_contain_text("3 touches together: Cube F1")
    three = float(re.search(r"by chance (\S+)", steps.nth(2).inner_text()).group(1))
    assert three < 0.01 * one
    expect(steps.nth(2)).to_contain_text("one place comes into question; Cube F1 100 %")
    scan.click()
    expect(page.locator("#scan-box")).to_be_hidden()


def test_a_wrong_mounting_is_found_and_undone(page, bench):
    httpx.post(f"{bench}api/flip", json={"changes": "quarter"})  # as if it were wired so
    expect(page.get_by_test_id("flip")).to_have_value("quarter")
    page.get_by_test_id("mounting-open").click()
    expect(page.get_by_test_id("mounting-ask")).to_contain_text("Touch Cube F1 near its middle")
    page.get_by_test_id("mounting-press").click()
    told = page.get_by_test_id("mounting-told")
    expect(told).to_contain_text(
        "mounted a quarter turn off, the other way", timeout=4 * PATIENCE_MS
    )
    page.get_by_test_id("mounting-use").click()
    expect(told).to_contain_text("turned back")
    page.locator("#mounting button[value=close]").click()
    expect(page.get_by_test_id("flip")).to_have_value("")
    rest(page)
    said = at(page, 30, 30, 20)
    assert said.startswith("Cube F1")
    turn = re.search(r"(-?[\d.]+)°", page.locator("#pose").inner_text()).group(1)
    assert float(turn) == pytest.approx(20, abs=1)
    newest = httpx.get(f"{bench}api/touches").json()["touches"][-1]
    assert newest["answer"]["mounting"] == "checked"
    httpx.post(f"{bench}api/flip", json={"changes": ""})
    expect(page.get_by_test_id("flip")).to_have_value("")
    assert httpx.post(f"{bench}api/flip", json={"changes": "sideways"}).status_code == 400


def test_the_print_is_checked_and_the_sensor_learned_from_touches(page, bench, lab):
    learn = page.get_by_test_id("learn")
    expect(learn).to_be_disabled()
    expect(learn).to_contain_text("of 16 touches")
    page.get_by_test_id("print-open").click()
    expect(page.get_by_test_id("print-estimate")).to_be_disabled()
    page.get_by_test_id("print-press").click()
    expect(page.get_by_test_id("print-ask")).to_contain_text(
        re.compile(r"^(1[6-9]|2\d) of 25 touches"), timeout=4 * PATIENCE_MS
    )
    page.get_by_test_id("print-estimate").click()
    parts = page.get_by_test_id("print-parts")
    expect(parts).to_contain_text("scale X", timeout=2 * PATIENCE_MS)
    scale = re.search(r"scale X ([\d.]+)", parts.inner_text()).group(1)
    assert float(scale) == pytest.approx(1.0, abs=0.004)  # touched as designed
    page.get_by_test_id("print-store").click()
    expect(page.get_by_test_id("print-told")).to_contain_text("Kept in the database")
    engine = open_database(str(lab / "lab.db"), writable=False)
    with read_transaction(engine) as connection:
        kept = read_as_built(connection, object_entry(connection, "Cube").object_id)
    assert [one.touches >= 12 for one in kept if one.part] == [True]
    page.locator("#print button[value=close]").click()
    until(page, "!document.getElementById('learn').disabled")
    learn.click()
    expect(page.get_by_test_id("states")).to_have_value(
        "sensor-001.state.json", timeout=8 * PATIENCE_MS
    )
    assert (lab / "recordings" / "sensor-001.state.json").exists()
    assert "gains differ" in page.get_by_test_id("states").get_attribute("title")
    assert at(page, 31, 29).startswith("Cube F1")
    page.get_by_test_id("states").select_option("")
    assert at(page, 31, 29).startswith("Cube F1")


def press_known_loads(page, loads_n, told):
    """Calibrate step by step, without a load and with each; the last one is left on the sensor."""
    page.get_by_test_id("calibrate").click()
    page.get_by_test_id("guide-loads").fill(", ".join(map(str, loads_n)))
    page.get_by_test_id("guide-seconds").fill("0.5")
    page.get_by_test_id("guide-start").click()
    steps = len(loads_n) + 1
    for step in range(steps):
        expect(page.get_by_test_id("guide-ask")).to_contain_text(f"{step + 1} of {steps}")
        page.get_by_test_id("guide-load").click()
        page.get_by_test_id("guide-read").click()
        expect(page.locator("#guide-felt li")).to_have_count(step + 1)
    page.get_by_test_id("guide-finish").click()
    expect(page.locator("#guide").get_by_text(told)).to_be_in_viewport()  # all else is behind it


def test_what_is_left_of_a_load_is_no_touch_and_the_scale_follows(page, lab):
    kept = page.get_by_test_id("touch-list").locator("button").count()
    press_known_loads(page, (80,), "a law needs 3")
    page.locator("#guide-close").click()
    press_known_loads(page, (80, 200, 600), "tactels are sound")  # 600 N are still on it
    frames = page.evaluate("bench.frames")
    until(page, f"bench.frames > {frames + 40}")
    assert page.evaluate("bench.contact") is False
    assert page.get_by_test_id("touch-list").locator("button").count() == kept
    page.locator("#guide-close").click()
    expect(page.get_by_test_id("calibration-age")).to_contain_text("fresh")
    assert list((lab / "recordings").glob("calibration-*.json"))
    page.wait_for_timeout(400)
    assert answered(page, page.get_by_test_id("touch-go").click).startswith("Cube")
    expect(page.locator("#scale")).to_contain_text(re.compile(r"0 to \d\.\d+ N"))
    rest(page)
    page.get_by_test_id("calibrations").select_option("")
    expect(page.get_by_test_id("calibration-age")).to_have_text("none")
    expect(page.locator("#scale")).to_contain_text("counts")


SHARES = """() => { window.shares = []; const bar = document.getElementById('upload-share');
    new MutationObserver(() => window.shares.push(bar.value))
    .observe(bar, { attributes: true }); }"""


def test_a_recording_is_sent_in_with_progress_and_times_are_its_own(page, lab, tmp_path):
    page.get_by_test_id("record").click()
    expect(page.get_by_test_id("record")).to_have_attribute("aria-pressed", "true")
    at(page, 30, 30)
    page.get_by_test_id("record").click()
    expect(page.get_by_test_id("record")).to_have_attribute("aria-pressed", "false")
    name = page.get_by_test_id("recordings").input_value()
    sent = tmp_path / f"sent-{random.randrange(10**6)}.h5"
    sent.write_bytes((lab / "recordings" / name).read_bytes())
    page.evaluate(SHARES)
    page.get_by_test_id("upload").set_input_files(sent)
    expect(page.get_by_test_id("recordings")).to_contain_text(sent.name)
    until(page, "window.shares.some((share) => share === 1)")
    expect(page.get_by_test_id("upload-share")).to_be_hidden()
    page.get_by_test_id("upload").set_input_files(sent)
    expect(page.get_by_test_id("error")).to_contain_text("there is a recording")
    page.get_by_test_id("recordings").select_option(sent.name)
    answered(page, page.get_by_test_id("replay").click)
    told = re.search(rf"{sent.name} at ([\d.]+) s", page.get_by_test_id("answer-of").inner_text())
    frames = list(Recording(lab / "recordings" / name).frames())
    assert 0 < float(told.group(1)) < 1e-9 * (frames[-1].t_ns - frames[0].t_ns)
    page.get_by_test_id("leave").click()
    expect(page.get_by_test_id("state")).to_contain_text("probe is there")


def test_the_tour_comes_once_and_columns_are_as_wide_as_one_wants(browser, bench):
    with opened(browser, bench, tour=True) as page:
        tour = page.get_by_test_id("tour")
        expect(tour).to_contain_text("1 of 4: Touch the part")
        rest(page)
        shown(page, "Cube")
        assert touched(page).startswith("Cube")  # it is in nobody's way
        page.locator("#tour-next").focus()
        for step in ("2 of 4: Read the answer", "3 of 4: Go back", "4 of 4: Work with"):
            page.keyboard.press("Enter")
            expect(tour).to_contain_text(step)
            assert page.locator(".panel.toured").count() == 1
        page.keyboard.press("Enter")
        expect(tour).to_be_hidden()
        page.get_by_test_id("tour-open").click()
        expect(tour).to_be_visible()
        page.keyboard.press("Escape")
        expect(tour).to_be_hidden()
        part, handle = page.locator(".panel.part"), page.get_by_test_id("pane-1")
        before = part.bounding_box()["width"]
        handle.focus()
        for _ in range(4):
            page.keyboard.press("ArrowRight")
        wider = part.bounding_box()["width"]
        assert wider > before + 40
        box = handle.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 200)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 2 - 120, box["y"] + 200, steps=6)
        page.mouse.up()
        kept = part.bounding_box()["width"]
        assert kept < wider - 80
        page.reload()
        until(page, "bench.shown !== ''")
        expect(tour).to_be_hidden()
        assert part.bounding_box()["width"] == pytest.approx(kept, abs=2)
        handle.focus()
        page.keyboard.press("Home")
        assert part.bounding_box()["width"] == pytest.approx(before, abs=2)
