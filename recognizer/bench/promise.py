"""What the faces of an object promise the bench's sensor, as `encode-object show` tells it.

Run as the command that it is, since what makes objects and what reads them share the database
alone; an object's promise is asked for once.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from recognizer.bench.errors import BenchError
from recognizer.bench.settings import DATABASE


@lru_cache(maxsize=DATABASE.promises)
def face_promises(
    database: str,
    name: str,
    registered: str,  # noqa: ARG001 - a new object of this name is another one
    sensor: SensorType,
) -> dict[str, dict[str, Any]]:
    """Return the promise of each face by its name; faces of which nothing is said are left out.

    Parameters
    ----------
    database
        URL or file.
    name, registered
        Of the object, and when it was registered.
    sensor
        What touches it.

    Raises
    ------
    BenchError
        `encode-object` could not tell; says why.
    """
    try:
        with tempfile.TemporaryDirectory() as folder:
            touching = Path(folder, "sensor.yaml")
            touching.write_text(sensor_type_text(sensor), encoding="utf-8")
            words = [sys.executable, "-c", "from generator.command import main; main()", "show",
                     name, "--database", database, "--sensor-type", str(touching),
                     "--json"]  # fmt: skip
            done = subprocess.run(  # noqa: S603, our own command
                words, capture_output=True, text=True, timeout=DATABASE.promise_s, check=False
            )
        told = json.loads(done.stdout)
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        raise BenchError(f"the promise of {name} is not known: {error}", fix="try again") from error
    if "error" in told:
        raise BenchError(told["error"].get("cause", "no promise"), fix=told["error"].get("fix", ""))
    return {face["name"]: face["promise"] for face in told["faces"] if face["promise"]}
