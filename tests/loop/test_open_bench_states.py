"""`open-bench` when things fail: the page says so, and what still works does."""

import re
import signal
import sqlite3
import time
from contextlib import ExitStack, closing
from itertools import islice

import httpx
from bench_page import PATIENCE_MS, rest, running, shown, touched, until
from playwright.sync_api import expect
from programs import PATIENCE_S

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.simulate.registered import registered_surface
from recognizer.bench.broker import Broker
from recognizer.bench.frames import FrameHandler
from recognizer.bench.reading import RecognitionThread
from recognizer.bench.simulated import PressSequence, SimulationSettings


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


def test_touches_that_came_and_went_while_the_reader_was_busy_are_read(lab):
    sensor, database = SensorType(), str(lab / "lab.db")
    presses = PressSequence(sensor, SimulationSettings(hold_s=0.1))
    frames, scene = presses.frames(), registered_surface(database, "Cube", "F1")
    waiting = []
    for x_mm in (24.0, 36.0):
        presses.touch(scene, Touch(x_mm, 30.0, 0.3, 60.0))
        waiting += islice(frames, 60)
    thread = RecognitionThread(database, sensor, Broker())
    FrameHandler(sensor, Broker(), thread, print).take(waiting)  # while it reads the database
    end_s = time.monotonic() + PATIENCE_S
    while len(thread.touches.all()) < 2 or thread.touches.all()[-1]["contact"]:
        assert time.monotonic() < end_s, thread.touches.all()
        time.sleep(0.05)
    thread.close()
    answers = [one["answer"] for one in thread.touches.all()]
    assert [one["face"] for one in answers] == ["F1", "F1"]
    assert [round(one["place"]["x_mm"]) for one in answers] == [24, 36]
