"""`open-bench` when things fail: the page says so, and what still works does."""

import re
import signal
import sqlite3
from contextlib import ExitStack, closing

import httpx
from bench_page import PATIENCE_MS, rest, running, shown, touched, until
from playwright.sync_api import expect


def process_of(lab, port=0):
    """Run a server at a port, 0: any; yields its address and its process."""
    return running(
        "--database", lab / "lab.db", "--folder", lab / "recordings",
        "--port", "touch:?hold=0.6&rate=60", "--web-port", port,
    )  # fmt: skip


def test_what_fails_is_said_and_overcome(browser, lab):
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    state, error = page.get_by_test_id("state"), page.get_by_test_id("error")
    with process_of(lab) as (address, first):
        page.goto(address)
        until(page, "bench.shown !== '' && bench.frames > 0")
        shown(page, "Cube")
        assert touched(page).startswith("Cube")
        rest(page)
        this_device_is_offline(page, error)
        somebody_locks_the_database(page, error, lab)
        assert page.evaluate("bench.touch") == 3
        frames = page.evaluate("bench.frames")
        first.send_signal(signal.SIGSTOP)  # no word that it has gone, as with a cut cable
        until(page, "document.body.dataset.line === 'gone'")
        expect(state).to_contain_text("open-bench does not answer")
        first.send_signal(signal.SIGCONT)
        until(page, f"document.body.dataset.line === 'there' && bench.frames > {frames + 20}")
        first.send_signal(signal.SIGKILL)
        expect(state).to_contain_text("open-bench does not answer")
        expect(state).to_contain_text("looked for")
        until(page, "document.getElementById('touch').inert")  # nothing to be clicked
        page.get_by_test_id("filter").select_option("median")  # what is on the page goes on
        assert page.get_by_test_id("answer").inner_text().startswith("Cube")
        page.get_by_test_id("touch-list").locator("button").first.click()
        expect(error).to_contain_text("open-bench does not answer")
        expect(error).to_contain_text("What is on the page stays")
    with ExitStack() as kept:
        with page.expect_navigation(timeout=PATIENCE_MS):  # of another server, the page is too
            kept.enter_context(process_of(lab, int(address.split(":")[-1].strip("/"))))
        expect(state).to_contain_text("probe is there")
        until(page, "bench.shown !== '' && bench.frames > 0")
        until(page, "bench.touch === 0")  # nothing is left of the other server's touches
        shown(page, "Cube")
        assert touched(page).startswith("Cube")
        assert page.evaluate("bench.touch") == 1
    page.close()


def this_device_is_offline(page, error):
    page.context.set_offline(True)
    page.get_by_test_id("touch-go").click()
    expect(error).to_contain_text("this device is offline")
    expect(error).to_contain_text("What is on the page stays")
    assert page.get_by_test_id("answer").inner_text().startswith("Cube")
    page.context.set_offline(False)
    until(page, "document.body.dataset.line === 'there'")
    assert touched(page, 0.46, 0.5).startswith("Cube")
    rest(page)


def somebody_locks_the_database(page, error, lab):
    with closing(sqlite3.connect(lab / "lab.db", isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        page.get_by_test_id("object").select_option("Cylinder")
        expect(error).to_contain_text("keep the database locked")
        expect(error).to_contain_text("Touches are still read")
        assert page.evaluate("bench.shown") == "Cube"
        expect(page.get_by_test_id("object")).to_have_value("Cube")  # what is really shown
        assert touched(page).startswith("Cube")
        rest(page)
        other.execute("ROLLBACK")
    shown(page, "Cylinder")


def test_a_token_is_asked_for_and_a_port_that_is_gone_for_good_is_named(served, browser, tmp_path):
    with served("--host", "0.0.0.0", "--port", f"serial://{tmp_path}/ttyNONE") as address:
        assert "0.0.0.0" not in address  # nobody can open that
        bare, token = address.split("?token=")
        assert len(token) >= 20
        for path, query in (("", {}), ("api/bench", {}), ("", {"token": "wrong"}),
                            ("api/bench", {"token": token})):  # fmt: skip
            assert httpx.get(bare + path, params=query).status_code == 401
        bearer = {"authorization": f"Bearer {token}"}
        assert httpx.get(bare + "api/bench", headers=bearer).status_code == 200
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(address)
        until(page, "bench.shown !== ''")
        assert page.url == bare  # the token does not stay in the address
        cookie = page.context.cookies()[0]
        assert (cookie["httpOnly"], cookie["sameSite"]) == (True, "Strict")
        state = page.get_by_test_id("state")
        expect(state).to_contain_text(re.compile("probe is gone: .*ttyNONE"))
        for name in ("record", "bias", "calibrate", "touch-go"):  # cannot work: off
            expect(page.get_by_test_id(name)).to_be_disabled()
        page.get_by_test_id("port").select_option("sim:touch")  # another one still can be chosen
        expect(state).to_contain_text("probe is there")
        assert httpx.get(f"{bare}api/touches", headers=bearer).json()["touches"] == []
        shown(page, "Cube")
        assert touched(page).startswith("Cube")
        page.close()
