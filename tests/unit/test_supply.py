"""What is imported is declared, what is installed is pinned, what is bundled has its licence."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import threading
import tomllib
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.metadata import packages_distributions

import pytest
from supply import CONSTRAINTS, ROOT, canonical, declared, needed

OURS = ("encoded_objects", "generator", "decoder", "probe", "recognizer")
#: simulators of a campaign, which says how to install them
APART = {"newton", "warp"}
#: of an extra that tests do not bring: the package that a module is of
ELSEWHERE = {"pydrake": ["drake"]}


def imported(folder):
    """Return the packages that files import, with one of the files each."""
    found = {}
    for file in sorted((ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                names = [node.module]
            else:
                continue
            for name in names:
                found.setdefault(name.partition(".")[0], file.relative_to(ROOT))
    return {name: file for name, file in found.items() if name not in sys.stdlib_module_names}


@pytest.mark.parametrize("folder", [*OURS, "tests"])
def test_direct_imports_are_declared(folder):
    extras = declared()
    shipped = [extra for extra in extras if folder == "tests" or extra not in ("test", "docs")]
    known = {canonical(one.name) for extra in shipped for one in extras[extra]}
    brings = ELSEWHERE | dict(packages_distributions())
    local = {file.stem for part in ("tests", "docs/examples") for file in (ROOT / part).rglob("*")}
    missing = {}
    for name, file in imported(folder).items():
        if name in OURS or (folder == "tests" and name in local | APART):
            continue
        packages = {canonical(one) for one in brings.get(name, [name])}
        if not packages & known:
            missing[name] = str(file)
    assert missing == {}


def test_constraints_pin_all_that_is_brought():
    lines = [line for line in CONSTRAINTS.read_text().splitlines() if not line.startswith("#")]
    pinned = dict(line.split("==") for line in lines)
    assert list(pinned) == sorted(pinned)
    assert set(needed()) <= set(pinned)
    for extra in declared().values():
        for one in extra:
            if canonical(one.name) in pinned:
                assert pinned[canonical(one.name)] in one.specifier, one


def test_whose_internals_are_used_is_bounded():
    """`open-bench` puts deadlines on a class that uvicorn does not document."""
    (uvicorn,) = [one for one in declared()["bench"] if one.name == "uvicorn"]
    assert "9.0" not in uvicorn.specifier


def test_the_licences_of_bundled_files_go_along():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["license"] == "Apache-2.0 AND MIT"
    for file in project["license-files"]:
        assert (ROOT / file).is_file()
    assert "MIT License" in (ROOT / project["license-files"][-1]).read_text()


@pytest.mark.parametrize("folder", ["probe/surface", "recognizer/touch"])
def test_compiled_loops_say_nothing_of_where_they_were_built(folder):
    content = (ROOT / folder / "kernels.so").read_bytes()
    assert str(ROOT).encode() not in content
    assert b".c\0" not in content


class Osv(BaseHTTPRequestHandler):
    """Answers as OSV does: one package has an advisory."""

    def do_POST(self):
        asked = json.loads(self.rfile.read(int(self.headers["content-length"])))["queries"]
        results = [{"vulns": [{"id": "PYSEC-1"}]} if one["package"]["name"] == "h5py" else {}
                   for one in asked]  # fmt: skip
        self.send_response(200)
        self.end_headers()
        self.wfile.write(json.dumps({"results": results}).encode())

    def log_message(self, *_):
        pass


def test_advisories_are_asked_once_and_their_date_is_said(tmp_path):
    def said(url):
        words = [sys.executable, str(ROOT / "tests" / "supply.py"), "advisories", "--url", url]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    with ThreadingHTTPServer(("127.0.0.1", 0), Osv) as server:
        url = f"http://127.0.0.1:{server.server_address[1]}/"
        assert said("http://127.0.0.1:9/")[0] == 2  # nothing can be asked, nothing is kept
        threading.Thread(target=server.serve_forever, daemon=True).start()
        code, out, _ = said(url)
        server.shutdown()
    assert code == 1
    assert "https://osv.dev/vulnerability/PYSEC-1" in out
    date = json.loads((tmp_path / "advisories.json").read_text())["asked"]
    code, again, err = said("http://127.0.0.1:9/")
    assert (code, again) == (1, out)
    assert f"as of {date}" in again
    assert "does not answer" in err
