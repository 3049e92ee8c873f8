"""An arm in MuJoCo that cannot see finds two parts on a table by touch, and says where they lie.

It presses its sensor down, place after place. Where something is higher than the table it reads
what MuJoCo's tactile sensor feels, and touches again where `next` says until a part answers. The
arm knows where it holds its sensor, and nothing of the parts but the lab's database.
"""

import math
from typing import Any

import mujoco
import numpy as np

from encoded_objects import Reader, Recognition, encode, open_lab

PARTS = {"Cube": "{cube: 55 mm}", "Prism": "{prism: {sides: 6, side: 32 mm, height: 45 mm}}"}
POSES = {"Cube": ([0.31, 0.13, 0.05], [0.5, 0.5, -0.35, 0.61]),
         "Prism": ([0.33, -0.12, 0.02], [0.9, 0.0, 0.0, 0.43])}  # fmt: skip
LINK, SHOULDER, TOOL = 0.3, 0.35, 0.08  # m
ARM = f"""<mujoco><compiler balanceinertia="true"/><option integrator="implicitfast"/>
<default><joint armature=".1" damping="20"/><position kp="20000" kv="400"/>
 <geom contype="0" conaffinity="0"/><default class="hits"><geom contype="1"/></default></default>
<asset><mesh name="tips" builtin="plate" params="48 48" scale=".0127 .0127 0" inertia="shell"/>
</asset><worldbody><geom class="hits" type="plane" size="1 1 .1"/>
<body gravcomp="1" pos="0 0 {SHOULDER}"><joint name="q1" axis="0 0 1"/><geom size=".03"/>
 <body gravcomp="1"><joint name="q2" axis="0 1 0"/>
  <geom type="capsule" size=".02" fromto="0 0 0 {LINK} 0 0"/>
  <body gravcomp="1" pos="{LINK} 0 0"><joint name="q3" axis="0 1 0"/>
   <geom type="capsule" size=".02" fromto="0 0 0 {LINK} 0 0"/>
   <body gravcomp="1" pos="{LINK} 0 0"><joint name="q4" axis="0 1 0"/><geom size=".02"/>
    <body gravcomp="1"><joint name="q5" axis="1 0 0"/>
     <geom type="capsule" size=".01" fromto="0 0 0 {TOOL - 0.02} 0 0"/>
     <body name="pad" gravcomp="1" pos="{TOOL} 0 0" quat=".7071068 0 -.7071068 0">
      <geom class="hits" type="box" size=".0127 .0127 .005" pos="0 0 .0054"/>
      <geom name="tips" type="mesh" mesh="tips" mass="0"/>
</body></body></body></body></body></body></worldbody>
<actuator>{"".join(f'<position joint="q{number}"/>' for number in range(1, 6))}</actuator>
<sensor><tactile name="depth" geom="tips" mesh="tips"/></sensor></mujoco>"""


def pose(body: Any) -> np.ndarray:
    """Return (4, 4) of a body of MuJoCo, mm."""
    return np.block([[body.xmat.reshape(3, 3), 1e3 * body.xpos[:, None]], [np.eye(4)[3:]]])


def angles(x: float, y: float, z: float, turn: float) -> list[float]:
    """Return the joints that hold the sensor level at a place (mm), turned (rad)."""
    out, down = 1e-3 * math.hypot(x, y), SHOULDER - TOOL - 1e-3 * z
    elbow = math.acos(math.hypot(out, down) / 2 / LINK)
    first = math.atan2(down, out) - elbow
    return [math.atan2(y, x), first, 2 * elbow, math.pi / 2 - first - 2 * elbow, turn]


def press(x: float, y: float, turn: float) -> np.ndarray | None:
    """Press down at a place; return the image, mm deep, or None on the table."""
    data.ctrl[:] = data.qpos[:5] = angles(x, y, 75, turn)
    data.qvel[:5] = 0
    for z in np.arange(75, -1, -0.1):
        data.ctrl[:] = angles(x, y, z, turn)
        mujoco.mj_step(model, data)
        depths = 1e3 * data.sensor("depth").data[: 48 * 48].reshape(16, 3, 16, 3).mean((1, 3))
        if (depths > 0.1).sum() > 20 and depths.max() > 0.3:
            return depths.T[::-1]
    return None


def find(x: float, y: float) -> tuple[Recognition, np.ndarray] | None:
    """Touch at a place, then where `next` says; return the answer and the part in the base."""
    turn = 0.0
    for _ in range(4):
        image = press(x, y, turn)
        if image is None:
            return None
        T_base_sensor, answer = pose(data.body("pad")), reader.read(1e3 * image)
        if answer:
            return answer, T_base_sensor @ np.linalg.inv(answer.T_object_probe)
        if answer.next is None:
            return None
        x, y = (T_base_sensor @ [answer.next.dx_mm, answer.next.dy_mm, 0, 1])[:2]
        turn += math.radians(answer.next.turn_deg)
    return None


world = mujoco.MjSpec.from_string(ARM)
for name, shape in PARTS.items():
    spec = f"name: {name}\nshape: {shape}\noutput: {{lab_key: 0123-4567-89AB-CDER}}\n"
    encode(spec, database="lab.db", formats=["mjcf"])
    part = mujoco.MjSpec.from_file(f"out/{name.lower()}/{name}.xml")
    part.mesh(f"{name}-touch").octree_maxdepth = 7
    part.body(name).pos, part.body(name).quat = POSES[name]
    world.attach(part, prefix="on/", frame=world.worldbody.add_frame())
model = world.compile()
data, reader = mujoco.MjData(model), Reader(open_lab("lab.db"))
data.ctrl[:] = data.qpos[:5] = angles(300, 0, 120, 0)
mujoco.mj_step(model, data, 500)  # the parts come to rest
for y in (130, -120):
    places = (find(x, y + beside) for x in (300, 330) for beside in (0, 25, -25))
    answer, T = next(found for found in places if found)
    off = (T - pose(data.body(f"on/{answer.object}")))[:2, 3]
    print(
        f"{answer.object} lies at x {T[0, 3]:.1f}, y {T[1, 3]:.1f} mm with {answer.face} up, found "
        f"by touch alone, {np.hypot(*off):.2f} mm from where MuJoCo has it."
    )
