"""`open-bench` when things fail: the page says so, and what still works does."""

from __future__ import annotations

import re
import signal
import sqlite3
from contextlib import ExitStack, closing

import httpx
import pytest
from bench_page import PATIENCE_MS, opened, rest, running, settle, shown, touched, until
from playwright.sync_api import expect

GROWTH = """() => new Promise((done) => { const heights = []; const look = () => {
    heights.push(document.getElementById('part').getBoundingClientRect().height);
    if (heights.length < 20) requestAnimationFrame(look); else done(heights); }; look(); })"""


@pytest.fixture(scope="module")
def bench(served):
    with served("--port", "touch:?hold=1.0") as address:
        yield address


def process_of(lab, port=0):
    """Run a server at a port, 0: any; yields its address and its process."""
    return running(
        "--database", lab / "lab.db", "--folder", lab / "recordings", "--port", "touch:?hold=1.0",
        "--web-port", port,
    )  # fmt: skip


def test_a_silent_and_a_killed_server_are_said_and_one_that_comes_back_is_found(browser, lab):
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    with process_of(lab) as (address, first):
        page.goto(address)
        until(page, "bench.shown !== '' && bench.frames > 0")
        shown(page, "Cube")
        for place in ((0.42, 0.55), (0.46, 0.5)):
            assert touched(page, *place).startswith("Cube")
            rest(page)
        assert page.evaluate("bench.touch") == 2
        state, frames = page.get_by_test_id("state"), page.evaluate("bench.frames")
        first.send_signal(signal.SIGSTOP)  # no word that it has gone, as with a cut cable
        until(page, "document.body.dataset.line === 'gone'")
        expect(state).to_contain_text("open-bench does not answer")
        first.send_signal(signal.SIGCONT)
        until(page, f"document.body.dataset.line === 'there' && bench.frames > {frames + 20}")
        first.send_signal(signal.SIGKILL)
        expect(state).to_contain_text("open-bench does not answer", timeout=PATIENCE_MS)
        expect(state).to_contain_text("looked for")
        until(page, "document.getElementById('touch').inert")  # nothing to be clicked
        page.get_by_test_id("filter").select_option("median")  # what is on the page goes on
        assert page.get_by_test_id("answer").inner_text().startswith("Cube")
        page.get_by_test_id("touch-list").locator("button").first.click()
        error = page.get_by_test_id("error")
        expect(error).to_contain_text("open-bench does not answer")
        expect(error).to_contain_text("What is on the page stays")
    with ExitStack() as kept:
        with page.expect_navigation(timeout=PATIENCE_MS):  # of another server, the page is too
            kept.enter_context(process_of(lab, int(address.split(":")[-1].strip("/"))))
        expect(state).to_contain_text("probe is there", timeout=PATIENCE_MS)
        until(page, "bench.shown !== '' && bench.frames > 0")
        until(page, "bench.touch === 0")  # nothing is left of the other server's touches
        shown(page, "Cube")
        assert touched(page).startswith("Cube")
        assert page.evaluate("bench.touch") == 1
    page.close()


def test_offline_is_said_and_overcome(page):
    touched(page)
    rest(page)
    page.context.set_offline(True)
    page.get_by_test_id("touch-go").click()
    error = page.get_by_test_id("error")
    expect(error).to_contain_text("this device is offline")
    expect(error).to_contain_text("What is on the page stays")
    assert page.get_by_test_id("answer").inner_text().startswith("Cube")
    page.context.set_offline(False)
    until(page, "document.body.dataset.line === 'there'")
    assert touched(page).startswith("Cube")


def test_a_locked_database_is_said_and_touches_are_still_read(page, lab):
    touched(page)  # the face is known to the simulation
    rest(page)
    with closing(sqlite3.connect(lab / "lab.db", isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        page.get_by_test_id("object").select_option("Cylinder")
        error = page.get_by_test_id("error")
        expect(error).to_contain_text("keep the database locked", timeout=PATIENCE_MS)
        expect(error).to_contain_text("Touches are still read")
        assert page.evaluate("bench.shown") == "Cube"
        expect(page.get_by_test_id("object")).to_have_value("Cube")  # what is really shown
        assert touched(page).startswith("Cube")
        rest(page)
        other.execute("ROLLBACK")
    shown(page, "Cylinder")


def test_two_browsers_see_the_same_and_both_can_work(browser, page, bench):
    with opened(browser, bench, viewport={"width": 1024, "height": 768}) as other:
        said = touched(page).splitlines()[0]
        until(
            other, f"bench.touch === {page.evaluate('bench.touch')} && bench.state === 'answered'"
        )
        assert other.get_by_test_id("answer").inner_text().splitlines()[0] == said
        assert "ms after the click" not in other.get_by_test_id("answer").inner_text()
        rest(page)
        shown(other, "Cylinder")
        assert page.evaluate("bench.shown") == "Cube"  # each looks at what it wants
        other.get_by_test_id("record").click()
        for one in (page, other):
            expect(one.get_by_test_id("record")).to_have_attribute(
                "aria-pressed", "true", timeout=PATIENCE_MS
            )
        page.get_by_test_id("record").click()
        expect(other.get_by_test_id("record")).to_have_attribute("aria-pressed", "false")
        buttons = [one.get_by_test_id("touch-list").locator("button") for one in (page, other)]
        kept = buttons[0].count()
        buttons[0].first.click()
        page.get_by_test_id("touch-name").fill("seen by both")
        page.get_by_test_id("touch-name").press("Enter")
        expect(buttons[1].first).to_contain_text("seen by both")
        page.get_by_test_id("touch-delete").click()
        expect(buttons[1]).to_have_count(kept - 1)


def test_a_phone_touches_by_a_tap(browser, bench):
    look = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    with opened(browser, bench, **look) as page:
        rest(page)
        shown(page, "Cube")
        part = page.get_by_test_id("part")
        part.scroll_into_view_if_needed()
        box, answers = part.bounding_box(), page.evaluate("bench.answers")
        page.touchscreen.tap(box["x"] + 0.46 * box["width"], box["y"] + 0.55 * box["height"])
        until(page, f"bench.answers > {answers}")
        assert page.get_by_test_id("answer").inner_text().startswith("Cube")
        until(page, "document.documentElement.scrollWidth <= 390")
        small = page.evaluate(
            """() => [...document.querySelectorAll('button, select, .button')]
            .filter((one) => one.checkVisibility() && one.getBoundingClientRect().height < 24)
            .map((one) => one.outerHTML)"""
        )
        assert small == []
        cut = page.evaluate(
            """() => [...document.querySelectorAll('button, select, input, h2')]
            .filter((one) => one.checkVisibility() && one.type !== 'file'
              && !one.closest('#touch-list')
              && (one.getBoundingClientRect().left < 0 || one.getBoundingClientRect().right > 390))
            .map((one) => one.outerHTML)"""
        )
        assert cut == []


def test_4k_uses_the_screen_and_text_grows(browser, bench):
    with opened(browser, bench, viewport={"width": 3840, "height": 2160}) as page:
        size = page.evaluate("parseFloat(getComputedStyle(document.body).fontSize)")
        assert size >= 19
        settle(page)
        used = page.evaluate(
            """() => [...document.querySelectorAll('main > .panel')]
            .filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect())
            .reduce((sum, box) => sum + box.width * Math.min(box.height, 2160), 0)"""
        )
        assert used > 0.8 * 3840 * 2160
        heights = page.evaluate(GROWTH)
        assert max(heights) == min(heights)  # a canvas whose pixels size its panel grows for ever
        page.set_viewport_size({"width": 1440, "height": 900})
        part = page.get_by_test_id("part")
        settle(page)
        before = part.bounding_box()
        page.set_viewport_size({"width": 3840, "height": 2160})
        page.set_viewport_size({"width": 1440, "height": 900})
        settle(page)
        assert part.bounding_box() == before
        page.set_viewport_size({"width": 3840, "height": 2160})
        rest(page)
        assert touched(page, 0.5, 0.5)


def test_a_port_that_goes_away_for_good_is_named(served, browser, tmp_path):
    missing = f"serial://{tmp_path}/ttyNONE"
    with served("--port", missing) as address:
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(address)
        until(page, "bench.shown !== ''")
        state = page.get_by_test_id("state")
        expect(state).to_contain_text(re.compile("probe is gone: .*ttyNONE"), timeout=PATIENCE_MS)
        for name in ("record", "bias", "calibrate", "touch-go"):  # cannot work: off
            expect(page.get_by_test_id(name)).to_be_disabled()
        page.get_by_test_id("port").select_option("sim:touch")  # another one still can be chosen
        expect(state).to_contain_text("probe is there", timeout=PATIENCE_MS)
        assert httpx.get(f"{address}api/touches").json()["touches"] == []
        shown(page, "Cube")
        assert touched(page).startswith("Cube")
        page.close()
