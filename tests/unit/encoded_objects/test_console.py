"""A command's process: what its start leaves out, its help page, and how it ends."""

import json
import subprocess
import sys
from typing import Annotated

import pytest
from typer.testing import CliRunner

from encoded_objects.base import console
from encoded_objects.base.options import Argument, Option, command

PROGRAM = """
import gc, json, os, sys
from encoded_objects.base import console
from encoded_objects.base.options import command

app = console.application()

class Cycle:
    def __init__(self): self.own = self
    def __del__(self): print("walked")

@command(app)
def act():
    state = [gc.get_threshold()[0], os.environ["PYDANTIC_DISABLE_PLUGINS"]]
    print(json.dumps(state))
    Cycle()
    return 3

console.main("do", lambda _: app, [], bare=True)
"""


def process(program, **environment):
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True,
        env={"PATH": "", "PYTHONPATH": ":".join(sys.path), **environment},
    )  # fmt: skip
    assert done.stderr == ""
    return done


def test_a_command_does_not_walk_through_what_stays():
    done = process(PROGRAM)
    assert done.returncode == 3
    threshold, plugins = json.loads(done.stdout)  # the cycle is left to the end of the process
    assert threshold > 10_000
    assert plugins == "__all__"


def test_plugins_that_somebody_asks_for_are_left():
    done = process(PROGRAM, PYDANTIC_DISABLE_PLUGINS="one")
    assert json.loads(done.stdout)[1] == "one"


app = console.application(help="Do things.", version_of="do")
part = console.application()
app.groups["part"] = part


@command(app)
def one(number: Annotated[int, Argument("How [bold]many[/].")]) -> int:
    """Do one."""
    return number


@command(part)
def two(name: Annotated[str, Option("Whose.")] = "x") -> int:
    """Do two."""
    return len(name)


@command(part)
def three() -> int:
    """Do three."""
    return 3


@pytest.mark.parametrize(
    "words",
    [["--help"], ["-h"], ["one", "--help"], ["part", "-h"], ["part", "two", "--help"],
     ["--json", "one", "-h"], ["part", "two", "--name", "y", "--help"]],
)  # fmt: skip
def test_page_is_that_of_typer(words, capsys):
    expected = CliRunner().invoke(app.for_typer(), words, prog_name="do")
    assert console.run("do", lambda _: app, words) == expected.exit_code == 0
    assert capsys.readouterr().out == expected.output


def test_errors_beside_help_are_told(capsys):
    assert console.run("do", lambda _: app, ["four", "--help"]) == 2
    assert "four" in capsys.readouterr().err


def test_stand_ins_are_gone_afterwards(monkeypatch):
    for name in (*console.UNUSED_BY_HELP, "typer.rich_utils"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(console.UNUSED_BY_HELP, "rich.markdown", ())  # typer asks for it
    console._import_help_page()
    assert not set(console.UNUSED_BY_HELP) & set(sys.modules)
    from rich.markdown import Markdown

    assert Markdown("*x*").parsed
