"""Where one touch shows too few symbols, touch again next to it: several are one belief."""

import numpy as np

from encoded_objects import Scan, encode, open_lab, simulate

encode({"name": "Plate", "shape": {"box": "90 x 90 x 40 mm"}, "profile": "thesis"},
       database="lab.db", formats=["stl"])  # fmt: skip

scan = Scan(open_lab("lab.db"))
for number, (x, y) in enumerate([(30, 30), (42, 30), (54, 30), (54, 42), (42, 42), (30, 42)]):
    touch = simulate("lab.db#Plate/F1", x=x, y=y, theta=10, force=80, seed=number)
    arm = np.array(touch.truth()["touches"][0]["T_object_probe"])  # what a robot would say
    answer = scan.add(touch.counts, pose=arm)
    print(f"{scan.touches} touches: {answer.object or answer.reason}")
    if answer:
        break
