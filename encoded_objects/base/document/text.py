"""The text of a file that a person wrote: UTF-8, at most 256 KiB."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from encoded_objects.base.document.problem import DocumentKind, Problem, SourceMark, TextSource

BYTES_MAX = 256 * 1024


def read_text(path: Path, kind: DocumentKind) -> str:
    """Return the text of a file.

    Raises
    ------
    DocumentError
        The file is missing (the fix names similar ones), too large, or not UTF-8.
    """
    try:
        with path.open("rb") as file:
            data = file.read(BYTES_MAX + 1)
    except FileNotFoundError:
        raise kind.error(
            [Problem("there is no such file", _suggest_similar(path, kind), file=str(path))]
        ) from None
    except IsADirectoryError:
        fix = f"name the files in it, for example {path / '*.yaml'}"
        raise kind.error(
            [Problem(f"this is a folder, not {kind.name}", fix, file=str(path))]
        ) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        fix = "check the name and the rights of the file"
        raise kind.error([Problem(f"cannot read: {reason}", fix, file=str(path))]) from None
    if len(data) > BYTES_MAX:
        cause = f"the file is larger than {BYTES_MAX // 1024} KiB"
        raise kind.error([Problem(cause, kind.large, file=str(path))])
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        source = TextSource.of(str(path), data.decode("utf-8", errors="replace"))
        mark = SourceMark.at(source, data[: error.start].decode("utf-8"))
        cause = f"byte 0x{data[error.start]:02x} is not UTF-8 text"
        raise kind.error([Problem(cause, "save the file as UTF-8", mark)]) from None
    return text


def _suggest_similar(path: Path, kind: DocumentKind) -> str:
    """Return a fix that names files like `path` beside it."""
    try:
        beside = sorted(entry.name for entry in path.parent.iterdir())
    except (OSError, ValueError):
        return f"check the folder '{path.parent}'"
    near = get_close_matches(path.name, beside, n=3, cutoff=0.6)
    if near:
        return "did you mean " + " or ".join(f"'{path.parent / name}'" for name in near) + "?"
    return kind.first
