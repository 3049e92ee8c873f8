"""A ROS 2 node that publishes touches and objects; where there is no ROS it shows the messages."""

from encoded_objects import Reader, encode, open_lab
from probe.client import Client
from probe.recording.ros import IMAGE, POSE_WITH_COVARIANCE, image_message
from recognizer.command.ros import object_message

try:
    import rclpy
    from rosidl_runtime_py import set_message_fields
    from rosidl_runtime_py.utilities import get_message

    rclpy.init()
    node = rclpy.create_node("touch")
    types = {"image": get_message(IMAGE), "object": get_message(POSE_WITH_COVARIANCE)}
    topics = {name: node.create_publisher(types[name], f"touch/{name}", 10) for name in types}
except ImportError:
    topics = {}
encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database="lab.db", formats=["stl"])
reader = Reader(open_lab("lab.db"))
with Client("sim:lab.db#Cube/F1?x=28&y=31&theta=25&period=1") as client:
    for frame in client.frames():
        found = reader.read(frame.counts, seq=frame.seq)
        sent = {"image": image_message(frame), "object": object_message(found, None, frame.t_ns)}
        for name in (name for name in topics if sent[name]):
            set_message_fields(message := types[name](), sent[name])
            topics[name].publish(message)
        if found and not topics:
            print(found.object, sent["object"]["pose"]["pose"]["position"])
            break
