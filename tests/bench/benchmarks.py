"""All figures of a release on one page, as ratios, beside the release before.

    python tests/bench/benchmarks.py                              # this tree -> docs/benchmarks.*
    python tests/bench/benchmarks.py --tree DIR --label 0.2.0     # another release, beforehand

Each figure is processor time of one thread with start-up and all files (medians), divided by that
of a product of two 1000 x 1000 matrices of numpy, measured just before it: the quotients of two
machines, or of a quiet and a busy one, can be compared; the seconds cannot. Reading is the time of
one call in a running process. Peers emboss the same vertical symbols (`embossing.py`, imports left
out); what takes longer than `--limit` CPU seconds is left out, with `--small` also 20,184 symbols,
the set and peers. `docs/benchmarks.json` keeps the records of
releases, the page and its picture show the last two.
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner
from embossing import OURS, WAYS, actual, run

# This process stays small: what it starts would count its memory as a peak of its own.
HERE = Path(__file__).resolve()
DOCS = HERE.parents[2] / "docs"
TARGETS_S = {  # what must be reached on a quiet core: docs/benchmarks.md says of what
    "encode-object, cube of 384 symbols": 0.7,
    "encode-object, cube of 20,184 symbols": 5.0,
    "recognize-object, one touch": 0.7,
    "Reader.read, mid-face": 0.0045,
    "Reader.read, a washer refused": 0.010,
    "decode, likelihood, one-touch, a window of a batch": 0.00003,
    "decode, logarithm, n = 64, one window": 0.001,
}
CUBES = {  # symbols: side (mm) and profile, at 7 mm
    "384": ("60 mm", "one-touch"),
    "2,400": ("146 mm", "large"),
    "20,184": ("412 mm", "auto"),
}
SET = """objects:
  - {name: Cube, shape: {cube: 60 mm}, copies: 10}
  - {name: Prism, shape: {triangular_prism: {side: 60 mm, height: 50 mm}}, copies: 10}
  - {name: Box, shape: {box: [80 mm, 60 mm, 40 mm]}, copies: 10}
  - {name: Tetra, shape: {tetrahedron: 80 mm}, copies: 10}
"""
TOUCHES = 8  #: read of each sort
CLOCK = """
import json, statistics, sys, time
import numpy as np
times = []
def clock(work, *values, parts=1):
    start = time.process_time()
    work(*values)
    times.append((time.process_time() - start) / parts)
"""
PRODUCT = f"""{CLOCK}
a, b = np.random.default_rng(0).normal(size=(2, 1000, 1000))
for _ in range(5):
    clock(np.matmul, a, b)
print(min(times))
"""
READING = f"""{CLOCK}
import h5py
from encoded_objects import Reader, open_lab
reader = Reader(open_lab(sys.argv[1]))
touches = h5py.File(sys.argv[2])["frames"][:]
for counts in touches:
    reader.read(counts)
for counts in touches:  # others in between: what one was searched with is kept for the next try
    clock(reader.read, counts)
print(json.dumps(statistics.median(times)))
"""
DECODING = f"""{CLOCK}
from decoder import Likelihood
from generator.array import profile
array = profile("one-touch").array()
rng = np.random.default_rng(1)
rows, columns = rng.integers(0, 63, 2000), rng.integers(0, 65, 2000)
r, c = np.indices((6, 6))
windows = array.symbols((rows[:, None, None] + r) % 63, (columns[:, None, None] + c) % 65)
decoder = Likelihood(array)
for _ in range(3):
    clock(decoder.decode, windows, parts=len(windows))
print(json.dumps(min(times)))
"""
EXACT = f"""{CLOCK}
from decoder import decode_exact
from generator.array import array_from
array = array_from(dict(family="prba", order=2, degree=64))
places = np.random.default_rng(1).integers(0, 2**31, (2, 50, 1, 1)).astype(np.uint64)
a, b = np.indices(array.window).astype(np.uint64)
for window in array.symbols(places[0] + a, places[1] + b):
    clock(decode_exact, array, window[None], "logarithm")
print(json.dumps(statistics.median(times)))
"""
HEAD = """# Benchmarks

Processor time of one thread with start-up and all files, in products of two 1000 x 1000
matrices of numpy in the same minute; in brackets seconds on the machine of the record,
and the peak of memory. *Target*: seconds on a quiet core. Made by
`python tests/bench/benchmarks.py`, whose head says how; the records are
[benchmarks.json](benchmarks.json).

![Figures of the last two records](benchmarks.png)
"""


class Figure(NamedTuple):
    """What one thing costs; 0 MB: not asked."""

    cpu_s: float
    ratio: float  #: of `cpu_s` to the product
    peak_mb: float = 0.0


def figure(cpu_s: float, product_s: float, peak_mb: float = 0.0) -> Figure:
    """Return a figure rounded to what is repeatable."""
    return Figure(float(f"{cpu_s:.3g}"), float(f"{cpu_s / product_s:.3g}"), round(peak_mb))


@dataclass(frozen=True)
class Tree:
    """A source tree that is measured, and a folder to work in."""

    root: Path
    folder: Path

    def process(self, code: str, *arguments: object, cwd: Path | None = None) -> tuple[Figure, str]:
        """Run Python code on the tree's packages; its cost, and what it printed."""
        environment = dict(os.environ)
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        environment |= {
            "PYTHONPATH": str(self.root), "PYTHONPYCACHEPREFIX": str(self.folder / "pyc"),
            "XDG_CACHE_HOME": str(self.folder / "cache"), "PYTHONNOUSERSITE": "1",
        }  # fmt: skip
        product_s = product()
        with (
            (self.folder / "stdout").open("w+b") as out,
            (self.folder / "stderr").open("w+b") as err,
        ):
            command = [sys.executable, "-c", code, *map(str, arguments)]
            child = subprocess.Popen(
                command, env=environment, cwd=cwd or self.folder, stdout=out, stderr=err
            )
            _, status, used = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            out.seek(0)
            err.seek(0)
            if child.returncode:
                raise RuntimeError(f"{command[3:]}: {err.read().decode()[-2000:]}")
            cpu_s = used.ru_utime + used.ru_stime
            return figure(cpu_s, product_s, used.ru_maxrss / 1024), out.read().decode()

    def command(self, name: str, *arguments: object, cwd: Path | None = None) -> Figure:
        """Run one of the tree's commands."""
        scripts = tomllib.loads((self.root / "pyproject.toml").read_text())["project"]["scripts"]
        module, function = scripts[name].split(":")
        code = f"import sys; from {module} import {function} as main; sys.exit(main())"
        return self.process(code, *arguments, cwd=cwd)[0]


def product() -> float:
    """Return the processor time (s) of the fixed product, the least of five."""
    done = subprocess.run([sys.executable, "-c", PRODUCT], capture_output=True, check=True)
    return float(done.stdout)


def median(figures: list[Figure]) -> Figure:
    """Return the figure of median ratio."""
    return sorted(figures, key=lambda one: one.ratio)[len(figures) // 2]


def measure(tree: Tree, found: dict[str, Figure], keep: Callable[[], None], *, large: bool) -> None:
    """Fill in all figures of a tree; `keep` them after each."""

    def note(name: str, figures: list[Figure]) -> None:
        found[name] = median(figures)
        print(f"{name:52} {found[name].ratio:10.4g} products  {found[name].cpu_s:9.4g} s  "
              f"{found[name].peak_mb:5.0f} MB", flush=True)  # fmt: skip
        keep()

    scripts = tomllib.loads((tree.root / "pyproject.toml").read_text())["project"]["scripts"]
    for name in scripts:
        note(f"{name} --help", [tree.command(name, "--help") for _ in range(6)][1:])
    for symbols, (side, profile) in CUBES.items():
        if symbols == "20,184" and not large:
            continue
        repeats = 6 if symbols == "384" else 4 if symbols == "2,400" else 3
        spec = {"name": "Cube", "shape": {"cube": side}, "profile": profile}
        note(f"encode-object, cube of {symbols} symbols",
             [_encode(tree, json.dumps(spec | {"symbols": {"pitch": "7 mm"}}), f"{symbols}-{k}")
              for k in range(repeats)][1 - repeats % 2 :])  # fmt: skip
    if large:
        note("encode-object, set of 40", [_encode(tree, SET, "forty", "-j", "1")])
    lab = tree.folder / "384-0" / "lab.db"
    face = tree.folder / "384-0" / "out" / "Cube-F1.stl"
    corner = ("at a corner", face, ("--x", 21, "--y", 21))
    middle, washer = ("mid-face", face, ("--x", 0, "--y", 0)), ("a washer refused", "washer", ())
    for name, target, place in (middle, corner, washer):
        touches = tree.folder / f"{name}.h5"
        made = tree.command("probe-sensor", "simulate", target, *place, "--touches", TOUCHES,
                            "--seed", 3, "-o", touches)  # fmt: skip
        if name == "mid-face":
            note(f"probe-sensor simulate, {TOUCHES} touches", [made])
            one = tree.folder / "one.h5"
            words = ("simulate", target, *place, "-o", one, "--replace")
            again = [tree.command("probe-sensor", *words) for _ in range(3)]
            note("probe-sensor simulate, one touch", again)
            read = [tree.command("recognize-object", one, "--database", lab) for _ in range(6)]
            note("recognize-object, one touch", read[1:])
        try:
            note(f"Reader.read, {name}", [_inside(tree, READING, lab, touches)])
        except RuntimeError as error:  # a release of another signature
            print(f"Reader.read, {name}: not measured, {str(error).splitlines()[-1]}")
    note("decode, likelihood, one-touch, a window of a batch", [_inside(tree, DECODING)])
    note("decode, logarithm, n = 64, one window", [_inside(tree, EXACT)])


def _encode(tree: Tree, spec: str, name: str, *more: object) -> Figure:
    """Make one spec in a folder of its own."""
    folder = tree.folder / name
    folder.mkdir()
    (folder / "spec.yaml").write_text(spec)
    where = ("-o", "out", "--database", "lab.db")
    return tree.command("encode-object", "spec.yaml", *where, *more, cwd=folder)


def _inside(tree: Tree, code: str, *arguments: object) -> Figure:
    """Return the time that the code itself took and printed."""
    product_s = product()
    whole, printed = tree.process(code, *arguments)
    return figure(json.loads(printed.splitlines()[-1]), product_s, whole.peak_mb)


def peers(symbols: int, limit_s: float) -> dict[str, Figure]:
    """Return what embossing a cube costs every way that stays below the limit, imports left out."""
    found = {}
    for way in WAYS:
        product_s = product()
        if made := run(way, symbols, limit_s):
            found[way] = figure(made.cpu_s, product_s, made.peak_mb)
        told = f"{made.cpu_s:9.4g} s" if made else "left out: over the limit"
        print(f"{way:52} {told}", flush=True)
    return found


def page(records: dict[str, dict]) -> str:
    """Return the page: the last two records side by side."""
    labels = list(records)[-2:]
    newest = records[labels[-1]]
    lines = [HEAD, "| | " + " | ".join(labels) + " | quotient | target |"]
    lines.append("| --- |" + " ---: |" * (len(labels) + 2))
    for name, figure in newest["figures"].items():
        cells = [_cell(records[label]["figures"].get(name)) for label in labels]
        before = records[labels[0]]["figures"].get(name) if len(labels) > 1 else None
        change = f"{figure['ratio'] / before['ratio']:.2f}" if before else ""
        target = f"{TARGETS_S[name]:g} s" if name in TARGETS_S else ""
        target = "0.15 s" if name.endswith("--help") else target
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {change} | {target} |")
    if newest["peers"]:
        lines += _peer_lines(newest)
    return "\n".join([*lines, "", f"Newest record: {newest['machine']}.", ""])


def _peer_lines(newest: dict) -> list[str]:
    """Return the table of embossing beside peers."""
    told = f"""
Embossing a cube of {newest["peer_symbols"]} symbols, STEP and STL (manifold3d: STL
alone), imports left out:

| way | products, seconds, memory | times this project |
| --- | ---: | ---: |"""
    lines = [told]
    ours = newest["peers"][OURS]["ratio"]
    for name, figure in newest["peers"].items():
        lines.append(f"| {name} | {_cell(figure)} | {figure['ratio'] / ours:.1f} |")
    return lines


def _cell(figure: dict | None) -> str:
    if figure is None:
        return ""
    memory = f", {figure['peak_mb']:.0f} MB" if figure["peak_mb"] else ""
    return f"{figure['ratio']:.3g} ({figure['cpu_s']:.3g} s{memory})"


def draw(records: dict[str, dict], path: Path) -> None:
    """Draw the last two records as bars."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    labels = list(records)[-2:]
    names = list(records[labels[-1]]["figures"])
    figure, axes = plt.subplots(figsize=(9, 0.32 * len(names) + 1.2), constrained_layout=True)
    for number, label in enumerate(labels):
        known = records[label]["figures"]
        there = [k for k, name in enumerate(names) if name in known]
        values = [known[names[k]]["ratio"] for k in there]
        axes.barh([k + 0.38 * (number - 0.5) for k in there], values, 0.36, label=label)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlabel("processor time, products of two 1000 x 1000 matrices")
    axes.grid(axis="x", alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=110, metadata={"Software": None})


def main() -> None:
    """Measure, keep the record, make the page."""
    options = runner.asked(__doc__, tree=str(HERE.parents[2]), label="unreleased", limit=60.0,
                           small=False, output=str(DOCS))  # fmt: skip
    options.tree, options.output = Path(options.tree), Path(options.output)
    file = options.output / "benchmarks.json"
    records = json.loads(file.read_text()) if file.exists() else {}
    figures: dict[str, Figure] = {}
    rivals: dict[str, Figure] = {}
    machine = (
        f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy "
        f"{version('numpy')}, product {1e3 * product():.0f} ms, load "
        f"{os.getloadavg()[0]:.0f}"
    )
    records.pop(options.label, None)

    def keep() -> None:
        """Write what is known: a run that is stopped leaves that much."""
        records[options.label] = {
            "machine": machine,
            "figures": {name: one._asdict() for name, one in figures.items()},
            "peer_symbols": actual(384),
            "peers": {name: one._asdict() for name, one in rivals.items()},
        }
        file.write_text(json.dumps(records, indent=1) + "\n")
        (options.output / "benchmarks.md").write_text(page(records))

    with tempfile.TemporaryDirectory() as folder:
        tree = Tree(options.tree.resolve(), Path(folder))
        measure(tree, figures, keep, large=not options.small)
    if options.tree.resolve() == HERE.parents[2] and not options.small:
        rivals |= peers(384, options.limit)
    keep()
    draw(records, options.output / "benchmarks.png")


if __name__ == "__main__":
    main()
