"""Files that a command writes: refused before work is done, and whole or not there."""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from encoded_objects.base.errors import EncodedObjectsError

NAME_LENGTH = 60  #: characters of the name of an object, which names files and rows too
_NAME = re.compile(r"[^\W_][\w .()+-]*\Z")


def name_fault(name: str) -> tuple[str, str] | None:
    """Return what is wrong with the name of an object, and the way out; None if nothing is.

    >>> name_fault("Cube"), name_fault("../Cube")[0]
    (None, "'../Cube' cannot be part of a file name")
    """
    if not name.strip():
        return "the name is empty", "write, for example, name: Cube"
    if len(name) > NAME_LENGTH:
        return f"the name has {len(name)} characters, {NAME_LENGTH} are allowed", "shorten it"
    if not _NAME.match(name) or name[-1] in " .":
        fix = "use letters, digits, spaces and - _ . ( ) +, a letter or digit first"
        return f"{name!r} cannot be part of a file name", fix
    return None


def refuse_taken(out: Path, suffix: str, *, replace: bool) -> None:
    """Refuse a file to write before work is done: its name must end in `suffix`.

    Raises EncodedObjectsError: with the way out; also for a folder that is not there, and another
    ending.
    """
    place = str(out)
    if out.suffix.lower() != suffix:
        fix = f"write {out.with_suffix(suffix)}" if out.name else "give a name"
        raise EncodedObjectsError(
            f"the name of this file has to end in {suffix}", fix=fix, place=place
        )
    if not out.parent.is_dir():
        raise EncodedObjectsError(
            f"there is no folder {out.parent}", fix="make it first", place=place
        )
    if out.exists() and not replace:
        raise file_exists_error(out)


def file_exists_error(out: Path) -> EncodedObjectsError:
    """Return the refusal of a file that is there already."""
    fix = "choose another name, or replace it with --replace"
    return EncodedObjectsError("the file is there already", fix=fix, place=out)


@contextmanager
def staged_file(out: Path, *, replace: bool = True) -> Iterator[Path]:
    """Yield a name next to `out` to write to; it becomes `out` when all went well.

    Raises `OSError` and `EncodedObjectsError`, of `out`; without `replace`, `FileExistsError` if
    `out` has come up meanwhile.
    """
    draft = out.with_name(f".{out.stem}.{os.getpid()}-{threading.get_ident()}{out.suffix}")
    try:
        yield draft
        (os.replace if replace else os.link)(draft, out)
    except OSError as error:
        if str(error.filename) == str(draft):  # a message names the file that was asked for
            error.filename = str(out)
        raise
    except EncodedObjectsError as error:
        if Path(error.place).name.startswith(draft.stem):  # also its parts
            error.place = str(out)
        raise
    finally:
        draft.unlink(missing_ok=True)


@contextmanager
def whole_file(out: Path) -> Iterator[IO[bytes]]:
    """Yield a stream to write to; `out` appears when all of it is on the disk."""
    with staged_file(out) as draft, draft.open("wb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())
