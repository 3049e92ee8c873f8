"""The options of `open-bench`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from encoded_objects.base.options import Option, Options

LAB = "lab.db"


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
