"""Find where the sensor sits on a robot's flange, and where a clamped part is, by touching it.

For each touch: T_base_flange T_flange_sensor = T_base_object T_object_probe, where the controller
says the first (here metres and quaternions) and the answer of the touch the last. A touch measures
x, y and the turn on its face well. How deep the tips sink in and how askew the sensor lies it does
not measure: depth and the end of the sensor look the same, so that the depth is assumed.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from encoded_objects import Reader, encode, open_lab, simulate

SUNK = 0.55  # mm, of the tips below the symbols' tops
SD = np.array([0.1, 0.1, 0.3, 0.02, 0.02, 0.003])  # mm and rad: of arm and touch, sensor frame


def pose(shift: ArrayLike, rotation: Rotation) -> np.ndarray:
    """Return a pose (4, 4)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.as_matrix(), shift
    return T


def pose_of(six: np.ndarray) -> np.ndarray:
    """Return the pose of a shift (mm) and a rotation vector (rad)."""
    return pose(six[:3], Rotation.from_rotvec(six[3:]))


encode({"name": "Block", "shape": {"box": "60 x 45 x 36 mm"}}, database="lab.db", formats=["stl"])
rng = np.random.default_rng(1)
T_flange_sensor = pose([3, -2, 86], Rotation.from_euler("xyz", [180.7, -0.8, 31], degrees=True))
T_base_object = pose([412, -133, 51], Rotation.from_euler("xyz", [2, -3, 77], degrees=True))

said, images = [], []  # what the controller says, and the images: yours come from your arm
for face in ("F2", "F3", "F4", "F6"):
    for _ in range(5):
        x, y = rng.uniform(13, 23, 2)
        touch = simulate(f"lab.db#Block/{face}", x=x, y=y, theta=rng.uniform(0, 360), force=80,
                         seed=int(rng.integers(1000)))  # fmt: skip
        held = T_base_object @ touch.truth()["touches"][0]["T_object_probe"]
        flange = (
            held @ np.linalg.inv(T_flange_sensor) @ pose_of(rng.normal(0, [0.1] * 3 + [5e-4] * 3))
        )
        said.append((flange[:3, 3] / 1000, Rotation.from_matrix(flange[:3, :3]).as_quat()))
        images.append(touch.counts)

reader = Reader(open_lab("lab.db"))
answers = [reader.read(image) for image in images]
pairs = [
    (pose(1000 * np.array(metres), Rotation.from_quat(xyzw)), answer.T_object_probe)
    for (metres, xyzw), answer in zip(said, answers, strict=True)
    if answer
]


def misfit(unknown: np.ndarray) -> np.ndarray:
    """Return how far the two ways around differ at every touch, in standard deviations."""
    sensor, part = pose_of(unknown[:6]), pose_of(unknown[6:])
    found = []
    for T_base_flange, T_object_probe in pairs:
        off = np.linalg.inv(part @ T_object_probe) @ T_base_flange @ sensor
        off[2, 3] += SUNK
        found.append(np.r_[off[:3, 3], Rotation.from_matrix(off[:3, :3]).as_rotvec()] / SD)
    return np.concatenate(found)


guesses = []
for turn in range(0, 360, 30):  # roughly: the sensor's z is the flange's, the other way
    mounted = pose([0, 0, 80], Rotation.from_euler("xz", [180, turn], degrees=True))
    part = pairs[0][0] @ mounted @ np.linalg.inv(pairs[0][1])
    guesses.append(np.concatenate([
        [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_rotvec()] for T in (mounted, part)
    ]))  # fmt: skip
nearest = min(guesses, key=lambda unknown: np.linalg.norm(misfit(unknown)))
best = least_squares(misfit, nearest, loss="soft_l1", x_scale="jac")
off = np.linalg.inv(T_flange_sensor) @ pose_of(best.x[:6])
turned = np.degrees(np.linalg.norm(Rotation.from_matrix(off[:3, :3]).as_rotvec()))
print(f"{len(pairs)} of {len(images)} touches answered; T_flange_sensor is off by")
print(f"{np.hypot(*off[:2, 3]):.2f} mm across, {off[2, 3]:.2f} mm along, {turned:.2f} degrees")
