"""Error against run time of every contact level, and the table that `press` picks from.

    PYTHONPATH=tests python tests/bench/contact_precision.py            # the table
    PYTHONPATH=tests python tests/bench/contact_precision.py --write    # and its files
    PYTHONPATH=tests python tests/bench/contact_precision.py --engine mujoco [--write]

Five indenters at some places each. The error of an image is the norm of its deviation over
the norm of the reference, root mean square over the places. References:

    tab   any indenter       817 points on every tip instead of 7, 19, 61
    pad   washer, sphere     axisymmetric elements, displacement and pressure (Q2-Q1), on a pad
                             that goes on beyond the matrix; the outermost tactels, to which the
                             layer gives what it would carry out there, are left out
          strip, patch, tilt layer with 24 cells to a tactel and 64 points to a cell

Times are CPU times with the surface, on one thread: the least of the repetitions of a touch, the
median over the touches; what a level makes once (influence functions) is made
before. A level that was not measured on every indenter,
or refuses one, is left out of what `press` picks from by itself.

With `--engine` the indenters are closed bodies, the patch is a written face, and the error is what
asking fewer than 217 points on a tip costs; beside it, how far the image lies from our own engine's
of an elastomer as stiff.
"""

import json
import math
import statistics
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from manifold3d import Manifold
from reference.elements import tactels_n
from reference.indenters import sphere

from encoded_objects import encode
from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.engines import engine_named
from probe.contact.layer import layer
from probe.contact.mujoco import DEEPEST_MM, STIFFER
from probe.contact.press import LEVELS, press
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import ContactError
from probe.simulate.target import part_surface
from probe.surface.body import body_of
from probe.surface.face import endless_face
from probe.surface.indenters import RaisedStrip, TiltedPlane, Washer
from probe.surface.mesh import mesh

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "probe" / "contact" / "precision.json"
PICTURE = ROOT / "docs" / "contact-precision.png"

L = (((-1, 1), (-1, -1)), ((-1, -1), (1, -1)))
GLYPHS = (
    L,
    (((1, -1), (-1, -1)), ((-1, -1), (-1, 0)), ((-1, 0), (0, 1)), ((0, -1), (0, 0))),
    (((-1, -1), (0, -1)), ((0, -1), (0, 0)), ((0, 0), (1, 1)), ((0, 0), (-1, 0))),
    (*L, ((1, -1), (1, 1))),
)
STIFF = WristStiffness(1e9, 1e9)  # a level plate, as the axisymmetric references have
BALL_MM = 30.0
ROUND = ("washer", "sphere")
#: What edges under a few points make is a matter of chance.
PLACES = {"tab": 48, "pad": 3, "engine": 40}
REFERENCE_POINTS = 817  #: on each tip; the next finer level has 61
ENGINE_POINTS, ENGINE_REFERENCE = (7, 19, 61), 217
DEEP_MM = 4.0  #: of the closed bodies


def cases(rng):
    """Name -> surface, force on tabs and on a pad (N), wrist."""
    labels = rng.integers(0, 4, (16, 16))
    return {
        "washer": (Washer(), 80.0, 80.0, STIFF),
        "strip": (RaisedStrip(2.0), 40.0, 40.0, STIFF),
        "sphere": (sphere(BALL_MM), 40.0, 40.0, STIFF),
        "patch": (endless_face(labels, GLYPHS), 80.0, 80.0, STIFF),
        "tilt": (TiltedPlane(0.02, 0.01), 60.0, 60.0, WristStiffness()),
    }


def places(rng, count, force_n, wrist):
    """Touches at random within a tactel, at any rotation."""
    for _ in range(count):
        x, y = rng.uniform(-0.8, 0.8, 2)
        yield Touch(float(x), float(y), float(rng.uniform(0, math.pi)), force_n, wrist=wrist)


def reference(kind, case, surface, sensor, touch):
    """Return the forces on the tactels that levels are measured by."""
    if kind == "tab":
        return tabs(surface, sensor, touch, Tips(REFERENCE_POINTS)).forces_n
    if case not in ROUND:
        return layer(surface, sensor, touch, cells_per_tactel=24, samples=64).forces_n
    return tactels_n(case, sensor, touch)


def measured(kind, case, surface, sensor, touches, repeat):
    """Return lines (level, error, ms) for one indenter; None where a level refuses it."""
    wanted = [reference(kind, case, surface, sensor, touch) for touch in touches]
    round_pad = kind == "pad" and case in ROUND
    kept = np.s_[1:-1, 1:-1] if round_pad else np.s_[:, :]
    found = {}
    for level in LEVELS[kind]:
        try:
            found[level] = [press(surface, sensor, t, accuracy=level).forces_n for t in touches]
        except ContactError as refused:
            print(f"{kind:4}{case:8}{level:12} refused: {refused}")
    times = timed(surface, sensor, touches, list(found), repeat)
    for level in LEVELS[kind]:
        if level not in found:
            yield level, math.inf, math.nan
            continue
        errors = apart([a[kept] for a in found[level]], [b[kept] for b in wanted])
        error = root_mean_square(errors)
        print(f"{kind:4}{case:8}{level:12} error {error:9.2e}, at most {max(errors):9.2e}"
              f"   {times[level]:9.2f} ms", flush=True)  # fmt: skip
        yield level, error, times[level]


def apart(images, wanted):
    """Return |image - wanted| / |wanted| of each."""
    return [np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in zip(images, wanted, strict=True)]


def root_mean_square(errors):
    return math.sqrt(statistics.fmean(e * e for e in errors))


def timed(surface, sensor, touches, levels, repeat):
    """Return CPU times, ms; the levels take turns, so that all meet the same machine."""
    times = {level: [[] for _ in touches] for level in levels}
    for number, touch in enumerate(touches):
        for _ in range(repeat):
            for level in levels:
                work = partial(press, surface, sensor, touch, accuracy=level)
                times[level][number].append(runner.clocked(work)[1])
    return {level: statistics.median(map(min, each)) for level, each in times.items()}


def bodies():
    """Name -> closed body, force (N), wrist, as `cases` has them."""
    low = (0, 0, -DEEP_MM)
    ring = Manifold.cylinder(DEEP_MM, 7.5, 7.5, 256) - Manifold.cylinder(DEEP_MM, 3.5, 3.5, 256)
    bar = Manifold.cube((2, 60, DEEP_MM)).translate((-1, -30, -DEEP_MM))
    cap = Manifold.sphere(BALL_MM, 512).translate((0, 0, -BALL_MM))
    cap = cap ^ Manifold.cube((60, 60, DEEP_MM), center=True).translate((0, 0, -DEEP_MM / 2))
    corners = [(x, y, z) for x in (-30, 30) for y in (-30, 30) for z in (0, 1)]
    plane = Manifold.hull_points([(x, y, z * DEEP_MM * 2 + 0.02 * x + 0.01 * y - 9 + z)
                                  for x, y, z in corners])  # fmt: skip
    return {
        "washer": (surface_of(ring.translate(low)), 80.0, STIFF),
        "strip": (surface_of(bar), 40.0, STIFF),
        "sphere": (surface_of(cap), 40.0, STIFF),
        "patch": (written_face(), 80.0, STIFF),
        "tilt": (surface_of(plane), 60.0, WristStiffness()),
    }


def surface_of(body):
    made = body.to_mesh()
    return mesh(np.asarray(made.vert_properties, float)[:, :3][np.asarray(made.tri_verts)])


def written_face():
    """Return a face of a cube as its STL holds it, its middle at the origin."""
    with tempfile.TemporaryDirectory() as folder:
        database = f"{folder}/lab.db"
        encode({"name": "Cube", "shape": {"cube": "90 mm"}, "profile": "one-touch"},
               folder=folder, database=database, formats=("stl",))  # fmt: skip
        part = next(iter(sorted(Path(folder).rglob("*-F1.stl"))))
        scene = part_surface(part, database=database, face="F1")
    triangles = body_of(scene.surface)
    return mesh(triangles - (*scene.centre_mm(), triangles[:, :, 2].max()))


def engine_lines(engine, chosen, seed, count, repeat):
    """Return the lines of an engine, worst error and median time over the indenters."""
    press_by, own, sensor = engine_named(engine).press, engine_named("own").press, SensorType()
    young = STIFFER * sensor.overlay.young_mpa * DEEPEST_MM / sensor.overlay.height_mm
    ours = replace(sensor, overlay=replace(sensor.overlay, young_mpa=young, height_mm=DEEPEST_MM))
    found = {points: [] for points in ENGINE_POINTS}
    for case, (surface, force_n, wrist) in bodies().items():
        if case not in chosen and chosen != [""]:
            continue
        touches = list(places(np.random.default_rng([seed, 7]), count, force_n, wrist))
        finest = Tips(ENGINE_REFERENCE)
        wanted = [press_by(surface, sensor, touch, finest).forces_n for touch in touches]
        others = [own(surface, ours, touch, finest).forces_n for touch in touches]
        for points in ENGINE_POINTS:
            images, times = [], []
            for touch in touches:
                work = partial(press_by, surface, sensor, touch, Tips(points))
                made = [runner.clocked(work) for _ in range(repeat)]
                images.append(made[-1][0].forces_n)
                times.append(min(ms for _, ms in made))
            error, other = (root_mean_square(apart(images, of)) for of in (wanted, others))
            found[points].append((error, other, statistics.median(times)))
            print(f"{case:8}{engine}-{points:<5} error {error:9.2e}, from our own {other:9.2e}"
                  f"   {found[points][-1][-1]:7.1f} ms", flush=True)  # fmt: skip
    table = []
    for points, lines in found.items():
        errors, others, ms = zip(*lines, strict=True)
        line = {"engine": engine, "level": f"{engine}-{points}", "touches": count * len(lines),
                "error": three(max(errors)), "from_own": three(max(others)),
                "ms": three(statistics.median(ms))}  # fmt: skip
        table.append(line)
        print(json.dumps(line))
    return table


def draw(known, path):
    """Draw error against run time, one panel for each overlay; the table's levels are named."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 2, figsize=(11, 4.8), sharey=True)
    for panel, kind in zip(panels, ("tab", "pad"), strict=True):
        lines = [p for p in known["cases"] if p["overlay"] == kind and p["error"]]
        for number, case in enumerate(dict.fromkeys(line["case"] for line in lines)):
            here = [p for p in lines if p["case"] == case]
            panel.loglog([p["ms"] for p in here], [p["error"] for p in here], "o-", ms=4, lw=1,
                         color=f"C{number}", label=case)  # fmt: skip
        worst = known["levels"][kind]
        panel.loglog([p["ms"] for p in worst], [p["error"] for p in worst], "k--", lw=1.5,
                     marker="D", ms=5, label="worst error, median time")  # fmt: skip
        for p in worst:
            panel.annotate(p["level"], (p["ms"], p["error"]), fontsize=9, weight="bold",
                           xytext=(6, 5), textcoords="offset points")  # fmt: skip
        engines = known["engines"] if kind == "tab" else []
        for number, engine in enumerate(dict.fromkeys(p["engine"] for p in engines)):
            here = [p for p in engines if p["engine"] == engine]
            panel.loglog([p["ms"] for p in here], [p["error"] for p in here], "^--", ms=6,
                         color=f"C{5 + number}", label=f"{engine}, worst and median")  # fmt: skip
            for p in here:
                panel.annotate(p["level"], (p["ms"], p["error"]), fontsize=9, ha="right",
                               xytext=(-7, 5), textcoords="offset points")  # fmt: skip
        panel.set_title(f"{kind} overlay")
        panel.set_xlabel("CPU time of a touch with its surface [ms], one core")
        panel.set_ylim(1e-5, 1.5)
        panel.margins(x=0.12)
        panel.grid(visible=True, which="both", alpha=0.25)
        panel.legend(title="indenter", fontsize=8, loc="lower left")
    panels[0].set_ylabel("error of the image over the reference's norm [-]")
    figure.tight_layout()
    figure.savefig(path, dpi=150)


def main():
    """Measure what is asked for; `--overlay` tab or pad, `--case` some indenters."""
    given = runner.asked(__doc__, seed=1, places=0, repeat=3, case=[""], overlay=["tab", "pad"],
                         engine="", write=False)  # fmt: skip
    known = json.loads(TABLE.read_text())
    if given.engine:
        count = given.places or PLACES["engine"]
        table = engine_lines(given.engine, given.case, given.seed, count, given.repeat)
        kept = [line for line in known.get("engines", []) if line["engine"] != given.engine]
        if given.write:
            write_table(known | {"engines": kept + table})
        return
    lines = {(p["overlay"], p["case"], p["level"]): p for p in known["cases"]}
    for kind in given.overlay:
        sensor = SensorType(overlay=Overlay(kind=kind))
        for case, (surface, *forces, wrist) in cases(np.random.default_rng(given.seed)).items():
            if case not in given.case and given.case != [""]:
                continue
            rng, force = np.random.default_rng([given.seed, 7]), forces[kind == "pad"]
            touches = list(places(rng, given.places or PLACES[kind], force, wrist))
            for level, error, ms in measured(kind, case, surface, sensor, touches, given.repeat):
                lines[kind, case, level] = {"overlay": kind, "case": case, "level": level,
                                            "error": three(error), "ms": three(ms)}  # fmt: skip
    levels = {kind: [] for kind in LEVELS}
    for kind, level in ((kind, level) for kind, names in LEVELS.items() for level in names):
        here = [p for p in lines.values() if (p["overlay"], p["level"]) == (kind, level)]
        if here and all(p["error"] is not None for p in here):
            worst = max(p["error"] for p in here)
            ms = statistics.median(p["ms"] for p in here)
            levels[kind].append({"level": level, "error": worst, "ms": ms})
            print(f"{kind:4}{'worst':8}{level:12} error {worst:9.2e}   {ms:9.2f} ms")
    if given.write:
        write_table(known | {"cases": list(lines.values()), "levels": levels})


def three(value):
    """Return a figure to three digits, None where there is none."""
    return float(f"{value:.3g}") if math.isfinite(value) else None


def write_table(known):
    """Write `precision.json`, a line for each measurement, and its picture."""

    def rows(lines, wide):
        return ",\n".join(" " * wide + json.dumps(line) for line in lines)

    made = "OPENBLAS_NUM_THREADS=1 python tests/bench/contact_precision.py --write"
    heads = ",\n".join(f'    "{kind}": [\n{rows(lines, 6)}\n    ]'
                       for kind, lines in known["levels"].items())  # fmt: skip
    engines = f'  "engines": [\n{rows(known.get("engines", []), 4)}\n  ]'
    cases = f'  "cases": [\n{rows(known["cases"], 4)}\n  ]'
    head = f'  "made": "{made}",\n  "levels": {{\n{heads}\n  }}'
    TABLE.write_text(f"{{\n{head},\n{engines},\n{cases}\n}}\n")
    draw(json.loads(TABLE.read_text()), PICTURE)


if __name__ == "__main__":
    main()
