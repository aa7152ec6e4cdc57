#!/usr/bin/python3
"""Bags of other robots, mapped and localised: a simulated lap, written again by @mcap/core and
@foxglove/rosmsg2-serialization (and into a .db3 by Python's sqlite3) with the names of LIMO, TurtleBot3, RealSense D435 and
OAK-D, with their chains of transforms.

usage: foreign_bags_test.py PROGRAM NPM_FOLDER
Exit code 77 (skipped) when tools/install_validators.sh has not been run.
"""
import base64
import json
import math
import os
import pathlib
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from made import LAP, made  # noqa: E402

PROGRAM, NPM = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).absolute()
HALF = math.sqrt(0.5)
# Rotation from x ahead, y left, z up to x right, y down, z ahead, as in every optical frame.
OPTICAL = [-0.5, 0.5, -0.5, 0.5]
LINE = """name: line
tag_family: tag36h11
tag_size_m: 0.16
anchor_id: 0
tags:
  - {id: 0, x_m: 2.6, y_m: 0.3, z_m: 0.3, facing_deg: 180}
  - {id: 1, x_m: 2.6, y_m: -0.3, z_m: 0.3, facing_deg: 180}
  - {id: 2, x_m: 2.6, y_m: 0, z_m: 0.5, facing_deg: 180}
path_closed: false
path_m: [[0, 0], [0.4, 0], [0.8, 0.1], [1.2, 0.1]]
"""
SAME_M = 1e-6      # the same messages in other frames: rounding of the composed chain
CLOCK_NS = 1_700_000_000 * 10**9


def step(parent, child, t=(0, 0, 0), q=(0, 0, 0, 1), **more):
    return {"parent": parent, "child": child, "t": list(t), "q": list(q), **more}


def robot(odom, base, frame, chain, infos, tags, **more):
    return {"topics": {"/tag_detections": tags, "/odom": odom, "/imu": more.pop("imu_topic", "/imu"),
                       "/joint_states": "/joint_states"},
            "frames": {"base_link": base, "camera_optical": frame, "odom": more.pop("odom_frame", "odom")},
            "chain": chain, "infos": infos, "clock_ns": CLOCK_NS, **more}


ROBOTS = {
    "limo": robot("/odom", "base_link", "camera_color_optical_frame",
                  [step("base_link", "camera_link", (0.084, 0, 0.18)), step("camera_link", "camera_color_frame", (0, 0.02, 0)),
                   step("camera_color_frame", "camera_color_optical_frame")],
                  [{"topic": "/camera/color/camera_info", "frame": "camera_color_optical_frame", "zero": True}],
                  "/tag_detections",
                  others=[step("base_link", "laser_link", (0.1, 0, 0.1)), step("base_link", "imu_link")]),
    "turtlebot3": robot("/odom", "base_footprint", "camera_rgb_optical_frame",
                        [step("base_footprint", "base_link", (0, 0, 0.01)),
                         step("base_link", "camera_link", (0.073, -0.011, 0.084), (0, 0, HALF, HALF)),
                         step("camera_link", "camera_rgb_frame", (0.003, 0.011, 0.009)),
                         step("camera_rgb_frame", "camera_rgb_optical_frame")],
                        [{"topic": "/camera/camera_info", "frame": "camera_rgb_optical_frame"}], "/apriltag/detections",
                        joints=["wheel_left_joint", "wheel_right_joint"]),
    # Half of the chain is on /tf, in a namespace; a second camera of the same device has another calibration.
    "d435": robot("/robot1/odom", "robot1/base_link", "camera_color_optical_frame",
                  [step("robot1/base_link", "camera_bottom_screw_frame", (0.12, 0, 0.2), topic="/tf"),
                   step("camera_bottom_screw_frame", "camera_link", (0, 0.0175, 0.0125), topic="/tf"),
                   step("camera_link", "camera_color_frame", (0, 0.015, 0)),
                   step("camera_color_frame", "camera_color_optical_frame")],
                  [{"topic": "/camera/infra1/camera_info", "frame": "camera_infra1_optical_frame", "focal": 1.3},
                   {"topic": "/camera/color/camera_info", "frame": "camera_color_optical_frame"}],
                  "/robot1/detections", namespace="/robot1", odom_frame="robot1/odom",
                  others=[step("camera_link", "camera_infra1_optical_frame", (0, 0.05, 0), OPTICAL)]),
    "oakd": robot("/odom", "base_link", "oak_rgb_camera_optical_frame",
                  [step("base_link", "oak-d-base-frame", (0.05, 0, 0.15)), step("oak-d-base-frame", "oak-d_frame"),
                   step("oak-d_frame", "oak_rgb_camera_frame"), step("oak_rgb_camera_frame", "oak_rgb_camera_optical_frame")],
                  [{"topic": "/oak/rgb/camera_info", "frame": "oak_rgb_camera_optical_frame"}], "/oak/detections",
                  imu_topic="/oak/imu/data", imu={"frame": "oak_imu_frame", "base_q_imu": OPTICAL},
                  others=[step("oak-d_frame", "oak_imu_frame", (0, 0, 0), OPTICAL)]),
}


def run(*words, cwd, code=0):
    done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, cwd=cwd, timeout=300)
    assert done.returncode == code, (words, done.returncode, done.stdout[-2000:], done.stderr[-4000:])
    return done


def tags_of(path):
    """id -> position of the tags in a map.yaml."""
    text = pathlib.Path(path).read_text()
    found = re.findall(r"tag: \"tag36h11:(\d+)\".*?position_m: \[([^\]]*)\]", text, re.S)
    assert found, text[:1500]
    return {int(number): [float(x) for x in position.split(",")] for number, position in found}


def poses_of(path):
    """Index of the pose -> position, of a TUM file."""
    rows = [[float(x) for x in line.split()] for line in pathlib.Path(path).read_text().splitlines() if line[:1] != "#"]
    return {number: row[1:4] for number, row in enumerate(rows)}


def farthest(a, b):
    assert a.keys() == b.keys(), sorted(a.keys() ^ b.keys())[:10]
    return max(math.dist(a[key], b[key]) for key in a)


class ForeignBags(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-foreign-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        shutil.copy(made(PROGRAM, *LAP) / "lap.mcap", cls.folder)
        # Other robots record no corner covariances and have other wheel names.
        run("convert", "lap.mcap", "plain.mcap", "--topics", "/tag_detections,/odom,/imu,/camera_info,/tf_static",
            cwd=cls.folder)
        cls.how = ["--tag-size-m", 0.16, "--anchor", 0, "--anchor-pose", 0, 0, 0.3, -90, 0, -90]
        run("map", "plain.mcap", "-o", "plain", *cls.how, cwd=cls.folder)
        run("localize", "plain.mcap", "--map", "plain", "-o", "plain.tum", cwd=cls.folder)

    def rewrite(self, name, suffix=".mcap", change=None, lap="lap.mcap"):
        description = json.loads(json.dumps(ROBOTS[name]))
        if change:
            change(description)
        (self.folder / "robot.json").write_text(json.dumps(description))
        out = self.folder / (name + suffix)
        done = subprocess.run([NPM / "node_modules/.bin/node", pathlib.Path(__file__).with_name("foreign_bag.mjs"), lap,
                               "robot.json", out], cwd=self.folder, capture_output=True, text=True, check=False,
                              env={**os.environ, "WAYMARK_NODE_MODULES": str(NPM / "node_modules")})
        self.assertEqual(done.returncode, 0, done.stderr)
        return out

    def to_db3(self, lines):
        """A bag as recorded by ROS 2 Humble: without message definitions."""
        path = lines.with_suffix(".db3")
        base = sqlite3.connect(path)
        base.executescript("""
            PRAGMA journal_mode=WAL;
            CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
            INSERT INTO schema VALUES(3, 'humble');
            CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
            CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
              serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
            CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
            CREATE INDEX timestamp_idx ON messages (timestamp ASC);""")
        topics = {}
        for line in lines.read_text().splitlines():
            topic, kind, seconds, nanoseconds, data = json.loads(line)
            if topic not in topics:
                topics[topic] = len(topics) + 1
                base.execute("INSERT INTO topics VALUES(?,?,?,'cdr','')", (topics[topic], topic, kind))
            base.execute("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)",
                         (topics[topic], seconds * 10**9 + nanoseconds, base64.b64decode(data)))
        base.commit()
        base.close()
        return path

    def assert_maps_and_localises(self, bag):
        name = bag.name.replace(".", "_")
        run("map", bag, "-o", name, *self.how, cwd=self.folder)
        moved = farthest(tags_of(self.folder / "plain/map.yaml"), tags_of(self.folder / name / "map.yaml"))
        run("localize", bag, "--map", name, "-o", f"{name}.tum", cwd=self.folder)
        apart = farthest(poses_of(self.folder / "plain.tum"), poses_of(self.folder / f"{name}.tum"))
        print(f"{bag.name}: tags within {moved:.1e} m of those of the lap itself, estimates within {apart:.1e} m")
        self.assertLess(moved, SAME_M)
        self.assertLess(apart, SAME_M)

    def test_limo(self):
        bag = self.rewrite("limo")
        self.assert_maps_and_localises(bag)
        # /camera_info is stamped zero; the duration is that of the drive.
        info = json.loads(run("info", "--json", bag, cwd=self.folder).stdout)
        self.assertLess(info["duration_s"], 200)
        self.assertGreater(info["start_ns"], CLOCK_NS)
        shown = run("play", bag, "--from", 2, "--to", 3, "--speed", 0, cwd=self.folder).stdout
        self.assertGreater(len(shown.splitlines()), 20)

    def test_turtlebot3(self):
        bag = self.rewrite("turtlebot3")
        self.assert_maps_and_localises(bag)
        # Wheels of other robots are found by their joint names.
        self.assertIn("wheels", json.loads(run("info", "--json", bag, cwd=self.folder).stdout)["contents"])

    def test_realsense_in_a_namespace(self):
        self.assert_maps_and_localises(self.rewrite("d435"))

    def test_oak_d_in_a_bag_of_humble(self):
        bag = self.to_db3(self.rewrite("oakd", ".jsonl"))
        self.assert_maps_and_localises(bag)
        self.assertFalse([p for p in self.folder.iterdir() if p.name.endswith(("-shm", "-wal"))])

    def test_compressed_images(self):
        (self.folder / "line.yaml").write_text(LINE)
        run("teach", "--world", "line.yaml", "--seed", 1, "--images", "--record-images", "jpeg", "-o", "images.mcap", cwd=self.folder)
        run("convert", "images.mcap", "images-only.mcap", "--topics", "/image_raw/compressed,/odom,/camera_info,/tf_static", cwd=self.folder)

        def images(description):
            del description["topics"]["/tag_detections"]
            description["topics"]["/image_raw/compressed"] = "/camera/color/image_raw/compressed"
        bag = self.rewrite("limo", change=images, lap="images.mcap")
        info = json.loads(run("info", "--json", bag, cwd=self.folder).stdout)
        self.assertIn("sensor_msgs/msg/CompressedImage", {topic["type"] for topic in info["topics"]})
        run("map", "images-only.mcap", "-o", "from-images", *self.how, cwd=self.folder)
        run("map", bag, "-o", "from-packed", *self.how, cwd=self.folder)
        moved = farthest(tags_of(self.folder / "from-images/map.yaml"), tags_of(self.folder / "from-packed/map.yaml"))
        self.assertLess(moved, SAME_M)

    def fails(self, name, change, *flags):
        bag = self.rewrite(name, change=change)
        return run("map", bag, "-o", "none", *self.how, *flags, cwd=self.folder, code=1).stderr

    def test_an_incomplete_chain_is_an_error_that_shows_the_tree(self):
        def without_middle(description):
            description["frames"]["base_link"] = "base_link"
            description["chain"][0]["parent"] = "somewhere"
        words = self.fails("limo", without_middle)
        for expected in ("'base_link'", "somewhere", "camera_color_optical_frame", "--base-frame", "--robot"):
            self.assertIn(expected, words)

        def other_camera_frame(description):
            description["frames"]["camera_optical"] = "default_cam"
            description["infos"][0]["frame"] = "default_cam"
        words = self.fails("limo", other_camera_frame)
        for expected in ("default_cam", "camera_link", "--camera-frame"):
            self.assertIn(expected, words)
        # With the flag the map is the same.
        bag = self.rewrite("limo", change=other_camera_frame)
        run("map", bag, "-o", "fixed", *self.how, "--camera-frame", "camera_color_optical_frame", cwd=self.folder)
        moved = farthest(tags_of(self.folder / "plain/map.yaml"), tags_of(self.folder / "fixed/map.yaml"))
        self.assertLess(moved, SAME_M)

    def test_two_parents_are_an_error(self):
        def second_parent(description):
            description["others"].append(step("base_link", "camera_color_frame", (0, 0, 1)))
        words = self.fails("limo", second_parent)
        self.assertRegex(words, "camera_color_frame.* base_link|base_link.* camera_color_frame")

    def test_a_body_frame_is_rejected_as_camera_frame(self):
        def body_frame(description):
            description["frames"]["camera_optical"] = "camera_color_frame"
            description["infos"][0]["frame"] = "camera_color_frame"
        words = self.fails("limo", body_frame)
        for expected in ("'camera_color_frame'", "--camera-frame"):
            self.assertIn(expected, words)

    def test_one_of_several_odometry_topics_must_be_chosen(self):
        def doubled(description):
            description["topics"]["/odom"] = "/wheel/odometry"
        bag = self.rewrite("limo", change=doubled)
        run("map", bag, "-o", "one", *self.how, cwd=self.folder)
        merged = self.folder / "two.mcap"
        other = self.rewrite("turtlebot3", change=lambda d: d["topics"].update({"/odom": "/filtered/odometry"}))
        run("convert", bag, other, merged, cwd=self.folder)
        err = run("map", merged, "-o", "none", *self.how, cwd=self.folder, code=1).stderr
        self.assertTrue("--odometry-topic" in err or "--camera-frame" in err, err)

    def test_the_robot_file_is_used_and_differences_are_reported(self):
        bag = self.rewrite("limo")
        described = (self.folder / "plain/robot.yaml").read_text()
        height = float(re.search(r"z_m: ([-.0-9e]+)", described[described.index("camera_mounting"):])[1])
        higher = described.replace(f"z_m: {height}", f"z_m: {height + 0.03}")
        self.assertNotEqual(higher, described)
        (self.folder / "higher.yaml").write_text(higher)
        done = run("map", bag, "-o", "given", *self.how, "--robot", "higher.yaml", cwd=self.folder)
        self.assertRegex(done.stderr, r"\b3\.0 cm .*\b0\.0 deg")


if __name__ == "__main__":
    if not (NPM / "node_modules/@mcap/core").exists():
        print(f"no libraries in {NPM}: tools/install_validators.sh installs them")
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
