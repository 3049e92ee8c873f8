"""Parts made through the page of `open-bench`, in a real browser: as by the command, or refused."""

from __future__ import annotations

import json
import time
from urllib.parse import parse_qsl

import httpx
import pytest
from bench_loads import LARGE, family
from bench_page import made, making, opened_to_make, running, until
from playwright.sync_api import expect

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


@pytest.fixture
def page(browser, own):
    page = opened_to_make(browser, own[0])
    yield page
    page.close()


def ask(address, spec, *, path="make/try", keep=False, timeout=60.0):
    body = {"name": "Die", "spec": spec, "keep": keep}
    return httpx.post(f"{address}api/{path}", json=body, timeout=timeout)


SMALL = {
    "box": {"shape.box": "[40 mm, 40 mm, 25 mm]"},
    "cylinder": {"shape.cylinder.diameter": "40 mm", "shape.cylinder.height": "30 mm"},
}


@pytest.mark.parametrize("shape", SMALL)
def test_a_part_has_the_bytes_that_the_command_writes(page, shape, tmp_path, monkeypatch):
    making(page, {"shape": shape, **SMALL[shape], "name": f"Own {shape}",
                  "output.formats": "[stl, 3mf]", "output.lab_key": KEY,
                  "print.printer": "prusa-mk4"})  # fmt: skip
    name, files = made(page)
    assert name == f"Own {shape}.zip"
    monkeypatch.chdir(tmp_path)
    spec = f"Own {shape}.yaml"
    (tmp_path / spec).write_bytes(files.pop(spec))
    assert encode_object([spec]) == 0
    files.pop("lab.db")
    written = {
        str(one.relative_to(tmp_path)): one.read_bytes() for one in tmp_path.rglob("out/*/*")
    }
    assert files == written


def test_what_is_promised_is_seen_and_a_link_opens_it_again(page, own, browser):
    making(page, {"shape": "box", "shape.box": "[60 mm, 60 mm, 5 mm]", "name": "Flat",
                  "print.parts": "whole"})  # fmt: skip
    expect(page.get_by_test_id("make-told")).to_contain_text("of touches anywhere on the part")
    faces = page.get_by_test_id("make-faces")
    expect(faces).to_contain_text("would help: 7 mm wide instead of 5")
    colours = faces.locator("i").evaluate_all("all => all.map((one) => one.style.background)")
    assert len(set(colours)) == 2
    spec = page.get_by_test_id("make-spec").text_content()
    with page.expect_download() as download:
        page.get_by_test_id("make-save").click()
    assert download.value.suggested_filename == "Flat.yaml"
    assert download.value.path().read_text() == spec
    assert dict(parse_qsl(page.url.split("?")[1]))["shape.box"] == "[60 mm, 60 mm, 5 mm]"
    other = opened_to_make(browser, page.url)
    assert other.get_by_test_id("make-spec").text_content() == spec
    other.close()
    long = opened_to_make(browser, f"{page.url.split('#')[0]}#make?shape.box={'9' * 2000}")
    expect(long.get_by_test_id("error")).to_contain_text("not offered here: shape.box")
    long.close()


def test_a_refusal_has_the_command_s_words_at_its_field(page, tmp_path, capsys):
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
    for field in ("name", "shape.prism.side"):
        expect(page.get_by_test_id(f"make-{field}")).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_test_id("make-shape.prism.sides")).to_have_attribute("aria-invalid", "false")
    expect(page.get_by_test_id("make-go")).to_be_disabled()


def test_keys_change_the_number_at_the_cursor_and_the_part_follows(page):
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
        httpx.post(
            f"{address}api/make", json={"name": "Can", "spec": LARGE, "keep": False}, timeout=2
        )
    end_s = time.monotonic() + 10.0
    while len(family(process.pid)) > 2:  # the server, and a process that waits for the next
        assert time.monotonic() < end_s
        time.sleep(0.05)


def test_what_is_made_in_the_lab_is_shown_and_touched(page, own):
    address, _, folder = own
    page.get_by_test_id("make-lab").select_option("lab")
    making(page, {"shape": "cube", "name": "Die", "output.formats": "[stl]"})
    name, files = made(page)
    assert name == "Die.zip"
    assert "lab.db" not in files
    assert all((folder / one).read_bytes() == files[one] for one in files if one != "Die.yaml")
    expect(page.get_by_test_id("object")).to_have_value("Die")
    page.keyboard.press("Escape")
    page.get_by_test_id("gallery-open").click()
    expect(page.locator("#gallery-list")).to_contain_text("Die")
    assert ask(address, CUBE.replace("40", "41"), keep=True).status_code == 400  # its name is taken
    assert ask(address, CUBE.replace("40", "41")).status_code == 200  # but not in a lab of its own


def test_a_part_of_very_many_symbols_is_not_drawn(monkeypatch):
    monkeypatch.setattr(bench_commands, "DRAWN", 10)
    monkeypatch.setattr(bench_commands, "load_ahead", lambda: None)
    found = bench_commands.try_part(CUBE, "Die", "", lambda: False)
    assert found["made"]["objects"][0]["symbols"] > 10
    assert found["shape"] is None
