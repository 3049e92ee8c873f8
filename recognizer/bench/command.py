"""`open-bench`: serve the page, here by default.

Exit codes: 0 ended by the operator, 2 bad input, 3 device, 4 database. Nothing heavy is
imported before it is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NoReturn

from encoded_objects.base import console
from encoded_objects.base.errors import require
from encoded_objects.base.options import Option, Options, command

HELP = """See the part, the touch and the answer in a web page.

Try it without a probe: [bold]open-bench --database lab.db[/], open the page, click on the part.
"""
EPILOG = "Exit codes: 0 ended, 2 bad input, 3 device, 4 database."
LAB = "lab.db"

app = console.application()


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `open-bench` and leave with its exit code."""
    console.one_thread()
    console.main("open-bench", lambda _arguments: app, arguments, bare=True)


@dataclass(frozen=True, slots=True)
class BenchOptions(Options):
    """What is served, where, and to whom."""

    port: Annotated[
        str,
        Option(
            "Of the probe: serial:///dev/ttyACM0, sim:, file:touch.h5, or sim:touch for a "
            "simulated one that comes down where you click (default).",
            "URL",
        ),
    ] = ""
    database: Annotated[
        str, Option("Of the objects: lab.db, sqlite:///lab.db, postgresql://host/name.", "URL")
    ] = LAB
    web_port: Annotated[int, Option("0: any free one.", least=0, most=65535)] = 8080
    host: Annotated[
        str, Option("Address to listen on. One that others reach asks for a token.")
    ] = "127.0.0.1"
    token: Annotated[
        str,
        Option(
            "Token that pages need; made anew by default where one is needed.",
            variable="OPEN_BENCH_TOKEN",
        ),
    ] = ""
    folder: Annotated[Path, Option("For recordings and calibrations.", "DIR")] = Path("recordings")
    parts: Annotated[
        Path | None,
        Option(
            "Where printed parts may be downloaded from; the database's folder by default.", "DIR"
        ),
    ] = None
    sensor_type: Annotated[
        str,
        Option(
            "Type of the sensor: a name that probe-sensor types lists, or a file; fsr-16 by "
            "default.",
            "NAME|FILE",
        ),
    ] = ""
    overlay: Annotated[
        str, Option("Elastic overlay; that of the sensor type.", choices=("tab", "pad"))
    ] = ""


@command(app, help=HELP, epilog=EPILOG)
def bench(options: BenchOptions) -> int:
    """Serve the bench."""
    require("fastapi", "uvicorn", "websockets", extra="bench", purpose="open-bench")
    from recognizer.bench.serve import serve

    return serve(options)


if __name__ == "__main__":
    main()
