"""A command: its process, its help page, its options, declared once for it and for Python."""

import json
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest

from encoded_objects.base import console
from encoded_objects.base.errors import UsageError, require
from encoded_objects.base.options import Application, Argument, Json, Option, Options, command
from encoded_objects.base.output import write, write_json

STREAMS = """
import sys
from encoded_objects.base import console
from encoded_objects.base.options import Application, Json, command

app = Application()

def fail_to_map():
    raise ImportError("libX.so: failed to map segment from shared object")

@command(app)
def act(as_json: Json = False):
    print("an answer")
    sys.stderr.write("a message\\n")
    return {}

console.main("do", lambda _: app, bare=True)
"""


CLEAN = {"PATH": "", "PYTHONPATH": ":".join(sys.path)}


@pytest.mark.parametrize(
    ("result", "redirect", "code", "out", "err"),
    [
        ("0", "2>&-", 0, "an answer\n", ""),
        ("0", ">&-", 0, "", "a message\n"),
        ("open('made', 'x').fileno() < 3", "<&- >&- 2>&-", 0, "", ""),
        ("0", ">/dev/full", 1, "", "cannot write: No space left on device"),
        ("0", "--json >/dev/full", 1, "", "cannot write: No space left on device"),
        ("open('gone/made', 'x')", "", 2, "an answer", "cannot write 'gone/made': No such file"),
        ("open('/dev/full', 'w', 1).write('x\\n')", "", 1, "an answer", "cannot write: No space"),
        ("bytearray(1 << 62)", "", 1, "an answer", "the memory is used up"),
        ("fail_to_map()", "", 1, "an answer", "the memory is used up"),
        ("bytearray(1 << 62)", "--json", 1, '"exit_code": 1', "a message\n"),
    ],
)
def test_streams_that_are_closed_or_full(result, redirect, code, out, err, tmp_path):
    (tmp_path / "do.py").write_text(STREAMS.format(result))
    done = subprocess.run(
        f"{sys.executable} do.py {redirect}", shell=True, cwd=tmp_path, capture_output=True,
        text=True, env=CLEAN,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    assert out in done.stdout
    assert err in done.stderr
    assert "Traceback" not in done.stderr


def test_a_module_is_loaded_whole_before_an_interruption_counts(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    text = "import signal\nsignal.raise_signal(signal.SIGINT)\nwhole = 1\n"
    (tmp_path / "slow_module.py").write_text(text)
    with pytest.raises(KeyboardInterrupt):
        require("slow_module", extra="cad", purpose="this")
    assert sys.modules["slow_module"].whole
    with pytest.raises(KeyboardInterrupt):  # as before
        signal.raise_signal(signal.SIGINT)


app = Application(help="Do things.", version_of="do")
part = Application()
app.groups["part"] = part


@command(app)
def one(number: Annotated[int, Argument("How [bold]many[/].")]) -> int:
    """Do one."""
    return number


@command(app)
def four(sort: Annotated[str, Option("Which.")] = "", as_json: Json = False) -> int:
    """Do four."""
    write_json({"sort": sort}) if as_json else write(sort)
    return 0


@command(part)
def five(as_json: Json = False) -> int:
    """Do five."""
    write_json("five") if as_json else write("five")
    return 0


@pytest.mark.parametrize(
    ("words", "code", "out"),
    [
        (["--json", "four", "--sort", "x"], 0, '"sort": "x"'),
        (["--json", "part", "five"], 0, '"five"'),
        (["--json", "part", "five", "--json"], 0, '"five"'),
        (["--json", "--version"], 0, '"version"'),
        (["--json"], 2, "no command is named"),
        (["--json", "part"], 2, "Missing command"),
        (["--json", "six"], 2, "No such command 'six'"),
        (["--json", "one", "7"], 2, "No such option: --json"),
        ([], 2, "Do things."),
    ],
)
def test_json_before_a_command_is_the_commands(words, code, out, capsys):
    assert console.run("do", lambda _: app, words) == code
    said = capsys.readouterr()
    assert out in said.out
    assert said.err == ""
    assert not words or json.loads(said.out)


@dataclass(frozen=True, slots=True)
class CookOptions(Options):
    """What is cooked, and how."""

    dish: Annotated[Path | None, Argument("What to cook.", "DISH")] = None
    heat: Annotated[str, Option("How hot.", choices=("low", "medium", "high"))] = "low"
    pots: Annotated[int, Option("How many pots.", "N", names=("-p", "--pots"), least=1)] = 2
    keep_warm: Annotated[bool, Option("Go on at low heat.")] = False
    as_json: Json = False

    def check(self) -> None:
        if self.keep_warm and self.heat != "low":
            raise UsageError("--keep-warm needs low heat")


taken: list[object] = []
kitchen = Application()


@command(kitchen, version_of="do", parts=lambda: {"stove": "gas"})
def cook(options: CookOptions, salt: Annotated[float, Option("Grams.")] = 1.5) -> int:
    """Cook."""
    taken.append((options, salt))
    return 0 if options.dish else 1


def test_checks_hold_for_python_too():
    with pytest.raises(UsageError, match="give low, medium or high"):
        CookOptions(heat="hot")
    with pytest.raises(UsageError, match="needs low heat"):
        CookOptions(heat="high", keep_warm=True)


@pytest.mark.parametrize(
    "words",
    [["soup"], ["--pots=4", "soup", "--salt", ".5"], ["-p", "7", "--keep-warm", "--json"],
     ["--heat", "low", "--heat", "high"], ["-p", "3", "soup", "--heat", "high"], []],
)  # fmt: skip
def test_a_plain_line_is_read_as_typer_reads_it(words):
    taken.clear()
    kitchen.read_plain(words)()
    kitchen.for_typer()(words, standalone_mode=False)()
    assert taken[0] == taken[1]


@pytest.mark.parametrize(
    "words",
    [["soup", "stew"], ["--pots", "0"], ["--pots", "many"], ["--pots", "1" * 5000], ["--nope"],
     ["-p3"], ["--heat"], ["--json=yes"], ["--salt", "-1"], ["--", "soup"], ["--keep-war"]],
)  # fmt: skip
def test_all_else_is_left_to_typer(words):
    assert kitchen.read_plain(words) is None
