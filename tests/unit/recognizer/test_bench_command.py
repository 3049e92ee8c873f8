"""`open-bench` from the command line: what it refuses, and that it starts light."""

from __future__ import annotations

import socket
import subprocess
import sys

import pytest

from recognizer.bench.command import main
from recognizer.bench.serve import _address


def ended(capsys, *words):
    """Run the command; returns its exit code and what it said."""
    with pytest.raises(SystemExit) as leaving:
        main([str(word) for word in words])
    return leaving.value.code, capsys.readouterr().err


def test_help_loads_no_server_no_array_and_no_database():
    code = (
        "import sys\nfrom recognizer.bench.command import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "print([m for m in ('numpy', 'fastapi', 'sqlalchemy', 'h5py') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"
    assert "--web-port" in run.stdout


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--token", "short"], 2, "12 or more"),
        (["--token", "a;b=c, with spaces in it"], 2, "12 or more"),
        (["--port", "touch:?rate=0"], 2, "give 1 to 500"),
        (["--port", "file:none.h5"], 2, "none.h5"),
    ],
)
def test_what_cannot_be_met_is_refused_with_the_way_out(
    words, code, said, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    got, message = ended(capsys, *words, "--web-port", 0)
    assert (got, "Traceback" in message) == (code, False)
    assert said in message


def test_a_port_of_the_page_that_is_taken(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.create_server(("127.0.0.1", 0)) as other:
        code, message = ended(capsys, "--web-port", other.getsockname()[1])
    assert code == 2
    assert "--web-port" in message


def test_the_address_that_is_printed():
    assert _address("127.0.0.1", 8080, "") == "open-bench: http://127.0.0.1:8080/"
    assert _address("fd00::1", 80, "secret") == "open-bench: http://[fd00::1]:80/?token=secret"
    for everywhere in ("::", "0.0.0.0"):
        told = _address(everywhere, 80, "secret")
        assert told.startswith("open-bench: http://")
        assert everywhere not in told.split(":80/")[0].split("//")[1].strip("[]").split()
