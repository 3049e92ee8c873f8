"""Follow a probe at a port, here a simulated one, and read a frame now and then."""

from encoded_objects import Reader, encode, open_lab
from probe.client import Client

encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database="lab.db", formats=["stl"])
reader = Reader(open_lab("lab.db"))

# A real probe: serial:///dev/ttyACM0. This one comes down, holds and lifts every second.
url = "sim:lab.db#Cube/F1?x=28&y=31&theta=25&period=1"
with Client(url) as client:
    for frame in client.frames():
        answer = reader.read(frame.counts, seq=frame.seq)
        if answer:
            print(answer)
            break
