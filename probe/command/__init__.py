"""`probe-sensor`: list, info, types, calibrate, record, replay, export, simulate, live.

    app, options   the commands; their options
    described      list, types, info
    recorded       record, replay, export, import
    calibrated     calibrate bias | loads | port
    simulated      simulate
    live           live

Results go to stdout, progress and messages to stderr. Exit codes: 0 done, 1 ran but failed,
2 bad input, 3 device, 4 database, 130 interrupted. Nothing heavy is imported before it is
needed: `probe-sensor --help` loads neither numpy, h5py and pyserial nor a plotting library.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

from encoded_objects.base import console

if TYPE_CHECKING:
    from encoded_objects.base.options import Application

NAME = "probe-sensor"


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `probe-sensor` and leave with its exit code."""
    console.main(NAME, application, arguments)


def run(arguments: list[str]) -> int:
    """Run one command; returns its exit code. Errors are reported, not raised."""
    return console.run(NAME, application, arguments)


def application(_arguments: list[str]) -> Application:
    """Return the application that reads the arguments."""
    from probe.command.app import app

    return app
