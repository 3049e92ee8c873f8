"""`recognize-object`: the command."""

from __future__ import annotations

from encoded_objects.base.options import Application, command
from recognizer.command import NAME
from recognizer.command.options import RecognizeOptions

HELP = """Say which object was touched, which face, where, and how sure.

RECORDING is any HDF5 file with /frames (N, rows, columns). Try it without a probe: \
[bold]probe-sensor simulate lab.db#Cube/F1 -o touch.h5[/], then \
[bold]recognize-object touch.h5[/]. How a part came out of the printer: \
[bold]recognize-object as-built --help[/].
"""
EPILOG = """Exit codes: 0 recognised, 1 nothing recognised, 2 bad input, 3 device, 4 database, \
130 interrupted.
"""

app = Application()


def _kernels() -> dict[str, str]:
    from recognizer.touch.symbols.kernels import kernels

    kernels()
    return {"kernels": "compiled"}


@command(app, help=HELP, epilog=EPILOG, version_of=NAME, parts=_kernels)
def recognize(options: RecognizeOptions) -> int:
    """Read touches; `HELP` is what people see."""
    from recognizer.command.recognize import recognize_touches

    return recognize_touches(options)
