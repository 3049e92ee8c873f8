"""A world to touch in: an arm, a compliant wrist, the probe, and encoded objects on a table.

MuJoCo moves the arm, presses the probe through the wrist's springs onto objects of unknown
pose, and says what the tactels feel of the written meshes and how the plate comes to rest on them.
The robot knows its link table, encoders with play and noise, and the wrist's four distances. It
presses over the table until something is higher than that, reads, goes where `next` says, and gives
object and pose in its base.

    python tests/campaigns/robot_world.py --trials 67 --seed 2 --more 5

A line of JSON for each of three objects a trial, then errors in the base by touches. With `--more`
each is touched so often again, anywhere on its face, and the poses are fused. Images are of our own
sensor model on the written faces; `docs/examples/mujoco_arm.py` has MuJoCo's.
"""

import json
import math
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import runner
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from encoded_objects import Reader, Scan, encode, open_lab
from probe.arm import Arm, SensorPose, inverse
from probe.errors import ContactError, PoseError
from probe.scan import JointErrors, touch_at
from probe.simulate.scene import Scene
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor, sample_sensor
from probe.wrist import (
    Wrist,
    WristPose,
    counts_of,
    distances_at,
    gripper_to_plate,
    plate_to_sensor,
    stiffness,
)
from recognizer.touch.robot import ObjectPose, carried_pose, fuse_poses, object_pose
from recognizer.validation.statistics import clopper_pearson
from recognizer.validation.touch_plan import written_surface

Array = np.ndarray
Found = tuple[Any, SensorPose | None, int]
OBJECTS = {"Cube": "{cube: 60 mm}", "Box": "{box: 70 x 55 x 45 mm}",
           "Prism": "{prism: {sides: 6, side: 36 mm, height: 50 mm}}"}  # fmt: skip
KEY = "0123-4567-89AB-CDER"  # so that every run has the same symbols
SECTORS = np.radians([-55.0, 0.0, 55.0])  # where on the table one of them lies
ARM, WRIST, ERRORS = Arm(), Wrist(), JointErrors()
FORCE_N, SPEED_MM_S, STEP_S, TICK_S = 60.0, 80.0, 0.001, 0.005
JOINTS = [f"q{i}" for i in range(1, 6)]
LEVEL = Rotation.from_rotvec([0, 0, -WRIST.gamma_rad]).as_matrix()  # of the plate on the gripper
SPRING_N_MM = 4 * WRIST.spring_n_mm + WRIST.axial_n_mm
ON = "table/"  # before the names of what lies there
HELD_OFF_MM = 0.65  # by which the symbols hold the tips' plane off the face at this force
SYMBOL_MM = 1.0  # height of the symbols: what collides reaches to their tops
SEARCH_MM = [(x, y) for x in (0, 28, -28) for y in (0, 28, -28)]
INSIDE_MM, REACH_RAD = 6.0, 1.2  # of a face's border, and turns, of further touches


def pose(body: Any) -> Array:
    """Return (4, 4) of a body or site of MuJoCo, mm."""
    T = np.eye(4)
    T[:3, :3] = body.xmat.reshape(3, 3)
    T[:3, 3] = 1e3 * body.xpos
    return T


@cache
def surface(lab: str, name: str, face: str) -> Scene:
    """Return a face as it was written."""
    return written_surface(lab, name, face)


def arm_mjcf() -> str:
    """Return the arm of `probe.arm` with wrist and probe, hanging under its table of links."""
    text, close = [], ""
    for i in range(5):
        a, d = ARM.a_mm[i] / 1e3, ARM.d_mm[i] / 1e3
        R = Rotation.from_rotvec([ARM.alpha_rad[i], 0, 0]).as_matrix()
        w, x = math.cos(ARM.alpha_rad[i] / 2), math.sin(ARM.alpha_rad[i] / 2)
        at, axis = -R.T @ [a, 0, d], R.T @ [0, 0, 1]
        text.append(
            f'<body name="link{i + 1}" pos="{a} 0 {d}" quat="{w} {x} 0 0" gravcomp="1">'
            f'<joint name="q{i + 1}" pos="{at[0]} {at[1]} {at[2]}" axis="{axis[0]} {axis[1]} '
            f'{axis[2]}" armature=".5" damping="5"/>'
            f'<geom type="capsule" size=".022" fromto="{at[0]} {at[1]} {at[2]} 0 0 0" '
            'rgba=".35 .42 .5 1" contype="0" conaffinity="0"/>'
        )
        close += "</body>"
    low, high = (1e-3 * stop for stop in WRIST.travel_mm)
    turns = [stiffness(WRIST).tilt_x_nmm_rad / 1e3, stiffness(WRIST).tilt_y_nmm_rad / 1e3]
    g, stop = WRIST.gamma_rad / 2, WRIST.tilt_rad
    half, tips = 0.0127, WRIST.tips_mm / 1e3
    text.append(
        f'<body name="plate" quat="{math.cos(g)} 0 0 {-math.sin(g)}" gravcomp="1">'
        f'<joint name="z" type="slide" axis="0 0 1" range="{low} {high}" springref="{high}" '
        f'stiffness="{1e3 * SPRING_N_MM}" damping="100" armature=".5"/>'
        f'<joint name="ty" axis="0 1 0" range="{-stop} {stop}" stiffness="{turns[1]}" '
        f'damping=".1" armature="2e-3"/><joint name="tx" axis="1 0 0" range="{-stop} {stop}" '
        f'stiffness="{turns[0]}" damping=".1" armature="2e-3"/>'
        '<geom type="cylinder" size=".032 .003" mass=".4" rgba=".2 .2 .22 1" contype="0" '
        'conaffinity="0"/>'
        f'<geom name="pad" type="box" size="{half} {half} .005" '
        f'pos="0 0 {tips - 0.005 + (HELD_OFF_MM - SYMBOL_MM) / 1e3}" '
        'rgba=".9 .47 .13 1" friction="1"/>'
        f'<site name="sensor" pos="0 0 {tips}" quat="0 1 0 0"/></body>'
    )
    return "".join(text) + close


def build(folder: Path) -> mujoco.MjModel:
    """Return the world: our own MJCF of each object, attached to table and arm."""
    actuators = "".join(f'<position joint="q{i}" kp="60000" kv="1500"/>' for i in range(1, 6))
    spec = mujoco.MjSpec.from_string(
        f'<mujoco><option timestep="{STEP_S}" integrator="implicitfast" '
        'cone="elliptic" impratio="10"/>'
        '<visual><global offwidth="640" offheight="480"/></visual><asset><texture type="skybox" '
        'builtin="flat" rgb1=".93 .94 .96" width="32" height="192"/></asset><worldbody>'
        '<light pos="0.3 -0.6 1.4" dir="0 .4 -1"/><camera name="film" pos=".78 -.55 .42" '
        'xyaxes=".62 .78 0 -.3 .24 .92"/><geom type="plane" size="1 1 .1" rgba=".82 .84 .86 1"/>'
        f"{arm_mjcf()}</worldbody><actuator>{actuators}</actuator></mujoco>"
    )
    for name in OBJECTS:
        path = folder / name / f"{name}.xml"
        part = mujoco.MjSpec.from_file(str(path))
        spec.attach(part, prefix=ON, frame=spec.worldbody.add_frame())
    for geom in spec.geoms:  # parts of 80 g under 70 N: the usual soft contact would swallow them
        geom.solref, geom.solimp = [2 * STEP_S, 1], [0.999, 0.9999, 1e-4, 0.5, 2]
    return spec.compile()


class Bench:
    """The arm at work."""

    def __init__(self, model: mujoco.MjModel, lab: str, rng: np.random.Generator) -> None:
        self.model, self.data, self.rng, self.lab = model, mujoco.MjData(model), rng, lab
        self.reader = Reader(open_lab(lab))
        self.joints = [model.joint(name).qposadr[0] for name in JOINTS]
        instance = sample_sensor(self.reader.sensor, rng)
        level = LEVELS["typical"]
        self.sensor = LevelSensor(self.reader.sensor, level, "mujoco", instance)
        hanging = WristPose(WRIST.travel_mm[1], 0.0, 0.0, np.zeros((3, 3)))
        self.T_gripper_sensor = gripper_to_plate(WRIST, hanging) @ plate_to_sensor(WRIST)

    def lay_out(self) -> None:
        """Put every object on a face of its own choice, anywhere in its sector."""
        mujoco.mj_resetData(self.model, self.data)
        for name, sector in zip(OBJECTS, self.rng.permutation(SECTORS), strict=True):
            faces = [self.model.site(i) for i in range(self.model.nsite)]
            faces = [f for f in faces if f.name.startswith(f"{ON}{name}-")]
            down = faces[self.rng.integers(len(faces))]
            R = Rotation.from_quat(np.roll(down.quat, -1)).inv()
            flip = Rotation.from_euler("xz", [math.pi, self.rng.uniform(-math.pi, math.pi)])
            turn = flip * R
            radius = self.rng.uniform(0.29, 0.34)
            at = radius * np.array([math.cos(sector), math.sin(sector)])
            middle = turn.apply(self.model.body(ON + name).ipos)
            low = -turn.apply(down.pos)[2] + SYMBOL_MM / 1e3
            start = self.model.joint(ON + name).qposadr[0]
            xy = at - middle[:2] + self.rng.uniform(-0.02, 0.02, 2)
            self.data.qpos[start : start + 7] = [*xy, low + 1e-4, *np.roll(turn.as_quat(), 1)]
        self._stand(self._angles([300, 0, 180], 0.0))
        self._steps(0.4)

    def touch(self, at_mm: Array, turn_rad: float) -> tuple[Array, SensorPose] | None:
        """Press down at a place; returns counts, believed pose and height, or None on the table."""
        above = self._angles([*at_mm, 95.0], turn_rad)
        self._stand(above)
        height = 95.0
        while self._force() < FORCE_N:
            height -= SPEED_MM_S * TICK_S * (1.0 if self._force() < 2.0 else 0.2)
            if height < -4.0:
                return None
            self.data.ctrl[:] = self._angles([*at_mm, height], turn_rad)
            self._steps(TICK_S)
        self._steps(0.25)
        if 1e3 * self.data.site("sensor").xpos[2] < 10.0:
            return None
        counts = self._feel()
        lean = [self.data.joint(name).qpos[0] for name in ("z", "tx", "ty")]
        gaps = distances_at(WRIST, 1e3 * lean[0], lean[1], lean[2])
        wrist = counts_of(WRIST, gaps + self.rng.normal(0, WRIST.reading_mm, 4))
        play = self.rng.uniform(-0.5, 0.5, 5) * ERRORS.backlash_rad
        encoders = self.data.qpos[self.joints] + play + self.rng.normal(0, ERRORS.noise_rad)
        sensor = carried_pose(ARM, WRIST, encoders, ERRORS.covariance(), wrist)
        return counts, sensor

    def _feel(self) -> Array:
        """Return what the tactels feel of the written part; let the plate rest as it is pressed."""
        name, face = self.under()
        if not face:
            return np.zeros((16, 16), np.uint16)
        site, scene = self.data.site(f"{ON}{name}-{face}"), surface(self.lab, name, face)
        T_face_base = np.linalg.inv(pose(site))
        T = T_face_base @ self.level_sensor()
        T[:3, 3] = (T_face_base @ pose(self.data.site("sensor")))[:3, 3]
        touch = touch_at(T, self._force(), stiffness(WRIST))
        try:
            reading = self.sensor.read(scene, touch, self.rng)
        except ContactError:  # the plate tips over the edge
            return np.zeros((16, 16), np.uint16)
        contact = reading.contact
        lean = Rotation.from_euler("ZXY", [touch.theta_rad, contact.tilt_x_rad, contact.tilt_y_rad])
        self._rest(pose(site), lean, np.array([touch.x_mm, touch.y_mm, contact.z_mm]))
        return reading.counts

    def _rest(self, T_base_face: Array, lean: Rotation, at_mm: Array) -> None:
        """Let the plate hang as the symbols hold it: tilts, height, and place."""
        R_base_level = pose(self.data.body("link5"))[:3, :3] @ LEVEL
        out = -(R_base_level.T @ T_base_face[:3, :3] @ lean.as_matrix())[:, 2]  # of the plate
        self.data.joint("ty").qpos[0] = math.atan2(out[0], out[2])
        self.data.joint("tx").qpos[0] = -math.asin(out[1])
        freedoms = [self.model.joint(name).dofadr[0] for name in (*JOINTS, "z")]
        columns = np.zeros((6, self.model.nv))
        for _ in range(3):  # as the plate tilts the tips swing aside: the arm yields by that much
            mujoco.mj_forward(self.model, self.data)
            sensor = self.data.site("sensor")
            off = T_base_face[:3, :3] @ at_mm + T_base_face[:3, 3] - pose(sensor)[:3, 3]
            mujoco.mj_jacSite(self.model, self.data, columns[:3], columns[3:], sensor.id)
            step = np.linalg.lstsq(columns[:, freedoms], [*(1e-3 * off), 0, 0, 0], rcond=None)[0]
            self.data.qpos[[*self.joints, self.model.joint("z").qposadr[0]]] += step
        mujoco.mj_forward(self.model, self.data)

    def under(self) -> tuple[str, str]:
        """Return object and face that lie under the sensor; empty where none does."""
        T_base_sensor, best = pose(self.data.site("sensor")), (math.inf, "", "")
        for i in range(self.model.nsite):
            site = self.data.site(i)
            T = np.linalg.inv(pose(site)) @ T_base_sensor
            if site.name == "sensor" or T[2, 2] < 0.98 or abs(T[2, 3] - HELD_OFF_MM) > 3.0:
                continue
            name, _, face = site.name.removeprefix(ON).rpartition("-")
            region, at = surface(self.lab, name, face).region, T[None, :2, 3]
            off = float(region.distance_mm(at)[0]) * (-1 if region.contains(at)[0] else 1)
            best = min(best, (off, name, face))
        return best[1:]

    def object_in(self, sector: float) -> str:
        """Return what lies in a sector."""
        where = {n: pose(self.data.body(ON + n))[:2, 3] for n in OBJECTS}
        return min(where, key=lambda n: abs(math.atan2(where[n][1], where[n][0]) - sector))

    def level_sensor(self) -> Array:
        """Return where the sensor would be if the wrist were level."""
        return pose(self.data.body("link5")) @ self.T_gripper_sensor

    def _force(self) -> float:
        return SPRING_N_MM * max(WRIST.travel_mm[1] - 1e3 * self.data.joint("z").qpos[0], 0.0)

    def _angles(self, at_mm: Any, turn_rad: float) -> Array:
        c, s = math.cos(turn_rad), math.sin(turn_rad)
        T = np.array(
            [[c, -s, 0, at_mm[0]], [s, c, 0, at_mm[1]], [0, 0, 1, at_mm[2]], [0, 0, 0, 1.0]]
        )
        found = inverse(ARM, T @ np.linalg.inv(self.T_gripper_sensor))
        return min(found, key=lambda q: float(np.abs(q - self.data.qpos[self.joints]).max()))

    def _stand(self, angles: Array) -> None:
        self.data.qpos[self.joints] = self.data.ctrl[:] = angles
        self.data.qvel[:] = 0
        self.data.joint("z").qpos[0] = WRIST.travel_mm[1] / 1e3
        for name in ("tx", "ty"):
            self.data.joint(name).qpos[0] = 0
        mujoco.mj_forward(self.model, self.data)

    def _steps(self, seconds: float) -> None:
        mujoco.mj_step(self.model, self.data, max(1, round(seconds / STEP_S)))

    def find(self, sector: float, most: int = 4) -> Found:
        """Search a sector; returns (recognition, pose of the sensor, touches read)."""
        middle = 315.0 * np.array([math.cos(sector), math.sin(sector)])
        read = 0
        for off in SEARCH_MM:
            at, turn, scan = middle + off, 0.0, Scan(self.reader)
            while read < most + 2:
                try:
                    pressed = self.touch(at, turn)
                except PoseError:
                    break
                if pressed is None:
                    break
                counts, sensor = pressed
                read += 1
                found = scan.add(counts.astype(float), sensor, seq=read)
                if found:
                    return found, sensor, read
                step = found.next and (found.next.dx_mm, found.next.dy_mm)
                if not step or not any(step) or scan.touches >= most:
                    break
                c, s = math.cos(turn), math.sin(turn)
                at = at + np.array([[c, -s], [s, c]]) @ step
                turn += math.radians(found.next.turn_deg)
        return None, None, read

    def touch_again(self, found: Any, placed: ObjectPose) -> ObjectPose | None:
        """Touch the face at another place, by what is believed of the object."""
        region = surface(self.lab, found.object, found.face).region
        at = self.rng.uniform(*region.box_mm)[None]
        if not region.contains(at)[0] or region.distance_mm(at)[0] < INSIDE_MM:
            return None
        T_object_face = found.T_object_probe @ np.linalg.inv(found.T_face_probe)
        spot = placed.T_robot_object @ T_object_face @ [*at[0], 0.0, 1.0]
        try:
            pressed = self.touch(spot[:2], self.rng.uniform(-REACH_RAD, REACH_RAD))
        except PoseError:  # the arm cannot stand so
            return None
        if pressed is None:
            return None
        counts, sensor = pressed
        again = self.reader.read(counts.astype(float))
        return object_pose(again, sensor) if again.object == found.object else None


def error_of(T: Array, truth: Array) -> Array:
    """Return (6,) truth less answer: mm and rad, base axes."""
    turn = Rotation.from_matrix(truth[:3, :3] @ T[:3, :3].T).as_rotvec()
    return np.array([*(truth[:3, 3] - T[:3, 3]), *turn])


def work_on(bench: Bench, trial: int, sector: float, more: int) -> runner.Row:
    """Find the object of a sector, touch it again; answer and errors by the number of touches."""
    name = bench.object_in(sector)
    found, sensor, read = bench.find(sector)
    row = {"trial": trial, "object": name, "answer": found.object if found else "",
           "touches": read, "fused": []}  # fmt: skip
    placed = object_pose(found, sensor) if found and sensor is not None else None
    if placed is None or found.object != name:
        return row
    poses = [placed]
    for _ in range(20 * more):
        if len(poses) <= more and (again := bench.touch_again(found, placed)) is not None:
            poses.append(again)
    for number in range(1, 1 + len(poses)):
        fused = fuse_poses(poses[:number])
        off = error_of(fused.pose.T_robot_object, pose(bench.data.body(ON + name)))
        far = float(off @ np.linalg.solve(fused.pose.covariance, off))
        row["fused"].append({"off": off.tolist(), "chi2": far, "moved": bool(fused.moved)})
    return row


def tabulate(rows: list[runner.Row]) -> None:
    """Print what became of the objects, and errors by number of touches."""
    right = sum(row["answer"] == row["object"] for row in rows)
    wrong = sum(row["answer"] not in ("", row["object"]) for row in rows)
    print(f"{len(rows)} objects: {right} right, {wrong} wrong")
    runner.table(("touches", "poses", "rms x, y mm", "z mm", "turn deg", "inside the 95 %",
                  "taken for moved"))  # fmt: skip
    for number in range(max(len(row["fused"]) for row in rows)):
        some = [row["fused"][number] for row in rows if len(row["fused"]) > number]
        rms = np.sqrt(np.mean([np.square(one["off"]) for one in some], axis=0))
        hits = sum(one["chi2"] < chi2.ppf(0.95, 6) for one in some)
        low, high = clopper_pearson(hits, len(some))
        inside = f"{hits} of {len(some)} ({100 * low:.0f}-{100 * high:.0f} %)"
        moved = sum(one["moved"] for one in some)
        sizes = (f"{value:.3f}" for value in (np.hypot(*rms[:2]), rms[2], np.degrees(rms[5])))
        runner.row(number + 1, len(some), *sizes, inside, moved)


def make(folder: Path) -> tuple[mujoco.MjModel, str]:
    """Encode the objects into a lab; return the world and the lab's URL."""
    for name, shape in OBJECTS.items():
        spec = f"name: {name}\nshape: {shape}\noutput: {{lab_key: {KEY}}}\n"
        encode(spec + "robot: {collision: body}\n", database=str(folder / "bench.db"),
               folder=folder / name, formats=("stl", "mjcf"))  # fmt: skip
    return build(folder), f"sqlite:///{folder / 'bench.db'}"


def main() -> None:
    """Lay out, search and read; three objects a trial."""
    asked = runner.asked(__doc__, trials=1, seed=1, more=0, folder="robot_world")
    folder, rows = Path(asked.folder), []
    folder.mkdir(exist_ok=True)
    model, lab = make(folder)
    for trial in range(asked.trials):
        bench = Bench(model, lab, np.random.default_rng([asked.seed, trial]))
        bench.lay_out()
        for sector in SECTORS:
            rows.append(work_on(bench, trial, sector, asked.more))
            print(json.dumps(rows[-1]), flush=True)
    tabulate(rows)


if __name__ == "__main__":
    main()
