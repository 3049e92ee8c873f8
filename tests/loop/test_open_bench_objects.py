"""Objects on the page of `open-bench`: gallery, what was felt, what is promised, mosaics."""

from __future__ import annotations

import re

import httpx
import pytest
from bench_page import PATIENCE_MS, rest, shown, touched, until
from playwright.sync_api import expect


@pytest.fixture(scope="module")
def bench(served):
    with served("--port", "touch:?hold=0.8") as address:
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
    page.get_by_test_id("gallery-search").fill("no such thing")
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
    assert part.screenshot() != felt
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
        re.compile(r"F1: \d+ % of touches answered at once, \d+ % within three"),
        timeout=PATIENCE_MS,
    )
    told = httpx.get(f"{bench}api/promise/Cube").json()["faces"]
    assert len(told) == 6
    expect(faces).to_contain_text(f"F1: {100 * told['F1']['at_once']:.0f} %")
    assert page.get_by_test_id("part").screenshot() != plain
    shown(page, "Cylinder")
    expect(faces).to_contain_text("F2: nothing is promised of single touches", timeout=PATIENCE_MS)
    page.get_by_test_id("tint").select_option("plain")
    assert httpx.get(f"{bench}api/promise/Nobody").status_code == 400
