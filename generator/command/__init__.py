"""`encode-object`: from a spec to printable parts and a registered object.

::

    __init__.py   which command, what an error or an interruption means for the exit code
    encode.py     encode-object SPEC.yaml...
    tools.py      encode-object init | schema | printers
    objects.py    encode-object list | show | retire | export | import
    report.py     results and errors as text and as JSON; object_report.py: of registered objects
    progress.py   a bar on a terminal

Results go to stdout, progress and messages to stderr. Exit codes: 0 done, 1 could not be
written, 2 bad input, 4 database, 130 interrupted. Nothing heavy is imported before it is
needed: `encode-object --help` loads no array, no geometry and no database.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType
from typing import NoReturn

TOOLS = ("init", "schema", "printers")
OBJECTS = ("list", "show", "retire", "export", "import")
WRITE_FAILED = 1
BAD_INPUT = 2
INTERRUPTED = 130

Action = Callable[[], int]
"""What a command does once its options are read; returns the exit code."""


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `encode-object` and leave with its exit code."""
    signal.signal(signal.SIGTERM, _end)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a name the terminal cannot show
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = run(given)
        sys.stdout.flush()
    except KeyboardInterrupt:
        sys.stderr.write("\nencode-object: interrupted\n")
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, as in `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = WRITE_FAILED
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run one command; returns its exit code. Errors are reported, not raised."""
    from typer import BadParameter, Exit

    from encoded_objects.errors import MissingExtraError
    from generator.command import report
    from generator.errors import GeneratorError

    usage_error: type[Exception] = BadParameter.__mro__[1]  # of every misused option
    as_json = "--json" in arguments
    try:
        action = _chosen(arguments)
        return action() if callable(action) else int(action or 0)
    except Exit as leaving:
        return leaving.exit_code
    except (GeneratorError, MissingExtraError) as error:
        report.error(error, as_json=as_json)
        return error.exit_code
    except usage_error as error:
        message = str(getattr(error, "message", error))
        named = arguments[0] if arguments[:1] and arguments[0] in TOOLS + OBJECTS else ""
        fix = f"see encode-object {named}"
        report.error(GeneratorError(message, fix=f"{fix.strip()} --help"), as_json=as_json)
        return BAD_INPUT
    except BrokenPipeError:
        raise
    except OSError as error:
        what = f"cannot write '{error.filename}'" if error.filename else "cannot write"
        cause = f"{what}: {error.strerror or error}"
        report.error(GeneratorError(cause, fix="check space and rights"), as_json=as_json)
        return WRITE_FAILED


def _chosen(arguments: list[str]) -> Action | int | None:
    """Read the options of the command that is meant; a spec file needs no command's name."""
    if arguments[:1] and arguments[0] in TOOLS:
        from generator.command.tools import app
    elif arguments[:1] and arguments[0] in OBJECTS:
        from generator.command.objects import app
    else:
        from generator.command.encode import app
    found: Action | int | None = app(
        arguments or ["--help"], prog_name="encode-object", standalone_mode=False
    )
    return found if arguments else BAD_INPUT


def _end(number: int, _frame: FrameType | None) -> NoReturn:
    """Leave on a request to end, so that what is half done is taken back."""
    sys.exit(128 + number)
