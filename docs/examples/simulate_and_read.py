"""Press a sensor onto a part in simulation and read which object, face and place it is."""

from encoded_objects import Reader, encode, open_lab, simulate

encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database="lab.db", formats=["stl"])
touch = simulate("lab.db#Cube/F3", x=24, y=31, theta=25, force=80)
print(touch)

answer = Reader(open_lab("lab.db")).read(touch.counts)
print(answer)

# The truth is known here: how far off is the answer?
truth = touch.truth()["touches"][0]["T_face_probe"]
print(f"off by {abs(answer.T_face_probe[:2, 3] - [truth[0][3], truth[1][3]]).max():.3f} mm")
