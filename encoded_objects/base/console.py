"""How every command starts and ends: exit codes of errors and signals, the page of `--help`.

A command is an `Application` (`options`), which reads the arguments and returns an action; the
action does the work and returns the exit code, or raises an `EncodedObjectsError`.
"""

from __future__ import annotations

import gc
import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType, ModuleType
from typing import TYPE_CHECKING, Any, NoReturn

from encoded_objects.base.options import HELP_OPTIONS, Application

if TYPE_CHECKING:
    from encoded_objects.base.errors import EncodedObjectsError

DONE, FAILED, BAD_INPUT, DEVICE, DATABASE, INTERRUPTED = 0, 1, 2, 3, 4, 130

Action = Callable[[], int]
"""What a command does once its options are read; returns the exit code."""

Chosen = Callable[[list[str]], Application]
"""Arguments -> the application that reads them; heavy parts load when it is called."""

MATRIX_LIBRARIES = ("OMP", "OPENBLAS", "MKL")

#: What typer's help page imports and no page of ours uses: names that it imports, by module.
UNUSED_BY_HELP = {"rich.markdown": ("Markdown",), "rich.traceback": ("Traceback",)}

GARBAGE = (50_000, 20, 100)
"""New objects between collections of cycles, and younger collections between older ones.

Imports make 300,000 objects that stay; at Python's 700 they are walked through again and again.
"""


def main(
    name: str,
    chosen: Chosen,
    arguments: Sequence[str] | None = None,
    *,
    bare: bool = False,
    advice: str = "",
) -> NoReturn:
    """Run a command and leave with its exit code.

    Parameters
    ----------
    name
        As a person calls it.
    chosen
        Returns the application for the arguments.
    arguments
        In place of the process's own.
    bare
        Whether the command does something without any argument; otherwise it shows its help.
    advice
        Follows "interrupted" ("; go on with --resume").
    """
    signal.signal(signal.SIGTERM, _end)
    if signal.getsignal(signal.SIGHUP) == signal.SIG_DFL:  # of a terminal that closes; not nohup
        signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))
    _open_closed_streams()
    _spare_start()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a name the terminal cannot show
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = run(name, chosen, given, bare=bare)
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one would end us without our code
        sys.stderr.write(f"\n{name}: interrupted{advice}\n")
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, as in `| head`
        code = FAILED
    try:
        sys.stdout.flush()
    except OSError:  # what is left of it would be written once more at the end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    gc.freeze()  # the process ends: what still refers to itself is not walked through once more
    sys.exit(code)


def run(name: str, chosen: Chosen, arguments: list[str], *, bare: bool = False) -> int:
    """Run one command; returns its exit code. Errors are reported, not raised."""
    from encoded_objects.base import output
    from encoded_objects.base.errors import (
        EncodedObjectsError,
        UsageError,
        exit_code_of_write,
        without_touch,
    )

    as_json = "--json" in arguments
    unsaid = not (arguments or bare)
    app = None
    try:
        app = chosen(arguments)
        arguments = app.with_json_of_command(arguments)
        unsaid = unsaid or arguments in [[group] for group in app.groups]
        asked = [*arguments, "--help"] if unsaid else arguments
        if any(word in HELP_OPTIONS for word in asked):
            action = _show_help(app, name, asked)
        else:
            action = app.read_plain(asked) or app.for_typer()(
                asked, prog_name=name, standalone_mode=False
            )
        code = action() if callable(action) else int(action or 0)
        sys.stdout.flush()
        return BAD_INPUT if unsaid else code
    except EncodedObjectsError as error:
        code, problem = error.exit_code, error
        if isinstance(error, UsageError):
            code, problem = BAD_INPUT, _misuse(error, name, app, arguments)
    except BrokenPipeError:
        raise
    except ModuleNotFoundError as error:
        absent = without_touch(error, name)
        if absent is None:
            raise
        code, problem = absent.exit_code, absent
    except OSError as error:
        what = f"cannot write '{error.filename}'" if error.filename else "cannot write"
        problem = EncodedObjectsError(
            f"{what}: {error.strerror or error}", fix="check folder, space and rights"
        )
        code = exit_code_of_write(error)
    except (MemoryError, ImportError) as error:
        if isinstance(error, ImportError) and "failed to map segment" not in str(error):
            raise
        problem = EncodedObjectsError(
            "the memory is used up", fix="end other programs, allow more, or do less at once"
        )
        code = FAILED
    except Exception as error:
        typer = sys.modules.get("typer")
        if typer is not None and isinstance(error, typer.Exit):
            return BAD_INPUT if unsaid else int(error.exit_code)
        if typer is None or not isinstance(error, typer.BadParameter.__mro__[1]):
            raise
        code, problem = BAD_INPUT, _misuse(error, name, app, arguments)
    problem.exit_code = code
    try:
        output.error(problem, as_json=as_json)
        sys.stdout.flush()
    except OSError:
        output.error(problem, as_json=False)
    return code


def one_thread() -> None:
    """Let matrix libraries use one thread, unless the user says otherwise; call before numpy loads.

    Matrices of a touch are small: several threads only wait for each other.
    """
    for library in MATRIX_LIBRARIES:
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")


@contextmanager
def interruption() -> Iterator[threading.Event]:
    """Yield an event that Ctrl-C sets; a second Ctrl-C interrupts at once."""
    interrupted = threading.Event()

    def note(_number: int, _frame: FrameType | None) -> None:
        if interrupted.is_set():
            raise KeyboardInterrupt
        interrupted.set()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)


def _open_closed_streams() -> None:
    """Open the null device for standard streams that are closed; a file would take their place."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = open(os.devnull, mode, encoding="utf-8")  # noqa: SIM115  open to the end
            setattr(sys, name, stream)


def _spare_start() -> None:
    """Leave out of start-up what no command needs."""
    gc.set_threshold(*GARBAGE)
    # Each installed package is asked for plug-ins of pydantic; none of ours needs one.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


def _misuse(
    error: Exception, name: str, app: Application | None, arguments: list[str]
) -> EncodedObjectsError:
    """Return what is wrong with an option, with the option's name and the command's."""
    from encoded_objects.base.errors import EncodedObjectsError

    words, inner, meant = [name], app, None
    for word in arguments:
        if inner is None or not (inner.is_group and word in inner.commands | inner.groups):
            break
        words.append(word)
        meant, inner = inner.commands.get(word), inner.groups.get(word)
    called = getattr(getattr(error, "ctx", None), "command_path", "") or " ".join(words)
    if getattr(error, "param", None) is None:  # a message of our own, which names it
        cause = str(getattr(error, "message", getattr(error, "cause", error)))
    else:
        message = str(getattr(error, "format_message", error.__str__)())
        cause = message.replace("Invalid value for ", "").removesuffix(".")
    instead = meant.instead.get(getattr(error, "option_name", "")) if meant else None
    return EncodedObjectsError(cause, fix=instead or f"see {called} --help")


def _end(number: int, _frame: FrameType | None) -> NoReturn:
    """Leave on a request to end, so that what is half done is taken back."""
    sys.exit(128 + number)


def _show_help(app: Application, name: str, arguments: list[str]) -> Any:
    """Run the command that the arguments name: its own `--help` shows its page.

    To find a subcommand typer reads the options of all groups above it, and imports pydantic for
    that, a third of the time of a page.
    """
    from typer.main import get_command

    command: Any = get_command(app.for_typer())
    words, rest = [name], list(arguments)
    while rest and rest[0] in getattr(command, "commands", {}):
        command = command.commands[rest[0]]
        words.append(rest.pop(0))
    _import_help_page()
    named = {"prog_name": " ".join(words), "help_option_names": list(HELP_OPTIONS)}
    return command.main(args=rest, standalone_mode=False, **named)


def _import_help_page() -> None:
    """Import typer's page without its parser of Markdown, a fifth of the time of a page."""
    stand_ins = {}
    for module, names in UNUSED_BY_HELP.items():
        if module not in sys.modules:
            stand_in = ModuleType(module)
            for one in names:
                setattr(stand_in, one, type(one, (), {}))
            stand_ins[module] = stand_in
    sys.modules.update(stand_ins)
    try:
        import typer.rich_utils  # noqa: F401
    except ImportError:  # of a typer that asks them for more: it imports them itself
        pass
    finally:
        for module in stand_ins:
            del sys.modules[module]
