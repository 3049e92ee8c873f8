"""`recognize-object RECORDING|--port URL`: which object, which face, where, and how sure.

::

    __init__.py   what an error or an interruption means for the exit code
    app           options
    source        recording or port -> touches, the sensor, its calibration
    answers       touches -> answers, printed as they come
    placed        the object in the robot's base
    report        answers and errors as text and as JSON

Results go to stdout, progress and messages to stderr. Exit codes: 0 recognised, 1 nothing
recognised, or ran but failed, 2 bad input, 3 device, 4 database, 130 interrupted. Nothing heavy is
imported before it is needed: `recognize-object --help` loads no numpy, database or HDF5 library.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from probe.command.ending import BAD_INPUT, FAILED, leave, misuse, unwritten
from recognizer.threads import one_thread


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `recognize-object` and leave with its exit code."""
    one_thread()
    leave("recognize-object", run, arguments)


def run(arguments: list[str]) -> int:
    """Run the command; returns its exit code. Errors are reported, not raised."""
    from typer import BadParameter, Exit

    from encoded_objects.errors import EncodedObjectsError
    from recognizer.command import report
    from recognizer.command.app import app
    from recognizer.errors import RecognizerError

    usage_error: type[Exception] = BadParameter.__mro__[1]  # of every misused option
    as_json = "--json" in arguments
    try:
        action = app(arguments or ["--help"], prog_name="recognize-object", standalone_mode=False)
        code = action() if callable(action) else int(action or 0)
        return code if arguments else BAD_INPUT
    except Exit as leaving:
        return leaving.exit_code
    except EncodedObjectsError as error:
        report.error(error, as_json=as_json)
        return error.exit_code
    except usage_error as error:
        told = misuse(error)
        fix = "see recognize-object --help"
        report.error(RecognizerError(told, fix=fix), as_json=as_json)
        return BAD_INPUT
    except BrokenPipeError:
        raise
    except OSError as error:
        fix = "check folder, space and rights"
        report.error(RecognizerError(unwritten(error), fix=fix), as_json=as_json)
        return FAILED
