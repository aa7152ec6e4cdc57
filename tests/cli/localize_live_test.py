#!/usr/bin/python3
"""`waymark localize` of a robot that another program drives, and of a hand-held camera.

usage: localize_live_test.py PROGRAM [unittest options]
"""
import json
import pathlib
import shutil
import signal
import subprocess
import sys

import images
from fake_camera import FakeCamera
from harness import PROGRAM, InFolder, program, rest_of, unittest
from laps import LAP_OF_SQUARE, MAP_OF_SQUARE, WithMap, made, put
import golden_page

# A simulated robot that drives a circle regardless of commands; it stores its standard input in received.txt.
DRIVEN = """
import subprocess, sys, threading, time
robot = subprocess.Popen([sys.argv[1], "robot-sim", "--world", "circuit24", "--seed", "3"], stdin=subprocess.PIPE, text=True)
over = threading.Event()
def drive():
    while not over.is_set():
        robot.stdin.write('{"type":"velocity","sequence":1,"speed_m_s":0.25,"yaw_rate_rad_s":0.1,"age_s":0}\\n')
        robot.stdin.flush()
        time.sleep(0.05)
threading.Thread(target=drive, daemon=True).start()
with open("received.txt", "w") as received:
    for line in sys.stdin:
        received.write(line)
        received.flush()
over.set()
robot.stdin.close()
robot.wait()
"""


class Driven(WithMap):
    def setUp(self):
        super().setUp()
        (self.folder / "driven.py").write_text(DRIVEN)
        self.robot = f"process:exec '{sys.executable}' driven.py '{PROGRAM}'"

    def test_a_listening_run_sends_no_commands_and_matches_the_offline_run(self):
        live = self.run_here("localize", "--robot", self.robot, "--map", "map", "--duration-s", "5", "-o", "live.mcap", "--json")
        self.assertEqual(live.code, 0, live.err)
        received = [json.loads(line) for line in (self.folder / "received.txt").read_text().splitlines()]
        self.assertEqual([order["type"] for order in received], ["hello", "bye"])
        self.assertTrue(received[0]["listen_only"])
        *moments, report = live.records
        self.assertGreaterEqual(len(moments), 4, "one a second")
        self.assertTrue(moments[-1]["pose"]["certain"])
        self.assertLess(moments[-1]["pose"]["position_sigma_m"], 0.1)
        self.assertGreater(report["certain"], 0.5 * report["estimates"])
        # The recording contains all sensor data, so the same filter ends at the same pose to the last digits.
        offline = self.run_here("localize", "live.mcap", "--map", "map", "--robot", "map/robot.yaml", "--no-adapt", "--json")
        self.assertEqual(offline.code, 0, offline.err)
        self.assertEqual(offline.records[0]["observations"], report["observations"])
        self.assertEqual(offline.records[0]["accepted"], report["accepted"])
        for key in ("x_m", "y_m", "yaw_rad"):
            self.assertAlmostEqual(offline.records[0]["last"][key], report["last"][key], delta=1e-9)
        # Judged by the truth, which the filter does not see.
        judged = self.run_here("evaluate", "live.mcap", "live.mcap", "--json")
        self.assertEqual(judged.code, 0, judged.err)
        self.assertLess(judged.records[0]["ate_rmse_m"], 0.05, judged.out)
        info = self.run_here("info", "live.mcap", "--json").records[0]
        topics = {topic["topic"] for topic in info["topics"]}
        self.assertLessEqual({"/odom", "/tag_detections", "/waymark/pose", "/waymark/nis", "/truth/pose"}, topics)
        self.assertNotIn("/cmd_vel", topics)

    def test_ctrl_c_keeps_the_recording(self):
        process = subprocess.Popen([PROGRAM, "localize", "--robot", self.robot, "--map", "map", "-o", "stopped.mcap"], cwd=self.folder,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = process.stdout.readline()
        self.assertRegex(line, r"^ +0\.0 s: ")
        self.assertRegex(process.stdout.readline(), r"^ +1\.\d s: ")
        process.send_signal(signal.SIGINT)
        out, err = rest_of(process)
        self.assertEqual(process.returncode, 130, err)
        self.assertRegex(out, r"(?m)^[1-9]\d+ estimates ")
        self.assertGreater(self.run_here("info", "stopped.mcap", "--json").records[0]["duration_s"], 0.5)


class Refused(InFolder):
    def test_invalid_combinations_of_arguments_are_reported(self):
        for words, part in (
                (["--map", "map"], "--robot"),
                (["lap.mcap", "--map", "map", "--robot", "ros2:limo"], "lap.mcap"),
                (["lap.mcap", "--map", "map", "--view"], "`waymark localize robot`"),
                (["--map", "map", "--robot", "process:true", "--no-adapt"], "`waymark localize log`"),
                (["--map", "map", "--robot", "process:true", "--record-images", "jpeg"], "(--record-images): "),
                (["--map", "map", "--robot", "process:true", "--search-strips"], "--search-strips"),
                (["--map", "map", "--robot", "process:true", "--method", "smoother"], "(--lag-s): "),
                (["robot", "--map", "map", "--robot", "limo"], "'limo'"),
                (["lap.mcap", "--map", "map", "--robot-file", "limo"], "`waymark localize robot`"),
                (["v4l2:/dev/video0", "--map", "map"], "(--camera): "),
                (["v4l2:/dev/video0", "v4l2:/dev/video1", "--map", "map"], "v4l2:/dev/video1"),
                (["v4l2:/dev/video0", "--map", "map", "--start", "0", "0", "0"], "`waymark localize log`")):
            outcome = self.run_here("localize", *words)
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "localize", outcome.err)

    def test_the_arguments_select_the_verb(self):
        (self.folder / "walk.mp4").write_bytes(b"")
        put(self.folder, *LAP_OF_SQUARE)
        (self.folder / "tags.csv").write_text("t_ns,camera,tag,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_y_px\n"
                                              "1000,cam,0,10,20,30,20,30,40,10,40\n")
        for line, verb in (
                ("lap.mcap --map map", "log"), ("--map map", "log"), ("--json lap.mcap --map map", "log"), ("lap.mcap --robot limo --map map", "log"),
                ("lap.mcap --map walk.mp4", "log"), ("lap.mcap --map map --camera camera.yaml", "log"), ("tags.csv --map map", "log"),
                ("lap.mcap --start 1 2 3 --camera camera.yaml", "log"), ("--robot ros2:limo --map map", "robot"),
                ("--robot=mbot: --map map", "robot"), ("--robot mbot: --camera-source v4l2:/dev/video0", "robot"),
                ("v4l2:/dev/video0 --map map", "camera"), ("--json gstreamer:libcamerasrc --map map", "camera"), ("walk.mp4 --map map", "video"),
                ("--json walk.mp4 --map map", "video"), ("tags.csv --map map --camera camera.yaml", "video"), ("log lap.mcap", "log"),
                ("robot --map map", "robot"), ("camera --map map", "camera"), ("video tags.csv", "video")):
            outcome = self.run_here("localize", *line.split(), "--help")
            self.assertEqual(outcome.code, 0, f"{line}: {outcome.err}")
            self.assertIn(f"Usage: waymark localize {verb} ", outcome.out, line)

    def test_a_lockstep_robot_is_refused(self):
        robot = f"process:exec '{PROGRAM}' robot-sim --world circuit24 --lockstep"
        outcome = self.run_here("localize", "--robot", robot, "--map", made(*MAP_OF_SQUARE) / "map", "-o", "none.mcap")
        self.assertEqual(outcome.code, 1, outcome.err)
        self.assertIn("lockstep", outcome.err)
        self.assertFalse((self.folder / "none.mcap").exists(), "an empty recording is removed")


class Camera(InFolder):
    def write_map(self):
        # The map of the drawn squares, in the frame of a body that looks along x. Focal length 300 px, principal point (159.5, 119.5).
        tags = ""
        for family, number, left, top, cell in images.SCENE_TAGS:
            corners = images.corners(family, number, left, top, cell)
            side_px = corners[2] - corners[0]
            ahead = 300 * 0.1 / side_px
            right, down = ((low + side_px / 2 - middle) * ahead / 300 for low, middle in ((left, 159.5), (top, 119.5)))
            tags += (f'  - {{tag: "{family}:{number}", size_m: 0.1, position_m: [{ahead}, {-right}, {-down}], '
                     "quaternion_xyzw: [-0.5, 0.5, -0.5, 0.5]}\n")
        (self.folder / "map.yaml").write_text(f'format: waymark-map-1\nanchor: "tag36h11:7"\ntags:\n{tags}')

    def test_the_pose_of_a_video_matches_its_tags(self):
        self.write_map()
        images.write_pgm(self.folder / "photograph.pgm", images.scene(320, 240, images.SCENE_TAGS))
        subprocess.run([program("ffmpeg", "ffmpeg"), "-v", "error", "-i", "photograph.pgm", "-pix_fmt", "yuv420p", "-c:v", "mpeg4", "-q:v", "1", "walk.mp4"], cwd=self.folder, check=True)
        asked = ["localize", "walk.mp4", "--map", "map.yaml", "--camera", "camera.yaml"]
        seen = self.run_here(*asked, "--json", "-o", "walk.tum")
        self.assertEqual(seen.code, 0, seen.err)
        self.assertRegex(seen.err, r": 1 \w+, 1 ")
        self.assertLess(max(map(abs, seen.records[0]["pose"]["position_m"])), 0.05)
        self.assertEqual(len((self.folder / "walk.tum").read_text().splitlines()), 2, "a comment and a pose")
        for flags, words in ((["--view"], "`waymark localize robot`"), (["--method", "ekf"], "`waymark localize log`"),
                             (["--camera-size", "x"], "(--camera-size): "), (["--camera-size", "640x360"], "(--camera-size): "),
                             (["--set", "filter.gate=0.9"], "`waymark localize log`")):
            outcome = self.run_here(*asked, *flags)
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn(words, outcome.err)
            golden_page.expect(self, "localize", outcome.err)
        for verb in (["localize", "walk.mp4", "--map", "map.yaml"], ["detect", "walk.mp4", "--tag-size-m", "0.1"],
                     ["convert", "walk.mp4", "walk.mcap", "--tag-size-m", "0.1"], ["map", "walk.mp4", "-o", "map", "--tag-size-m", "0.1"]):
            outcome = self.run_here(*verb, "--camera", "camera.yaml", "--camera-size", "640x480")
            self.assertEqual(outcome.code, 1, f"{verb}: the images do not match the calibration: {outcome.err}")
            self.assertIn("--camera-size 320x240", outcome.err)

    def test_the_pose_of_a_live_camera_matches_its_tags(self):
        fake = FakeCamera(self.folder / "fake", PROGRAM)
        still = images.scene(320, 240, images.SCENE_TAGS)
        fake.play([[bytearray(value - 2 * n if value > 100 else value for value in row) for row in still] for n in range(4)], 50, "YUYV")
        self.write_map()
        seen = self.run_here("localize", "v4l2:/dev/video0", "--camera", "camera.yaml", "--map", "map.yaml", "--duration-s", "1", "--every-s",
                             "0.1", "-o", "hand.mcap", "--json", env=fake.environment(""))
        self.assertEqual(seen.code, 0, seen.err)
        self.assertGreater(len(seen.records), 2)
        for record in seen.records:
            self.assertEqual(record["tags"], 2)
            self.assertLess(max(map(abs, record["pose"]["position_m"])), 0.01, record)
            self.assertGreater(record["pose"]["rotation_xyzw"][3] ** 2, 0.9998, record)
            self.assertLess(record["pose"]["position_sigma_m"], 0.02)
        topics = {topic["topic"] for topic in self.run_here("info", "hand.mcap", "--json").records[0]["topics"]}
        self.assertLessEqual({"/waymark/pose", "/tag_detections", "/camera_info"}, topics)
        (self.folder / "other.yaml").write_text((self.folder / "map.yaml").read_text().replace("tag36h11:7", "tag36h11:8").replace("tag36h11:42", "tag36h11:43"))
        lost = self.run_here("localize", "v4l2:/dev/video0", "--camera", "camera.yaml", "--map", "other.yaml", "--duration-s", "0.5", env=fake.environment(""))
        self.assertEqual(lost.code, 1, "none of the observed tags are in this map")
        self.assertNotIn("yaw", lost.out, "no pose is printed")
        self.assertIn("map", lost.out)


if __name__ == "__main__":
    unittest.main()
