"""How a command ends: what a signal, a closed pipe or a misused option means for the exit code."""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType
from typing import NoReturn

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def leave(
    name: str,
    run: Callable[[list[str]], int],
    arguments: Sequence[str] | None,
    advice: str = "",
) -> NoReturn:
    """Run a command and leave with its exit code; `advice` follows an interruption."""
    signal.signal(signal.SIGTERM, _end)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a name the terminal cannot show
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = run(given)
        sys.stdout.flush()
    except KeyboardInterrupt:
        sys.stderr.write(f"\n{name}: interrupted{advice}\n")
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, as in `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = FAILED
    sys.exit(code)


def misuse(error: Exception) -> str:
    """Return what is wrong with an option, with the option's name."""
    if getattr(error, "param", None) is None:  # a message of our own, which names it
        return str(getattr(error, "message", error))
    told = str(getattr(error, "format_message", error.__str__)())
    return told.replace("Invalid value for ", "").removesuffix(".")


def unwritten(error: OSError) -> str:
    """Return what could not be written, and why."""
    what = f"cannot write '{error.filename}'" if error.filename else "cannot write"
    return f"{what}: {error.strerror or error}"


def _end(number: int, _frame: FrameType | None) -> NoReturn:
    """Leave on a request to end, so that what is open is closed."""
    sys.exit(128 + number)
