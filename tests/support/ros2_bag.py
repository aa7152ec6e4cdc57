"""ROS 2 bags (SQLite, as Humble writes them) with messages of cameras."""
import math
import pathlib
import sqlite3
import struct

IMAGE = "sensor_msgs/msg/Image"
INFO = "sensor_msgs/msg/CameraInfo"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
ODOMETRY = "nav_msgs/msg/Odometry"
DETECTIONS = "apriltag_msgs/msg/AprilTagDetectionArray"


class Message:
    """CDR, little-endian: each number is aligned to its size, relative to the end of the four-byte header."""

    def __init__(self):
        self.body = bytearray()

    def put(self, code, *values):
        for value in values:
            size = struct.calcsize(code)
            self.body += bytes(-len(self.body) % size) + struct.pack("<" + code, value)
        return self

    def text(self, text):
        data = text.encode() + b"\0"
        self.put("I", len(data)).body.extend(data)
        return self

    def header(self, ns, frame):
        return self.put("i", ns // 10**9).put("I", ns % 10**9).text(frame)

    def bytes(self):
        return b"\0\1\0\0" + bytes(self.body)


def image(ns, frame, width, height, encoding, data, step):
    message = Message().header(ns, frame).put("I", height, width).text(encoding).put("B", 0).put("I", step, len(data))
    message.body += data
    return message.bytes()


def camera_info(ns, frame, width, height, k, d, model="plumb_bob", p=None, binning=0, roi=(0, 0, 0, 0)):
    """`k`: 3 x 3 and `p`: 3 x 4 matrices as flat lists; `roi`: x, y, height, width."""
    message = Message().header(ns, frame).put("I", height, width).text(model).put("I", len(d)).put("d", *d)
    message.put("d", *k).put("d", 1, 0, 0, 0, 1, 0, 0, 0, 1).put("d", *(p or [*k[:3], 0, *k[3:6], 0, *k[6:], 0]))
    return message.put("I", binning, binning, *roi).put("B", 0).bytes()


def transform(ns, parent, child, translation, xyzw):
    return Message().put("I", 1).header(ns, parent).text(child).put("d", *translation, *xyzw).bytes()


def odometry(ns, x, speed, y=0, yaw=0, yaw_rate=0):
    message = Message().header(ns, "odom").text("base_link")
    message.put("d", x, y, 0, 0, 0, math.sin(yaw / 2), math.cos(yaw / 2), *[0] * 36)
    return message.put("d", speed, 0, 0, 0, 0, yaw_rate, *[0] * 36).bytes()


def detections(ns, frame, tags):
    """`tags`: {number: corners TL, TR, BR, BL with pixel centres at integers}, or pairs of both; messages list BL, BR, TR, TL."""
    tags = list(tags.items()) if isinstance(tags, dict) else tags
    message = Message().header(ns, frame).put("I", len(tags))
    for number, corners in tags:
        message.text("tag36h11").put("i", number, 0).put("f", 0, 70).put("d", *corners.mean(axis=0))
        message.put("d", *corners[[3, 2, 1, 0]].ravel(), *[0] * 9)
    return message.bytes()


def write(path, messages):
    """messages = [(ns, topic, type, cdr bytes)]. Replaces an existing file."""
    pathlib.Path(path).unlink(missing_ok=True)
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)")
    base.execute("INSERT INTO schema VALUES(3, 'humble')")
    base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, "
                 "offered_qos_profiles TEXT NOT NULL)")
    base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
    topics = {}
    for _, topic, kind, _ in messages:
        topics.setdefault(topic, (len(topics) + 1, topic, kind))
    base.executemany("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')", topics.values())
    base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                     [(topics[topic][0], ns, data) for ns, topic, _, data in messages])
    base.commit()
    base.close()
    return pathlib.Path(path)
