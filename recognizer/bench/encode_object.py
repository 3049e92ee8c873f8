"""What the bench asks of `encode-object`: an example object, and what faces promise.

It runs as the command, since making and reading share the database alone.
"""

from __future__ import annotations

import json
import tempfile
import threading
from functools import lru_cache
from pathlib import Path
from typing import Any

from encoded_objects.base.foreign import run_limited
from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from recognizer.bench.errors import BenchError, BusyError

EXAMPLE = "Example"
SPEC = f"""# An example, made by open-bench.
name: {EXAMPLE}
shape: {{cube: 60 mm}}
"""
EXAMPLE_S = 120.0  #: longest time to make the example
PROMISE_S = 60.0  #: longest time that `encode-object show` may take
MEMORY = 4 * 1024**3  #: bytes of addresses of the command; the example takes 0.6 GB
WRITTEN = 1024**3  #: bytes of a file that it writes

_TURN = threading.Lock()  #: one command at a time
_ENDING = threading.Event()


def make_example(folder: Path, database: str) -> str:
    """Make the example in a folder and register it; returns the object's name.

    The folder gets `example.yaml` and `out/`; the database is a URL, or a file's name in it.

    Raises
    ------
    BenchError
        `encode-object` could not make it; says why.
    """
    spec = folder / "example.yaml"
    try:
        if not spec.exists():
            spec.write_text(SPEC, encoding="utf-8")
        code, output = _run(spec.name, "--database", database, folder=folder, longest_s=EXAMPLE_S)
    except (OSError, TimeoutError) as error:
        raise BenchError(f"no example could be made: {error}", fix="see that the folder can be "
                         "written, or make one by encode-object") from error  # fmt: skip
    if code:
        try:
            reason = dict(json.loads(output)["error"])
        except (ValueError, KeyError, TypeError):
            reason = {}
        raise BenchError(reason.get("cause", "no example could be made"),
                         fix=reason.get("fix", "make one by encode-object"))  # fmt: skip
    return EXAMPLE


@lru_cache(maxsize=512)
def face_promises(
    database: str,
    name: str,
    registered: str,  # noqa: ARG001 - a new object of this name is another one
    sensor: SensorType,
) -> dict[str, dict[str, Any]]:
    """Return the expected recognition rate of each face by its name, as `encode-object show`.

    Faces of which nothing is said are left out.

    Raises
    ------
    BenchError
        `encode-object` fails; says why.
    """
    try:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "sensor.yaml")
            file.write_text(sensor_type_text(sensor), encoding="utf-8")
            _, output = _run(
                "show", name, "--database", database, "--sensor-type", str(file),
                longest_s=PROMISE_S,
            )  # fmt: skip
        found = json.loads(output)
    except (OSError, ValueError, TimeoutError) as error:
        raise BenchError(f"the promise of {name} is not known: {error}", fix="try again") from error
    if "error" in found:
        reason = found["error"]
        raise BenchError(reason.get("cause", "no promise"), fix=reason.get("fix", ""))
    return {face["name"]: face["promise"] for face in found["faces"] if face["promise"]}


def end_all() -> None:
    """End the command that runs, and begin no other: the server ends."""
    _ENDING.set()


def _run(*words: str, longest_s: float, folder: Path | None = None) -> tuple[int, str]:
    """Run the command in a folder; returns its exit code and what it printed as JSON.

    Raises
    ------
    BusyError
        The server ends.
    """
    with _TURN:
        code, printed = run_limited(
            "generator.command", [*words, "--json"], memory_bytes=MEMORY, cpu_s=longest_s,
            written_bytes=WRITTEN, folder=folder, ending=_ENDING.is_set,
        )  # fmt: skip
    if _ENDING.is_set():
        raise BusyError("open-bench ends", fix="start it again")
    return code, printed.decode()
