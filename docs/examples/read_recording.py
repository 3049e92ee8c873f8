"""Read every touch of a recording: who answers, and who says why not."""

from encoded_objects import Reader, Recording, encode, open_lab, simulate

encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database="lab.db", formats=["stl"])
simulate("lab.db#Cube/F2", touches=5, frames=8, seed=4).save("touches.h5")

recording = Recording("touches.h5")
print(recording)

reader = Reader(open_lab("lab.db"))
for answer in reader.read_all(recording):
    print(answer.seq, answer)
