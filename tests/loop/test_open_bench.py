"""`open-bench` as an operator meets it: a server, a probe on a serial line, a real browser."""

import re

import httpx
import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from bench_page import WATCH, answered, downloaded, opened, rest, settle, shown, touched, until
from playwright.sync_api import expect

from probe.recording.read import Recording


@pytest.fixture(scope="module")
def bench(served):
    """Address of a bench with a simulated probe."""
    with served("--port", "touch:?hold=1&rate=40") as address:
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
    rest(page)
    shown(page, "Cylinder")
    assert touched(page).startswith("Cylinder")
    assert np.allclose(*asked_and_read(page), atol=0.5)


def test_no_picture_shows_the_last_answer_for_a_new_touch(page):
    assert touched(page).startswith("Cube")
    rest(page)
    first = page.evaluate("bench.touch")
    page.evaluate(WATCH)
    for number, place in enumerate(((0.46, 0.5), (0.38, 0.6)) * 3, 1):
        touched(page, *place)
        rest(page)
        new = [one for one in page.evaluate("window.seen") if one[0] > first]
        before = [one[2:5] for one in new if one[1] in ("felt", "reading")]
        if before and number > 1:  # a loaded machine may read a touch before it is drawn
            break
    assert len({one[0] for one in new}) == number
    assert before, "no picture of a touch that was not read yet"
    for lit, answer, pose in before:
        assert (lit, pose, "Cube" in answer) == ("", "", False)


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
    assert "the first one" in downloaded(page.get_by_test_id("touch-csv")).path().read_text()
    assert len(Recording(downloaded(page.get_by_test_id("touch-h5")).path())) >= 2
    page.get_by_test_id("touch-list").press("Escape")
    buttons.nth(kept - 1).click()
    page.get_by_test_id("touch-delete").click()
    expect(buttons).to_have_count(kept)
    expect(answer).to_have_text(re.compile(f"^{re.escape(other)}"), use_inner_text=True)


def test_keys_turn_the_part_and_touch_it(page):
    part = page.get_by_test_id("part")
    part.focus()
    before = part.screenshot()
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    said = answered(page, page.keyboard.press, "Enter")
    assert part.screenshot() != before
    assert said.startswith(f"Cube {page.get_by_test_id('touch-face').input_value()}")


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
    expect(state).to_contain_text("probe is gone")
    expect(state).to_contain_text("probe is there")
    frames = page.evaluate("bench.frames")
    until(page, f"bench.frames > {frames + 10}")
    page.get_by_test_id("filter").select_option("raw")  # the image of a touch is held until then
    paints = page.evaluate("bench.paints")
    until(page, f"bench.paints > {paints + 3}")
    before = heat(page)
    until(page, f"document.getElementById('heat').toDataURL() !== '{before}'")  # by noise alone
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
    assert answered(page, page.get_by_test_id("replay").click).startswith(said)
    expect(page.get_by_test_id("state")).to_contain_text("replaying")
    expect(page.get_by_test_id("play")).to_have_text("Play")
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
    expect(page.get_by_test_id("state")).to_contain_text("probe is there")


def test_files_and_pictures_can_be_had(page, lab):
    page.get_by_text("Files of this object").click()
    file = downloaded(page.get_by_test_id("files").get_by_role("link").first)
    assert file.path().read_bytes() == (lab / "out" / file.suggested_filename).read_bytes()
    picture = downloaded(page.get_by_test_id("save-picture")).path()
    assert picture.read_bytes().startswith(b"\x89PNG")
    frame = downloaded(page.get_by_test_id("save-frame")).path()
    assert np.loadtxt(frame, delimiter=",").shape == (16, 16)


def test_where_to_touch_next_is_said_and_done(page):
    page.get_by_test_id("touch-face").select_option("F1")
    for axis in "xy":
        page.locator(f"#touch-{axis}").fill("-4")
    assert answered(page, page.get_by_test_id("touch-go").click).startswith("Not recognised:")
    assert page.get_by_test_id("part").get_attribute("data-lit") == ""
    expect(page.get_by_test_id("next")).to_contain_text(re.compile("Next: .* mm (right|left)"))
    rest(page)
    for _ in range(2):
        if page.evaluate("bench.state") == "answered":
            break
        answered(page, page.get_by_test_id("next-go").click)
        rest(page)
    assert page.get_by_test_id("answer").inner_text().startswith("Cube F1")


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
            expect(one.get_by_test_id("record")).to_have_attribute("aria-pressed", "true")
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


def violations(page):
    """Return what axe-core finds, and where."""
    found = Axe().run(page).response["violations"]
    return [(one["id"], [node["html"] for node in one["nodes"]]) for one in found]


def looked_at(browser, bench, scheme, width, **look):
    """Open the page in a scheme of colours; `bypass_csp` is for axe's own script."""
    return opened(browser, bench, color_scheme=scheme, bypass_csp=True,
                  viewport={"width": width, "height": 900}, **look)  # fmt: skip


def test_axe_finds_nothing_in_the_dark(browser, bench):
    with looked_at(browser, bench, "dark", 1440) as page:
        paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert int(re.search(r"\d+", paper).group()) < 40
        rest(page)
        touched(page)
        assert violations(page) == []  # in contact
        rest(page)
        page.get_by_test_id("scan").click()
        page.get_by_test_id("tint").select_option("coverage")
        expect(page.get_by_test_id("face-list")).to_be_visible()
        assert violations(page) == []  # lifted
        page.get_by_test_id("scan").click()
        for name in ("gallery", "mounting", "print", "calibrate", "tour", "make"):
            page.get_by_test_id(name if name == "calibrate" else f"{name}-open").click()
            if name == "make":
                until(page, "bench.tried > 0")
            assert violations(page) == [], name
            page.keyboard.press("Escape")


OUTSIDE = """() => [...document.querySelectorAll('button, select, input, h2, .button')]
    .filter((one) => { const box = one.getBoundingClientRect();
      return one.checkVisibility() && one.type !== 'file' && !one.closest('#touch-list')
        && (box.left < 0 || box.right > 390); }).map((one) => one.outerHTML)"""
SMALL = """() => [...document.querySelectorAll('button, select, .button')]
    .filter((one) => one.checkVisibility() && one.getBoundingClientRect().height < 24)
    .map((one) => one.outerHTML)"""


def test_a_phone_touches_by_a_tap(browser, bench):
    with looked_at(browser, bench, "light", 390, has_touch=True, is_mobile=True) as page:
        rest(page)
        shown(page, "Cube")
        part = page.get_by_test_id("part")
        part.scroll_into_view_if_needed()
        box = part.bounding_box()
        at = box["x"] + 0.46 * box["width"], box["y"] + 0.55 * box["height"]
        assert answered(page, page.touchscreen.tap, *at).startswith("Cube")
        assert violations(page) == []
        until(page, "document.documentElement.scrollWidth <= 390")
        assert page.evaluate(SMALL) == []
        assert page.evaluate(OUTSIDE) == []


AREA = """() => [...document.querySelectorAll('main > .panel')]
    .filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect())
    .reduce((sum, box) => sum + box.width * Math.min(box.height, 2160), 0)"""
GROWTH = """() => new Promise((done) => { const heights = []; const look = () => {
    heights.push(document.getElementById('part').getBoundingClientRect().height);
    if (heights.length < 20) requestAnimationFrame(look); else done(heights); }; look(); })"""


def test_the_answer_is_on_the_first_screen_and_4k_is_used(page):
    part = page.get_by_test_id("part")
    page.evaluate("scrollTo(0, 0)")
    settle(page)
    before = part.bounding_box()
    touched(page)
    box = "document.getElementById('answer').getBoundingClientRect()"
    for width, height in ((390, 844), (1024, 768), (3840, 2160)):
        page.set_viewport_size({"width": width, "height": height})
        settle(page)
        page.evaluate("scrollTo(0, 0)")
        until(
            page,
            f"document.documentElement.scrollWidth <= {width} && {box}.height > 0"
            f" && {box}.bottom <= {height}",
        )
    assert page.evaluate("parseFloat(getComputedStyle(document.body).fontSize)") >= 19
    assert page.evaluate(AREA) > 0.8 * 3840 * 2160
    heights = page.evaluate(GROWTH)
    assert max(heights) == min(heights)  # a canvas whose pixels size its panel grows for ever
    rest(page)
    assert touched(page, 0.5, 0.5)
    page.set_viewport_size({"width": 1440, "height": 900})
    page.evaluate("scrollTo(0, 0)")
    settle(page)
    assert part.bounding_box() == before
