"""`probe-sensor`: list, info, calibrate, record, replay, export, simulate, live.

::

    __init__.py    what an error means for the exit code; ending: interruptions, misuse
    app            which command: the modules below register themselves there
    options        options that several commands share
    report         results and errors as text and as JSON
    progress       a bar on a terminal, notices beside it
    stream         frames of a client while the terminal is served
    devices        list, info           described    what info says
    record         record               recorded     the work
    replay         replay
    files          export, import, repair
    calibrate      calibrate            calibrated   the work, guided   step by step,
                                        loads, listen   what goes in, laws   what comes out
    simulate       simulate             simulated    the work
    live           live                 live_loop, live_state, live_view, keys

Results go to stdout, progress and messages to stderr. Exit codes: 0 done, 1 ran but failed,
2 bad input, 3 device, 4 database, 130 interrupted. Nothing heavy is imported before it is
needed: `probe-sensor --help` loads neither numpy, h5py and pyserial nor a plotting library.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NoReturn

from probe.command.ending import BAD_INPUT, FAILED, leave, misuse, unwritten

Action = Callable[[], int]
"""What a command does once its options are read; returns the exit code."""


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `probe-sensor` and leave with its exit code."""
    leave("probe-sensor", run, arguments)


def run(arguments: list[str]) -> int:
    """Run one command; returns its exit code. Errors are reported, not raised."""
    from typer import BadParameter, Exit

    from probe.command import report
    from probe.command.app import app, command_of
    from probe.errors import ProbeError

    usage_error: type[Exception] = BadParameter.__mro__[1]  # of every misused option
    as_json = "--json" in arguments
    try:
        nothing = arguments in ([], ["calibrate"])  # which command is not said
        asked = [*arguments, "--help"] if nothing else arguments
        action = app(asked, prog_name="probe-sensor", standalone_mode=False)
        code = action() if callable(action) else int(action or 0)
        return BAD_INPUT if nothing else code
    except Exit as leaving:
        return leaving.exit_code
    except ProbeError as error:
        report.error(error, as_json=as_json)
        return error.exit_code
    except usage_error as error:
        fix = f"see {command_of(arguments)} --help"
        report.error(ProbeError(misuse(error), fix=fix), as_json=as_json)
        return BAD_INPUT
    except BrokenPipeError:
        raise
    except OSError as error:
        report.error(
            ProbeError(unwritten(error), fix="check folder, space and rights"), as_json=as_json
        )
        return FAILED
