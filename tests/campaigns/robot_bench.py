"""Objects found by touch in MuJoCo, several touches of each as one pose, and a move noticed.

    python tests/campaigns/robot_bench.py -o OUT.jsonl --trials 67 --seed 1

Three objects a trial in the world of `docs/examples/mujoco_bench.py`. In every eighth trial each is
touched `--more` times again at other places of its face, then moved (1, 2, 5, 10 mm, 1, 2, 5
degrees in turn) and touched once more. A line of JSON an object; trials that are in OUT are not run
again. Prints errors and covariances after 1, 2, 3 ... touches, and how often a move was noticed.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from robot_bench_table import summary
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "examples"))
import mujoco
import mujoco_bench as world

from probe.arm import SensorPose
from probe.errors import PoseError
from recognizer.touch.recognition import Recognition
from recognizer.touch.robot import ObjectPose, object_pose

Array = np.ndarray
MOVES = [("mm", 1.0), ("mm", 2.0), ("mm", 5.0), ("mm", 10.0), ("deg", 1.0), ("deg", 2.0),
         ("deg", 5.0)]  # fmt: skip
LONG = 8  #: every so many trials have further touches
INSIDE_MM = 6.0  #: of the face's border are further touches
REACH_RAD = 1.2  #: turns of further touches, both ways


def record(bench: Any, name: str, found: Recognition, sensor: SensorPose) -> dict[str, Any]:
    """Return a touch as it is kept: what was told, and the simulator's truth."""
    T_base_object = world.pose(bench.data.body(world.ON + name))
    told: dict[str, Any] = {"object": found.object, "face": found.face, "reason": found.reason}
    told["truth"] = T_base_object.tolist()
    told["sensor"] = sensor.T_base_sensor.tolist()
    told["sensor_covariance"] = sensor.covariance.tolist()
    if found:
        told["T_face_probe"] = found.T_face_probe.tolist()
        told["T_object_probe"] = found.T_object_probe.tolist()
        told["covariance"] = found.covariance.tolist()
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
    bench.presses = 0
    where = {n: world.pose(bench.data.body(world.ON + n))[:2, 3] for n in world.OBJECTS}
    name = min(where, key=lambda n: abs(math.atan2(where[n][1], where[n][0]) - sector))
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--trials", type=int, default=67)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--more", type=int, default=5)
    options = parser.parse_args()
    lines = []
    if options.output.exists():
        lines = [json.loads(line) for line in options.output.read_text().splitlines()]
    done = {line["trial"] for line in lines}
    folder = options.output.with_suffix("")
    folder.mkdir(parents=True, exist_ok=True)
    made_before = (folder / "bench.db").exists()
    model, lab = world.load(folder) if made_before else world.make(folder)
    for trial in range(options.trials):
        if trial in done:
            continue
        bench = world.Bench(model, lab, np.random.default_rng([options.seed, trial]))
        bench.lay_out()
        made = []
        for sector in world.SECTORS:
            long = trial % LONG == 0
            shift = MOVES[(trial // LONG * 3 + len(made)) % len(MOVES)] if long else None
            more = options.more if long else 0
            made.append({"trial": trial} | work_on(bench, sector, more, shift))
        with options.output.open("a") as file:
            file.write("".join(json.dumps(line) + "\n" for line in made))
        lines += made
        print(f"trial {trial}: {[len(line['touches']) for line in made]}", file=sys.stderr)
    print(summary(lines))


if __name__ == "__main__":
    main()
