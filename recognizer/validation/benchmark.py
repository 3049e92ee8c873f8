"""`validate-set benchmark`: frozen touches with truth, and what readers make of them.

Seeds -> a folder with parts, a public half (fixed seed) and a hidden half (its seed is drawn when
it is run, or given), each in three forms, and the table of all readers::

    labs/TYPE/                  parts of a sensor type and their database: what a reader may know
    public/, hidden/
        WORLD.npz               touches: counts, truth and the least error of each (`COLUMNS`)
        WORLD.zarr              the same as FTP-1 (`dataset_formats`)
        WORLD/lerobot           the same as LeRobot v3.0
        card.md, card.json      what is inside: seeds, version, format, licence, sha256
    results.json, results.md    of the readers, by half, world, class and decoy

The same seed gives the same bytes in arrays; `FROZEN` holds the sha256 of the first touches of each
world of the public half.

A world is a sensor type and an engine of contact (`WORLDS`). An answer is right if it names the
face, within 2 mm and 10 degrees of the truth; next to another part, either may be named. Of what no
database holds, every answer is wrong. A reader is judged at the score that keeps its wrong answers
at `RATE` of all touches: with N touches of which none is wrong, a rate below 3.7 / N is shown.
"""

from __future__ import annotations

import hashlib
import json
import math
import secrets
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.files import whole_file
from encoded_objects.base.sensor_type_file import sensor_type_named
from recognizer.touch.recognition import NO_CONTACT, refusal
from recognizer.validation.benchmark_readers import (
    READERS,
    Read,
    ReaderAnswer,
    ReaderWorld,
    reader_named,
)
from recognizer.validation.campaign import Campaign, Work, series_of, shares_of
from recognizer.validation.dataset import (
    TouchDataset,
    errors_of_answers,
    faces_by_name,
    truth_row,
)
from recognizer.validation.dataset_formats import write_ftp1, write_lerobot
from recognizer.validation.draw import draw_touch
from recognizer.validation.errors import ValidationError
from recognizer.validation.files import write_json, write_text
from recognizer.validation.limits import bound_of_touch, errors_of
from recognizer.validation.run import TouchProgress, prepare_run
from recognizer.validation.statistics import (
    inside_of,
    normalised_errors,
    rms,
    round_digits,
    share_of,
)
from recognizer.validation.trial import NEAR_MM, judge
from recognizer.validation.workers import prepare_reader

Array = NDArray[Any]

TOUCHES = 2000  #: of a half, .7 MB: three minutes of CPU to make, of which MuJoCo takes one
PUBLIC_SEED = 37
RATE = 1e-4  #: of wrong answers, of all touches
HALVES = PUBLIC, HIDDEN = ("public", "hidden")
FROZEN: Final = Path(__file__).with_name("benchmark.json")
FIRST = 4  #: touches of each world whose sha256 stands there, too
LICENCE = "CC0-1.0"
DECIMALS = 6  #: of floats: mm, rad, N
SMALL_PITCH_MM = 4.0  #: below it, parts are for a resin printer
NOTHING = ReaderAnswer("", math.nan, math.nan, math.nan, -math.inf)  #: where a reader refuses

_FACES = "face=8,edge=3,corner=2"
_ALL = f"{_FACES},worn=1,blank=.5,foreign=2,decoy=3"
_LEVELS = (
    "low=2,typical=6,hard=3,mismatch=5,light=3,dead-10=1,hot-5=1,gain-30=1,hysteresis-15=1,"
    "saturated=1,bleed-2=1"
)
_SET = """version: 1
sensor_type: {name}
print: {{printer: {printer}}}
objects:
  - {{name: Cube, shape: {{cube: 80 mm}}}}
  - {{name: Box, shape: {{box: [90 mm, 70 mm, 60 mm]}}}}
  - {{name: Prism, shape: {{triangular_prism: {{side: 80 mm, height: 90 mm}}}}}}
  - {{name: Pyramid, shape: {{pyramid: {{sides: 4, side: 90 mm, height: 70 mm}}}}}}
"""


@dataclass(frozen=True, slots=True)
class BenchmarkWorld:
    """A sensor type that touches its own parts."""

    share: float  #: of all touches
    sensor_type: str
    kinds: str = _ALL
    engine: str = "own"


WORLDS = {
    "fsr-16": BenchmarkWorld(0.45, "fsr-16", f"{_ALL},same_profile=.5"),
    "fsr-16-mujoco": BenchmarkWorld(0.05, "fsr-16", _FACES, "mujoco"),
    "fsr-8x8": BenchmarkWorld(0.1, "fsr-8x8"),
    "flexitac-12x32": BenchmarkWorld(0.1, "flexitac-12x32"),
    "flexitac-16x32": BenchmarkWorld(0.1, "flexitac-16x32"),
    "mat-32x32": BenchmarkWorld(0.1, "mat-32x32"),
    "gel-24x32": BenchmarkWorld(0.1, "gel-24x32"),
}
#: Arrays of a half, besides `counts` (N, rows, columns) u16 and `names` (L,).
COLUMNS = {
    "number": "of the touch",
    "kind": "face, edge, corner, worn, blank, foreign, decoy, same_profile",
    "surface": "the kind, or which foreign surface or decoy",
    "level": "faults of the sensor and the print",
    "label": "number in `names` of the face touched; -1: none that a reader knows",
    "x_mm": "of the sensor's centre, face frame; NaN with label -1",
    "y_mm": "",
    "theta_rad": "of its turn",
    "also_label": "the other part, or the panel in another seat, that may be named; -1: none",
    "also_x_mm": "as x_mm, on that face",
    "also_y_mm": "",
    "also_theta_rad": "",
    "force_n": "by which it is pressed",
    "tilt_rad": "of the wrist",
    "bound_mm": "least standard deviation of a reader's place, Cramer-Rao; NaN: of no face",
    "bound_deg": "and of its turn",
}


def run_benchmark(
    folder: str | Path = "benchmark",
    *,
    touches: int = TOUCHES,
    worlds: Sequence[str] = (),
    seed: int | None = None,
    readers: Sequence[str] = (),
    progress: TouchProgress | None = None,
) -> dict[str, Any]:
    """Make both halves, read them, and write tables; returns what `results.json` holds.

    Parameters
    ----------
    touches
        Of a half, shared out over the worlds of `WORLDS`, or those named.
    seed
        Of the hidden half; drawn if not given.
    readers
        Of `READERS`, or `module:function`; all of `READERS` if none is named.

    Raises
    ------
    ValidationError
        A world or a reader is not known.
    MissingExtraError
        What makes or reads touches is not installed.
    """
    place, steps = Path(folder), progress or TouchProgress()
    unknown = [name for name in worlds if name not in WORLDS]
    if unknown:
        raise ValidationError(
            f"'{unknown[0]}' is not known", fix=f"give {', '.join(WORLDS)}", place="--worlds"
        )
    chosen = {name: WORLDS[name] for name in worlds or WORLDS}
    makers = {name: reader_named(name) for name in readers or READERS}
    shares = sum(world.share for world in chosen.values())
    counts = {n: max(FIRST, round(touches * w.share / shares)) for n, w in chosen.items()}
    seeds = {PUBLIC: PUBLIC_SEED, HIDDEN: secrets.randbelow(1 << 31) if seed is None else seed}
    works = {name: _lab(place, world) for name, world in chosen.items()}
    halves = {
        half: {n: _make(place / half, n, works[n], seeds[half], counts[n], steps) for n in chosen}
        for half in HALVES
    }
    digests = {half: _write_card(place / half, seeds[half], halves[half]) for half in HALVES}
    found: dict[str, Any] = {
        "seeds": seeds, "rate": RATE, "frozen": _as_frozen(halves[PUBLIC]),
        "sha256": digests, "readers": {},
    }  # fmt: skip
    for name, make in makers.items():
        lines: dict[str, Any] = {half: [] for half in HALVES}
        for world, work in works.items():
            sensor = work.campaign.sensor
            known = ReaderWorld(world, work.database, sensor, dict(halves[PUBLIC][world]))
            read = make(known)
            for half in HALVES:
                lines[half].append(_read_all(read, world, halves[half][world], steps, name))
        found["readers"][name] = {half: _figures(lines[half]) for half in HALVES}
    write_json(place / "results.json", found)
    write_text(place / "results.md", table_of(found) + "\n")
    return found


def _lab(place: Path, world: BenchmarkWorld) -> Work:
    """Make the parts of a world's sensor type if they are not there; returns its work."""
    sensor = sensor_type_named(world.sensor_type)
    folder = place / "labs" / world.sensor_type
    spec = folder / "set.yaml"
    printer = "resin" if sensor.symbol_pitch_mm < SMALL_PITCH_MM else "fdm-0.4"
    write_text(spec, _SET.format(name=world.sensor_type, printer=printer))
    kinds = next(one.kinds for one in WORLDS.values() if one.sensor_type == world.sensor_type)
    campaign = Campaign(
        kinds=_shares(kinds), levels=_shares(_LEVELS), sensor_type=sensor,
        overlay=sensor.overlay.kind, seed=PUBLIC_SEED,
    )  # fmt: skip
    work = prepare_run(folder, campaign, [spec], "", resume=True)
    campaign = replace(campaign, kinds=_shares(world.kinds), engine=world.engine)
    return replace(work, campaign=campaign)


def _shares(text: str) -> tuple[tuple[str, float], ...]:
    return shares_of(text, tuple(one.partition("=")[0] for one in text.split(",")), "")


def touches_of(work: Work, seed: int, count: int, progress: TouchProgress) -> dict[str, Array]:
    """Return the arrays of a world's touches 0 ... count - 1, `COLUMNS`, `counts` and `names`."""
    reader = prepare_reader(work)
    work = replace(work, campaign=replace(work.campaign, seed=seed, touches=count))
    series = series_of(work.campaign)[0]
    label_of = {name: label for label, name in enumerate(faces_by_name(reader.lab))}
    rows = []
    for number in range(count):
        plan = work.plan(series, number)
        found = draw_touch(plan, number, reader)
        trial = judge(plan, number, found, refusal(number, NO_CONTACT), reader)
        row = truth_row(found, trial, label_of)
        row |= {"surface": trial.surface, "also_label": -1}
        row |= dict.fromkeys(("also_x_mm", "also_y_mm", "also_theta_rad"), math.nan)
        if found.contact.adjacent is not None:
            scene, place = found.contact.adjacent
            touch = place.touch_inside(found.touch)
            row["also_label"] = label_of.get(f"{scene.object_name}/{scene.face}", -1)
            row |= {"also_x_mm": touch.x_mm, "also_y_mm": touch.y_mm}
            row["also_theta_rad"] = math.remainder(touch.theta_rad, math.tau)
        bound = None
        signal = reader.signal(found.counts)
        if row["label"] >= 0 and trial.kind != "worn" and signal.contact:
            bound = bound_of_touch(reader, signal, found, errors_of(reader.sensor, plan.noise))
        least = np.full((3, 3), math.nan) if bound is None else bound
        row["bound_mm"] = math.sqrt(least[0, 0] + least[1, 1])
        row["bound_deg"] = math.degrees(math.sqrt(least[2, 2]))
        rows.append(row)
        progress.step("touches")
    arrays = {name: np.array([row[name] for row in rows]) for name in ("counts", *COLUMNS)}
    for name, values in arrays.items():
        if values.dtype.kind == "f":
            arrays[name] = np.round(values, DECIMALS) + 0.0
    return arrays | {"names": np.array(list(label_of))}


def digest_of(arrays: Mapping[str, Array], count: int) -> str:
    """Return the sha256 of the first `count` touches of a world: names, types and bytes."""
    digest = hashlib.sha256()
    for name in ("counts", *COLUMNS, "names"):
        values = arrays[name] if name == "names" else arrays[name][:count]
        if values.dtype.kind == "U":
            content = json.dumps(values.tolist()).encode()
        else:
            content = values.astype(values.dtype.newbyteorder("<")).tobytes()
        digest.update(f"{name} {values.dtype.kind} {values.shape}\n".encode() + content)
    return digest.hexdigest()


def _make(
    folder: Path, name: str, work: Work, seed: int, count: int, progress: TouchProgress
) -> dict[str, Array]:
    progress.begin(f"{folder.name}: {name}", count, 0)
    arrays = touches_of(work, 100 * seed + list(WORLDS).index(name), count, progress)
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / f"{name}.npz") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
    sensor, said = work.campaign.sensor, {"world": name, "names": arrays["names"].tolist()}
    write_ftp1(arrays, sensor.name, folder / f"{name}.zarr", said)
    whole = arrays | {"test": np.full(count, folder.name == HIDDEN)}
    write_lerobot(TouchDataset(whole, sensor.pitch_mm, said), folder / name)
    return arrays


def _write_card(folder: Path, seed: int, half: Mapping[str, Mapping[str, Array]]) -> dict[str, str]:
    """Write what a half is; returns the sha256 of each world."""
    worlds: dict[str, dict[str, Any]] = {
        name: {
            "touches": len(arrays["counts"]), "shape": list(arrays["counts"].shape[1:]),
            "sensor_type": WORLDS[name].sensor_type, "engine": WORLDS[name].engine,
            "sha256": digest_of(arrays, len(arrays["counts"])),
        }
        for name, arrays in half.items()
    }  # fmt: skip
    card: dict[str, Any] = {
        "name": f"encoded-objects benchmark, {folder.name} half",
        "version": version("encoded-objects"), "seed": seed, "licence": LICENCE,
        "simulated": True, "worlds": worlds,
        "arrays": {"counts": "what the sensor read, (N, rows, columns)", **COLUMNS},
    }  # fmt: skip
    write_json(folder / "card.json", card)
    about = (
        f"Simulated touches of version {card['version']}, seed {seed}, {LICENCE}. `WORLD.npz`, "
        "`WORLD.zarr` (FTP-1) and `WORLD/lerobot` (v3.0) hold the same touches."
    )
    held = [
        (name, w["touches"], "{} x {}".format(*w["shape"]), w["engine"], w["sha256"][:16])
        for name, w in worlds.items()
    ]
    tables = (
        _table(("world", "touches", "counts", "engine", "sha256"), held),
        _table(("array", ""), [(f"`{name}`", text) for name, text in COLUMNS.items()]),
    )
    write_text(folder / "card.md", "\n\n".join([f"# {card['name']}", about, *tables]) + "\n")
    return {name: world["sha256"] for name, world in worlds.items()}


def _table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|"]
    return "\n".join([*lines, *(f"| {' | '.join(map(str, row))} |" for row in rows)])


def _as_frozen(half: Mapping[str, Mapping[str, Array]]) -> dict[str, bool]:
    """Return of each world whether its touches are those that were frozen, as far as both go."""
    known = json.loads(FROZEN.read_text("utf-8"))
    return {
        name: all(
            digest_of(arrays, int(count)) == sha256
            for count, sha256 in known.get(name, {}).items()
            if int(count) <= len(arrays["counts"])
        )
        for name, arrays in half.items()
    }


def freeze(folder: Path) -> None:
    """Write `FROZEN` of the public half that `run_benchmark` made in a folder.

    For a change that means to draw other touches: `python -c "from pathlib import Path; from
    recognizer.validation.benchmark import freeze; freeze(Path('benchmark'))"`.
    """
    known = {}
    for name in WORLDS:
        arrays = dict(np.load(folder / PUBLIC / f"{name}.npz"))
        known[name] = {str(n): digest_of(arrays, n) for n in (FIRST, len(arrays["counts"]))}
    write_json(FROZEN, known)


def _read_all(
    read: Read, world: str, arrays: Mapping[str, Array], progress: TouchProgress, reader: str
) -> dict[str, Array]:
    """Return what a reader says of a world's touches, beside the truth."""
    names: list[str] = arrays["names"].tolist()
    progress.begin(f"{reader}: {world}", len(arrays["counts"]), 0)
    answers, ms = [], []
    for counts in arrays["counts"]:
        start = time.process_time()
        answer = read(counts) or NOTHING
        ms.append(1e3 * (time.process_time() - start))
        answer = ReaderAnswer(*answer)  # which a plain tuple may be
        if answer.name not in (*names, NOTHING.name):
            cause, fix = f"a reader names '{answer.name}'", f"name one of {', '.join(names)}"
            raise ValidationError(cause, fix=fix, place=reader)
        spread = np.eye(3) if answer.covariance is None else np.asarray(answer.covariance)
        if spread.shape != (3, 3) or np.linalg.det(spread) <= 0:
            cause = f"a reader gives the covariance {spread.tolist()}"
            fix = "give 3 x 3 of mm, mm and rad, positive definite, or None"
            raise ValidationError(cause, fix=fix, place=reader)
        answers.append(answer)
        progress.step("touches")
    unknown = np.full((3, 3), math.nan)
    label_of = {name: label for label, name in enumerate(names)} | {NOTHING.name: -1}
    whole = {name: arrays[name] for name in COLUMNS} | {
        "answer": np.array([label_of[one.name] for one in answers]),
        "answer_x_mm": np.array([one.x_mm for one in answers]),
        "answer_y_mm": np.array([one.y_mm for one in answers]),
        "answer_theta_rad": np.array([one.theta_rad for one in answers]),
        "score": np.array([one.score for one in answers]),
        "ms": np.array(ms),
    }
    spreads = [unknown if one.covariance is None else one.covariance for one in answers]
    named, away = errors_of_answers(whole)
    other, away_of_other = errors_of_answers(whole, "also_")
    right, away = named | other, np.where(named[:, None], away, away_of_other)
    chi2 = np.array([_chi2(a, c) for a, c in zip(away, spreads, strict=True)])
    return whole | {
        "right": right, "off": np.hypot(away[:, 0], away[:, 1]), "turn": np.degrees(away[:, 2]),
        "chi2": np.where(right, chi2, math.nan), "world": np.full(len(answers), world),
    }  # fmt: skip


def _chi2(away: Array, covariance: Array) -> float:
    if not np.isfinite(covariance).all():
        return math.nan
    return float(away @ np.linalg.solve(covariance, away))


def _figures(lines: Sequence[Mapping[str, Array]]) -> dict[str, Any]:
    """Return the figures of a reader: of all worlds, of each, by class, and by decoy."""
    whole = {name: np.concatenate([line[name] for line in lines]) for name in lines[0]}
    light = (whole["level"] == "light") & (whole["kind"] == "face")
    classes = np.where(light, "light", whole["kind"])
    return {
        **_figures_of(whole, np.ones(len(classes), bool)),
        "worlds": dict(_each(whole, whole["world"])),
        "classes": dict(_each(whole, classes)),
        "decoys": dict(_each(whole, np.where(whole["kind"] == "decoy", whole["surface"], ""))),
    }


def _each(whole: Mapping[str, Array], groups: Array) -> Iterator[tuple[str, dict[str, Any]]]:
    for group in sorted(set(groups.tolist()) - {""}):
        yield group, _figures_of(whole, groups == group)


def _figures_of(whole: Mapping[str, Array], some: NDArray[np.bool_]) -> dict[str, Any]:
    part = {name: values[some] for name, values in whole.items()}
    total, right = len(part["right"]), part["right"]
    known = (part["label"] >= 0) | (part["also_label"] >= 0)
    wrong = (part["answer"] >= 0) & ~right
    allowed = math.floor(RATE * total)
    # the lowest score above which no more than so many answers are wrong
    scores = np.sort(part["score"][wrong])[::-1]
    least = float(scores[allowed]) if len(scores) > allowed else -math.inf
    sure = right & (part["score"] > least)
    bound = right & (part["bound_mm"] < NEAR_MM)  # where nothing is bounded, nothing is compared
    chi2 = part["chi2"][np.isfinite(part["chi2"])]
    line: dict[str, Any] = {
        "touches": total,
        "known": int(known.sum()),
        "right": share_of(int(right.sum()), int(known.sum())),
        "wrong": share_of(int(wrong.sum()), total),
        "refused": share_of(int((part["answer"] < 0).sum()), total),
        "at_rate": {
            **share_of(int(sure.sum()), int(known.sum())),
            "wrong": share_of(int((wrong & (part["score"] > least)).sum()), total),
        },
        "inside_95": inside_of(chi2),
        "normalised": normalised_errors(chi2)["mean"],
        "ms": round_digits(float(np.mean(part["ms"])), 3),
    }
    for unit, name in (("mm", "off"), ("deg", "turn")):
        error, best = rms(part[name][bound]), rms(part[f"bound_{unit}"][bound])
        line |= {f"rms_{unit}": rms(part[name][right]), f"bound_{unit}": best}
        line[f"ratio_{unit}"] = round_digits(error / best, 3) if error and best else None
    return line


def table_of(found: Mapping[str, Any]) -> str:
    """Return the table of all readers as Markdown."""
    heads = ("reader", "half", "right", f"right at {RATE:g}", "wrong", "refused", "rms mm",
             "over bound", "rms degrees", "over bound", "inside", "normalised", "ms")  # fmt: skip
    rows = [
        (
            name, half, _percent(line["right"]), _percent(line["at_rate"]),
            f"{line['wrong']['count']} ({_number(100 * line['wrong']['high'])} % at most)",
            _percent(line["refused"]),
            *(_number(line[key]) for key in ("rms_mm", "ratio_mm", "rms_deg", "ratio_deg")),
            _percent(line["inside_95"]), _number(line["normalised"]), _number(line["ms"]),
        )
        for name, halves in found["readers"].items()
        for half, line in halves.items()
    ]  # fmt: skip
    return _table(heads, rows)


def _percent(share: Mapping[str, Any]) -> str:
    return "-" if share["share"] is None else f"{100 * share['share']:.1f} %"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
