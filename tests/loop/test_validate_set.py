"""`validate-set` from spec to report: the same bytes whoever does the work, and after any end."""

import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest
from programs import command, wait_for

from recognizer.validation.command import run
from recognizer.validation.errors import SetError
from recognizer.validation.touch_plan import written_surface

TOUCHES, SHARD = 18, 6
COMMAND = command("recognizer.validation")
ADDRESS = re.compile(r'"address": "([^"]+)"')
OUTWARD = re.compile(r"""(src|href)\s*=\s*["'](?!#|data:)|url\((?!#)|@import""")
SAME = ("trials.parquet", "results.json")


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    path = tmp_path_factory.mktemp("specs") / "cube.yaml"
    path.write_text("name: Cube\nshape: {cube: 45 mm}\n")
    return path


def asked(spec: Path, folder: Path, *more: str) -> list[str]:
    return [str(spec), "--touches", str(TOUCHES), "--shard", str(SHARD), "--study", "0",
            "-o", str(folder), *more]  # fmt: skip


@pytest.fixture(scope="module")
def reference(spec, tmp_path_factory):
    """A run by one process, and what it printed."""
    folder = tmp_path_factory.mktemp("reference")
    done = subprocess.run(
        [*COMMAND, *asked(spec, folder, "--json")], capture_output=True, text=True, check=True
    )
    return folder, json.loads(done.stdout)


def assert_same(folder: Path, reference: Path):
    for name in SAME:
        assert (folder / name).read_bytes() == (reference / name).read_bytes(), name


def begun(*arguments: str) -> subprocess.Popen:
    """Start a run in a session of its own, so that all of its processes can be found."""
    return subprocess.Popen(
        [*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip


def left_of(session: int) -> list[int]:
    found = []
    for process in psutil.process_iter(["pid", "status"]):
        with suppress(ProcessLookupError):
            if os.getsid(process.pid) == session:
                found.append(process)
    return [one.pid for one in found if one.info["status"] != psutil.STATUS_ZOMBIE]


def test_what_it_prints_and_leaves(reference):
    folder, printed = reference
    rows = pq.read_table(folder / "trials.parquet").to_pydict()
    assert rows["number"] == list(range(TOUCHES))
    for verdict in ("right", "wrong", "rejected"):
        assert printed[verdict] == rows["verdict"].count(verdict)
    assert (printed["touches"], printed["right"] > 0, printed["seconds"] > 0) == (18, True, True)
    assert printed["rms_mm"] < 0.5
    assert printed["rms_deg"] < 2
    told = (folder / "results.json").read_text() + (folder / "report.html").read_text()
    assert str(folder) not in told
    assert str(Path.home()) not in told
    assert not re.search(r"20\d\d-\d\d-\d\d[T ]", told)
    assert "utc" in json.loads((folder / "provenance.json").read_text())
    assert not OUTWARD.search((folder / "report.html").read_text())


def test_the_page_fits_asks_for_nothing_and_prints(reference, browser):
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((reference[0] / "report.html").as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280
    assert [url.rpartition("/")[2] for url in asked] == ["report.html"]
    assert page.pdf().count(b"/Type /Page\n") >= 2
    page.close()


def test_two_processes_interrupted_killed_and_resumed(spec, reference, tmp_path):
    folder = tmp_path / "run"
    work = asked(spec, folder)
    for number, shards in ((signal.SIGINT, 1), (signal.SIGKILL, 2)):
        more = ["--resume", "-j", "1"] if shards > 1 else ["-j", "2"]
        process = begun(*work, *more)
        wait_for(lambda n=shards: len(list(folder.glob("shards/touches/*.parquet"))) >= n)
        process.send_signal(number)
        _, err = process.communicate(timeout=30)
        if number == signal.SIGINT and process.returncode == 130:
            assert "interrupted; go on with --resume" in err
            assert "Traceback" not in err
        wait_for(lambda p=process.pid: not left_of(p), 20)
    again = subprocess.run([*COMMAND, *work, "-j", "2", "--resume"], capture_output=True, text=True)
    assert again.returncode == 0, again.stderr
    assert_same(folder, reference[0])
    assert not list(folder.rglob("*.writing"))


def test_a_cluster_of_two_workers_one_of_them_killed(spec, reference, tmp_path):
    address, folder = tmp_path / "scheduler.json", tmp_path / "run"
    with ExitStack() as started:

        def start(what, *options):
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{what}", *options, "--no-dashboard"],
                cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            started.enter_context(process)
            started.callback(process.kill)
            return process

        start("scheduler", "--port", "0", "--host", "127.0.0.1", "--scheduler-file", str(address))
        wait_for(address.exists)
        url = wait_for(lambda: ADDRESS.search(address.read_text()))[1]
        worker, _ = (start("worker", url, "--nthreads", "1", "--no-nanny") for _ in range(2))
        process = begun(*asked(spec, folder, "--cluster", url))
        wait_for(lambda: list(folder.glob("shards/touches/*.parquet")))
        worker.kill()
        _, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
    assert_same(folder, reference[0])


def test_repeat_report_and_compare(reference, tmp_path, capsys):
    folder = reference[0]
    rows = pq.read_table(folder / "trials.parquet").to_pylist()
    right = next(row for row in rows if row["verdict"] == "right")
    strange = next(row for row in rows if row["kind"] in ("foreign", "blank"))
    picture = tmp_path / "touch.png"
    for row, more in ((right, ["--plot", str(picture)]), (strange, [])):
        assert run(["repeat", str(folder), str(row["number"]), "--json", *more]) == 0
        again = json.loads(capsys.readouterr().out)
        assert again == {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in row.items()
        }
    assert picture.stat().st_size > 10_000
    page, results = (folder / "report.html").read_bytes(), (folder / "results.json").read_bytes()
    assert run(["report", str(folder)]) == 0
    assert (folder / "results.json").read_bytes() == results
    assert (folder / "report.html").read_bytes() == page
    capsys.readouterr()
    html = tmp_path / "pair.html"
    assert run(["compare", str(folder), str(folder), "-o", str(html), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["differ"] == []
    assert {line["word"] for line in found["lines"]} <= {"same within chance", ""}
    assert html.stat().st_size > 10_000


def test_worlds_of_two_runs_are_a_page_with_json_beside_it(reference, tmp_path, capsys):
    one, other, page = reference[0], tmp_path / "other", tmp_path / "worlds.html"
    shutil.copytree(one, other)
    assert run(["worlds", str(one), str(other), "-o", str(page), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert json.loads(page.with_suffix(".json").read_text()) == said
    assert str(tmp_path) not in page.read_text() + page.with_suffix(".json").read_text()
    assert not OUTWARD.search(page.read_text())
    assert run(["worlds", str(one), str(one)]) == 2
    assert "stands twice" in capsys.readouterr().err
    results = json.loads((other / "results.json").read_text())
    del results["format"]
    (other / "results.json").write_text(json.dumps(results))
    assert run(["compare", str(one), str(other)]) == 2
    assert "validate-set report" in capsys.readouterr().err


def test_a_report_of_what_no_database_knows_shows_no_errors_of_right_answers(reference, tmp_path):
    own = ["--database", str(reference[0] / "lab.db"), "--kinds", "blank", "--study", "0"]
    assert run([*own, "--touches", "3", "-o", str(tmp_path / "blank")]) == 0
    blank, usual = (
        (folder / "report.html").read_text() for folder in (tmp_path / "blank", reference[0])
    )
    assert "When it answers" in blank
    assert ("How far off" in blank, "How far off" in usual) == (False, True)


def test_a_changed_file_is_found_out(reference, tmp_path):
    lab = tmp_path / "lab"
    shutil.copytree(reference[0], lab)
    file = min((lab / "parts").rglob("*-F1.stl"))
    written_surface(str(lab / "lab.db"), "Cube", "F1")
    content = bytearray(file.read_bytes())
    content[200] ^= 1
    file.write_bytes(content)
    with pytest.raises(SetError, match="not the one that the database registers"):
        written_surface(str(lab / "lab.db"), "Cube", "F1")
    file.unlink()
    with pytest.raises(SetError, match="cannot read the part"):
        written_surface(str(lab / "lab.db"), "Cube", "F1")
