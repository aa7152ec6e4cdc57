#!/usr/bin/python3
"""Bags written by `waymark convert --format rosbag2`, read by SQLite, PyYAML and @mcap/core. Their fields are those that rosbag2 of Humble
and Jazzy writes (ros2/rosbag2: rosbag2_storage/yaml.hpp, rosbag2_storage_sqlite3/sqlite_storage.cpp). rosbag2 itself was not run.

usage: rosbag2_export_test.py PROGRAM NPM_FOLDER [unittest options]
"""
import json
import os
import pathlib
import sqlite3
import subprocess
import sys
import unittest

import yaml

NPM = pathlib.Path(sys.argv.pop(2)) if len(sys.argv) > 2 else sys.exit("usage: rosbag2_export_test.py PROGRAM NPM_FOLDER")

from harness import InFolder  # noqa: E402
from laps import LAP_OF_SQUARE, put  # noqa: E402
import golden_page  # noqa: E402

BAG_KEYS = ["version", "storage_identifier", "duration", "starting_time", "message_count", "topics_with_message_count",
            "compression_format", "compression_mode", "relative_file_paths", "files"]
QOS_KEYS = ["history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness", "liveliness_lease_duration",
            "avoid_ros_namespace_conventions"]
TABLES = {
    "schema": ["schema_version", "ros_distro"], "metadata": ["id", "metadata_version", "metadata"],
    "topics": ["id", "name", "type", "serialization_format", "offered_qos_profiles"],
    "messages": ["id", "topic_id", "timestamp", "data"]}
DEFINITIONS = ["id", "topic_type", "encoding", "encoded_message_definition", "type_description_hash"]


class Export(InFolder):
    def setUp(self):
        super().setUp()
        put(self.folder, *LAP_OF_SQUARE)

    def export(self, source, name, *flags):
        done = self.run_here("convert", source, name, "--format", "rosbag2", *flags, "--json")
        self.assertEqual(done.code, 0, done.err)
        return json.loads(done.out), yaml.safe_load((self.folder / name / "metadata.yaml").read_text())["rosbag2_bagfile_information"]

    def counts(self, path):
        shown = json.loads(self.run_here("info", "--json", path).out)
        return {t["topic"]: t["messages"] for t in shown["topics"]}, shown

    def check_qos(self, profiles, names):
        self.assertTrue(profiles)
        for profile in profiles:
            self.assertEqual(list(profile), QOS_KEYS)
            for key in ("deadline", "lifespan", "liveliness_lease_duration"):
                self.assertEqual(list(profile[key]), ["sec", "nsec"])
            for key in ("history", "reliability", "durability", "liveliness"):
                self.assertIsInstance(profile[key], str if names else int, key)

    def check_metadata(self, bag, counts, jazzy, storage, file):
        self.assertEqual(list(bag), BAG_KEYS + ["custom_data", "ros_distro"] * jazzy)
        self.assertEqual((bag["version"], bag["storage_identifier"]), (9 if jazzy else 5, storage))
        self.assertEqual(bag["relative_file_paths"], [file])
        self.assertEqual((bag["compression_format"], bag["compression_mode"]), ("", ""))
        topics = {t["topic_metadata"]["name"]: t for t in bag["topics_with_message_count"]}
        self.assertEqual({name: t["message_count"] for name, t in topics.items()}, counts)
        self.assertEqual(bag["message_count"], sum(counts.values()))
        described = ["name", "type", "serialization_format", "offered_qos_profiles"] + ["type_description_hash"] * jazzy
        for topic in topics.values():
            self.assertEqual(list(topic["topic_metadata"]), described)
            offered = topic["topic_metadata"]["offered_qos_profiles"]
            self.check_qos(offered if jazzy else yaml.safe_load(offered), names=jazzy)
        (part,) = bag["files"]
        self.assertEqual(list(part), ["path", "starting_time", "duration", "message_count"])
        self.assertEqual((part["path"], part["message_count"]), (file, bag["message_count"]))
        self.assertEqual((part["starting_time"], part["duration"]), (bag["starting_time"], bag["duration"]))

    def check_tables(self, path, counts, jazzy):
        base = sqlite3.connect(path)
        self.addCleanup(base.close)
        self.assertEqual(base.execute("PRAGMA integrity_check").fetchone(), ("ok",))
        columns = lambda table: [row[1] for row in base.execute(f"PRAGMA table_info({table})")]
        wanted = {**TABLES, "topics": TABLES["topics"] + ["type_description_hash"] * jazzy,
                  **({"message_definitions": DEFINITIONS} if jazzy else {})}
        tables = {row[0] for row in base.execute("SELECT name FROM sqlite_master WHERE type='table'")}
        self.assertEqual({table: columns(table) for table in tables}, wanted)
        self.assertEqual(base.execute("SELECT * FROM schema").fetchall(), [(4, "jazzy") if jazzy else (3, "humble")])
        self.assertTrue(base.execute("SELECT 1 FROM sqlite_master WHERE type='index' AND name='timestamp_idx'").fetchone())
        rows = base.execute("SELECT name, count(*) FROM topics JOIN messages ON topic_id = topics.id GROUP BY name")
        self.assertEqual(dict(rows.fetchall()), counts)
        version, text = base.execute("SELECT metadata_version, metadata FROM metadata").fetchone()
        self.assertEqual((version, text), (9 if jazzy else 5, (path.parent / "metadata.yaml").read_text()))
        for (qos,) in base.execute("SELECT offered_qos_profiles FROM topics"):
            self.check_qos(yaml.safe_load(qos), names=jazzy)
        if jazzy:
            types = {row[0] for row in base.execute("SELECT type FROM topics")}
            defined = dict(base.execute("SELECT topic_type, encoded_message_definition FROM message_definitions").fetchall())
            self.assertEqual(set(defined), types)
            self.assertIn("float64", defined["nav_msgs/msg/Odometry"])
        return base

    def test_every_layout_is_that_of_rosbag2(self):
        counts, shown = self.counts("lap.mcap")
        for distro, usual, other in (("humble", "sqlite3", "mcap"), ("jazzy", "mcap", "sqlite3")):
            for storage in (usual, other):
                name = f"{distro}-{storage}"
                with self.subTest(name):
                    flags = ("--ros-distro", distro) + (() if storage == usual else ("--storage", storage))
                    report, bag = self.export("lap.mcap", name, *flags)
                    file = f"{name}_0" + (".db3" if storage == "sqlite3" else ".mcap")
                    self.assertEqual(sorted(p.name for p in (self.folder / name).iterdir()), sorted([file, "metadata.yaml"]))
                    self.check_metadata(bag, counts, distro == "jazzy", storage, file)
                    problems = [p["key"] for p in report["problems"]]
                    self.assertEqual("rosbag2.no_metadata_blocks" in problems, storage == "sqlite3")
                    if storage == "sqlite3":
                        self.check_tables(self.folder / name / file, counts, distro == "jazzy")
                    again, read = self.counts(name)
                    self.assertEqual((again, read["duration_s"]), (counts, shown["duration_s"]))

    def test_messages_are_exported_unchanged(self):
        """Exported from MCAP to SQLite and compared as tables of odometry, detections and IMU data."""
        self.export("lap.mcap", "bag", "--ros-distro", "humble")
        for kind in ("odometry", "detections", "imu"):
            for source in ("lap.mcap", "bag"):
                self.assertEqual(self.run_here("convert", source, f"{source}.{kind}.csv", "--kind", kind).code, 0)
            self.assertEqual((self.folder / f"bag.{kind}.csv").read_bytes(), (self.folder / f"lap.mcap.{kind}.csv").read_bytes())
        mapped = self.run_here("map", "bag", "-o", "map", "--tag-size-m", "0.054", "--anchor", "tagCustom48h12:1")
        self.assertEqual(mapped.code, 0, mapped.err)
        summary = json.loads((self.folder / "map/summary.json").read_text())
        self.assertTrue(summary["truth_aligned"])  # the bag does not contain the pose of the anchor in the frame of the ground truth
        self.assertLess(summary["trajectory_rmse_m"], 0.02)

    def test_the_official_mcap_reader_accepts_mcap_bags(self):
        if not (NPM / "node_modules/@mcap/core").exists():
            self.skipTest("no validators (tools/install_validators.sh)")
        self.export("lap.mcap", "bag", "--ros-distro", "jazzy")
        script = pathlib.Path(__file__).parents[1] / "npm/validate_recording.mjs"
        done = subprocess.run([NPM / "node_modules/.bin/node", script, self.folder / "bag/bag_0.mcap", "--foreign"], capture_output=True,
                              text=True, check=False, env={**os.environ, "WAYMARK_NODE_MODULES": str(NPM / "node_modules")})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sum(json.loads(done.stdout)["types"].values()), sum(self.counts("lap.mcap")[0].values()))

    def test_a_bag_in_mcap_keeps_attachments_and_metadata(self):
        self.export("lap.mcap", "bag")
        self.assertEqual(self.run_here("convert", "bag", "back.mcap").code, 0)
        lap, bag, back = (json.loads(self.run_here("info", "--json", name).out) for name in ("lap.mcap", "bag", "back.mcap"))
        self.assertTrue(lap["attachments"])
        self.assertEqual(bag["attachments"], lap["attachments"])
        self.assertEqual(back["attachments"], lap["attachments"])

    def test_tables_are_converted_to_bags(self):
        self.run_here("convert", "lap.mcap", "drive.csv", "--kind", "odometry")
        _, bag = self.export("drive.csv", "tables", "--ros-distro", "jazzy", "--storage", "sqlite3")
        self.check_tables(self.folder / "tables/tables_0.db3", {"/odom": bag["message_count"]}, jazzy=True)

    def test_a_time_interval_is_exported(self):
        _, bag = self.export("lap.mcap", "part", "--topics", "/odom", "--from", "2", "--to", "3")
        self.assertLessEqual(bag["duration"]["nanoseconds"], 10**9)
        self.assertEqual([t["topic_metadata"]["name"] for t in bag["topics_with_message_count"]], ["/odom"])

    def test_mistakes(self):
        (self.folder / "there").mkdir()
        self.export("lap.mcap", "bag")
        for words, code, part in (
                ("lap.mcap there --format rosbag2", 1, "there: "),
                ("lap.mcap new --format rosbag2 --ros-distro dashing", 2, "'dashing'"),
                ("lap.mcap new --format rosbag2 --storage tape", 2, "'tape'"),
                ("lap.mcap new.mcap --ros-distro humble", 2, "--format rosbag2"),
                ("lap.mcap new.mcap --storage mcap", 2, "--format rosbag2"),
                ("lap.mcap new --format rosbag2 --kind imu", 2, "'imu'"),
                ("lap.mcap new.mcap --kind imu", 2, "'imu'"),
                ("lap.mcap new", 2, "new (-o): "),
                ("lap.mcap bag/new --format rosbag2", 1, "bag/new: "),
                ("lap.mcap nowhere/new --format rosbag2", 1, "nowhere")):
            with self.subTest(words):
                done = self.run_here("convert", *words.split())
                self.assertEqual(done.code, code, done.err)
                self.assertIn(part, done.err)
                golden_page.expect(self, "convert", done.err)
                self.assertFalse([p for p in self.folder.iterdir() if p.name.startswith("new")])


if __name__ == "__main__":
    unittest.main()
