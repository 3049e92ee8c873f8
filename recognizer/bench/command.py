"""`open-bench`: serve the page, here by default.

Exit codes: 0 ended by the operator, 2 bad input, 3 device, 4 database. Nothing heavy is
imported before it is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from encoded_objects.base import console
from encoded_objects.base.console import Action
from encoded_objects.base.errors import require

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


@app.command(help=HELP, epilog=EPILOG)
def bench(
    port: Annotated[
        str, typer.Option(metavar="URL", show_default=False,
                          help="Of the probe: serial:///dev/ttyACM0, sim:, file:touch.h5, or "
                               "touch: for a simulated one that comes down where you click "
                               "(default)."),
    ] = "",
    database: Annotated[
        str, typer.Option(metavar="URL", help="Of the objects: lab.db, sqlite:///lab.db, "
                                              "postgresql://host/name."),
    ] = LAB,
    web_port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free one.")] = 8080,
    host: Annotated[
        str, typer.Option(help="Address to listen on. One that others reach asks for a token.")
    ] = "127.0.0.1",
    token: Annotated[
        str, typer.Option(envvar="OPEN_BENCH_TOKEN", show_default=False,
                          help="Token that pages need; made anew by default where one is needed."),
    ] = "",
    folder: Annotated[
        Path, typer.Option(metavar="DIR", help="For recordings and calibrations.")
    ] = Path("recordings"),
    parts: Annotated[
        Path | None,
        typer.Option(metavar="DIR", show_default=False,
                     help="Where printed parts may be downloaded from; the database's folder by "
                          "default."),
    ] = None,
    sensor_type: Annotated[
        str, typer.Option("--sensor-type", metavar="NAME|FILE", show_default=False,
                          help="Type of the sensor: a name that probe-sensor types lists, or a "
                               "file; fsr-16 by default."),
    ] = "",
    overlay: Annotated[
        str, typer.Option(metavar="tab|pad", show_default=False,
                          help="Elastic overlay; that of the sensor type."),
    ] = "",
) -> Action:  # fmt: skip
    """Serve the bench."""

    def action() -> int:
        require("fastapi", "uvicorn", "websockets", extra="bench", purpose="open-bench")
        from recognizer.bench.serve import BenchOptions, serve

        return serve(
            BenchOptions(port, database, web_port, host, token, folder, parts, overlay, sensor_type)
        )

    return action


if __name__ == "__main__":
    main()
