"""What `robot_bench.py` kept -> tables: answers, errors and covariances, fused poses, moves."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import beta, chi2

from probe.arm import SensorPose
from recognizer.touch.recognition import Recognition
from recognizer.touch.robot import ObjectPose, fuse_poses, object_pose

Array = np.ndarray
FLAT = [0, 1, 5]  #: x, y and the turn about the vertical
SHIFTS_MM, TURNS_DEG = (1.0, 2.0, 5.0, 10.0), (1.0, 2.0, 5.0)


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


def off_by(placed: ObjectPose, truth: Any) -> Array:
    """Return (6,) truth less answer, mm and rad, base axes."""
    T, true = placed.T_robot_object, np.array(truth)
    turn = Rotation.from_matrix(true[:3, :3] @ T[:3, :3].T).as_rotvec()
    return np.array([*(true[:3, 3] - T[:3, 3]), *turn])


def inside(off: Array, covariance: Array, which: list[int]) -> bool:
    """Tell whether an error lies inside the 95 % ellipsoid of some freedoms."""
    part = covariance[np.ix_(which, which)]
    return bool(off[which] @ np.linalg.solve(part, off[which]) < chi2.ppf(0.95, len(which)))


def share(hits: int, of: int) -> str:
    """Return a share with its exact 95 % interval, per cent."""
    low = 0.0 if hits == 0 else beta.ppf(0.025, hits, of - hits + 1)
    high = 1.0 if hits == of else beta.ppf(0.975, hits + 1, of - hits)
    return f"{hits} of {of} ({100 * low:.0f}-{100 * high:.0f} %)"


def table_head(columns: tuple[str, ...]) -> list[str]:
    """Return the first two lines of a table."""
    return ["| " + " | ".join(columns) + " |", "| " + " | ".join(["---"] * len(columns)) + " |"]


def read_by_face(line: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the touches that told the right object."""
    return [touch for touch in line["touches"] if touch["object"] == line["name"]]


def summary(lines: list[dict[str, Any]]) -> str:
    """Return the tables."""
    said = [line["touches"][0]["object"] if line["touches"] else None for line in lines]
    right = sum(name == line["name"] for name, line in zip(said, lines, strict=True))
    wrong = sum(name not in (None, line["name"]) for name, line in zip(said, lines, strict=True))
    read = np.bincount([line["read"] for line in lines])
    out = [f"{len(lines)} objects: {right} right, {wrong} wrong; touches read: "
           + ", ".join(f"{n}: {count}" for n, count in enumerate(read) if count)]  # fmt: skip
    again = [touch for line in lines for touch in line["touches"][1:]]
    seen = sum(touch["object"] is not None for touch in again)
    out += [f"touches again: {seen} of {len(again)} answered", "", *errors(lines), ""]
    return "\n".join([*out, *alarms(lines), "", *moves(lines)])


def errors(lines: list[dict[str, Any]]) -> list[str]:
    """Return errors and ellipses by number of touches."""
    head = (
        "touches",
        "poses",
        "rms x, y mm",
        "z mm",
        "turn deg",
        "stated x, y mm",
        "area of the x, y ellipse mm2",
        "volume of 6",
        "inside, 6",
        "inside, x, y, turn",
    )
    out = table_head(head)
    for n in range(1, 1 + max(len(line["touches"]) for line in lines)):
        offs, spreads = [], []
        for line in lines:
            touches = read_by_face(line)[:n]
            if len(touches) == n:
                fused = fuse_poses([told(touch) for touch in touches]).pose
                offs.append(off_by(fused, touches[-1]["truth"]))
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
        out.append(
            f"| {n} | {len(off)} | {np.hypot(*rms[:2]):.3f} | {rms[2]:.3f} | "
            f"{np.degrees(rms[5]):.3f} | {np.hypot(*sd[:2]):.3f} | {np.median(area):.3f} | "
            f"{volume:.2e} | {both[0]} | {both[1]} |"
        )
    return out


def alarms(lines: list[dict[str, Any]]) -> list[str]:
    """Return how often an object that lay still was taken for moved."""
    fused = [fuse_poses([told(touch) for touch in read_by_face(line)[:n]])
             for line in lines for n in range(2, 1 + len(read_by_face(line)))]  # fmt: skip
    return [f"false alarms: {share(sum(one.moved for one in fused), len(fused))} fused poses"]


def displaced(placed: ObjectPose, kind: str, by: float, way: float) -> ObjectPose:
    """Return a pose as it would be told had the object been moved: in the plane, or turned."""
    T = placed.T_robot_object.copy()
    if kind == "mm":
        T[:2, 3] += by * np.array([np.cos(way), np.sin(way)])
    else:
        turn = Rotation.from_euler("z", by * (1 if way < np.pi else -1), degrees=True)
        T[:3, :3] = turn.as_matrix() @ T[:3, :3]
    return ObjectPose(T, placed.covariance, placed.shared)


def moves(lines: list[dict[str, Any]]) -> list[str]:
    """Return how often a move was noticed by one further touch: as it was made, and as if made."""
    rng = np.random.default_rng(0)
    out = table_head(("move", "after 1 touch", "after all", "made in the simulator, after all"))
    for kind, sizes in (("mm", SHIFTS_MM), ("deg", TURNS_DEG)):
        for by in sizes:
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
            out.append(f"| {by:g} {kind} | "
                       + " | ".join(share(sum(x), len(x)) for x in (one, several, made) if x)
                       + " |")  # fmt: skip
    return out
