"""Parts made through the page of `open-bench`, in a real browser: as by the command, or refused."""

import json
from urllib.parse import parse_qsl

import httpx
import pytest
from bench_loads import LARGE, family
from bench_page import downloaded, made, making, opened_to_make, running, until
from playwright.sync_api import expect
from programs import wait_for

from generator.command import run as encode_object
from recognizer.bench import encode_object as bench_commands

KEY = "0123-4567-89AB-CDER"
CUBE = "name: Die\nshape: {cube: 40 mm}\noutput: {formats: [stl]}\n"


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A server without a lab, in a folder of its own: address, process, folder."""
    folder = tmp_path_factory.mktemp("making")
    with running(folder=folder) as (address, process):
        yield address, process, folder


@pytest.fixture(scope="module")
def page(browser, own):
    """The page of that server; the tests work its form one after the other."""
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.goto(own[0])
    yield page
    page.close()


def ask(address, spec, *, path="make/try", keep=False, timeout=60.0):
    body = {"name": "Die", "spec": spec, "keep": keep}
    return httpx.post(f"{address}api/{path}", json=body, timeout=timeout)


def test_an_empty_lab_offers_an_example(page, own):
    address, _, folder = own
    button = page.get_by_test_id("example")
    expect(button).to_be_visible()
    button.click()
    until(page, "bench.answers > 0")
    assert page.get_by_test_id("answer").inner_text().startswith("Example F1")
    expect(button).to_be_hidden()
    assert (folder / "lab.db").exists()
    assert httpx.post(f"{address}api/example", json={}).status_code == 409


def test_keys_change_the_number_at_the_cursor_and_the_part_follows(page):
    page.get_by_test_id("make-open").click()
    until(page, "bench.tried > 0")
    making(page, {"shape": "box"})
    field = page.get_by_test_id("make-shape.box")
    field.focus()
    field.evaluate("one => one.setSelectionRange(9, 9)")
    tried = page.evaluate("bench.tried")
    page.keyboard.press("Shift+ArrowDown")
    page.keyboard.press("ArrowUp")
    expect(field).to_have_value("[80 mm, 71 mm, 120 mm]")
    until(page, f"bench.tried > {tried}")
    expect(page.get_by_test_id("make-faces")).to_contain_text("71 x 120 mm")


def test_what_is_promised_is_seen_and_a_link_opens_it_again(page, browser):
    making(page, {"shape": "box", "shape.box": "[60 mm, 60 mm, 5 mm]", "name": "Flat",
                  "print.parts": "whole"})  # fmt: skip
    expect(page.get_by_test_id("make-told")).to_contain_text("of touches anywhere on the part")
    faces = page.get_by_test_id("make-faces")
    expect(faces).to_contain_text("would help: 7 mm wide instead of 5")
    colours = faces.locator("i").evaluate_all("all => all.map((one) => one.style.background)")
    assert len(set(colours)) == 2
    spec = page.get_by_test_id("make-spec").text_content()
    saved = downloaded(page.get_by_test_id("make-save"))
    assert (saved.suggested_filename, saved.path().read_text()) == ("Flat.yaml", spec)
    assert dict(parse_qsl(page.url.split("?")[1]))["shape.box"] == "[60 mm, 60 mm, 5 mm]"
    other = opened_to_make(browser, page.url)
    assert other.get_by_test_id("make-spec").text_content() == spec
    other.goto("about:blank")
    other.goto(f"{page.url.split('#')[0]}#make?shape.box={'9' * 2000}")
    expect(other.get_by_test_id("error")).to_contain_text("not offered here: shape.box")
    other.close()


def test_a_part_has_the_bytes_that_the_command_writes(page, tmp_path, monkeypatch):
    page.get_by_test_id("make-lab").select_option("")  # one of its own
    making(page, {"shape": "cylinder", "shape.cylinder.diameter": "40 mm",
                  "shape.cylinder.height": "30 mm", "name": "Own can", "print.parts": "",
                  "output.formats": "[stl, 3mf]", "output.lab_key": KEY,
                  "print.printer": "prusa-mk4"})  # fmt: skip
    name, files = made(page)
    assert name == "Own can.zip"
    monkeypatch.chdir(tmp_path)
    spec = tmp_path / "Own can.yaml"
    spec.write_bytes(files.pop(spec.name))
    assert encode_object([spec.name]) == 0
    files.pop("lab.db")
    written = tmp_path.rglob("out/*/*")
    assert files == {str(one.relative_to(tmp_path)): one.read_bytes() for one in written}


def test_what_is_made_in_the_lab_is_shown_and_touched(page, own):
    address, _, folder = own
    page.get_by_test_id("make-lab").select_option("lab")
    making(page, {"shape": "cube", "name": "Die", "output.formats": "[stl]",
                  "output.lab_key": ""})  # fmt: skip
    slow = []  # its picture comes after the reader has read the lab again
    page.route("**/api/objects/Die", lambda one: slow.append(one))
    name, files = made(page)
    assert name == "Die.zip"
    expect(page.get_by_test_id("object").locator("option")).to_have_count(2)
    page.unroute("**/api/objects/Die")  # lets it go
    assert "lab.db" not in files
    assert all((folder / one).read_bytes() == files[one] for one in files if one != "Die.yaml")
    expect(page.get_by_test_id("object")).to_have_value("Die")
    page.keyboard.press("Escape")
    page.get_by_test_id("gallery-open").click()
    expect(page.locator("#gallery-list")).to_contain_text("Die")
    assert ask(address, CUBE.replace("40", "41"), keep=True).status_code == 400  # its name is taken
    assert ask(address, CUBE.replace("40", "41")).status_code == 200  # but not in a lab of its own
    page.keyboard.press("Escape")


def test_a_refusal_has_the_command_s_words_at_its_field(page, tmp_path, capsys):
    page.get_by_test_id("make-open").click()
    page.get_by_test_id("make-name").fill("a/b: c")
    making(page, {"shape": "prism", "shape.prism.side": "40 mmm"}, state="refused")
    spec = tmp_path / "spec.yaml"
    spec.write_text(page.get_by_test_id("make-spec").text_content())
    assert encode_object([str(spec), "--dry-run", "--json"]) == 2
    problems = json.loads(capsys.readouterr().out)["error"]["problems"]
    said = page.get_by_test_id("make-problems")
    expect(said.locator("p")).to_have_count(len(problems))
    for one in problems:
        expect(said).to_contain_text(one["cause"])
        expect(said).to_contain_text(one["fix"])
    for field, wrong in (("name", "true"), ("shape.prism.side", "true"),
                         ("shape.prism.sides", "false")):  # fmt: skip
        expect(page.get_by_test_id(f"make-{field}")).to_have_attribute("aria-invalid", wrong)
    expect(page.get_by_test_id("make-go")).to_be_disabled()


SECRETS = (
    "name: Die\nshape: {file: secret.stl}\nsensor_type: secret\nprint: {printer: secret.yaml}\n"
    "symbols: {alphabet: {file: secret}}\noutput: {folder: elsewhere, database: other.db}\n"
)


def test_a_spec_from_the_page_names_no_files(own):
    address, _, folder = own
    (folder / "secret").write_text("kept to itself")
    before = sorted(folder.rglob("*"))
    for path in ("make/try", "make"):
        answer = ask(address, SECRETS, path=path, keep=True)
        assert answer.status_code == 400
        assert [one["line"] for one in answer.json()["error"]["problems"]] == [2, 3, 4, 5, 6, 6]
        assert "kept" not in answer.text
    assert sorted(folder.rglob("*")) == before


def test_it_ends_with_the_page_that_waits_for_it(own):
    address, process, _ = own
    ask(address, CUBE)
    with pytest.raises(httpx.ReadTimeout):
        ask(address, LARGE, path="make", timeout=2)
    wait_for(lambda: len(family(process.pid)) <= 2, 10)  # the server, one that waits for the next


def test_a_part_of_very_many_symbols_is_not_drawn(monkeypatch):
    monkeypatch.setattr(bench_commands, "DRAWN", 10)
    monkeypatch.setattr(bench_commands, "load_ahead", lambda: None)
    found = bench_commands.try_part(CUBE, "Die", "", lambda: False)
    assert found["made"]["objects"][0]["symbols"] > 10
    assert found["shape"] is None
