"""What a kind of foreign input is, what may become of a case, and the sound things.

"leak": bytes of another file were read, or something may lead there; "left outside": files of what
was refused, or in other folders; "wrong value": something was read that was never written.
"""

import os
import random
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from recorded import frames, pose_at

TESTS = Path(__file__).parents[1]
FIXTURES = TESTS.parent / "fixtures"
SECRET = b"kept to itself " * 80  #: of a file next to the folder that is given
LONGEST_S = 5.0  #: of a case
MOST_BYTES = 512 << 20  #: of memory that a case may take
BOMBS_MB = (64, 640)  #: what zips unpack to
ROOM = 3 << 29  #: bytes of addresses; what asks for more fails at once

READ, REFUSED = "read", "refused"
FAULTS = ("traceback", "wrong code", "no place", "hang", "memory", "left outside", "leak",
          "wrong value", "died")  # fmt: skip


class FaultError(Exception):
    """What may not become of a case, one of `FAULTS`, and where."""


class HangError(BaseException):
    """A case took longer than it may."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case."""

    what: str  #: `READ`, `REFUSED`, or one of `FAULTS`
    detail: str = ""  #: where it went wrong, the same for the same fault
    seconds: float = 0.0
    megabytes: float = 0.0


@dataclass(frozen=True)
class Kind:
    """One kind of what comes from outside."""

    write: Callable[[random.Random, Path], Any]  #: into a folder; returns what is to be read
    read: Callable[[Any, Path], object]  #: it, with a folder for what comes of it
    codes: tuple[int, ...] = (2,)  #: exit codes of what is refused
    file: bool = True  #: a file is read, which may also be no file
    placed: bool = True  #: errors name the file
    longest_s: float = LONGEST_S
    most_bytes: int = MOST_BYTES
    sound: tuple[Callable[[], Any], ...] = ()  #: make what is damaged, once


GOOD = 48  #: frames of the recordings


@cache
def kept() -> tuple[Path, list[Any]]:
    """Return a folder of sound things, made once in a process and its children."""
    folder = Path(tempfile.mkdtemp(prefix="foreign-", dir=scratch()))
    given = frames(GOOD, pose=pose_at(3.0))
    return folder, given


def scratch() -> str | None:
    """Return where cases are quick: in memory, where there is such a folder."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
