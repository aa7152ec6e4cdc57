#!/usr/bin/python3
"""Live cameras, simulated by tests/fake_v4l2: list, detection, page, recording, use with a robot, and errors."""
import json
import math
import pathlib
import re
import signal
import subprocess
import sys
import time

import images
from fake_camera import FakeCamera
from harness import PROGRAM, InFolder, event, program, unittest
import golden_page

ROOT = pathlib.Path(__file__).resolve().parents[2]
VIDEO = "v4l2:/dev/video0"


def moving_images(width, height):
    """The tags on a changing background: identical frames would be reported as a frozen camera."""
    still = images.scene(width, height, images.SCENE_TAGS)
    return [[bytearray(value - 2 * n if value > 100 else value for value in row) for row in still] for n in range(4)]


class LiveCamera(InFolder):
    def setUp(self):
        super().setUp()
        self.camera = FakeCamera(self.folder / "fake", PROGRAM)
        self.camera.play(moving_images(320, 240), 50, "YUYV")

    def see(self, *words, faults=""):
        return self.run_here(*words, env=self.camera.environment(faults))

    def start(self, *words, faults=""):
        return subprocess.Popen([PROGRAM, *words], cwd=self.folder, env=self.camera.environment(faults), stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def test_are_listed(self):
        shown = self.see("cameras")
        self.assertEqual(shown.code, 0, shown.err)
        for words in ("/dev/video0: Fake camera", "/dev/v4l/by-id/usb-Fake_camera_0-video-index0", "YUYV", "320 x 240", "50 Hz",
                      "exposure_ms 10", "0.3", "204.7"):
            self.assertIn(words, shown.out)
        golden_page.expect(self, "cameras", shown.out)
        camera = self.see("cameras", "--json").records[0]["cameras"][0]
        self.assertEqual(camera["modes"], [{"format": "YUYV", "readable": True, "width_px": 320, "height_px": 240, "rates_hz": [50]}])
        self.assertIn("power_line_frequency", [control["name"] for control in camera["controls"]])
        self.assertEqual(self.see("cameras", "/dev/video7").code, 1)
        self.camera.unplug()
        none = self.see("cameras")
        self.assertEqual((none.code, none.out), (0, ""))
        golden_page.expect(self, "cameras", none.err)

    def test_tags_of_several_cameras_are_found(self):
        other = FakeCamera(self.folder / "fake", PROGRAM, 1)
        other.play([[bytes(320)] * 240, [bytes([1] * 320)] * 240], 25, "GREY")
        second = "v4l2:/dev/video1"
        seen = self.see("detect", VIDEO, second, "--json", "--duration-s", "1")
        self.assertEqual(seen.code, 0, seen.err)
        by_camera = {address: [r for r in seen.records if r["image"].startswith(address + "#")] for address in (VIDEO, second)}
        for address, records in by_camera.items():
            self.assertGreater(len(records), 3, address)
            self.assertRegex(seen.err, rf"{address}: {len(records)} ")
        self.assertEqual(len(seen.records), sum(map(len, by_camera.values())), "lines are complete")
        self.assert_tags(by_camera[VIDEO][0], images.SCENE_TAGS)
        for words in ([second, second], [VIDEO, second, "--view"], [VIDEO, "photograph.png"]):
            refused = self.see("detect", *words)
            self.assertEqual(refused.code, 2, refused.err)
            golden_page.expect(self, "cameras", refused.err)
        gone = self.see("detect", VIDEO, "v4l2:/dev/video7", "--duration-s", "1")
        self.assertEqual(gone.code, 1, gone.err)

    def test_tags_are_found(self):
        seen = self.see("detect", VIDEO, "--json", "--duration-s", "1")
        self.assertEqual(seen.code, 0, seen.err)
        self.assertGreater(len(seen.records), 3)  # of 50, on a busy machine
        for record in seen.records:
            self.assert_tags(record, images.SCENE_TAGS)
            self.assertGreater(record["age_ms"], 14)  # 20 ms from the start of an exposure of 10 ms to the arrival
            self.assertLess(abs(record["stamp_s"] - time.time()), 60)
        posed = self.see("detect", VIDEO, "--camera", "camera.yaml", "--tag-size-m", "0.1", "--duration-s", "0.1")
        self.assertEqual(posed.code, 0, posed.err)
        self.assertGreater(posed.out.count("tag36h11"), 0)

    def test_a_recording_is_closed_by_time_and_by_ctrl_c(self):
        timed = self.see("convert", VIDEO + ",lock", "timed.mcap", "--duration-s", "0.5", "--record-images", "jpeg", "--json")
        self.assertEqual(timed.code, 0, timed.err)
        process = self.start("convert", VIDEO, "stopped.mcap")
        event.until(lambda: any("stopped.mcap" in path.name for path in self.folder.iterdir()), "it records")  # under another name until it is closed
        time.sleep(1.5)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
        self.assertEqual(process.returncode, 130)
        for name, topics in (("timed.mcap", {"/image_raw/compressed", "/tag_detections"}), ("stopped.mcap", {"/tag_detections"})):
            info = self.run_here("info", name, "--json").records[0]
            self.assertLessEqual(topics, {topic["topic"] for topic in info["topics"]})
            self.assertLess(info["duration_s"], 10)
            self.assertGreater(info["duration_s"], 0.4)
        self.assertEqual(timed.records[0]["images"], timed.records[0]["tags"] / 2)

    def test_errors_have_hints(self):
        for faults, words in (("denied", "usermod -aG"), ("busy", "/dev/video0")):
            failed = self.see("detect", VIDEO, faults=faults)
            self.assertEqual(failed.code, 1, faults)
            self.assertIn(words, failed.err)
        for address, words in (("v4l2:/dev/video0,size=99x99", "YUYV 320x240"), ("v4l2:/dev/video9", "waymark cameras"),
                               ("v4l2:/dev/video0,gain=1000", "100")):
            failed = self.see("detect", address)
            self.assertIn(failed.code, (1, 2), address)
            self.assertIn(words, failed.err)
        for words in (("detect", VIDEO, "photograph.png"), ("detect", "v4l2:0,size=big"), ("detect", VIDEO, "--annotate", "seen"),
                      ("detect", "photograph.png", "--view"), ("convert", "v4l2:0", "out.csv"),
                      ("teach", "--world", "circuit24", "--camera-source", VIDEO, "-o", "lap.mcap")):
            self.assertEqual(self.see(*words).code, 2, words)

    def test_damaged_images_are_counted_and_an_unplugged_camera_is_awaited(self):
        damaged = self.see("detect", VIDEO, "--json", "--duration-s", "0.5", faults="short:4")
        self.assertEqual(damaged.code, 0, damaged.err)
        self.assertIn("damaged", damaged.err)
        process = self.start("detect", VIDEO, "--json")
        found, words = event.Lines(process.stdout), event.Lines(process.stderr)
        found.wait_for("tag36h11")
        self.camera.unplug()
        words.wait_for("unplugged")
        self.camera.plug_in()
        words.wait_for("connected")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(20), 130, words.rest())

    def test_doctor(self):
        (self.folder / "calibration.yaml").write_text("nothing: 1\n")
        bad = self.see("doctor", "--json", "--rate-hz", "5")
        self.assertEqual(bad.code, 1, bad.err)
        levels = {line["check"]: line["level"] for line in bad.records[0]["checks"]}
        self.assertEqual(levels["calibration"], "fail")
        (self.folder / "calibration.yaml").unlink()
        good = self.see("doctor", "--json", "--rate-hz", "5", "--camera", "camera.yaml", "--camera-source", VIDEO + ",lock")
        lines = [line for line in good.records[0]["checks"] if line["check"] not in ("serial", "gamepad")]  # of this machine
        self.assertEqual([line["check"] for line in lines], ["camera", "camera", "calibration", "disk", "processor"])
        self.assertEqual([line["level"] for line in lines[:2]], ["ok", "ok"], good.out)
        self.assertRegex(lines[1]["message"], r" \d+\.\d ")
        for line in lines:
            self.assertEqual(line["level"] == "ok", line["command"] == "", line)
        denied = self.see("doctor", "--rate-hz", "5", faults="denied")
        self.assertEqual(denied.code, 1)
        self.assertIn("usermod -aG", denied.out)

    def test_doctor_measures_the_printed_size_of_a_tag(self):
        family, number, x, y, cell = images.SCENE_TAGS[0]
        still = images.scene(320, 240, [(family, number, x, y, cell)])
        self.camera.lines = ["card Fake camera"]
        self.camera.play([[bytearray(value - 2 * n if value > 100 else value for value in row) for row in still] for n in range(4)], 50, "YUYV")
        side_px = 8 * cell  # of tag36h11, in a camera of 300 px focal length and its centre at 159.5, 119.5
        middle = [first + side_px / 2 - 0.5 - centre for first, centre in ((x, 159.5), (y, 119.5))]
        away_m = 0.16 * 300 / side_px * math.hypot(1, middle[0] / 300, middle[1] / 300)
        seen = self.see("doctor", "--json", "--rate-hz", "5", "--camera", "camera.yaml", "--camera-source", VIDEO, "--tag-size-m", "0.16",
                        "--tag-at-m", str(round(0.94 * away_m, 4)))
        line = next(line for line in seen.records[0]["checks"] if line["check"] == "tag size")
        self.assertEqual(line["level"], "warn", line)
        self.assertAlmostEqual(float(re.findall(r"(\d+\.?\d*) mm", line["message"])[0]), 0.94 * 160, delta=1.5)

    def test_doctor_reports_missed_map_tags(self):
        tags = ""
        for family, number, left, top, cell in [*images.SCENE_TAGS, ("tag36h11", 3, 40, 120, 6)]:  # the last one is not in the image
            side_px = 8 * cell  # in a camera of 300 px focal length and its centre at 159.5, 119.5
            ahead = 300 * 0.1 / side_px
            right, down = ((low + side_px / 2 - 0.5 - middle) * ahead / 300 for low, middle in ((left, 159.5), (top, 119.5)))
            tags += (f'  - {{tag: "{family}:{number}", size_m: 0.1, position_m: [{right}, {down}, {ahead}], quaternion_xyzw: [0, 0, 0, 1]}}\n')
        (self.folder / "map.yaml").write_text(f'format: waymark-map-1\nanchor: "tag36h11:7"\ntags:\n{tags}', encoding="utf-8")
        seen = self.see("doctor", "--json", "--rate-hz", "5", "--camera", "camera.yaml", "--camera-source", VIDEO, "--map", "map.yaml")
        line = next(line for line in seen.records[0]["checks"] if line["check"] == "map")
        self.assertEqual(line["level"], "warn", line)
        self.assertRegex(line["message"], r"\b1 missed.* tag36h11:3 ")
        self.assertIn("occluded", line["message"])
        none = self.see("doctor", "--json", "--rate-hz", "5", "--camera", "camera.yaml", "--camera-source", VIDEO, "--map", "nowhere")
        line = next(line for line in none.records[0]["checks"] if line["check"] == "map")
        self.assertEqual((line["level"], "nowhere" in line["message"], none.code), ("fail", True, 1), line)
        none = self.see("doctor", "--json", "--rate-hz", "5", "--camera-source", VIDEO, "--map", "map.yaml")
        line = next(line for line in none.records[0]["checks"] if line["check"] == "map")
        self.assertEqual((line["level"], "--camera FILE" in line["command"], none.code), ("fail", True, 1), line)

    def test_a_pipeline_is_a_camera(self):
        images.write_pgm(self.folder / "one.pgm", images.scene(320, 240, images.SCENE_TAGS))
        raw = (self.folder / "one.pgm").read_bytes()[-320 * 240:]
        (self.folder / "frames.raw").write_bytes(raw * 25)
        pipeline = "gstreamer:filesrc location=frames.raw ! rawvideoparse width=320 height=240 format=gray8 framerate=50/1"
        seen = self.run_here("detect", pipeline, "--json")
        self.assertEqual(seen.code, 0, seen.err)
        self.assertGreater(len(seen.records), 3)
        for record in seen.records:
            self.assert_tags(record, images.SCENE_TAGS)

    def test_another_program_reads_the_same_camera(self):
        """Checks the simulated camera with ffmpeg: it reads the frames of the test."""
        read = subprocess.run([program("ffmpeg", "ffmpeg"), "-v", "error", "-f", "v4l2", "-i", "/dev/video0", "-frames:v", "3", "-f", "rawvideo", "-"],
                              env=self.camera.environment(), capture_output=True, timeout=60, check=True)
        rows = images.scene(320, 240, images.SCENE_TAGS)
        self.assertEqual(read.stdout[:640:2], bytes(rows[0]))
        self.assertEqual(len(read.stdout), 3 * 2 * 320 * 240)


class WithARobot(InFolder):
    ROBOT = """import json, sys, time
def send(**line): print(json.dumps(line), flush=True)
send(type="hello", protocol_version=1, name="blind")
for i in range(10**6):
    send(type="odometry", stamp_s=1000 + 0.02 * i, x_m=0, y_m=0, yaw_rad=0, speed_m_s=0, yaw_rate_rad_s=0)
    send(type="tag_poses", stamp_s=1000 + 0.02 * i, tags=[{"tag": "tag36h11:3", "position_m": [0, 0, 1], "rotation_xyzw": [0, 0, 0, 1]}])
    time.sleep(0.02)
"""

    def session(self, frames, *flags):
        camera = FakeCamera(self.folder / "fake", PROGRAM)
        camera.play(frames, 30)
        (self.folder / "blind.py").write_text(self.ROBOT)
        process = subprocess.Popen([PROGRAM, "run", "--robot", f"process:{sys.executable} blind.py", "--driver", "lines", "-o", "session",
                                    "--tag-size-m", "0.1", "--camera-source", VIDEO, *flags],
                                   cwd=self.folder, env=camera.environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        process.stdin.write("go\n")
        process.stdin.flush()
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and not list(self.folder.glob("session/*.mcap")):
            time.sleep(0.1)
        time.sleep(5)
        return process.communicate("quit\n", timeout=60)

    def test_the_selected_detector_detects_the_family_of_the_anchor(self):
        still = images.scene(640, 480, [("tag16h5", 3, 180, 90, 10)])
        frames = [[bytearray(value - 2 * n if value > 100 else value for value in row) for row in still] for n in range(4)]
        words = self.session(frames, "--anchor", "tag16h5:3", "--detector", "waymark")
        (lap,) = (self.folder / "session").glob("*.mcap")
        seen = self.run_here("play", str(lap), "--speed", "0", "--json", "--topics", "/tag_detections")
        self.assertIn("tag16h5:3", seen.out, words)

    def test_a_camera_of_this_computer_replaces_the_detections_of_the_robot(self):
        words = self.session(moving_images(640, 480), "--anchor", "7")
        laps = list((self.folder / "session").glob("*.mcap"))
        self.assertTrue(laps, words)
        topics = {topic["topic"]: topic for topic in self.run_here("info", str(laps[0]), "--json").records[0]["topics"]}
        self.assertGreater(topics["/tag_detections"]["messages"], 5, words)
        self.assertFalse([topic for topic in topics if "pose" in topic], "corners replace the poses of the robot's own detector")
        self.assertLess(self.run_here("info", str(laps[0]), "--json").records[0]["duration_s"], 60)


if __name__ == "__main__":
    unittest.main()
