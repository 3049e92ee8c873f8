"""`open-bench` as an operator meets it: a server, a probe on a serial line, a real browser."""

from __future__ import annotations

import re
import time

import httpx
import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from bench_page import PATIENCE_MS, opened, rest, settle, shown, touched, until
from playwright.sync_api import expect

from probe.recording.read import Recording


@pytest.fixture(scope="module")
def bench(served):
    """Address of a bench with a simulated probe."""
    with served("--port", "touch:?hold=1.5&rate=40") as address:
        yield address


def heat(page):
    """Return the heat map's pixels, as the page has them."""
    return page.evaluate("document.getElementById('heat').toDataURL()")


def asked_and_read(page):
    """Return the place (x, y), mm, that was clicked on, and the one that was read."""
    asked = [float(page.locator(f"#touch-{axis}").input_value()) for axis in "xy"]
    read = re.search(r"x (-?[\d.]+), y (-?[\d.]+) mm", page.locator("#pose").inner_text())
    return asked, [float(value) for value in read.groups()]


def test_a_click_touches_there_and_the_face_is_lit(page):
    said = touched(page)
    face = page.get_by_test_id("touch-face").input_value()
    assert said.startswith(f"Cube {face}")
    assert page.get_by_test_id("part").get_attribute("data-lit") == face
    assert np.allclose(*asked_and_read(page), atol=0.3)
    assert re.search("needed|no other", page.locator("#margin-text").inner_text())
    expect(page.get_by_test_id("mosaic-text")).to_contain_text(f"Cube {face}")
    assert "Cube" in page.locator("#map-text").inner_text()


def test_a_click_on_a_round_face_touches_there(page):
    shown(page, "Cylinder")
    for place in ((0.5, 0.5), (0.42, 0.55)):
        said = touched(page, *place)
        assert said.startswith("Cylinder"), said
        assert np.allclose(*asked_and_read(page), atol=0.5)
        rest(page)


WATCH = """() => { window.seen = []; const look = () => {
    window.seen.push([bench.touch, bench.state, bench.contact, bench.lit,
      document.getElementById('answer').innerText, document.getElementById('pose').innerText]);
    if (window.seen.length < 5000) requestAnimationFrame(look); }; look(); }"""


def test_no_picture_shows_the_last_answer_for_a_new_touch(page):
    assert touched(page).startswith("Cube")
    rest(page)
    first = page.evaluate("bench.touch")
    page.evaluate(WATCH)
    for place in ((0.46, 0.5), (0.38, 0.6)):
        touched(page, *place)
        rest(page)
    seen = page.evaluate("window.seen")
    new = [one for one in seen if one[0] > first]
    before = [one for one in new if one[1] in ("felt", "reading")]
    assert len({one[0] for one in new}) >= 2
    assert before, "no picture of a touch that was not read yet"
    for _, _, _, lit, answer, pose in before:
        assert (lit, pose) == ("", "")
        assert "Cube" not in answer


def test_touches_are_kept_to_go_back_to(page):
    buttons = page.get_by_test_id("touch-list").locator("button")
    said = touched(page).splitlines()[0]
    rest(page)
    kept = buttons.count()
    other = touched(page, 0.46, 0.5).splitlines()[0]
    rest(page)
    expect(buttons).to_have_count(kept + 1)
    buttons.nth(kept - 1).click()
    answer = page.get_by_test_id("answer")
    expect(answer).to_have_text(re.compile(f"^{re.escape(said)}"), use_inner_text=True)
    expect(page.get_by_test_id("answer-of")).to_contain_text("seen again")
    page.get_by_test_id("touch-name").fill("the first one")
    page.get_by_test_id("touch-name").press("Enter")
    expect(buttons.nth(kept - 1)).to_contain_text("the first one")
    buttons.nth(kept).click(modifiers=["Shift"])
    expect(page.get_by_test_id("touch-compared")).to_contain_text("Cube")
    with page.expect_download() as download:
        page.get_by_test_id("touch-csv").click()
    assert "the first one" in download.value.path().read_text()
    with page.expect_download() as download:
        page.get_by_test_id("touch-h5").click()
    assert len(Recording(download.value.path())) >= 2
    page.get_by_test_id("touch-list").press("Escape")
    buttons.nth(kept - 1).click()
    page.get_by_test_id("touch-delete").click()
    expect(buttons).to_have_count(kept)
    expect(answer).to_have_text(re.compile(f"^{re.escape(other)}"), use_inner_text=True)


def test_keys_turn_the_part_and_touch_it(page):
    part = page.get_by_test_id("part")
    part.focus()
    before, answers = part.screenshot(), page.evaluate("bench.answers")
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    until(page, f"bench.answers > {answers}")
    assert part.screenshot() != before
    face = page.get_by_test_id("touch-face").input_value()
    assert page.get_by_test_id("answer").inner_text().startswith(f"Cube {face}")


def test_filters_and_overlays(page):
    touched(page)
    seen = {}
    page.locator("#freeze").uncheck()
    for name in ("raw", "bias-free", "median", "sobel"):
        page.get_by_test_id("filter").select_option(name)
        paints = page.evaluate("bench.paints")
        until(page, f"bench.paints > {paints + 3}")
        seen[name] = heat(page)
    assert len(set(seen.values())) == 4
    page.get_by_test_id("filter").select_option("bias-free")


def test_unplug_and_replug_are_said_plainly(page):
    page.get_by_test_id("unplug").click()
    state = page.get_by_test_id("state")
    expect(state).to_contain_text("probe is gone", timeout=PATIENCE_MS)
    expect(state).to_contain_text("probe is there", timeout=PATIENCE_MS)
    frames = page.evaluate("bench.frames")
    until(page, f"bench.frames > {frames + 10}")
    page.get_by_test_id("filter").select_option("raw")  # the image of a touch is held until then
    paints = page.evaluate("bench.paints")
    until(page, f"bench.paints > {paints + 3}")
    before, deadline = heat(page), time.monotonic() + PATIENCE_MS / 1000
    while heat(page) == before:  # noise alone moves it
        assert time.monotonic() < deadline
    page.get_by_test_id("filter").select_option("bias-free")
    assert 20 < float(page.get_by_test_id("rate").inner_text().split()[0]) < 300
    assert touched(page).startswith("Cube")
    expect(page.get_by_test_id("notices")).to_contain_text("the probe is back")


def test_record_and_replay(page, lab):
    record = page.get_by_test_id("record")
    record.click()
    expect(record).to_have_attribute("aria-pressed", "true")
    said = touched(page).splitlines()[0]
    rest(page)
    record.click()
    expect(record).to_have_attribute("aria-pressed", "false")
    name = page.get_by_test_id("recordings").input_value()
    frames = len(Recording(lab / "recordings" / name))
    assert frames > 50
    answers = page.evaluate("bench.answers")
    page.get_by_test_id("replay").click()
    expect(page.get_by_test_id("state")).to_contain_text("replaying")
    until(page, f"bench.answers > {answers}")
    assert page.get_by_test_id("answer").inner_text().startswith(said)
    expect(page.get_by_test_id("play")).to_have_text("Play", timeout=PATIENCE_MS)
    until(page, "bench.contact === false")
    strength = httpx.get(f"{page.url}api/timeline").json()["strength"]
    held = np.flatnonzero(np.array(strength) > 0.8)
    place = 1000 * (held[len(held) // 2] + 0.5) / len(strength)
    page.get_by_test_id("seek").fill(f"{place:.0f}")
    until(page, "bench.contact === true")  # shown although it pauses
    expect(page.get_by_test_id("play")).to_have_text("Play")
    words = "document.querySelector('[data-testid=place]').innerText.split(' ').map(parseFloat)"
    until(page, f"(w => Math.abs(w[0] - {place / 1000} * w[2]) < 0.2)({words})")
    page.get_by_test_id("leave").click()
    expect(page.get_by_test_id("state")).to_contain_text("probe is there", timeout=PATIENCE_MS)


def test_loads_that_tell_too_little_are_refused_where_it_is_asked(page):
    page.get_by_test_id("calibrate").click()
    page.get_by_test_id("guide-loads").fill("80")
    page.get_by_test_id("guide-seconds").fill("0.5")
    page.get_by_test_id("guide-start").click()
    for step in range(2):
        expect(page.get_by_test_id("guide-ask")).to_contain_text(f"{step + 1} of 2")
        page.get_by_test_id("guide-load").click()
        page.get_by_test_id("guide-read").click()
        expect(page.locator("#guide-felt li")).to_have_count(step + 1)
    page.get_by_test_id("guide-finish").click()
    refused = page.locator("#guide").get_by_test_id("error")  # all else is behind the dialog
    expect(refused).to_contain_text("a law needs 3")
    expect(refused).to_be_in_viewport()
    page.locator("#guide-close").click()


def test_files_and_pictures_can_be_had(page, lab):
    page.get_by_text("Files of this object").click()
    with page.expect_download() as download:
        page.get_by_test_id("files").get_by_role("link").first.click()
    name = download.value.suggested_filename
    assert download.value.path().read_bytes() == (lab / "out" / name).read_bytes()
    with page.expect_download() as download:
        page.get_by_test_id("save-picture").click()
    assert download.value.path().read_bytes().startswith(b"\x89PNG")
    with page.expect_download() as download:
        page.get_by_test_id("save-frame").click()
    assert np.loadtxt(download.value.path(), delimiter=",").shape == (16, 16)


@pytest.mark.parametrize(("width", "scheme"), [(1440, "dark"), (390, "light")])
def test_axe_finds_nothing(browser, bench, width, scheme):
    with opened(
        browser, bench, viewport={"width": width, "height": 900}, color_scheme=scheme,
        bypass_csp=True,  # for axe's own script
    ) as page:  # fmt: skip
        paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (int(re.search(r"\d+", paper).group()) < 40) == (scheme == "dark")
        rest(page)
        touched(page)
        assert violations(page) == []  # in contact
        rest(page)
        page.get_by_test_id("scan").click()
        page.get_by_test_id("tint").select_option("coverage")
        expect(page.get_by_test_id("face-list")).to_be_visible()
        assert violations(page) == []  # lifted
        page.get_by_test_id("scan").click()
        if width == 1440:
            for name in ("gallery-open", "mounting-open", "print-open", "calibrate", "tour-open",
                         "make-open"):  # fmt: skip
                page.get_by_test_id(name).click()
                if name == "make-open":
                    until(page, "bench.tried > 0")
                assert violations(page) == [], name
                page.keyboard.press("Escape")


def violations(page):
    """Return what axe-core finds, and where."""
    found = Axe().run(page).response["violations"]
    return [(one["id"], [node["html"] for node in one["nodes"]]) for one in found]


def test_the_answer_is_on_the_first_screen(page):
    touched(page)
    for width, height in ((390, 844), (1024, 768), (3840, 2160), (1440, 900)):
        page.set_viewport_size({"width": width, "height": height})
        settle(page)
        page.evaluate("scrollTo(0, 0)")
        box = "document.getElementById('answer').getBoundingClientRect()"
        until(
            page,
            f"document.documentElement.scrollWidth <= {width} && {box}.height > 0"
            f" && {box}.bottom <= {height}",
        )


def test_an_empty_lab_offers_an_example(served, browser, tmp_path):
    with served(folder=tmp_path) as address:
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(address)
        button = page.get_by_test_id("example")
        expect(button).to_be_visible(timeout=PATIENCE_MS)
        button.click()
        until(page, "bench.answers > 0")
        assert page.get_by_test_id("answer").inner_text().startswith("Example F1")
        expect(button).to_be_hidden()
        assert (tmp_path / "lab.db").exists()
        assert httpx.post(f"{address}api/example", json={}).status_code == 409
        page.close()


def test_where_to_touch_next_is_said_and_done(page):
    page.get_by_test_id("touch-face").select_option("F1")
    answers = page.evaluate("bench.answers")
    for axis in "xy":
        page.locator(f"#touch-{axis}").fill("-4")
    page.get_by_test_id("touch-go").click()
    until(page, f"bench.answers > {answers}")
    assert page.get_by_test_id("answer").inner_text().startswith("Not recognised:")
    assert page.get_by_test_id("part").get_attribute("data-lit") == ""
    expect(page.get_by_test_id("next")).to_contain_text(re.compile("Next: .* mm (right|left)"))
    rest(page)
    for _ in range(2):
        if page.evaluate("bench.state") == "answered":
            break
        answers = page.evaluate("bench.answers")
        page.get_by_test_id("next-go").click()
        until(page, f"bench.answers > {answers}")
        rest(page)
    assert page.get_by_test_id("answer").inner_text().startswith("Cube F1")


def test_a_token_is_asked_for_where_others_can_come(served, browser):
    with served("--host", "0.0.0.0", "--port", "sim:") as address:
        assert "0.0.0.0" not in address  # nobody can open that
        bare, token = address.split("?token=")
        assert len(token) >= 20
        assert httpx.get(bare).status_code == 401
        assert httpx.get(bare + "api/bench").status_code == 401
        assert httpx.get(bare, params={"token": "wrong"}).status_code == 401
        assert httpx.get(bare + "api/bench", params={"token": token}).status_code == 401
        bearer = {"authorization": f"Bearer {token}"}
        assert httpx.get(bare + "api/bench", headers=bearer).status_code == 200
        with opened(browser, address) as page:
            assert page.url == bare  # the token does not stay in the address
            cookie = page.context.cookies()[0]
            assert (cookie["httpOnly"], cookie["sameSite"]) == (True, "Strict")
