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

HELP_OPTIONS = ("-h", "--help")

Work = Callable[..., int]
Declared = dict[str, tuple[Any, "Option", Any]]  #: parameter -> type, option, default

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

        shown = self._shown(default)
        return TyperOption(*self.typed(name), envvar=self.variable or None, **shown)

    def _shown(self, default: object) -> dict[str, Any]:
        """Return what typer shows and checks of an option and an argument."""
        return {
            "help": self.help, "metavar": self.metavar or "|".join(self.choices) or None,
            "show_default": default not in (None, "", inspect.Parameter.empty),
            "min": self.least, "max": self.most,
        }  # fmt: skip


@dataclass(frozen=True, slots=True)
class Argument(Option):
    """An argument: it is given by its position."""

    def for_typer(self, name: str, default: object) -> Any:  # noqa: ARG002
        """Return the declaration that typer reads."""
        from typer import Argument as TyperArgument

        return TyperArgument(**self._shown(default))


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
_VERSION = Option("Say which version this is.")


@dataclass(frozen=True, slots=True)
class DeclaredCommand:
    """A function that is called by name."""

    work: Work
    declared: Declared
    version_of: str  #: name of the command, which then has the option `--version`
    parts: Callable[[], Mapping[str, str]]  #: what the version says besides
    page: dict[str, Any]  #: help and epilog, in place of the docstring
    instead: Mapping[str, str]  #: option that it does not have -> what to do instead

    def read(self, **given: Any) -> Callable[[], int]:
        """Return the action of a command line, from the values of its options."""
        if given.pop("version", False):
            return partial(_report_version, self.version_of, self.parts, bool(given.get("as_json")))
        values = dict(given)
        for parameter, options in _option_classes(self.work).items():
            chosen = {field.name: values.pop(field.name) for field in fields(options)}
            values[parameter] = options(**chosen)
        for parameter in values.keys() & self.declared.keys():
            _, option, default = self.declared[parameter]
            option.checked(parameter, values[parameter], default)
        return partial(self.work, **values)

    def for_typer(self) -> Callable[..., Callable[[], int]]:
        """Return the function whose signature typer reads."""

        def read(**given: Any) -> Callable[[], int]:
            return self.read(**given)

        signature = [
            inspect.Parameter(
                parameter, inspect.Parameter.KEYWORD_ONLY, default=default,
                annotation=Annotated[kind, option.for_typer(parameter, default)],
            )
            for parameter, (kind, option, default) in self.declared.items()
        ]  # fmt: skip
        read.__signature__ = inspect.Signature(signature)  # type: ignore[attr-defined]
        read.__annotations__ = {one.name: one.annotation for one in signature}
        read.__doc__, read.__name__ = self.work.__doc__, self.work.__name__
        return read


class Application:
    """The commands of a program, or of a group of them.

    Typer's own application is made where typer is needed: for help, and for lines that are not
    plain. It takes a sixth of the start of `recognize-object`.

    Parameters
    ----------
    help, epilog
        Of the page of `--help` of several commands.
    named
        Whether the only command is called by its name.
    version_of
        Name of the program: it gets the options `--version` and `--json`.
    """

    def __init__(
        self,
        *,
        help: str | None = None,  # noqa: A002  typer's word
        epilog: str | None = None,
        named: bool = False,
        version_of: str = "",
    ) -> None:
        self.commands: dict[str, DeclaredCommand] = {}
        self.groups: dict[str, Application] = {}
        self._page: dict[str, Any] = {"help": help, "epilog": epilog}
        self._named = named
        self._version_of = version_of

    @property
    def is_group(self) -> bool:
        """Whether its commands are called by their names."""
        return bool(len(self.commands) > 1 or self.groups or self._named or self._version_of)

    def for_typer(self) -> Typer:
        """Return typer's application."""
        from typer import Typer

        made = Typer(
            add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich",
            context_settings={"help_option_names": list(HELP_OPTIONS)},
            **{name: text for name, text in self._page.items() if text is not None},
        )  # fmt: skip
        if self._version_of:
            made.callback(invoke_without_command=True)(self._head())
        elif self._named:
            made.callback()(lambda: None)
        for name, group in self.groups.items():
            made.add_typer(group.for_typer(), name=name)
        for name, one in self.commands.items():
            made.command(name, **one.page)(one.for_typer())
        return made

    def _head(self) -> Callable[..., None]:
        """Return the function of a line without a command."""
        from typer import Context, Exit

        def head(context: Context, version: bool, as_json: bool) -> None:
            if version:
                _report_version(self._version_of, dict, as_json)
                raise Exit
            if context.invoked_subcommand is None:
                raise UsageError("no command is named")

        given = {"version": _VERSION, "as_json": typing.get_args(Json)[1]}
        head.__annotations__ = {"context": Context} | {
            name: Annotated[bool, option.for_typer(name, default=False)]
            for name, option in given.items()
        }
        head.__defaults__ = (False, False)
        return head

    def with_json_of_command(self, arguments: list[str]) -> list[str]:
        """Return the arguments with a `--json` that stands before a command handed to it."""
        if not self._version_of or arguments[:1] != ["--json"] or {*HELP_OPTIONS} & {*arguments}:
            return arguments
        groups = self.groups
        for place, word in enumerate(arguments[1:], start=2):
            if word not in groups:
                return [*arguments[1:place], "--json", *arguments[place:]]
            groups = groups[word].groups
        return arguments

    def read_plain(self, arguments: Sequence[str]) -> Callable[[], int] | None:
        """Return the action of a plain command line; None: it is left to typer, with every error.

        Plain is a line of known options with sound values.
        """
        words = list(arguments)
        if self.is_group:
            if not words or words[0] not in self.commands:
                return None
            command = self.commands[words.pop(0)]
        else:
            [command] = self.commands.values()
        values = _plain_values(command.declared, words)
        return None if values is None else command.read(**values)


def command(
    app: Application,
    name: str | None = None,
    *,
    help: str | None = None,  # noqa: A002  typer's word
    epilog: str | None = None,
    version_of: str = "",
    parts: Callable[[], Mapping[str, str]] = dict,
    instead: Mapping[str, str] | None = None,
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
    instead
        Options that other commands have and this one does not: what to do instead.
    """

    def register(work: Work) -> Work:
        declared = _declared(work)
        if version_of:
            declared = declared | {"version": (bool, _VERSION, False)}
        page = {"help": help, "epilog": epilog}
        app.commands[name or work.__name__.replace("_", "-")] = DeclaredCommand(
            work, declared, version_of, parts, page, instead or {}
        )
        return work

    return register


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
