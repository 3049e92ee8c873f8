"""The root of every error that a person can cause; each package draws its own tree below it.

::

    EncodedObjectsError       exit code 2
    ├── MissingExtraError     here
    ├── UsageError            here
    ├── GeneratorError        generator.errors
    ├── DecoderError          decoder.errors
    ├── ProbeError            probe.errors
    └── RecognizerError       recognizer.errors
"""

from __future__ import annotations

import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any


class EncodedObjectsError(Exception):
    """Something that was given cannot be used: what is wrong, where, and the way out.

    Parameters
    ----------
    cause
        What is wrong, with the value that was given and what is allowed.
    fix
        The way out, as an instruction ("set pitch to 5.7 mm or less").
    place
        Where: a file, `file:line:column`, the name of a face, a port's URL; kept as text.
    exit_code
        Of the command; None: that of the class.

    Examples
    --------
    >>> from encoded_objects import EncodedObjectsError, decode
    >>> try:
    ...     decode("01 12", profile="thesis")
    ... except EncodedObjectsError as error:
    ...     print(error.cause)
    ...     print(error.fix)
    row 2 '12': '2' is no symbol of this array, which has 0 to 1, or ? for one that is not seen
    write one digit per symbol, rows apart by spaces, as '01 11 0?'
    """

    exit_code = 2

    def __init__(
        self, cause: str, *, fix: str = "", place: str | Path = "", exit_code: int | None = None
    ) -> None:
        self.cause = without_password(cause)
        super().__init__(self.cause)
        self.fix = without_password(fix)
        self.place = without_password(str(place))
        if exit_code is not None:
            self.exit_code = exit_code

    def __str__(self) -> str:
        head = f"{self.place}: {self.cause}" if self.place else self.cause
        return f"{head}; {self.fix}" if self.fix else head

    def as_text(self) -> str:
        """Return what a command writes to stderr: place, cause, and the way out in a line."""
        place = printable(f"{self.place}: ") if self.place else ""
        cause = "\n".join(printable(line) for line in self.cause.split("\n"))
        fix = f"\n  fix: {printable(self.fix)}" if self.fix else ""
        return f"{place}error: {cause}{fix}"

    def as_json(self) -> dict[str, Any]:
        """Return what `--json` prints in its place, under the key `error`."""
        return {
            "kind": type(self).__name__,
            "exit_code": self.exit_code,
            "place": self.place,
            "cause": self.cause,
            "fix": self.fix,
        }


class MissingExtraError(EncodedObjectsError):
    """A library that a plain install leaves out; the fix is the line that installs it."""


class UsageError(EncodedObjectsError):
    """Options that exclude each other, or a value that an option does not take."""


def require(*modules: str, extra: str, purpose: str) -> None:
    """Load modules of an extra, or say in one line how they are installed.

    Call it before the imports of such modules, where they are used and never at start.

    Parameters
    ----------
    modules
        As they are imported (`pyarrow.parquet`).
    extra
        Of this distribution, which brings them.
    purpose
        What needs them, as a person calls it ("validate-set").

    Raises
    ------
    MissingExtraError
        One of them is not installed, or a library of the system that it needs is not.

    Examples
    --------
    >>> require("no_such_module", extra="report", purpose="validate-set")
    Traceback (most recent call last):
    encoded_objects.base.errors.MissingExtraError: validate-set needs no_such_module, which is not \
installed; pip install 'encoded-objects[report]'
    """
    for module in modules:
        try:
            with _signals_held():
                import_module(module)
        except ImportError as error:
            absent = isinstance(error, ModuleNotFoundError)
            why = "is not installed" if absent else f"cannot be loaded ({error})"
            raise _missing(module, extra, purpose, why) from error


@contextmanager
def _signals_held() -> Iterator[None]:
    """Hold requests to end back until a module is loaded: one in C++ would fail or abort."""
    came: list[int] = []
    before = {}
    if current_thread() is main_thread():
        for one in (signal.SIGINT, signal.SIGTERM):
            before[one] = signal.signal(one, lambda number, _frame: came.append(number))
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
        for number in came[:1]:
            signal.raise_signal(number)


TOUCH_LIBRARIES = ("cobs", "h5py", "scipy", "serial")  #: of the extra `touch`


def without_touch(error: ModuleNotFoundError, purpose: str) -> MissingExtraError | None:
    """Return what to say where a library of the extra `touch` is not installed; else None."""
    module = (error.name or "").partition(".")[0]
    if module not in TOUCH_LIBRARIES:
        return None
    return _missing(module, "touch", purpose)


def _missing(
    module: str, extra: str, purpose: str, why: str = "is not installed"
) -> MissingExtraError:
    cause = f"{purpose} needs {module.partition('.')[0]}, which {why}"
    return MissingExtraError(cause, fix=install_line(extra))


def exit_code_of_write(error: OSError) -> int:
    """Return 2 where the name of a file is wrong, 1 where there is no space or no right for it."""
    wrong_names = (FileNotFoundError, NotADirectoryError, IsADirectoryError)
    return 2 if isinstance(error, wrong_names) else 1


def install_line(extra: str) -> str:
    """Return the line that installs an extra."""
    return f"pip install 'encoded-objects[{extra}]'"


def printable(text: str) -> str:
    """Return `text` without characters that would disturb a terminal."""
    return "".join(c if c == " " or c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


_PASSWORD = re.compile(r"((?:sql|postgres)[\w+]*://[^:/@\s]*):[^@]*@(?:[^@/?#\s]*@)*")
_PASSWORD_OPTION = re.compile(r"([?&](?:ssl)?password=)[^&#\s]*")


def without_password(text: str, instead: str = "***") -> str:
    """Return a text in which addresses of databases have no password, as it may be shown and kept.

    >>> without_password("sim:postgresql://lab:secret@host/objects#Cube/F1")
    'sim:postgresql://lab:***@host/objects#Cube/F1'
    >>> without_password("postgresql://lab:secret@host/objects", "")
    'postgresql://lab@host/objects'
    """
    colon = ":" if instead else ""
    shown = _PASSWORD.sub(rf"\1{colon}{instead}@", text)
    return _PASSWORD_OPTION.sub(rf"\1{instead}", shown)
