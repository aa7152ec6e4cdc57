"""MCAP recordings as another program might write them: no chunks, no index, messages as plain CDR."""
import struct

LINE = """name: line
tag_family: tag36h11
tag_size_m: 0.16
anchor_id: 0
tags:
  - {id: 0, x_m: 2.6, y_m: 0.3, z_m: 0.3, facing_deg: 180}
  - {id: 1, x_m: 2.6, y_m: -0.3, z_m: 0.3, facing_deg: 180}
  - {id: 2, x_m: 2.6, y_m: 0, z_m: 0.5, facing_deg: 180}
path_closed: false
path_m: [[0, 0], [0.3, 0], [0.6, 0]]
"""

MAGIC = b"\x89MCAP0\r\n"


def text(words):
    data = words.encode()
    return struct.pack("<I", len(data)) + data


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


class Cdr:
    """Plain CDR, little-endian: each number is aligned to its size, relative to the end of the four-byte header."""

    def __init__(self):
        self.body = bytearray()

    def number(self, code, value):
        size = struct.calcsize(code)
        self.body += b"\0" * (-len(self.body) % size) + struct.pack("<" + code, value)
        return self

    def text(self, words):
        data = words.encode() + b"\0"
        self.number("I", len(data)).body.extend(data)
        return self

    def blob(self, data):
        self.number("I", len(data)).body.extend(data)
        return self

    def header(self, stamp_ns, frame):
        return self.number("i", stamp_ns // 10**9).number("I", stamp_ns % 10**9).text(frame)

    def bytes(self):
        return b"\0\1\0\0" + bytes(self.body)


def compressed_image(stamp_ns, data):
    return Cdr().header(stamp_ns, "camera_optical").text("png").blob(data).bytes()


def no_tags(stamp_ns, camera):
    return Cdr().header(stamp_ns, f"{camera}_optical").number("I", 0).bytes()


def odometry(stamp_ns, speed_m_s=0.3):
    cdr = Cdr().header(stamp_ns, "odom").text("base_link")
    for value in (0, 0, 0, 0, 0, 0, 1, *[0] * 36, speed_m_s, 0, 0, 0, 0, 0, *[0] * 36):
        cdr.number("d", value)
    return cdr.bytes()


def write(path, messages, close=True):
    """messages = [(topic, type, log_time_ns, cdr bytes)]"""
    out = bytearray(MAGIC + record(1, text("ros2") + text("a test")))
    channels = {}
    for number, (topic, kind, time, data) in enumerate(messages):
        if topic not in channels:
            channels[topic] = len(channels) + 1
            out += record(3, struct.pack("<H", channels[topic]) + text(kind) + text("ros2msg")
                          + text("std_msgs/Header header\n"))
            out += record(4, struct.pack("<HH", channels[topic], channels[topic]) + text(topic) + text("cdr")
                          + struct.pack("<I", 0))
        out += record(5, struct.pack("<HIQQ", channels[topic], number, time, time) + data)
    if close:
        out += record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MAGIC
    path.write_bytes(out)
