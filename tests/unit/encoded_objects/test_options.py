"""An option is declared once: name, help, default, checks; for the command and for Python."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest

from encoded_objects.base import console
from encoded_objects.base.errors import UsageError
from encoded_objects.base.options import Argument, Json, Option, Options, command


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
app = console.application()


@command(app, version_of="do", parts=lambda: {"stove": "gas"})
def cook(options: CookOptions, salt: Annotated[float, Option("Grams.")] = 1.5) -> int:
    """Cook."""
    taken.append((options, salt))
    return 0 if options.dish else 1


def run(*words: str) -> int:
    taken.clear()
    return console.run("do", lambda _: app, list(words), bare=True)


def test_fields_and_parameters_are_options():
    assert run("soup", "--heat", "high", "-p", "3", "--json", "--salt", "2") == 0
    assert taken == [(CookOptions(Path("soup"), "high", 3, as_json=True), 2.0)]
    assert run() == 1
    assert taken == [(CookOptions(), 1.5)]


def test_help_has_names_ranges_and_defaults(capsys):
    assert run("--help") == 0
    page = capsys.readouterr().out
    for words in ("DISH", "low|medium|high", "[default: low]", "--pots", "[x>=1]", "--keep-warm",
                  "[default: 1.5]", "--version"):  # fmt: skip
        assert words in page
    assert "--no-keep-warm" not in page
    assert "None" not in page


@pytest.mark.parametrize(
    ("words", "message"),
    [(["--heat", "hot"], "--heat hot: give low, medium or high"),
     (["--keep-warm", "--heat", "high"], "--keep-warm needs low heat"),
     (["--pots", "0"], "'-p' / '--pots': Input should be greater than or equal to 1")],
)  # fmt: skip
def test_misuse(words, message, capsys):
    assert run(*words) == console.BAD_INPUT
    assert capsys.readouterr().err == f"error: {message}\n  fix: see do --help\n"
    assert not taken


def test_checks_hold_for_python_too():
    with pytest.raises(UsageError, match="give low, medium or high"):
        CookOptions(heat="hot")
    with pytest.raises(UsageError, match="needs low heat"):
        CookOptions(heat="high", keep_warm=True)


def test_version_needs_nothing_else(capsys):
    assert run("--version", "--heat", "hot") == 0
    assert capsys.readouterr().out.endswith("stove: gas\n")
    assert not taken


@pytest.mark.parametrize(
    "words",
    [["soup"], ["--pots=4", "soup", "--salt", ".5"], ["-p", "7", "--keep-warm", "--json"],
     ["--heat", "low", "--heat", "high"], []],
)  # fmt: skip
def test_a_plain_line_is_read_as_typer_reads_it(words):
    taken.clear()
    app.read_plain(words)()
    app.for_typer()(words, standalone_mode=False)()
    assert taken[0] == taken[1]


@pytest.mark.parametrize(
    "words",
    [["soup", "stew"], ["--pots", "0"], ["--pots", "many"], ["--pots", "1" * 5000], ["--nope"],
     ["-p3"], ["--heat"], ["--json=yes"], ["--salt", "-1"], ["--", "soup"], ["--keep-war"]],
)  # fmt: skip
def test_all_else_is_left_to_typer(words):
    assert app.read_plain(words) is None
