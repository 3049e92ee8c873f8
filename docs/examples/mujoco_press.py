"""A part on a table in MuJoCo: press a sensor onto it, and read which part and place it is."""

import mujoco

from encoded_objects import Reader, encode, open_lab

WORLD = """<mujoco><compiler balanceinertia="true"/><worldbody>
<geom type="plane" size="1 1 .1"/><body name="pad" mocap="true" pos=".004 -.003 .07" euler="0 0 30">
 <geom type="box" size=".0127 .0127 .005" pos="0 0 .0055"/>
 <geom name="tips" type="mesh" mesh="tips" contype="0" conaffinity="0"/></body></worldbody><asset>
<mesh name="tips" builtin="plate" params="48 48" scale=".0127 .0127 0" inertia="shell"/></asset>
<sensor><tactile name="depth" geom="tips" mesh="tips"/></sensor></mujoco>"""

encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database="lab.db", formats=["mjcf"])
world, part = mujoco.MjSpec.from_string(WORLD), mujoco.MjSpec.from_file("out/cube/Cube.xml")
part.mesh("Cube-touch").octree_maxdepth = 7  # MuJoCo's own 6 is too coarse for strokes of 1 mm
world.attach(part, prefix="on/", frame=world.worldbody.add_frame(pos=[0, 0, 0.002]))
model = world.compile()
data = mujoco.MjData(model)
depths = data.sensor("depth").data[: 48 * 48]  # m, of 3 x 3 points in each of 16 x 16 tactels
while depths.max() < 4e-4:
    data.mocap_pos[0, 2] -= 2e-5
    mujoco.mj_step(model, data)
image = depths.reshape(16, 3, 16, 3).mean((1, 3)).T[::-1]  # row 0 on top
print(Reader(open_lab("lab.db")).read(1e6 * image))
