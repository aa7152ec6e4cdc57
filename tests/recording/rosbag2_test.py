"""rosbag2 bags (SQLite), generated here in the schemas of Humble, Jazzy and earlier releases."""
import gzip
import pathlib
import sqlite3
import struct
import subprocess
import sys

import dumps

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import installed  # noqa: E402


def text(value):
    raw = value.encode() + b"\0"
    return struct.pack("<I", len(raw)) + raw


def padded(raw, size):
    return raw + b"\0" * (-len(raw) % size)


def odometry(ns, x):
    body = struct.pack("<iI", ns // 10**9, ns % 10**9) + text("odom")
    body = padded(padded(body, 4) + text("base_link"), 8)
    body += struct.pack("<7d", x, 0, 0, 0, 0, 0, 1) + struct.pack("<36d", *([0] * 36))
    body += struct.pack("<6d", 0.5, 0, 0, 0, 0, 0.1) + struct.pack("<36d", *([0] * 36))
    return b"\0\1\0\0" + body


class Bags(dumps.InFolder):
    def make(self, name, schema, times, qos=True, extra=()):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        base = sqlite3.connect(path)
        if schema:
            base.execute("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)")
            base.execute("INSERT INTO schema VALUES(?,?)", (schema, {3: "humble", 4: "jazzy"}[schema]))
            base.execute("CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL)")
        columns = ["id INTEGER PRIMARY KEY", "name TEXT NOT NULL", "type TEXT NOT NULL", "serialization_format TEXT NOT NULL"]
        columns += ["offered_qos_profiles TEXT NOT NULL"] * qos + ["type_description_hash TEXT NOT NULL"] * (schema == 4)
        base.execute(f"CREATE TABLE topics({','.join(columns)})")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
                     "data BLOB NOT NULL)")
        base.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
        if schema == 4:
            base.execute("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT "
                         "NULL, encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL)")
            base.execute("INSERT INTO message_definitions VALUES(1,'mine_msgs/msg/Odd','ros2msg','uint8 x\n','RIHS01_1')")
        for k, (topic, kind) in enumerate((("/odom", "nav_msgs/msg/Odometry"), ("/odd", "mine_msgs/msg/Odd"))):
            row = [k + 1, topic, kind, "cdr"] + ["- history: 1\n  depth: 10\n"] * qos + ["RIHS01_0"] * (schema == 4)
            base.execute(f"INSERT INTO topics VALUES({','.join('?' * len(row))})", row)
        rows = [(1, t, odometry(t, i * 0.1)) for i, t in enumerate(times)] + [(2, t, b"\0\1\0\0\x07") for t in times[::5]]
        base.executemany("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", rows + list(extra))
        base.commit()
        base.close()
        return path

    def test_every_schema(self):
        times = [10**18 + k * 10**8 for k in (3, 1, 2, 0, 4, 5, 7, 6, 8, 9)]
        for schema, qos in ((3, True), (4, True), (0, False)):
            with self.subTest(schema=schema):
                path = self.make(f"bag{schema}", schema, times, qos)  # no suffix: recognised by content
                log = dumps.Log(path)
                self.assertEqual([m.time for m in log.messages if m.topic == "/odom"], sorted(times))
                self.assertEqual(len(log.messages), 12)
                self.assert_in_order([m.time for m in log.messages])
                samples = dumps.Log(path, "--samples").samples
                self.assertEqual([int(s[1]) for s in samples], sorted(times))
                self.assertEqual(samples[0][2].split()[:1] + samples[0][2].split()[3:], ["0.3000000", "0.5000000", "0.1000000"])
                channels = dumps.Log(path, "--channels")
                self.assertEqual(channels.channels["/odom"], ("nav_msgs/msg/Odometry", "cdr", 10))
                # Bags of Humble contain no definitions; those of Jazzy do.
                self.assertEqual("rosbag2.no_definition:mine_msgs/msg/Odd" in log.problems, schema != 4)

    def test_split_bag(self):
        first = [10**18 + k * 10**8 for k in range(30)]
        second = [10**18 + 2_850_000_000 + k * 10**8 for k in range(30)]  # overlaps the first slightly
        self.make("bag/b_0.db3", 3, first)
        self.make("bag/b_1.db3", 3, second)
        metadata = self.folder / "bag/metadata.yaml"
        metadata.write_text("rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n"
                            "    - b_0.db3\n    - bag/b_1.db3\n  duration:\n    nanoseconds: 5\n")
        for path in (self.folder / "bag", metadata):
            log = dumps.Log(path)
            self.assertEqual([m.time for m in log.messages if m.topic == "/odom"], sorted(first + second))
            self.assert_in_order([m.time for m in log.messages])
            self.assertFalse([p for p in log.problems.values() if p.kind == "damage"])
        (self.folder / "bag/b_1.db3").unlink()
        log = dumps.Log(self.folder / "bag")
        self.assertEqual(sum(m.topic == "/odom" for m in log.messages), 30)
        self.assertIn("b_1.db3", log.problems["rosbag2.missing_file"].words)
        for words in ("rosbag2_bagfile_information: [", "", "rosbag2_bagfile_information:\n  relative_file_paths:\n    - other.db3\n"):
            metadata.write_text(words)
            log = dumps.Log(self.folder / "bag")
            self.assertIn("metadata.yaml", log.problems["rosbag2.no_metadata"].words)
            self.assertEqual(sum(m.topic == "/odom" for m in log.messages), 30)
        metadata.unlink()
        log = dumps.Log(self.folder / "bag")
        self.assertIn("rosbag2.no_metadata", log.problems)
        self.assertEqual(sum(m.topic == "/odom" for m in log.messages), 30)

    def test_compressed_files_and_messages(self):
        """rosbag2 compresses a whole file or each message (compression_mode FILE, MESSAGE); any program may gzip a file."""
        times = [10**18 + k * 10**8 for k in range(12)]
        plain = self.make("plain", 3, times)
        expected = dumps.Log(plain).messages
        (self.folder / "some.gz").write_bytes(gzip.compress(plain.read_bytes()))
        self.assertEqual(dumps.Log(self.folder / "some.gz").messages, expected)
        pack = lambda raw: subprocess.run([installed.program("zstd", "zstd"), "-c"], input=raw, capture_output=True, check=True).stdout
        (self.folder / "file").mkdir()
        (self.folder / "file/b_0.db3.zstd").write_bytes(pack(plain.read_bytes()))
        metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - b_0.db3{}\n  compression_format: zstd\n" \
            "  compression_mode: {}\n"
        (self.folder / "file/metadata.yaml").write_text(metadata.format(".zstd", "FILE"))
        self.assertEqual(dumps.Log(self.folder / "file").messages, expected)
        each = self.make("each/b_0.db3", 3, times)
        base = sqlite3.connect(each)
        for key, data in base.execute("SELECT id, data FROM messages").fetchall():
            base.execute("UPDATE messages SET data=? WHERE id=?", (pack(data), key))
        base.commit()
        base.close()
        (self.folder / "each/metadata.yaml").write_text(metadata.format("", "MESSAGE"))
        self.assertEqual(dumps.Log(self.folder / "each").messages, expected)

    def test_damage(self):
        path = self.make("bag.db3", 3, [10**18 + k * 10**7 for k in range(300)], extra=[(9, 10**18, b"")])
        log = dumps.Log(path)
        self.assertEqual(log.problems["rosbag2.no_topic"].count, 1)
        data = path.read_bytes()
        for cut in range(4096, len(data), len(data) // 17):
            path.write_bytes(data[:cut])
            log = dumps.Log(path)
            self.assertTrue(log.code == 1 or "rosbag2.damage" in log.problems, log.words)
            self.assert_in_order([m.time for m in log.messages])
        # A damaged page in the middle: messages before it in time are read, also from a folder.
        self.make("bag/b_0.db3", 3, [10**18 + k * 10**7 for k in range(3000)])
        (self.folder / "bag/metadata.yaml").write_text("rosbag2_bagfile_information:\n  relative_file_paths:\n    - b_0.db3\n")
        data = bytearray((self.folder / "bag/b_0.db3").read_bytes())
        page = len(data) // 8192 * 4096
        data[page:page + 4096] = b"\xff" * 4096
        (self.folder / "bag/b_0.db3").write_bytes(data)
        log = dumps.Log(self.folder / "bag")
        self.assertIn("rosbag2.damage", log.problems)
        self.assertGreater(len(log.messages), 500)
        self.assert_in_order([m.time for m in log.messages])
        other = self.folder / "other.db3"
        base = sqlite3.connect(other)
        base.execute("CREATE TABLE messages(x)")
        base.commit()
        base.close()
        log = dumps.Log(other)
        self.assertEqual(log.code, 1)
        self.assertIn("rosbag2", log.words)


if __name__ == "__main__":
    dumps.main()
