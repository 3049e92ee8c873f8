"""Objects found by touch in MuJoCo, several touches of each as one pose, and a move noticed.

    python tests/campaigns/robot_bench.py -o OUT.jsonl --trials 67 --seed 1

Three objects a trial in the world of `robot_world.py`. In every eighth trial each is
touched `--more` times again at other places of its face, then moved (1, 2, 5, 10 mm, 1, 2, 5
degrees in turn) and touched once more. A line of JSON a trial; trials that are in OUT are not run
again. Prints errors and covariances after 1, 2, 3 ... touches, and how often a move was noticed.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import mujoco
import numpy as np
import robot_world as world
import runner
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from probe.arm import SensorPose
from probe.errors import PoseError
from recognizer.touch.recognition import Recognition
from recognizer.touch.robot import ObjectPose, fuse_poses, object_pose
from recognizer.validation.statistics import clopper_pearson

Array = np.ndarray
MOVES = [("mm", 1.0), ("mm", 2.0), ("mm", 5.0), ("mm", 10.0), ("deg", 1.0), ("deg", 2.0),
         ("deg", 5.0)]  # fmt: skip
LONG = 8  #: every so many trials have further touches
INSIDE_MM = 6.0  #: of the face's border are further touches
REACH_RAD = 1.2  #: turns of further touches, both ways
FLAT = [0, 1, 5]  #: x, y and the turn about the vertical


def record(bench: Any, name: str, found: Recognition, sensor: SensorPose) -> dict[str, Any]:
    """Return a touch as it is kept: what was told, and the simulator's truth."""
    T_base_object = world.pose(bench.data.body(world.ON + name))
    told: dict[str, Any] = {"object": found.object, "face": found.face, "reason": found.reason}
    told["truth"] = T_base_object.tolist()
    told["sensor"] = sensor.T_base_sensor.tolist()
    told["sensor_covariance"] = sensor.covariance.tolist()
    if found:
        for key in ("T_face_probe", "T_object_probe", "covariance"):
            told[key] = getattr(found, key).tolist()
        T_object_face = found.T_object_probe @ np.linalg.inv(found.T_face_probe)
        true = np.linalg.inv(T_base_object @ T_object_face)
        told["T_face_sensor"] = (true @ world.pose(bench.data.site("sensor"))).tolist()
        region = world.surface(bench.lab, found.object, found.face).region
        at = np.array(told["T_face_sensor"])[None, :2, 3]
        sign = 1 if region.contains(at)[0] else -1
        told["inside_mm"] = sign * float(region.distance_mm(at)[0])
    return told


def place_on(bench: Any, placed: ObjectPose, found: Recognition) -> tuple[Array, float]:
    """Draw where to touch a face again, by what is believed of the object; base frame."""
    region = world.surface(bench.lab, found.object, found.face).region
    low, high = region.box_mm
    while True:
        at = bench.rng.uniform(low, high)[None]
        if region.contains(at)[0] and region.distance_mm(at)[0] > INSIDE_MM:
            break
    T_object_face = found.T_object_probe @ np.linalg.inv(found.T_face_probe)
    spot = placed.T_robot_object @ T_object_face @ [*at[0], 0.0, 1.0]
    return spot[:2], bench.rng.uniform(-REACH_RAD, REACH_RAD)


def touch_again(bench: Any, name: str, placed: ObjectPose, found: Recognition) -> dict[str, Any]:
    """Touch the face at another place, and read that touch alone."""
    while True:
        try:
            felt = bench.touch(*place_on(bench, placed, found))
        except PoseError:  # the arm cannot stand so
            continue
        if felt is None:
            return {"object": None, "reason": "the table"}
        counts, sensor = felt
        return record(bench, name, bench.reader.read(counts.astype(float)), sensor)


def move(bench: Any, name: str, kind: str, by: float) -> None:
    """Move an object on the table, somewhere; or turn it about the vertical through its middle."""
    start = bench.model.joint(world.ON + name).qposadr[0]
    qpos = bench.data.qpos[start : start + 7]
    if kind == "mm":
        way = bench.rng.uniform(-math.pi, math.pi)
        qpos[:2] += 1e-3 * by * np.array([math.cos(way), math.sin(way)])
    else:
        turn = Rotation.from_euler("z", by * bench.rng.choice([-1, 1]), degrees=True)
        middle = bench.data.body(world.ON + name).xipos
        qpos[:3] = middle + turn.apply(qpos[:3] - middle)
        qpos[3:] = np.roll((turn * Rotation.from_quat(np.roll(qpos[3:], -1))).as_quat(), 1)
    mujoco.mj_forward(bench.model, bench.data)


def work_on(
    bench: Any, sector: float, more: int, shift: tuple[str, float] | None
) -> dict[str, Any]:
    """Find the object of a sector, touch it again, move it, touch it once more."""
    name = bench.object_in(sector)
    found, sensor, read = bench.find(sector)
    line = {"name": name, "read": read, "presses": bench.presses, "touches": []}
    if not found or sensor is None:
        return line
    line["touches"].append(record(bench, name, found, sensor))
    placed = object_pose(found, sensor)
    if placed is None or found.object != name:
        return line
    line["touches"] += [touch_again(bench, name, placed, found) for _ in range(more)]
    if shift is not None:
        move(bench, name, *shift)
        line["move"], line["after"] = shift, touch_again(bench, name, placed, found)
    return line


def work_on_trial(asked: Any, model: Any, lab: Any, trial: int) -> dict[str, Any]:
    """Return the lines of a trial's objects."""
    bench = world.Bench(model, lab, np.random.default_rng([asked.seed, trial]))
    bench.lay_out()
    made: list[dict[str, Any]] = []
    for sector in world.SECTORS:
        long = trial % LONG == 0
        shift = MOVES[(trial // LONG * 3 + len(made)) % len(MOVES)] if long else None
        made.append(work_on(bench, sector, asked.more if long else 0, shift))
    return {"trial": trial, "objects": made}


def told(touch: dict[str, Any]) -> ObjectPose:
    """Return the pose of the object that a touch told."""
    recognition = Recognition(
        0, touch["object"], touch["face"], (0, 0), np.array(touch["T_face_probe"]),
        np.array(touch["T_object_probe"]), np.array(touch["covariance"]), 0.0, None, "",
        inside_mm=touch["inside_mm"],
    )  # fmt: skip
    sensor = SensorPose(np.array(touch["sensor"]), np.array(touch["sensor_covariance"]))
    placed = object_pose(recognition, sensor)
    assert placed is not None
    return placed


def inside(off: Array, covariance: Array, which: list[int]) -> bool:
    """Tell whether an error lies inside the 95 % ellipsoid of some freedoms."""
    part = covariance[np.ix_(which, which)]
    return bool(off[which] @ np.linalg.solve(part, off[which]) < chi2.ppf(0.95, len(which)))


def share(hits: int, of: int) -> str:
    """Return a share with its exact 95 % interval, per cent."""
    low, high = clopper_pearson(hits, of)
    return f"{hits} of {of} ({100 * low:.0f}-{100 * high:.0f} %)"


def read_by_face(line: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the touches that told the right object."""
    return [touch for touch in line["touches"] if touch["object"] == line["name"]]


def summarise(lines: list[dict[str, Any]]) -> None:
    """Print the tables."""
    said = [line["touches"][0]["object"] if line["touches"] else None for line in lines]
    right = sum(name == line["name"] for name, line in zip(said, lines, strict=True))
    wrong = sum(name not in (None, line["name"]) for name, line in zip(said, lines, strict=True))
    read = np.bincount([line["read"] for line in lines])
    print(f"{len(lines)} objects: {right} right, {wrong} wrong; touches read: "
          + ", ".join(f"{n}: {count}" for n, count in enumerate(read) if count))  # fmt: skip
    again = [touch for line in lines for touch in line["touches"][1:]]
    seen = sum(touch["object"] is not None for touch in again)
    print(f"touches again: {seen} of {len(again)} answered\n")
    tabulate_errors(lines)
    fused = [fuse_poses([told(touch) for touch in read_by_face(line)[:n]])
             for line in lines for n in range(2, 1 + len(read_by_face(line)))]  # fmt: skip
    moved = share(sum(one.moved for one in fused), len(fused))
    print(f"\nfalse alarms: {moved} fused poses\n")
    tabulate_moves(lines)


def tabulate_errors(lines: list[dict[str, Any]]) -> None:
    """Print errors and ellipses by number of touches."""
    runner.table(("touches", "poses", "rms x, y mm", "z mm", "turn deg", "stated x, y mm",
                  "area of the x, y ellipse mm2", "volume of 6", "inside, 6",
                  "inside, x, y, turn"))  # fmt: skip
    for n in range(1, 1 + max(len(line["touches"]) for line in lines)):
        offs, spreads = [], []
        for line in lines:
            touches = read_by_face(line)[:n]
            if len(touches) == n:
                fused = fuse_poses([told(touch) for touch in touches]).pose
                truth = np.array(touches[-1]["truth"])
                offs.append(world.error_of(fused.T_robot_object, truth))
                spreads.append(fused.covariance)
        if not offs:
            continue
        off, spread = np.array(offs), np.array(spreads)
        rms, sd = np.sqrt((off**2).mean(0)), np.sqrt(np.einsum("nii->ni", spread).mean(0))
        area = np.pi * chi2.ppf(0.95, 2) * np.sqrt(np.linalg.det(spread[:, :2, :2]))
        volume = np.exp(0.5 * np.linalg.slogdet(spread)[1].mean())
        both = [
            share(sum(inside(o, s, which) for o, s in zip(off, spread, strict=True)), len(off))
            for which in (list(range(6)), FLAT)
        ]
        values = (np.hypot(*rms[:2]), rms[2], np.degrees(rms[5]), np.hypot(*sd[:2]))
        sizes = (f"{value:.3f}" for value in (*values, np.median(area)))
        runner.row(n, len(off), *sizes, f"{volume:.2e}", *both)


def displaced(placed: ObjectPose, kind: str, by: float, way: float) -> ObjectPose:
    """Return a pose as it would be told had the object been moved: in the plane, or turned."""
    T = placed.T_robot_object.copy()
    if kind == "mm":
        T[:2, 3] += by * np.array([np.cos(way), np.sin(way)])
    else:
        turn = Rotation.from_euler("z", by * (1 if way < np.pi else -1), degrees=True)
        T[:3, :3] = turn.as_matrix() @ T[:3, :3]
    return ObjectPose(T, placed.covariance, placed.shared)


def tabulate_moves(lines: list[dict[str, Any]]) -> None:
    """Print how often a move was noticed by one further touch: as it was made, and as if made."""
    rng = np.random.default_rng(0)
    runner.table(("move", "after 1 touch", "after all", "made in the simulator, after all"))
    for kind, by in MOVES:
        one, several, made = [], [], []
        for line in lines:
            poses = [told(touch) for touch in read_by_face(line)]
            if len(poses) > 1:
                new = displaced(poses[-1], kind, by, rng.uniform(0, 2 * np.pi))
                one.append(fuse_poses([poses[-2], new]).moved)
                if len(poses) > 3:
                    several.append(fuse_poses([*poses[:-1], new]).moved)
            after = line.get("after")
            if after and list(line["move"]) == [kind, by] and after["object"] == line["name"]:
                made.append(fuse_poses([*poses, told(after)]).moved)
        runner.row(f"{by:g} {kind}", *(share(sum(x), len(x)) for x in (one, several, made) if x))


def main() -> None:
    """Run the trials that are left, and print the tables."""
    asked = runner.asked(__doc__, output=True, seed=1, trials=67, more=5)
    folder = asked.output.with_suffix("")
    folder.mkdir(parents=True, exist_ok=True)
    made_before = (folder / "bench.db").exists()
    model, lab = world.load(folder) if made_before else world.make(folder)
    work = partial(work_on_trial, asked, model, lab)
    trials = runner.resume(asked.output, range(asked.trials), work)
    summarise([line for trial in trials for line in trial["objects"]])


if __name__ == "__main__":
    main()
