"""Run the project's commands by their entry points in `pyproject.toml`, many of them quickly.

Arguments, folder and environment -> exit code, stdout, stderr. A clean process loads the large
libraries once, and each module of the project once a command has used it, and forks a child for
each command: the child's state is as fresh as that of a process of its own, without the start-up.
What a command sees of the machine is fixed: width, colour, language, time zone, home and cache
folder.
"""

import atexit
import importlib
import io
import json
import os
import re
import runpy
import signal
import subprocess
import sys
import tomllib
import traceback
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
FIXTURES = ROOT / "fixtures"
DATA = Path(__file__).parent / "data"
LAB_KEY = "F1XT-VRES-0000-000Q"  #: of all that is made

OURS = ("encoded_objects", "generator", "decoder", "probe", "recognizer")
SCIPY = ("fft", "linalg", "ndimage", "optimize", "sparse.linalg", "spatial")
LIBRARIES = ("numpy", *(f"scipy.{part}" for part in SCIPY), "h5py", "pydantic", "sqlalchemy")
LIBRARIES += ("rich.console", "rich.table", "typer", "yaml")
# What floating point depends on, as `make.py` has set it.
KEPT = ("NPY_DISABLE_CPU_FEATURES", "OPENBLAS_CORETYPE", "PYTHONHASHSEED", "SOURCE_DATE_EPOCH")
KEPT += ("MKL_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
LOOK = {"COLUMNS": "100", "LINES": "40", "LANG": "C.UTF-8", "NO_COLOR": "1", "TERM": "dumb"}
LIMIT_S = 300  #: a command that takes longer hangs


class Outcome(NamedTuple):
    """What a command left behind."""

    code: int  #: exit code
    stdout: str
    stderr: str


@dataclass(frozen=True)
class Commands:
    """Starts commands in a folder."""

    folder: Path
    server: subprocess.Popen[str]  #: they are forked from it

    def run(self, *arguments: object) -> Outcome:
        """Run `arguments`: a command's name, or "python" and a script, and its arguments."""
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        asked = {"arguments": list(map(str, arguments)), "cwd": str(self.folder)}
        self.server.stdin.write(json.dumps(asked) + "\n")
        self.server.stdin.flush()
        answer = self.server.stdout.readline()
        if not answer:
            raise RuntimeError(f"the process that starts commands ended at {arguments}")
        return Outcome(**json.loads(answer))

    def answer(self, *arguments: object) -> str:
        """Return the stdout of a command that must work; exit code 1 is an answer, too."""
        outcome = self.run(*arguments)
        if outcome.code not in (0, 1):
            raise RuntimeError(f"{arguments}: exit code {outcome.code}\n{outcome.stderr}")
        return outcome.stdout

    def entry(self, *arguments: object) -> dict[str, Any]:
        """Return what a command says as an entry of a corpus: stdout as JSON where it is."""
        code, stdout, stderr = self.run(*arguments)
        try:
            said = normal_value(json.loads(stdout), self.folder)
        except ValueError:
            said = normal_text(stdout, self.folder)
        return {"code": code, "stdout": said, "stderr": normal_text(stderr, self.folder)}


@contextmanager
def started_commands() -> Iterator[Commands]:
    """Yield what starts commands in an empty folder.

    It is in /tmp whatever TMPDIR says: a table is as wide as the paths in it.
    """
    with TemporaryDirectory(dir="/tmp") as name:
        work = Path(name).resolve() / "work"
        work.mkdir()
        yield Commands(work, _server())


@cache
def _server() -> subprocess.Popen[str]:
    """Return the process from which all commands of this one are forked."""
    closing = ExitStack()
    atexit.register(closing.close)
    return closing.enter_context(started_server())


@contextmanager
def started_server() -> Iterator[subprocess.Popen[str]]:
    """Yield a process from which commands are forked; home and cache are empty at its start."""
    with TemporaryDirectory() as name:
        home = Path(name).resolve()
        modules = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        environment = LOOK | {"MPLBACKEND": "agg", "TZ": "UTC", "HOME": str(home)}
        environment |= {"XDG_CACHE_HOME": str(home / "cache"), "PYTHONPATH": modules}
        environment |= {name: os.environ[name] for name in ("PATH", *KEPT) if name in os.environ}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        with subprocess.Popen([sys.executable, __file__], env=environment, **pipes) as server:
            yield server


def normal_text(text: str, folder: Path) -> str:
    """Return `text` without what differs from run to run: folders, versions, times.

    Parameters
    ----------
    folder
        Where the commands work; it is written FOLDER.
    """
    text = text.replace(str(folder), "FOLDER").replace(str(ROOT), "ROOT")
    text = re.sub(r"Matplotlib is building the font cache[^\n]*\n", "", text)  # slow machines
    text = text.replace(os.path.relpath(ROOT, folder), "ROOT")
    text = re.sub(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?(\.\d+)?(Z|\+00:00)?", "UTC", text)
    text = re.sub(r"(?<=/)(\.[\w-]+\.\w+)\.\d+\b", r"\1.PROCESS", text)  # drafts of files
    text = KEY_FORM.sub(lambda key: key[0] if key[0] in LAB_KEYS else "LABK-EYDR-AWNX-XXXX", text)
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


KEY_FORM = re.compile(r"\b[0-9A-HJKMNP-TV-Z]{4}(-[0-9A-HJKMNP-TV-Z]{4}){3}\b")
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
        with TemporaryFile() as out, TemporaryFile() as error, TemporaryFile() as used:
            child = os.fork()
            if not child:
                _become(scripts, asked, out.fileno(), error.fileno(), used.fileno())
            _, status = os.waitpid(child, 0)
            used.seek(0)
            for module in used.read().decode().split():
                importlib.import_module(module)
            answer = {"code": os.waitstatus_to_exitcode(status)}
            for name, file in (("stdout", out), ("stderr", error)):
                file.seek(0)
                answer[name] = file.read().decode(errors="backslashreplace")
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _become(
    scripts: dict[str, str], asked: dict[str, Any], out: int, error: int, used: int
) -> None:
    """Be the process of one command, write the modules of ours that it used, and end."""
    signal.alarm(LIMIT_S)
    code: Any = 1
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(error, 2)
        sys.stdin = _text(io.BufferedReader(io.FileIO(0, closefd=False)))
        sys.stdout = _text(io.BufferedWriter(io.FileIO(1, "w", closefd=False)))
        sys.stderr = _text(io.BufferedWriter(io.FileIO(2, "w", closefd=False)))
        os.chdir(asked["cwd"])
        name, *arguments = asked["arguments"]
        if name == "python":
            sys.argv = arguments
            runpy.run_path(arguments[0], run_name="__main__")
        else:
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
