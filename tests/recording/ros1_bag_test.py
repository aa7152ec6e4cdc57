"""ROS 1 bags, compared with Debian's python3-rosbag message by message: bytes, times and (by a short CDR encoder on top of
genpy) the converted messages."""
import bz2
import collections
import random
import struct
import zlib

import genpy
import rosbag

import dumps

NUMBERS = {"bool": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q",
           "uint64": "Q", "float32": "f", "float64": "d", "byte": "b", "char": "B"}


class Cdr:
    """Plain little-endian CDR of a genpy message, without sequence numbers of headers."""

    def __init__(self, message):
        self.out = bytearray()
        self.struct(message)

    def bytes(self):
        return b"\0\1\0\0" + bytes(self.out)

    def number(self, code, value):
        size = struct.calcsize("<" + code)
        self.out += b"\0" * (-len(self.out) % size) + struct.pack("<" + code, value)

    def struct(self, message):
        for name, kind in zip(message.__slots__, message._slot_types):
            if message._type == "std_msgs/Header" and name == "seq":
                continue
            self.field(kind, getattr(message, name))

    def field(self, kind, value):
        if kind.endswith("]"):
            base, count = kind[:-1].split("[")
            if not count:
                self.number("I", len(value))
            if base in ("uint8", "char") and isinstance(value, bytes):
                self.out += value
            else:
                for item in value:
                    self.field(base, item)
        elif kind == "string":
            text = value.encode() if isinstance(value, str) else value
            self.number("I", len(text) + 1)
            self.out += text + b"\0"
        elif kind in ("time", "duration"):
            self.number("i", value.secs)
            self.number("i", value.nsecs)
        elif kind in NUMBERS:
            self.number(NUMBERS[kind], value)
        else:
            self.struct(value)


def by_rosbag(path, cdr):
    """Messages as read by python3-rosbag, in its order."""
    out = []
    with rosbag.Bag(str(path)) as bag:
        for topic, raw, time in bag.read_messages(raw=True):
            out.append([topic, time.to_nsec(), len(raw[1]), zlib.crc32(raw[1]), 0])
        if cdr:
            for line, (_, message, _) in zip(out, bag.read_messages()):
                line[4] = zlib.crc32(Cdr(message).bytes())
    return [dumps.Message(*line) for line in out]


def records(data, offset, end):
    """(op, header fields, data offset, end) of the records in a part of a bag."""
    while offset + 4 <= end:
        size, = struct.unpack_from("<I", data, offset)
        header, at = {}, offset + 4
        while at < offset + 4 + size:
            field, = struct.unpack_from("<I", data, at)
            name, value = data[at + 4:at + 4 + field].split(b"=", 1)
            header[name] = value
            at += 4 + field
        length, = struct.unpack_from("<I", data, at)
        yield header[b"op"][0], header, at + 4, at + 4 + length
        offset = at + 4 + length


def stamped(make, i, **fields):
    message = make(**fields)
    message.header.seq, message.header.frame_id = i, f"frame{i % 3}"
    message.header.stamp = genpy.Time(1_700_000_000 + i // 50, (i % 50) * 20_000_000 + 7)
    return message


def some_messages(count):
    """Common types of a robot, with lengths that need all kinds of padding."""
    from geometry_msgs.msg import PoseStamped, TransformStamped, Twist, TwistStamped
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu, Joy, LaserScan
    from std_msgs.msg import Empty, String
    from tf2_msgs.msg import TFMessage
    rand = random.Random(4)
    for i in range(count):
        odometry = stamped(Odometry, i, child_frame_id="base" * (i % 4))
        odometry.pose.pose.position.x, odometry.pose.pose.orientation.w = i * 0.1, 1
        odometry.pose.covariance = [rand.random() for _ in range(36)]
        odometry.twist.twist.linear.x = 0.5
        yield "/odom", odometry
        imu = stamped(Imu, i)
        imu.angular_velocity.z = rand.random()
        yield "/imu", imu
        transform = stamped(TransformStamped, i, child_frame_id="x" * (i % 5))
        transform.transform.rotation.w = 1
        yield "/tf", TFMessage(transforms=[transform] * (i % 3))
        twist = Twist()
        twist.linear.x = i
        yield "/cmd_vel", twist
        yield "/cmd_vel_stamped", stamped(TwistStamped, i, twist=twist)
        yield "/scan", stamped(LaserScan, i, angle_increment=0.1, range_max=9.0, ranges=[rand.random() for _ in range(i % 7)],
                               intensities=[1.0] * (i % 2))
        yield "/joy", stamped(Joy, i, axes=[rand.random()] * (i % 4), buttons=[1, 0, i])
        yield "/goal", stamped(PoseStamped, i)
        if i % 10 == 0:
            yield "/image", stamped(Image, i, height=4, width=6, encoding="mono8", step=6, data=bytes(rand.randbytes(24)))
            yield "/image/compressed", stamped(CompressedImage, i, format="jpeg", data=bytes(rand.randbytes(i % 9)))
            yield "/camera_info", stamped(CameraInfo, i, height=480, width=640, distortion_model="plumb_bob",
                                          D=[0.1, 0, 0, 0, 0], K=[500, 0, 320, 0, 500, 240, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                                          P=[500, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0])
            yield "/words", String(data="wörds " * (i % 3))
            yield "/tick", Empty()


class Ros1Bags(dumps.InFolder):
    def write(self, compression, count=100, chunk=3000, name="some.bag"):
        path = self.folder / name
        with rosbag.Bag(str(path), "w", compression=compression, chunk_threshold=chunk) as bag:
            for k, (topic, message) in enumerate(some_messages(count)):
                # Sometimes written out of order, as by a recorder under load.
                bag.write(topic, message, genpy.Time(1_700_000_000, (k + 3 * (k % 5)) * 100_000))
        return path

    def compare(self, path, expected):
        log = dumps.Log(path)
        self.assertEqual(log.code, 0, log.words)
        ours = log.messages
        self.assertEqual(len(ours), len(expected))
        self.assert_in_order([m.time for m in ours])
        # Both are sorted by time; messages with the same time may have any order.
        mismatches = sum(a != b for a, b in zip(sorted(ours), sorted(expected)))
        self.assertEqual(mismatches, 0)
        by_topic = collections.defaultdict(list), collections.defaultdict(list)
        for k, messages in enumerate((ours, expected)):
            for message in messages:
                by_topic[k][message.topic].append(message)
        self.assertEqual(*by_topic)
        return log

    def test_generated_bags_in_every_compression(self):
        for compression in ("none", "bz2", "lz4"):
            with self.subTest(compression):
                path = self.write(compression)
                expected = by_rosbag(path, cdr=True)
                # genpy writes nothing for an empty message, CDR one byte.
                expected = [m._replace(cdr=zlib.crc32(b"\0\1\0\0\0")) if m.topic == "/tick" else m for m in expected]
                log = self.compare(path, expected)
                self.assertEqual(log.problems, {})
                if compression != "none":
                    self.assertIn(compression, log.description)
                print(f"{compression}: {len(expected)} messages, 0 mismatches")

    def test_types_and_samples(self):
        path = self.write("lz4")
        channels = dumps.Log(path, "--channels").channels
        self.assertEqual(channels["/image"], ("sensor_msgs/msg/Image", "ros1", 10))
        self.assertEqual(channels["/tf"], ("tf2_msgs/msg/TFMessage", "ros1", 100))
        samples = dumps.Log(path, "--samples")
        counts = collections.Counter(s[0] for s in samples.samples)
        self.assertEqual(counts["odometry"], 100)
        self.assertEqual(counts["imu"], 100)
        self.assertEqual(counts["scan"], 100)
        self.assertEqual(counts["gamepad"], 100)
        self.assertEqual(counts["command"], 200)
        self.assertEqual(counts["image"], 10)  # without the invalid ones in `jpeg`, which are noted
        self.assertEqual(samples.problems["message.undecodable:/image/compressed"].count, 10)
        odometry = next(s for s in samples.samples if s[0] == "odometry")
        self.assertEqual(odometry[1], "1700000000000000007")

    def test_file_compressed_with_bzip2(self):
        path = self.write("none")
        expected = by_rosbag(path, cdr=False)
        packed = self.folder / "anything"
        packed.write_bytes(bz2.compress(path.read_bytes(), 1))
        self.assertEqual(sorted(m._replace(cdr=0) for m in dumps.Log(packed).messages), sorted(expected))
        half = self.folder / "half"
        half.write_bytes(packed.read_bytes()[:-5000])
        log = dumps.Log(half)
        self.assertGreater(len(log.messages), 400)
        self.assertEqual([m for m in log.messages if m._replace(cdr=0) not in set(expected)], [])
        self.assertIn(f"byte {half.stat().st_size}", log.problems["file.packing"].words)

    def test_messages_before_a_truncation_are_read(self):
        path = self.write("none", count=40)
        data = path.read_bytes()
        ends = []  # end offset of each message
        for op, header, begin, end in records(data, 13, len(data)):
            if op == 5:
                ends += [e for inner, _, _, e in records(data, begin, end) if inner == 2]
        for cut in random.Random(5).sample(range(6000, len(data)), 25):
            part = self.folder / "cut.bag"
            part.write_bytes(data[:cut])
            log = dumps.Log(part)
            self.assertEqual(log.code, 0, log.words)
            self.assertEqual(len(log.messages), sum(end <= cut for end in ends), f"truncated at {cut}")
            self.assertTrue({"ros1bag.cut", "ros1bag.no_index"} & log.problems.keys(), log.words)

    def test_only_the_damaged_chunk_is_lost(self):
        path = self.write("bz2", count=60)
        data = bytearray(path.read_bytes())
        whole = dumps.Log(path).messages
        chunks = [(begin, end) for op, _, begin, end in records(bytes(data), 13, len(data)) if op == 5]
        begin, end = chunks[len(chunks) // 2]
        data[(begin + end) // 2] ^= 0x55
        path.write_bytes(data)
        log = dumps.Log(path)
        lost = len(whole) - len(log.messages)
        self.assertEqual(log.problems["ros1bag.chunk"].count, 1)
        self.assertRegex(log.problems["ros1bag.chunk"].words, r"byte \d+")
        self.assertTrue(0 < lost < len(whole) / 4, lost)

    def test_other_files_are_errors(self):
        for name, content in (("a", b""), ("b", b"#ROSBAG V1.2\n..."), ("c", b"BZh9" + b"x" * 100), ("d", b"\x7fELF")):
            (self.folder / name).write_bytes(content)
            log = dumps.Log(self.folder / name)
            self.assertEqual((log.code, len(log.lines)), (1, 0))
            self.assertTrue(log.words)

    def test_all_real_bags(self):
        bags = sorted(dumps.real_data("tagslam").glob("test_*/tag_detections.bag.bz2"))
        self.assertEqual(len(bags), 12)
        total = 0
        for packed in bags:
            with self.subTest(packed.parent.name):
                plain = self.folder / "plain.bag"
                plain.write_bytes(bz2.decompress(packed.read_bytes()))
                cdr = dumps.FULL or packed.stat().st_size < 250_000
                expected = by_rosbag(plain, cdr)
                ours = dumps.Log(packed)
                if not cdr:
                    ours.lines = ["\t".join(line.split("\t")[:4] + ["0"]) for line in ours.lines]
                self.assertEqual(sum(a != b for a, b in zip(sorted(ours.messages), sorted(expected))), 0)
                self.assertEqual(len(ours.messages), len(expected))
                self.assert_in_order([m.time for m in ours.messages])
                total += len(expected)
        print(f"{len(bags)} real bags, {total} messages, 0 mismatches")

    def test_detections_of_real_bags_match_the_tables(self):
        """The tables next to the bags were converted by an independent program."""
        import csv
        import gzip
        for name in ("test_1", "test_16", "test_22", "test_24"):
            bag = dumps.Log(dumps.real_data(f"tagslam/{name}/tag_detections.bag.bz2"), "--samples")
            seen = collections.Counter()
            for sample in bag.samples:
                if sample[0] == "tags":
                    for tag in sample[4:]:
                        tag_id, rest = tag.split(":")[1:]
                        numbers = [float(v) for v in rest.split(",")[1:]]
                        corners = [round(v - 0.5, 3) for v in numbers[6:8] + numbers[4:6] + numbers[2:4] + numbers[0:2]]
                        seen[sample[1], tag_id, tuple(round(v, 2) for v in corners)] += 1
            with gzip.open(dumps.real_data(f"tagslam/{name}/detections.csv.gz"), "rt") as table:
                rows = list(csv.DictReader(table))
            expected = collections.Counter(
                (r["t_ns"], r["tag"], tuple(round(float(r[f"{a}{k}"]), 2) for k in range(4) for a in "xy")) for r in rows)
            self.assertEqual(sum(seen.values()), sum(expected.values()), name)
            self.assertLess(sum((expected - seen).values()), 0.02 * len(rows), name)  # double rounding of the third decimal


if __name__ == "__main__":
    dumps.main()
