"""Poses with covariance from an MCAP file, read only by the specification of the format (mcap.dev; CDR of ROS 2)."""
import ctypes
import math
import pathlib
import struct
import typing

import numpy as np

import frames

MAGIC = b"\x89MCAP0\r\n"
OP_CHANNEL, OP_MESSAGE, OP_CHUNK = 0x04, 0x05, 0x06


def records(data: bytes) -> typing.Iterator[tuple[int, bytes]]:
    at = 0
    while at + 9 <= len(data):
        kind, length = struct.unpack_from("<BQ", data, at)
        content = data[at + 9:at + 9 + length]
        at += 9 + length
        yield from records(unpack_chunk(content)) if kind == OP_CHUNK else [(kind, content)]


def unpack_chunk(chunk: bytes) -> bytes:
    """start, end, size, CRC, compression, records."""
    size, _, name_length = struct.unpack_from("<QII", chunk, 16)
    compression = chunk[32:32 + name_length].decode()
    length, = struct.unpack_from("<Q", chunk, 32 + name_length)
    packed = chunk[40 + name_length:40 + name_length + length]
    if compression == "":
        return packed
    if compression != "zstd":
        raise ValueError(f"compression {compression} is not read")
    library = ctypes.CDLL("libzstd.so.1")
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    out = ctypes.create_string_buffer(size)
    if library.ZSTD_decompress(out, size, packed, len(packed)) != size:
        raise ValueError("a chunk does not unpack")
    return out.raw


def channel_topic(record: bytes) -> tuple[int, str]:
    number, _, length = struct.unpack_from("<HHI", record)
    return number, record[8:8 + length].decode()


def read(file: pathlib.Path, topic: str = "/waymark/pose") -> tuple[np.ndarray, np.ndarray]:
    """Rows of t_s, x, y, yaw; and 3 x 3 covariances of x, y, yaw in the axes of the map."""
    read_of = [pose_with_covariance(content) for _, content in messages(file, topic)]
    return np.array([pose for pose, _ in read_of]), np.array([covariance for _, covariance in read_of])


def commands(file: pathlib.Path, topic: str = "/cmd_vel") -> np.ndarray:
    """Rows of t_s, speed_m_s, yaw_rate_rad_s, of geometry_msgs/TwistStamped."""
    rows = []
    for logged_ns, cdr in messages(file, topic):
        _, _, length = struct.unpack_from("<iII", cdr, 4)
        twist = struct.unpack_from("<6d", cdr, 4 + (12 + length + 7) // 8 * 8)
        rows.append([logged_ns * 1e-9, twist[0], twist[5]])
    return np.array(rows)


def messages(file: pathlib.Path, topic: str) -> typing.Iterator[tuple[int, bytes]]:
    """Log time [ns] and content of the messages of a topic."""
    data = file.read_bytes()
    if not data.startswith(MAGIC):
        raise ValueError(f"{file}: no MCAP file")
    wanted = None
    for kind, content in records(data[len(MAGIC):-len(MAGIC)]):
        if kind == OP_CHANNEL:
            number, name = channel_topic(content)
            wanted = number if name == topic else wanted
        elif kind == OP_MESSAGE and struct.unpack_from("<H", content)[0] == wanted:
            yield struct.unpack_from("<Q", content, 6)[0], content[22:]


def read_in_space(file: pathlib.Path, topic: str = "/waymark/pose") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s]; 4 x 4 poses in the map; and 6 x 6 covariances of position and of a rotation about the axes of the map."""
    found = [in_space(content) for _, content in messages(file, topic)]
    return tuple(np.array([one[place] for one in found]) for place in range(3))  # type: ignore[return-value]


def in_space(cdr: bytes) -> tuple[float, np.ndarray, np.ndarray]:
    """geometry_msgs/PoseWithCovarianceStamped, little-endian, after four bytes of encapsulation."""
    sec, nanosec, length = struct.unpack_from("<iII", cdr, 4)
    at = 4 + (12 + length + 7) // 8 * 8
    x, y, z, qx, qy, qz, qw, *covariance = struct.unpack_from("<43d", cdr, at)
    return sec + nanosec * 1e-9, frames.rigid(frames.from_quaternion(qx, qy, qz, qw), (x, y, z)), np.array(covariance).reshape(6, 6)


def pose_with_covariance(cdr: bytes) -> tuple[list[float], np.ndarray]:
    """x, y and yaw of the same message."""
    time_s, pose, covariance = in_space(cdr)
    keep = [0, 1, 5]
    return [time_s, pose[0, 3], pose[1, 3], math.atan2(pose[1, 0], pose[0, 0])], covariance[np.ix_(keep, keep)]
