"""Run the project's commands by their entry points in `pyproject.toml`, many of them quickly.

Arguments, folder and environment -> exit code, stdout, stderr. A clean process loads the large
libraries once, and each module of the project once a command has used it, and forks a child for
each command: the child's state is as fresh as that of a process of its own, without the start-up.
What a command sees of the machine is fixed: width, colour, language, time zone, home and cache
folder.
"""

from __future__ import annotations

import atexit
import importlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import tomllib
import traceback
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

ROOT = Path(__file__).parents[2]
FIXTURES = ROOT / "fixtures"
DATA = Path(__file__).parent / "data"

OURS = ("encoded_objects", "generator", "decoder", "probe", "recognizer")
LIBRARIES = (
    "numpy",
    "scipy.fft",
    "scipy.linalg",
    "scipy.ndimage",
    "scipy.optimize",
    "scipy.sparse.linalg",
    "scipy.spatial",
    "h5py",
    "pydantic",
    "rich.console",
    "rich.table",
    "sqlalchemy",
    "typer",
    "yaml",
)
# What floating point depends on, as `make.py` has set it.
KEPT = (
    "MKL_NUM_THREADS",
    "NPY_DISABLE_CPU_FEATURES",
    "OMP_NUM_THREADS",
    "OPENBLAS_CORETYPE",
    "OPENBLAS_NUM_THREADS",
    "PYTHONHASHSEED",
    "SOURCE_DATE_EPOCH",
)
LIMIT_S = 300  #: a command that takes longer hangs


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a command left behind."""

    code: int  #: exit code
    stdout: str
    stderr: str

    def value(self) -> Any:
        """Return the JSON on stdout."""
        return json.loads(self.stdout)


class Commands:
    """Starts commands; a context manager that owns the process they are forked from.

    Parameters
    ----------
    folder
        For the home and cache folder that commands see.
    """

    def __init__(self, folder: Path) -> None:
        self.home = folder / "home"
        self.home.mkdir(parents=True, exist_ok=True)
        environment = {
            "COLUMNS": "100",
            "HOME": str(self.home),
            "LANG": "C.UTF-8",
            "LINES": "40",
            "MPLBACKEND": "agg",
            "NO_COLOR": "1",
            "PATH": os.environ["PATH"],
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
            "TERM": "dumb",
            "TZ": "UTC",
            "XDG_CACHE_HOME": str(self.home / "cache"),
        } | {name: os.environ[name] for name in KEPT if name in os.environ}
        pipe = subprocess.PIPE
        self._server = subprocess.Popen(
            [sys.executable, __file__], stdin=pipe, stdout=pipe, text=True, env=environment
        )

    def __enter__(self) -> Commands:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.close()
        self._server.stdout.close()
        self._server.wait(timeout=LIMIT_S)

    def run(self, *arguments: object, cwd: Path, stdin: str = "") -> Outcome:
        """Run `arguments`, of which the first is the command's name, in the folder `cwd`."""
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        asked = {"arguments": list(map(str, arguments)), "cwd": str(cwd), "stdin": stdin}
        self._server.stdin.write(json.dumps(asked) + "\n")
        self._server.stdin.flush()
        answer = self._server.stdout.readline()
        if not answer:
            raise RuntimeError(f"the process that starts commands ended at {arguments}")
        return Outcome(**json.loads(answer))

    def done(self, *arguments: object, cwd: Path) -> Outcome:
        """Run a command that must succeed."""
        outcome = self.run(*arguments, cwd=cwd)
        if outcome.code:
            raise RuntimeError(f"{arguments}: exit code {outcome.code}\n{outcome.stderr}")
        return outcome


def normal_text(text: str, folder: Path) -> str:
    """Return `text` without what differs from run to run: folders, versions, times.

    Parameters
    ----------
    folder
        Where the commands work; it is written FOLDER.
    """
    text = text.replace(str(folder), "FOLDER").replace(str(ROOT), "ROOT")
    text = text.replace(os.path.relpath(ROOT, folder), "ROOT")
    text = re.sub(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?(\.\d+)?(Z|\+00:00)?", "UTC", text)
    text = re.sub(r"(?<=/)(\.[\w-]+\.\w+)\.\d+\b", r"\1.PROCESS", text)  # drafts of files
    text = LAB_KEY.sub(lambda key: key[0] if key[0] in LAB_KEYS else "LABK-EYDR-AWNX-XXXX", text)
    text = re.sub(r"\(\d+(\.\d+)? s\)", "(TIME s)", text)
    text = re.sub(r"(?<=ports that are there: )[^\n]*", "PORTS", text)
    version = re.escape(_version())
    return re.sub(rf"(?<![\w.]){version}(?![\w.])", "VERSION", text)


def normal_value(value: Any, folder: Path) -> Any:
    """Return JSON as `normal_text` does texts, with what depends on the machine as null."""
    if isinstance(value, dict):
        timed = str(value.get("name", "")).startswith("CPU")  # a line of validate-set compare
        return {
            key: None if key in VOLATILE or (timed and key in "ab") else normal_value(one, folder)
            for key, one in value.items()
        }
    if isinstance(value, list):
        return [normal_value(one, folder) for one in value]
    return normal_text(value, folder) if isinstance(value, str) else value


LAB_KEY = re.compile(r"\b[0-9A-HJKMNP-TV-Z]{4}(-[0-9A-HJKMNP-TV-Z]{4}){3}\b")
#: Those that are given, and that of the Guest's lab; others are drawn at random.
LAB_KEYS = {
    "F1XT-VRES-0000-000Q",
    "0000-0000-0000-0000",
    "EXZ6-74HR-AG6D-7N8M",
    "0123-4567-89AB-CDEQ",
}
#: Durations; versions of libraries with a hash of the source.
VOLATILE = {"seconds", "drawing_ms", "reading_ms", "versions"}


def _version() -> str:
    text = (ROOT / "encoded_objects/__init__.py").read_text()
    found = re.search(r'__version__ = "([^"]+)"', text)
    assert found is not None
    return found[1]


def _serve() -> None:
    sys.path[0] = str(ROOT)  # this folder holds modules that are no libraries
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    for library in LIBRARIES:
        importlib.import_module(library)
    answers = os.fdopen(os.dup(1), "w")
    questions = os.fdopen(os.dup(0))
    while line := questions.readline():
        asked = json.loads(line)
        temporary = tempfile.TemporaryFile
        with temporary() as out, temporary() as error, temporary() as used:
            child = os.fork()
            if not child:
                _become(scripts, asked, out.fileno(), error.fileno(), used.fileno())
            _, status = os.waitpid(child, 0)
            used.seek(0)
            for module in used.read().decode().split():
                importlib.import_module(module)
            texts = []
            for file in (out, error):
                file.seek(0)
                texts.append(file.read().decode(errors="backslashreplace"))
        code = os.waitstatus_to_exitcode(status)
        answers.write(json.dumps({"code": code, "stdout": texts[0], "stderr": texts[1]}) + "\n")
        answers.flush()


def _become(
    scripts: dict[str, str], asked: dict[str, Any], out: int, error: int, used: int
) -> None:
    """Be the process of one command, write the modules of ours that it used, and end."""
    signal.alarm(LIMIT_S)
    code: Any = 1
    try:
        with tempfile.TemporaryFile() as given:
            given.write(asked["stdin"].encode())
            given.seek(0)
            os.dup2(given.fileno(), 0)
        os.dup2(out, 1)
        os.dup2(error, 2)
        sys.stdin = _text(io.BufferedReader(io.FileIO(0, closefd=False)))
        sys.stdout = _text(io.BufferedWriter(io.FileIO(1, "w", closefd=False)))
        sys.stderr = _text(io.BufferedWriter(io.FileIO(2, "w", closefd=False)))
        os.chdir(asked["cwd"])
        name, *arguments = asked["arguments"]
        sys.argv = [name, *arguments]
        module, function = scripts[name].split(":")
        getattr(importlib.import_module(module), function)()
        code = 0
    except SystemExit as leaving:
        code = 0 if leaving.code is None else leaving.code
    finally:
        if sys.exc_info()[0] is not None:
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
        os.write(used, " ".join(m for m in sys.modules if m.partition(".")[0] in OURS).encode())
        atexit._run_exitfuncs()  # those of libraries, as at the end of a process of its own
        os._exit(code if isinstance(code, int) else 1)


def _text(stream: io.BufferedReader | io.BufferedWriter) -> io.TextIOWrapper:
    return io.TextIOWrapper(stream, encoding="utf-8", line_buffering=True)


if __name__ == "__main__":
    _serve()
