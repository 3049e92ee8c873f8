"""Touches of every world, read by `recognize-object`: the whole JSON of each answer.

Frames and databases are stored (`data/touches.npz`, `data/labs`), so that nothing but reading is
looked at here. In `touches.npz` a set NAME has NAME.counts (N, rows, columns) u16, NAME.labels
(N,), what was touched as JSON, and of scans NAME.pose (N, 4, 4) T_base_sensor in mm.

Drawn once by `validate-set`, `simulate` and the levels of `docs/validation/README.md`, seeds 901
to 920, on the forty objects (`forty`), the small ones (`small`) and labs of a part or two.
"""

import json
import lzma
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import h5py
import numpy as np
from corpora.commands import DATA, Commands, started_commands

NAME = "answers"


@dataclass(frozen=True)
class Reading:
    """How a set of touches is read."""

    lab: str  #: database in data/labs
    options: tuple[str, ...] = ()  #: of `recognize-object`
    of: tuple[str, ...] = ()  #: sets that are read; none: the one of the part's name
    every: int = 1  #: of so many touches one is read
    learns: bool = False  #: the sensor, from its touches, before they are read
    scan: bool = False  #: touches of one label "scan" are one recording, and one answer
    posed: bool = True  #: a scan by an arm; False: moved by hand, its poses are left out


FORTY, SMALL = Reading("forty"), Reading("small")
TYPES = ("flexitac-12x32", "flexitac-16x32", "fsr-8x8", "gel-24x32", "mat-32x32")
LEARNED = ("dead-20", "hot-5", "gain-30", "floating", "places-25")
SCAN = ("--scan",)

READINGS = {
    **dict.fromkeys(("own-1", "own-2", "own-3", "own-4"), FORTY),  # usual kinds and levels
    "worlds": replace(FORTY, of=("light", "soft", "rows", "hard", "mujoco", "side")),
    "faulty": replace(FORTY, of=("sensors",)),  # sensors of which nothing was learned
    "others": replace(FORTY, of=("anything", "other-lab")),  # what no lab made, or another one
    "pad": replace(FORTY, options=("--overlay", "pad")),
    "small": replace(SMALL, of=("small-1", "small-2", "small-light", "small-mujoco")),
    "printed": Reading("printed", of=("printed-usual", "printed-bad")),
    "round": Reading("round"),
    "one-touch": Reading("one-touch"),
    "thesis": Reading("thesis"),  # refused: one touch is too little
    **{f"type-{name}": Reading(f"type-{name}", ("--sensor-type", name)) for name in TYPES},
    **{f"learn-{name}": replace(FORTY, learns=True) for name in LEARNED},
    "scan-thesis": Reading("thesis", SCAN, scan=True),
    "scan-thesis-way": Reading(
        "thesis", (*SCAN, "--method", "thesis"), of=("scan-thesis",), every=2, scan=True
    ),
    "scan-product": Reading("product", SCAN, scan=True),
    "scan-thesis-by-hand": Reading("thesis", SCAN, of=("scan-thesis",), scan=True, posed=False),
    "scan-product-by-hand": Reading("product", SCAN, of=("scan-product",), scan=True, posed=False),
    "scan-small": replace(SMALL, options=SCAN, scan=True),
    "scan-forty": replace(FORTY, options=SCAN, scan=True),
    "scan-one-touch": Reading("one-touch", SCAN, scan=True),
}
PARTS = tuple(READINGS)


@dataclass(frozen=True)
class Touches:
    """Frames of touches, and what was touched."""

    counts: np.ndarray  #: (N, rows, columns) u16
    labels: tuple[dict[str, Any], ...]
    pose: np.ndarray | None  #: (N, 4, 4) T_base_sensor, mm


def collect(part: str) -> Iterator[tuple[str, Any]]:
    """Yield what is read of each touch of a part."""
    how = READINGS[part]
    touches = touches_of(how.of or (part,), how.every)
    with started_commands() as commands:
        packed = (DATA / "labs" / f"{how.lab}.db.xz").read_bytes()
        (commands.folder / "lab.db").write_bytes(lzma.decompress(packed))
        for prefix, some in _recordings(touches, scan=how.scan):
            yield from _read(f"{part}/{prefix}", some, how, commands)


def touches_of(names: tuple[str, ...], every: int) -> Touches:
    """Return stored sets, of so many touches of each one."""
    labels: list[dict[str, Any]] = []
    counts, poses = [], []
    with np.load(DATA / "touches.npz") as stored:
        for name in names:
            counts.append(stored[f"{name}.counts"][::every])
            told = [json.loads(str(one)) for one in stored[f"{name}.labels"]]
            numbered = [{"number": number, **one} for number, one in enumerate(told)]
            labels += [{"set": name, **one} for one in numbered[::every]]
            if f"{name}.pose" in stored:
                poses.append(stored[f"{name}.pose"][::every])
    pose = np.concatenate(poses) if poses else None
    return Touches(np.concatenate(counts), tuple(labels), pose)


def _recordings(touches: Touches, *, scan: bool) -> Iterator[tuple[str, Touches]]:
    """Yield touches with the beginning of their names: each scan, or all together."""
    if not scan:
        yield "", touches
        return
    scans = [label["scan"] for label in touches.labels]
    for scan_number in sorted(set(scans)):
        chosen = [k for k, one in enumerate(scans) if one == scan_number]
        pose = None if touches.pose is None else touches.pose[chosen]
        labels = tuple(touches.labels[k] for k in chosen)
        yield f"{scan_number} ", Touches(touches.counts[chosen], labels, pose)


def _read(
    prefix: str, touches: Touches, how: Reading, commands: Commands
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the answers to touches, each under the number and the label of its touch."""
    with h5py.File(commands.folder / "touches.h5", "w") as file:
        file["frames"] = touches.counts
        if touches.pose is not None and how.posed:
            file["pose"] = touches.pose
    learn = ("--learn", "state.json") if how.learns else ()
    words = ("recognize-object", "touches.h5", "--every", "--json", *how.options, *learn)
    last = -1
    for answer in json.loads(commands.answer(*words)):
        label = touches.labels[answer["seq"]]
        words = [label[key] for key in ("kind", "level", "face") if label.get(key)]
        whole = " (the whole scan)" if answer["seq"] <= last else ""
        name = f"{label['set']} {label['number']:04d} {' '.join(words)}"
        yield f"{prefix}{name}{whole}", answer
        last = answer["seq"]
    if how.learns:
        yield f"{prefix}state", json.loads((commands.folder / "state.json").read_text())
