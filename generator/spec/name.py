"""The name of an object, as a spec gives it."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import BeforeValidator

from encoded_objects.base.settings import refuse

NAME_LENGTH_MAX = 60
_NAME = re.compile(r"[^\W_][\w .()+-]*\Z")


def object_name(value: Any) -> str:
    """Return the name of an object: it names files and rows of the database too."""
    if not isinstance(value, str):
        raise refuse(f"a name must be text, not {value!r}", f"put it in quotes: '{value}'")
    if not value.strip():
        raise refuse("the name is empty", "write, for example, name: Cube")
    if len(value) > NAME_LENGTH_MAX:
        cause = f"the name has {len(value)} characters, {NAME_LENGTH_MAX} are allowed"
        raise refuse(cause, "shorten it")
    if not _NAME.match(value) or value[-1] in " .":
        fix = "use letters, digits, spaces and - _ . ( ) +, a letter or digit first"
        raise refuse(f"{value!r} cannot be part of a file name", fix)
    return value


ObjectName = Annotated[str, BeforeValidator(object_name)]
