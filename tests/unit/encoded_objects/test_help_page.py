"""The page of --help is typer's own, found without the imports that it does not need."""

import sys

import pytest
import typer
from typer.testing import CliRunner

from encoded_objects.base.console import application, help_page, run

app = application()
part = application()
app.add_typer(part, name="part")


@app.callback()
def head(loud: bool = False) -> None:
    """Do things."""


@app.command()
def one(number: int = typer.Argument(help="How [bold]many[/].")) -> None:
    """Do one."""


@part.command()
def two(name: str = "x") -> None:
    """Do two."""


@part.command()
def three() -> None:
    """Do three."""


@pytest.mark.parametrize(
    "words",
    [["--help"], ["-h"], ["one", "--help"], ["part", "-h"], ["part", "two", "--help"],
     ["--loud", "one", "-h"], ["part", "two", "--name", "y", "--help"]],
)  # fmt: skip
def test_page_is_that_of_typer(words, capsys):
    expected = CliRunner().invoke(app, words, prog_name="do")
    assert run("do", lambda _: app, words) == expected.exit_code == 0
    assert capsys.readouterr().out == expected.output


def test_errors_beside_help_are_told(capsys):
    assert run("do", lambda _: app, ["four", "--help"]) == 2
    assert "four" in capsys.readouterr().err


def test_stand_ins_are_gone_afterwards(monkeypatch):
    for name in (*help_page.UNUSED, "typer.rich_utils"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(help_page.UNUSED, "rich.markdown", ())  # typer asks for a name: refused
    help_page._import_page()
    assert not set(help_page.UNUSED) & set(sys.modules)
    from rich.markdown import Markdown

    assert Markdown("*x*").parsed
