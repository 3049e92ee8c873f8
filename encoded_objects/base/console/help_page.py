"""The page of `--help`, without what it does not need: half of its time went into imports.

Our pages are written in rich's markup, never in Markdown; typer imports a parser of it (a fifth of
the time) for the case. To find a subcommand it reads the options of all groups above it, and for
that imports pydantic (a third).
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typer import Typer

HELP = ("-h", "--help")
#: What typer's page imports and no page of ours uses; by the names it asks them for.
UNUSED = {"rich.markdown": ("Markdown",), "rich.traceback": ("Traceback",)}


def show_help(app: Typer, name: str, arguments: list[str]) -> Any:
    """Run the command that the arguments name first; its page is shown by its own `--help`.

    Returns
    -------
    Any
        What the command returns.
    """
    from typer.main import get_command

    command: Any = get_command(app)
    words, rest = [name], list(arguments)
    while rest and rest[0] in getattr(command, "commands", {}):
        command = command.commands[rest[0]]
        words.append(rest.pop(0))
    _import_page()
    named = {"prog_name": " ".join(words), "help_option_names": list(HELP)}
    return command.main(args=rest, standalone_mode=False, **named)


def _import_page() -> None:
    """Import typer's page with stand-ins for what it does not use here."""
    stand_ins = {}
    for module, names in UNUSED.items():
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
