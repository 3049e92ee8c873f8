"""Encode public CAD models: made and verified, or refused with a reason; none may crash.

    python tests/campaigns/cad_models.py --fetch cad-models

Models of `cad_sources.py` go through the whole command, `encode-object --verify`, in a process
of their own with a limit of processor time: STEP is read back by the CAD kernel, STL by
pymeshlab. What was read of a model is compared with its volume by the kernel. A model is scaled
so that its largest face has the area of a square of 60 mm if it is smaller and of 120 mm if it is
larger. A polyhedral model that cannot be made as panels is made whole. Exit code 1 when a model
crashes, runs out of time, fails verification, or is refused without cause, place and way out.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import math
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from cad_sources import SOURCES, fetched, models

from generator.command import run
from generator.errors import GeneratorError
from generator.export.check import read_step, read_stl
from generator.polyhedron import Polyhedron, face_area, volume
from generator.polyhedron.read import read_shape

SMALL_MM, LARGE_MM = 60.0, 120.0  #: sides of a square as large as the largest face
PLANAR = 1e-4  #: share of the volume by which what is read may be off
CHORD_MM = 1.0  #: distance of round faces by which it may be off: the coarsest division
PATIENCE = 10  #: times the limit of processor time, by the clock: for a busy machine
UNVERIFIED = "do not print it"  #: in the way out of a part that failed verification


def encoded(model: Path) -> dict[str, object]:
    """Encode one model in the current folder and return a row of the table."""
    row: dict[str, object] = {"scale": 1.0, "faces": "", "result": "refused", "reason": ""}
    try:
        solid = read_shape(model)
    except GeneratorError as error:
        return row | refusal(error)
    runs = [surface.facets for surface in solid.surfaces]
    other = {solid.faces[k].name.partition(".")[0] for k in solid.blank}
    planar = len(solid.faces) - sum(map(len, runs)) - len(solid.blank)
    row["scale"] = scale = scale_of(solid)
    row["faces"] = f"{planar}/{len(runs)}/{len(other)}"
    try:
        solid = read_shape(model, scale)
    except GeneratorError as error:
        return row | refusal(error)
    if problem := volume_problem(model, solid, scale):
        return row | {"result": "FAILED", "reason": problem}
    for parts in ("panels", "whole") if not (runs or other) else ("whole",):
        spec = f"name: Part\nshape: {{file: {json.dumps(str(model))}, scale: {scale}}}\n"
        spec += f"profile: auto\nprint: {{parts: {parts}}}\n"
        Path(f"{parts}.yaml").write_text(spec)
        arguments = [f"{parts}.yaml", "-o", parts, "--database", f"{parts}.db", "--verify"]
        with contextlib.redirect_stdout(io.StringIO()) as said:
            code = run([*arguments, "--format", "step,stl", "--json"])
        answer = json.loads(said.getvalue())
        if code == 0:
            (made,) = answer["objects"]
            counts = {"symbols": made["symbols"], "places": made["places"]}
            name = f"{made['parts']} panels" if parts == "panels" else "whole"
            return row | {"result": "encoded", "parts": name, **counts}
        problems = answer["error"].get("problems", [answer["error"]])
        row["reason"], row["fix"] = (problems[0][key] for key in ("cause", "fix"))
        row["complete"] = all(all((p["place"], p["cause"], p["fix"])) for p in problems)
        if UNVERIFIED in problems[0]["fix"] or code != 2:
            return row | {"result": "FAILED"}
    return row


def refusal(error: GeneratorError) -> dict[str, object]:
    """Return what a row says of a model that is refused when it is read."""
    complete = all((error.place, error.cause, error.fix))
    return {"reason": error.cause, "fix": error.fix, "complete": complete}


def scale_of(solid: Polyhedron) -> float:
    """Return the scale, to two digits, at which the largest face is neither small nor large."""
    runs = [surface.facets for surface in solid.surfaces]
    bent = {facet for facets in (*runs, solid.blank) for facet in facets}
    areas = [face_area(solid, k) for k in range(len(solid.faces)) if k not in bent]
    areas += [sum(face_area(solid, k) for k in facets) for facets in runs]
    side = math.sqrt(max(areas, default=float(np.ptp(solid.vertices, axis=0).max()) ** 2))
    exact = min(max(1.0, SMALL_MM / side), LARGE_MM / side)
    return float(f"{exact:.2g}")


def volume_problem(model: Path, solid: Polyhedron, scale: float) -> str:
    """Compare the volume that was read with that of the kernel or mesh library."""
    suffix = model.suffix.lower()
    if suffix == ".obj":
        return ""
    report = (read_stl if suffix == ".stl" else read_step)(model)
    exact = abs(report.volume_mm3) * scale**3
    bent = {facet for surface in solid.surfaces for facet in surface.facets} | {*solid.blank}
    allowed = PLANAR * exact + CHORD_MM * sum(face_area(solid, facet) for facet in bent)
    error = volume(solid) - exact
    if abs(error) <= allowed:
        return ""
    return f"it is read with a volume of {volume(solid):.6g} mm3; the kernel says {exact:.6g} mm3"


def limited(model: Path, seconds: float) -> dict[str, object]:
    """Encode one model in a process and a folder of its own, in so much processor time."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, __file__, "--one", str(model.resolve())]
        command += ["--seconds", str(seconds)]
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        child = subprocess.Popen(command, cwd=folder, start_new_session=True, **streams)
        try:
            said, errors = child.communicate(timeout=PATIENCE * seconds)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
            return {"result": "TIMEOUT", "reason": f"not done in {PATIENCE * seconds:g} s"}
    if child.returncode == -signal.SIGXCPU:
        return {"result": "TIMEOUT", "reason": f"not done in {seconds:g} s of processor time"}
    if child.returncode:
        lines = errors.strip().splitlines() or [f"exit code {child.returncode}"]
        return {"result": "CRASHED", "reason": lines[-1]}
    row: dict[str, object] = json.loads(said.strip().splitlines()[-1])
    if row["result"] == "refused" and not row["complete"]:
        row["result"] = "UNSAID"
    return row


def line(package: str, model: Path, row: dict[str, object]) -> str:
    """Return one row of the table."""
    shown = " ".join(str(row.get("reason", "")).split())
    if row["result"] == "encoded":
        shown = f"{row['parts']}, {row['symbols']} symbols, {row['places']} places, verified"
    name = f"{model.parent.name}/{model.name}" if model.parent.name.startswith("s1") else model.name
    return (
        f"{name[:44]:44} {package[:16]:16} {row.get('faces', ''):>10} {row.get('scale', 1):>6g} "
        f"{row['result']:8} {row.get('seconds', math.nan):5.1f}  {shown[:200]}"
    )


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path, nargs="?", help="models, one folder a package")
    options.add_argument("--fetch", type=Path, metavar="FOLDER", help="fill it with the models")
    options.add_argument("--only", default="", metavar="REGEX", help="models whose path matches")
    options.add_argument(
        "--seconds", type=float, default=120.0, help="of processor time, for each model"
    )
    options.add_argument("-j", type=int, default=1)
    options.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    chosen = options.parse_args()
    if chosen.one:
        limit = math.ceil(chosen.seconds)  # of this process, and of each that it starts
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        row = encoded(chosen.one)
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = time.process_time() + children.ru_utime + children.ru_stime
        print(json.dumps(row | {"seconds": seconds}))
        return 0
    folder = chosen.fetch or chosen.folder
    if folder is None:
        options.error("give a folder of models, or --fetch FOLDER")
    if chosen.fetch:
        fetched(folder)
    found = [(p, m) for p, m in models(folder) if re.search(chosen.only, str(m))]
    print(f"{'model':44} {'package':16} planar/round/other  scale, result, s of processor")
    results: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    symbols = 0
    with ThreadPoolExecutor(chosen.j) as pool:
        rows = pool.map(lambda each: limited(each[1], chosen.seconds), found)
        for (package, model), row in zip(found, rows, strict=True):
            print(line(package, model, row), flush=True)
            results[str(row["result"])] += 1
            symbols += int(str(row.get("symbols", 0)))
            if row["result"] == "refused":
                words = "".join(c for c in str(row["reason"]) if not c.isdigit()).split()
                reasons[" ".join(words[:7])] += 1
    packages = len({package for package, _ in found})
    print(f"{len(found)} models of {packages} packages: {results['encoded']} encoded and verified "
          f"({symbols} symbols), {results['refused']} refused with a reason, "
          f"{len(found) - results['encoded'] - results['refused']} failed")  # fmt: skip
    for reason, count in reasons.most_common():
        print(f"  refused {count}: {reason} ...")
    print("packages: " + ", ".join(f"{s.package} {s.version} ({s.client})" for s in SOURCES))
    return 0 if found and set(results) <= {"encoded", "refused"} else 1


if __name__ == "__main__":
    sys.exit(main())
