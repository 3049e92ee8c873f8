"""Options of commands, each declared once.

An option is a parameter of the command's function, or a field of an `Options` class that the
function takes; its annotation carries the help, its default is the option's::

    @command(app)
    def export(file: Annotated[Path, Argument("The file to write.", "FILE")],
               overlay: Annotated[str, Option("Elastic overlay.", choices=("tab", "pad"))] = "",
               as_json: Json = False) -> int:

From that follow the name (`--overlay`), the page of `--help`, what typer reads, and the checks,
which hold for Python callers of an `Options` class too. The function returns the exit code.
"""

from __future__ import annotations

import inspect
import os
import re
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from encoded_objects.base.errors import UsageError

if TYPE_CHECKING:
    from typer import Typer

Work = Callable[..., int]
Declared = dict[str, tuple[Any, "Option", Any]]  #: parameter -> type, option, default

_COMMANDS: dict[Typer, dict[str, tuple[Declared, Callable[..., Any]]]] = {}
_NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)(e-?\d{1,2})?", re.ASCII)


@dataclass(frozen=True, slots=True)
class Option:
    """An option that is given by name; a default other than None or "" is shown in the help."""

    help: str
    metavar: str = ""  #: stands for the value in the help; of choices "tab|pad"
    names: tuple[str, ...] = ()  #: as they are typed; by default --parameter-name
    choices: tuple[str, ...] = ()  #: allowed values, besides the default
    least: float | None = None  #: of a number
    most: float | None = None
    variable: str = ""  #: of the environment, read where the option is not given

    def checked(self, name: str, value: object, default: object) -> None:
        """Refuse a value that is no choice; raises `UsageError` with the choices."""
        if self.choices and value not in self.choices and value != default:
            *others, last = self.choices
            allowed = f"{', '.join(others)} or {last}" if others else last
            raise UsageError(f"{self.typed(name)[-1]} {value}: give {allowed}")

    def typed(self, name: str) -> tuple[str, ...]:
        """Return the names under which a parameter is typed."""
        return self.names or (f"--{name.rstrip('_').replace('_', '-')}",)

    def for_typer(self, name: str, default: object) -> Any:
        """Return the declaration that typer reads."""
        from typer import Option as TyperOption

        shown = default not in (None, "", inspect.Parameter.empty)
        metavar = self.metavar or "|".join(self.choices) or None
        return TyperOption(
            *self.typed(name), help=self.help, metavar=metavar, show_default=shown,
            min=self.least, max=self.most, envvar=self.variable or None,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Argument(Option):
    """An argument: it is given by its position."""

    def for_typer(self, name: str, default: object) -> Any:  # noqa: ARG002
        """Return the declaration that typer reads."""
        from typer import Argument as TyperArgument

        shown = default not in (None, "", inspect.Parameter.empty)
        return TyperArgument(
            help=self.help, metavar=self.metavar or None, show_default=shown,
            min=self.least, max=self.most,
        )  # fmt: skip


class Options:
    """Base of a dataclass whose fields are options."""

    __slots__ = ()

    def __post_init__(self) -> None:
        """Check every option by itself, and all together."""
        own: Any = type(self)
        for name, (_, option, default) in _declared(own).items():
            option.checked(name, getattr(self, name), default)
        self.check()

    def check(self) -> None:
        """Refuse options that exclude each other; raises `UsageError` with what to give."""


Json = Annotated[bool, Option("One JSON object on stdout, also for errors.", names=("--json",))]
Replace = Annotated[bool, Option("Replace files that are there.")]


def command(
    app: Typer,
    name: str | None = None,
    *,
    help: str | None = None,  # noqa: A002  typer's word
    epilog: str | None = None,
    version_of: str = "",
    parts: Callable[[], Mapping[str, str]] = dict,
) -> Callable[[Work], Work]:
    """Make a function a command of an application.

    Parameters
    ----------
    name
        Of the subcommand; that of the function by default.
    help, epilog
        Of the page of `--help`; the docstring by default.
    version_of
        Name of the command: it gets the option `--version`.
    parts
        Returns what the version says besides, as which kernels are in use.
    """

    def register(work: Work) -> Work:
        declared, classes = _declared(work), _option_classes(work)

        def read(**given: Any) -> Callable[[], int]:
            if given.pop("version", False):
                return partial(_report_version, version_of, parts, bool(given.get("as_json")))
            values = dict(given)
            for parameter, options in classes.items():
                chosen = {field.name: values.pop(field.name) for field in fields(options)}
                values[parameter] = options(**chosen)
            for parameter in values.keys() & declared.keys():
                _, option, default = declared[parameter]
                option.checked(parameter, values[parameter], default)
            return partial(work, **values)

        if version_of:
            version = Option("Say which version this is.")
            declared = declared | {"version": (bool, version, False)}
        signature = [
            inspect.Parameter(
                parameter, inspect.Parameter.KEYWORD_ONLY, default=default,
                annotation=Annotated[kind, option.for_typer(parameter, default)],
            )
            for parameter, (kind, option, default) in declared.items()
        ]  # fmt: skip
        read.__signature__ = inspect.Signature(signature)  # type: ignore[attr-defined]
        read.__annotations__ = {one.name: one.annotation for one in signature}
        read.__doc__, read.__name__ = work.__doc__, work.__name__
        _COMMANDS.setdefault(app, {})[name or work.__name__.replace("_", "-")] = declared, read
        app.command(name, help=help, epilog=epilog)(read)
        return work

    return register


def read_plain(app: Typer, arguments: Sequence[str]) -> Callable[[], int] | None:
    """Return the action of a plain command line; None: it is left to typer, with every error.

    To read options typer imports pydantic, a quarter of the start of `recognize-object`. Plain is
    a line of known options with sound values.
    """
    commands, words = _COMMANDS.get(app, {}), list(arguments)
    if len(app.registered_commands) > 1 or app.registered_groups or app.registered_callback:
        if not words or words[0] not in commands:
            return None
        declared, read = commands[words.pop(0)]
    elif len(commands) == 1:
        [(declared, read)] = commands.values()
    else:
        return None
    values = _plain_values(declared, words)
    if values is None:
        return None
    action: Callable[[], int] = read(**values)
    return action


def _plain_values(declared: Declared, words: list[str]) -> dict[str, Any] | None:
    """Return the values of a command line; None where it is not plain."""
    values: dict[str, Any] = {name: default for name, (_, _, default) in declared.items()}
    given: dict[str, list[str]] = {}
    places = [name for name, (_, option, _) in declared.items() if isinstance(option, Argument)]
    names = {
        typed: name for name, (_, option, _) in declared.items()
        if name not in places for typed in option.typed(name)
    }  # fmt: skip
    rest = []
    while words:
        word = words.pop(0)
        typed, equals, text = word.partition("=") if word.startswith("--") else (word, "", "")
        if not word.startswith("-"):
            rest.append(word)
        elif typed not in names or (bool(equals) and declared[names[typed]][0] is bool):
            return None
        elif declared[names[typed]][0] is bool:
            values[names[typed]] = True
        else:
            if not equals and (not words or words[0].startswith("-")):
                return None
            given.setdefault(names[typed], []).append(text if equals else words.pop(0))
    for name in places:
        many = _plain_type(declared[name][0])[1]
        if rest:
            given[name], rest = (rest, []) if many else (rest[:1], rest[1:])
    if rest:
        return None
    for name, (kind, option, default) in declared.items():
        if name in given:
            single, many = _plain_type(kind)
            found = [_plain_value(single, option, text) for text in given[name]]
            if None in found:
                return None
            values[name] = found if many else found[-1]
        elif default is inspect.Parameter.empty or os.environ.get(option.variable or " "):
            return None
    return values


def _plain_type(kind: Any) -> tuple[Any, bool]:
    """Return the type of one value, and whether there may be several."""
    if isinstance(kind, types.UnionType):
        kind = next(one for one in typing.get_args(kind) if one is not type(None))
    many = typing.get_origin(kind) is list
    return (typing.get_args(kind)[0] if many else kind), many


def _plain_value(kind: Any, option: Option, text: str) -> Any:
    """Return a value of a type; None where typer has to say what is wrong with it."""
    if kind is str:
        return text
    if kind is Path:
        return Path(text) if text else None
    if kind not in (int, float) or len(text) > 20 or not _NUMBER.fullmatch(text):
        return None
    if kind is int and not text.removeprefix("-").isdecimal():
        return None
    value = kind(text)
    low, high = option.least, option.most
    return (
        None if (low is not None and value < low) or (high is not None and value > high) else value
    )


def _report_version(name: str, parts: Callable[[], Mapping[str, str]], as_json: bool) -> int:
    from encoded_objects.base import output

    output.version(name, as_json=as_json, **parts())
    return 0


def _option_classes(work: Work) -> dict[str, type[Any]]:
    """Return the parameters of a function that are classes of options."""
    hints = typing.get_type_hints(work)
    return {
        name: kind for name, kind in hints.items()
        if name != "return" and isinstance(kind, type) and issubclass(kind, Options)
    }  # fmt: skip


@cache
def _declared(source: Any) -> Declared:
    """Return type, option and default of each option of a function or a class, in order."""
    hints = typing.get_type_hints(source, include_extras=True)
    found: Declared = {}
    for name, parameter in inspect.signature(source).parameters.items():
        kind = hints[name]
        if isinstance(kind, type) and is_dataclass(kind):
            found |= _declared(kind)
            continue
        kind, *marks = typing.get_args(kind)
        found[name] = (kind, marks[0], parameter.default)
    return found
