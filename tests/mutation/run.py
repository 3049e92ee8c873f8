"""Change one thing in a module that decides, run its unit tests, and see whether they notice.

    python tests/mutation/run.py [MODULE.py ...]     run what has no result yet; Ctrl-C and go on
    python tests/mutation/run.py --share .1 --seed 1 a tenth of the mutants, drawn by the seed
    python tests/mutation/run.py --report            say what is known, run nothing
    python tests/mutation/run.py --sabotage          the sabotages of `plan.toml` alone

`plan.toml` says which modules decide and which tests watch each of them, `survivors.md` which
changes may pass the tests, and why. Exit code 1: something survives that is not listed there,
or is listed and no longer survives. Every mutant is run in a fork of a process in which the
libraries are loaded already, in one thread, and nothing on the disk is touched but
`.mutation/`, where the results stand.
"""

import argparse
import ast
import contextlib
import hashlib
import importlib
import json
import os
import re
import resource
import signal
import sys
import time
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT), str(HERE.parent)]

import changed  # noqa: E402
from corpora import make  # noqa: E402
from mutants import Mutant, mutants_of  # noqa: E402

os.environ.update(make.ENVIRONMENT)  # before numpy loads

LOADED = (  # third parties' modules that tests and code load
    "numpy", "scipy.ndimage", "scipy.optimize", "scipy.spatial", "scipy.stats", "pytest",
    "sqlalchemy", "pydantic", "yaml", "h5py", "_pytest.assertion.rewrite",
)  # fmt: skip
OURS = ("encoded_objects", "generator", "decoder", "probe", "recognizer")
LONGEST_S = 20.0  #: CPU seconds that no unit test needs; a mutant that takes longer is caught
MOST_BYTES = 6 << 30  #: of memory
FORKED = get_context("fork")


@dataclass(frozen=True, slots=True)
class Watched:
    """A module that decides, and the tests that watch it, the likeliest to notice first."""

    module: str
    tests: tuple[str, ...]
    within: tuple[str, ...] = ()  #: names (constants too) of what decides; all by default
    corpora: tuple[str, ...] = ()  #: CORPUS/PART made after the tests, as stored or not
    share: float = 1.0  #: of its changes that are drawn
    seed: int = 0

    def mutants(self) -> list[Mutant]:
        """Return every change of it, or those that are drawn."""
        return [m for m in mutants_of((ROOT / self.module).read_text()) if self._is_drawn(m)]

    def _is_drawn(self, mutant: Mutant) -> bool:
        names = {mutant.place.split(".")[0], re.split(":| = ", mutant.before)[0]}
        drawn = _digest(f"{self.seed} {self.module} {mutant.name}".encode())
        within = not self.within or names & {*self.within}
        return bool(within) and int(drawn, 16) < self.share * 16 ** len(drawn)

    def state(self) -> str:
        """Return a digest of the tests: with other ones a survivor is tried again."""
        files = [ROOT / test.split("::")[0] for test in self.tests]
        files += [file for part in self.corpora for file in make.files_of(part.split("/")[0])]
        files = [file for file in files if file.exists()]
        return _digest(b"".join(file.read_bytes() for file in files))


class Results:
    """What is known of mutants: one line of JSON each, appended as they are run."""

    def __init__(self, path: Path) -> None:
        self._path = path
        path.parent.mkdir(exist_ok=True)
        lines = path.read_text().splitlines() if path.exists() else []
        self._known = {(e["module"], e["mutant"]): e for e in map(json.loads, lines)}

    def outcome(self, watched: Watched, mutant: Mutant, state: str) -> str | None:
        """Return "killed", "survived" or None: what was killed once, stays so."""
        entry = self._known.get((watched.module, _digest(mutant.source.encode())))
        if entry is None or (entry["outcome"] == "survived" and entry["tests"] != state):
            return None
        return str(entry["outcome"])

    def add(self, watched: Watched, mutant: Mutant, state: str, outcome: str) -> None:
        """Keep a result."""
        digest = _digest(mutant.source.encode())
        entry = {"module": watched.module, "mutant": digest, "name": mutant.name}
        entry |= {"tests": state, "outcome": outcome}
        self._known[watched.module, digest] = entry
        with self._path.open("a") as file:
            file.write(json.dumps(entry) + "\n")


def load_others(watched: Watched) -> None:
    """Import what the tests need of ours and does not itself import the watched module."""
    for test in watched.tests:
        for name in _imports(ROOT / test.split("::")[0], ""):
            with contextlib.suppress(ImportError):
                importlib.import_module(name)
    ours = {
        name: _imports(Path(module.__file__), name)
        for name, module in list(sys.modules.items())
        if name.split(".")[0] in OURS and getattr(module, "__file__", None)
    }
    dependent, size = {changed.dotted(watched.module)}, 0
    while len(dependent) > size:
        size = len(dependent)
        dependent |= {name for name, needed in ours.items() if needed & dependent}
    for name in dependent & set(ours):
        parent, _, own = name.rpartition(".")
        del sys.modules[name]
        if parent in sys.modules:
            vars(sys.modules[parent]).pop(own, None)


def _imports(file: Path, name: str) -> set[str]:
    """Return the modules of ours that a file may import, whatever the names stand for."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {str(node.module)} | {f"{node.module}.{alias.name}" for alias in node.names}
    found |= {part.rpartition(".")[0] for part in found}
    return {one for one in found if one.split(".")[0] in OURS} - {name}


def passes(watched: Watched, source: str, *, loud: bool = False) -> bool:
    """Return whether the tests pass with a module's changed source, in a process of their own."""
    child = FORKED.Process(target=_test_alone, args=(watched, source, loud))
    child.start()
    try:
        child.join(20 * LONGEST_S)
    finally:  # late, or Ctrl-C
        if child.is_alive():
            os.killpg(child.pid, signal.SIGKILL)
            child.join()
    if child.exitcode in (4, 5):  # pytest: wrong usage, no tests
        raise SystemExit(f"{watched.module}: {watched.tests} cannot be run")
    return child.exitcode == 0


def _test_alone(watched: Watched, source: str, loud: bool) -> None:
    os.setpgid(0, 0)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (int(LONGEST_S), int(LONGEST_S) + 2))
    if not loud:
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in (1, 2):
            os.dup2(nothing, stream)
    raise SystemExit(_tested(watched, source))


def _tested(watched: Watched, source: str) -> int:
    import pytest

    changed.install(watched.module, source)
    os.chdir(ROOT)
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    options = ["-x", "-q", "--no-header", "--tb=short"]
    options += ["-p", "no:cacheprovider", "-p", "xdist.plugin"]
    failed = int(pytest.main([*options, *watched.tests]))
    if failed or not watched.corpora:
        return failed
    with changed.installed_in_programs(watched.module, source):
        return int(not all(make.make(part, check=True) for part in watched.corpora))


def justified(path: Path) -> dict[str, set[str]]:
    """Return module -> names of the mutants that `survivors.md` lists."""
    found: dict[str, set[str]] = {}
    module = ""
    for line in path.read_text().splitlines() if path.exists() else ():
        if line.startswith("## "):
            module = line[3:].strip()
        elif line.startswith("- "):
            found.setdefault(module, set()).add(line[2:].strip())
    return found


def run_module(watched: Watched, results: Results) -> None:
    """Run what is not known yet of a module; in a process of its own, which it spoils."""
    state = watched.state()
    unknown = [m for m in watched.mutants() if results.outcome(watched, m, state) is None]
    if not unknown:
        return
    load_others(watched)
    source = (ROOT / watched.module).read_text()
    if not passes(watched, source, loud=True):
        raise SystemExit(f"{watched.module}: its tests fail without any change")
    began = time.monotonic()
    for mutant in unknown:
        alive = passes(watched, mutant.source)
        results.add(watched, mutant, state, "survived" if alive else "killed")
        if alive:
            print(f"  line {mutant.line}: {mutant.name}", flush=True)
    seconds = (time.monotonic() - began) / len(unknown)
    print(f"{watched.module}: {len(unknown)} run, {seconds:.2f} s each", flush=True)


def report(watched: Watched, results: Results, listed: set[str]) -> int:
    """Say what survives in a module; return how many of these are not as they are listed."""
    state = watched.state()
    outcomes = {m.name: results.outcome(watched, m, state) for m in watched.mutants()}
    found = {name for name, outcome in outcomes.items() if outcome == "survived"}
    unknown = {name for name, outcome in outcomes.items() if outcome is None}
    print(
        f"{watched.module}: {len(outcomes)} mutants, {len(found)} survive, "
        f"{len(found & listed)} of them justified" + (f"; {len(unknown)} not run" * bool(unknown))
    )
    for name in outcomes:
        if name in found - listed:
            print(f"- {name}")
    drawn = listed if watched.share == 1.0 else listed & {*outcomes}
    caught = drawn - found - unknown
    for name in sorted(caught):
        print(f"  justified, but it does not survive: {name}")
    return len(found - listed) + len(caught) + len(unknown)


def run_sabotages(watched: Watched, plan: list[dict[str, str]]) -> None:
    """Run the sabotages of a module; exit with their number that passes the tests."""
    load_others(watched)
    source, passed = (ROOT / watched.module).read_text(), 0
    for one in plan:
        there = source.count(one["old"]) == 1
        alive = there and passes(watched, source.replace(one["old"], one["new"]))
        said = "SURVIVES" if alive else "caught" if there else "its text is not there once"
        print(f"{one['name']}: {said}", flush=True)
        passed += alive or not there
    raise SystemExit(passed)


def alone(run: Callable[..., None], *values: object) -> int:
    """Run a function in a process of its own; return its exit code."""

    def quietly() -> None:
        try:
            run(*values)
        except KeyboardInterrupt:
            raise SystemExit(130) from None

    child = FORKED.Process(target=quietly)
    child.start()
    while True:
        with contextlib.suppress(KeyboardInterrupt):  # the child has it too, and ends
            child.join()
            return int(child.exitcode or 0)


def main() -> int:
    """Run."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("modules", nargs="*", help="all of the plan by default")
    parser.add_argument("--share", type=float, default=1.0, help="of the mutants, drawn by --seed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--report", action="store_true", help="run nothing")
    parser.add_argument("--sabotage", action="store_true", help="the named sabotages alone")
    asked = parser.parse_args()
    os.nice(10)
    plan = tomllib.loads((HERE / "plan.toml").read_text())
    watched = []
    for entry in plan["watch"]:
        if not asked.modules or entry["module"] in asked.modules:
            lists = {key: tuple(value) for key, value in entry.items() if key != "module"}
            watched.append(Watched(entry["module"], **lists, share=asked.share, seed=asked.seed))
    for name in () if asked.report else LOADED:
        importlib.import_module(name)
    if asked.sabotage:
        passed = 0
        for one in watched:
            if each := [s for s in plan["sabotage"] if s["module"] == one.module]:
                passed += alone(run_sabotages, one, each)
        return int(passed > 0)
    path = ROOT / ".mutation" / "results.jsonl"
    for one in () if asked.report else watched:
        if code := alone(run_module, one, Results(path)):
            return code
    results, listed = Results(path), justified(HERE / "survivors.md")
    return int(sum(report(one, results, listed.get(one.module, set())) for one in watched) > 0)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:24]


if __name__ == "__main__":
    sys.exit(main())
