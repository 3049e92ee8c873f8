"""`encode-object`: from a spec to printable parts and a registered object.

::

    encode.py          encode-object SPEC.yaml...
    tools.py           encode-object init | schema | printers
    objects.py         encode-object lab | list | show | retire | export | import
    made_report.py     what was made, as text and as JSON
    object_report.py   what is registered and how full the lab is, as text and as JSON
    printed_report.py  what becomes of symbols on a printer

Exit codes: 0 done, 1 could not be written, 2 bad input, 4 database, 130 interrupted. Nothing heavy
is imported before it is needed: `--help` loads no array, no geometry, no database.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

from encoded_objects.base import console

if TYPE_CHECKING:
    from encoded_objects.base.options import Application

NAME = "encode-object"
TOOLS = ("init", "schema", "printers")
OBJECTS = ("lab", "list", "show", "retire", "export", "import")


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `encode-object` and leave with its exit code."""
    console.main(NAME, _application, arguments)


def run(arguments: list[str]) -> int:
    """Run one command; returns its exit code. Errors are reported, not raised."""
    return console.run(NAME, _application, arguments)


def _application(arguments: list[str]) -> Application:
    """Return the command that is meant; a spec file needs no command's name."""
    if arguments[:1] and arguments[0] in TOOLS:
        from generator.command.tools import app
    elif arguments[:1] and arguments[0] in OBJECTS:
        from generator.command.objects import app
    else:
        from generator.command.encode import app
    return app
