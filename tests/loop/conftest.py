"""Two registered objects and a running `open-bench`, for the tests of its page and its guard."""

from contextlib import contextmanager

import pytest
from bench_page import CHROMIUM, FLAGS, opened, rest, running, shown
from playwright.sync_api import sync_playwright

ENDED_S = 30.0


@pytest.fixture(scope="session")
def lab(tmp_path_factory):
    """A folder with a cube and a cylinder, their files and database, and a secret beside it."""
    from generator.pipeline import encode
    from generator.spec import read_specs

    folder = tmp_path_factory.mktemp("bench")
    lab = folder / "lab"
    lab.mkdir()
    (folder / "secret.txt").write_text("kept to itself")
    shapes = {"Cube": "{cube: 60 mm}", "Cylinder": "{cylinder: {diameter: 60 mm, height: 60 mm}}"}
    for name, shape in shapes.items():
        spec = lab / f"{name}.yaml"
        spec.write_text(f"name: {name}\nshape: {shape}\n")
        encode(
            read_specs([spec]), folder=lab / "out", formats=("stl",),
            database=str(lab / "lab.db"),
        )  # fmt: skip
    return lab


@pytest.fixture(scope="session")
def served(lab):
    """Return a context manager: options -> address of a server, that has to end in order."""

    @contextmanager
    def server(*options, folder=None, errors=None):
        words = ("--database", lab / "lab.db") if folder is None else ()
        words += ("--folder", (folder or lab) / "recordings")
        with running(*words, *options, folder=folder, errors=errors) as (address, process):
            try:
                yield address
            finally:
                process.terminate()
                assert process.wait(ENDED_S) == 0

    return server


@pytest.fixture(scope="module")
def browser():
    """Chromium, without a window."""
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def work(browser, bench):
    """The page of a module's `bench`; its tests work it one after the other."""
    with opened(browser, bench) as page:
        yield page


@pytest.fixture
def page(work):
    """Return the module's page without dialogs, showing the cube, with nothing touched."""
    work.evaluate("document.querySelectorAll('dialog[open]').forEach((one) => one.close())")
    rest(work)
    shown(work, "Cube")
    return work
