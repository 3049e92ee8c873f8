"""Read images of a sensor of your own: an array (N, rows, columns) of values that rise with force.

Of another shape than 16x16 with its type: import_array(..., sensor_type="flexitac-12x32").
"""

from pathlib import Path

import numpy as np

from encoded_objects import Reader, encode, open_lab, simulate
from probe.recording.imported import import_array

encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database="lab.db", formats=["stl"])
counts = simulate("lab.db#Cube/F4", x=28, y=31, force=80).counts
np.save("mine.npy", np.stack([counts, counts]) / 1023)  # here: in volts of the amplifier, say

recording = import_array(Path("mine.npy"), Path("mine.h5"))  # as counts, for the commands, too
print(recording)
for answer in Reader(open_lab("lab.db")).read_all(recording, every=True):
    print(answer)
