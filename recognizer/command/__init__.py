"""`recognize-object RECORDING|--port URL`: which object, which face, where, and how sure.

`recognize-object as-built RECORDING`: how a part came out of the printer.

`recognize-object check --at OBJECT/FACE`: how the sensor is mounted.

::

    app, options  the command and its options
    recognize     touches -> answers, printed and drawn as they come
    scanning      several touches as one belief; how the probe moved
    port          a port -> touches, the sensor, its calibration
    learning      the sensor, learned from the touches and kept
    answers       an answer as text and as JSON
    ros, publish  answers as ROS 2 messages: into a file, over the network
    as_built      recognize-object as-built
    check         recognize-object check

Results go to stdout, progress and messages to stderr. Exit codes: 0 recognised, 1 nothing
recognised, or ran but failed, 2 bad input, 3 device, 4 database, 130 interrupted. Nothing heavy is
imported before it is needed: `recognize-object --help` loads no numpy, database or HDF5 library.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

from encoded_objects.base import console

if TYPE_CHECKING:
    from encoded_objects.base.options import Application

NAME = "recognize-object"


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `recognize-object` and leave with its exit code."""
    console.one_thread()
    console.main(NAME, application, arguments)


def run(arguments: list[str]) -> int:
    """Run the command; returns its exit code. Errors are reported, not raised."""
    return console.run(NAME, application, arguments)


def application(arguments: list[str]) -> Application:
    """Return the application that reads the arguments; a recording needs no command's name."""
    if arguments[:1] == ["as-built"]:
        from recognizer.command.as_built import app
    elif arguments[:1] == ["check"]:
        from recognizer.command.check import app
    else:
        from recognizer.command.app import app
    return app
