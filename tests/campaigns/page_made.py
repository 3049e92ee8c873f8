"""Make every shape that the page offers through a real browser, and the same specs by command.

    python tests/campaigns/page_made.py [--only cube cone]

Both labs have one key and take the shapes in one order, so that every file has to have the same
bytes. Seconds from a change to the preview (the pause of the form and its process that loads ahead
among them), from a click to the zip, and of the command; MB and files of the zip. Exit code 1 where
a file differs.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import runner
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_page import CHROMIUM, FLAGS, made, making, opened_to_make, running

KEY = "0123-4567-89AB-CDER"
READING_S = 3.0  #: that somebody looks at a preview, while the next process loads


def main() -> int:
    asked = runner.asked(__doc__, only=[""])
    wrong = 0
    runner.table(("shape", "preview, s", "zip, s", "command, s", "MB", "files", "differ"))
    with tempfile.TemporaryDirectory() as root, sync_playwright() as playwright:
        served, own = Path(root, "served"), Path(root, "own")
        served.mkdir()
        own.mkdir()
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        with running(folder=served) as (address, _):
            page = opened_to_make(browser, address)
            page.get_by_test_id("make-lab").select_option("lab")
            options = page.get_by_test_id("make-shape").locator("option")
            for shape in options.evaluate_all("all => all.map((one) => one.value)"):
                if asked.only != [""] and shape not in asked.only:
                    continue
                making(page, {"shape": shape, "name": shape, "output.lab_key": KEY})
                page.wait_for_timeout(1e3 * READING_S)
                size = page.get_by_test_id("make-form").locator(
                    f"[data-testid^='make-shape.{shape}']"
                )
                began_s = time.monotonic()
                size.last.press("ArrowUp")
                making(page, {})
                tried_s = time.monotonic() - began_s
                began_s = time.monotonic()
                _, files = made(page)
                made_s = time.monotonic() - began_s
                spec = f"{shape}.yaml"
                (own / spec).write_bytes(files.pop(spec))
                began_s = time.monotonic()
                subprocess.run(runner.command("generator", spec), cwd=own, check=True,
                               capture_output=True)  # fmt: skip
                command_s = time.monotonic() - began_s
                names = {str(one.relative_to(home)) for home in (own, served)
                         for one in home.glob(f"out/{shape.replace('_', '-')}/*")}  # fmt: skip
                differ = [name for name in names | files.keys()
                          if {files.get(name)} != {(own / name).read_bytes(),
                                                   (served / name).read_bytes()}]  # fmt: skip
                wrong += len(differ)
                size_mb = sum(map(len, files.values())) / 1e6
                runner.row(shape, tried_s, made_s, command_s, size_mb, len(files), len(differ))
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
