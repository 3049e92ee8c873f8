"""The page of `open-bench` in a real browser, for the tests that work it.

Chromium draws in software. `wait_for_function` would need `eval`, which the page forbids, so what
is waited for is asked again and again.
"""

import re
import time
import zipfile
from contextlib import contextmanager
from weakref import WeakKeyDictionary

from playwright.sync_api import Page, expect
from programs import PATIENCE_S, started

CHROMIUM = "/usr/bin/chromium"
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync",
)  # fmt: skip
PATIENCE_MS = 1e3 * PATIENCE_S
RESTED: WeakKeyDictionary[Page, int] = WeakKeyDictionary()  #: the touch that a page rested from
SETTLED = """() => new Promise((done) => {
    const places = () => JSON.stringify(['part', 'answer'].map(
      (id) => document.getElementById(id).getBoundingClientRect()));
    const first = places(); let frames = 0;
    const look = () => {
      if (places() !== first) done(false);
      else if (++frames === 5) done(true);
      else requestAnimationFrame(look);
    };
    requestAnimationFrame(look); })"""
#: Notes every picture: touch, state, lit face, answer, pose, ms since the one before.
WATCH = """() => { window.seen = []; let before = performance.now(); const look = () => {
    const now = performance.now();
    window.seen.push([bench.touch, bench.state, bench.lit,
      document.getElementById('answer').innerText, document.getElementById('pose').innerText,
      now - before]);
    before = now; requestAnimationFrame(look); }; look(); }"""
expect.set_options(timeout=PATIENCE_MS)


@contextmanager
def running(*options, folder=None, errors=None):
    """Run `open-bench` at any free port of its own; yields its address and its process."""
    words = ("--web-port", 0, *options)
    with started("recognizer.bench", *words, stderr=errors, cwd=folder) as process:
        yield process.stdout.readline().split()[-1], process


@contextmanager
def opened(browser, address, *, tour=False, **look):
    """Open the page; nothing may be asked of anybody else, and nothing go wrong in it."""
    look = {"viewport": {"width": 1440, "height": 900}} | look
    page = browser.new_page(**look)
    if not tour:
        page.add_init_script("localStorage.setItem('toured', 'yes')")
    asked, wrong = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(address)
    until(page, "bench.shown !== '' && bench.frames > 0")
    yield page
    host = address.split("/")[2]
    assert {re.split("[/?]", url)[2] for url in asked if not url.startswith("blob:")} == {host}
    assert wrong == []
    page.close()


def until(page, wanted):
    """Wait until an expression holds in the page."""
    end_s = time.monotonic() + PATIENCE_S
    while not page.evaluate(wanted):
        assert time.monotonic() < end_s, f"{wanted}: {page.evaluate('JSON.stringify(bench)')}"
        time.sleep(0.05)


def until_redrawn(picture, before):
    """Wait until a picture looks other than its screenshot `before`."""
    end_s = time.monotonic() + PATIENCE_S
    while picture.screenshot() == before:
        assert time.monotonic() < end_s, "the picture stays as it was"


def settle(page):
    """Wait until part and answer keep their places for some frames: pictures follow the window."""
    until(page, SETTLED)


def rest(page):
    """Wait until nothing is touched any more, and the film has forgotten it."""
    until(page, "bench.contact === false")
    if RESTED.get(page) != page.evaluate("bench.touch"):
        page.wait_for_timeout(500)
        until(page, "bench.contact === false")
        RESTED[page] = page.evaluate("bench.touch")


def shown(page, name):
    """Show an object of the lab, seen from a side."""
    page.get_by_test_id("object").select_option(name)
    until(page, f"bench.shown === '{name}'")


def answered(page, act, *values):
    """Do what brings an answer; returns what the page then says."""
    before = page.evaluate("bench.answers")
    act(*values)
    until(page, f"bench.answers > {before}")
    return page.get_by_test_id("answer").inner_text()


def touched(page, x=0.42, y=0.55):
    """Click on the part; returns what the page then says."""
    box = page.get_by_test_id("part").bounding_box()
    at = box["x"] + x * box["width"], box["y"] + y * box["height"]
    return answered(page, page.mouse.click, *at)


def downloaded(button, patience_ms=PATIENCE_MS):
    """Click; return the file that comes."""
    with button.page.expect_download(timeout=patience_ms) as download:
        button.click()
    return download.value


def opened_to_make(browser, address):
    """Open the page to make a part, or at a link to one; it has been tried."""
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.add_init_script("localStorage.setItem('toured', 'yes')")
    page.goto(address, wait_until="networkidle")  # before that the button does nothing
    if "#" not in address:
        page.get_by_test_id("make-open").click()
    until(page, "bench.tried > 0")
    return page


def making(page, settings, state="sound"):
    """Fill in the form, the shape first; wait until it is tried, or refused."""
    page.get_by_test_id("make-form").evaluate(
        "form => form.querySelectorAll('details').forEach((one) => { one.open = true; })"
    )
    for setting, value in settings.items():
        field = page.get_by_test_id(f"make-{setting}")
        if field.evaluate("one => one.tagName") == "SELECT":
            field.select_option(value)
        else:
            field.fill(value)
    dialog = page.get_by_test_id("make")
    expect(dialog).not_to_have_attribute("aria-busy", "true")
    expect(dialog).to_have_attribute("data-state", state)


def made(page):
    """Let it be made; return the name of the zip, and its files by their names."""
    packed = downloaded(page.get_by_test_id("make-go"), 5 * PATIENCE_MS)
    with zipfile.ZipFile(packed.path()) as archive:
        return packed.suggested_filename, {name: archive.read(name) for name in archive.namelist()}
