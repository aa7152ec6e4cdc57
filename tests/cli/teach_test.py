#!/usr/bin/python3
"""`waymark teach` and `waymark info`: a recorded lap, its file, and errors.

usage: teach_test.py PROGRAM [unittest options]
"""
import json
import signal
import subprocess
import time
import unittest

from harness import PROGRAM, InFolder
import golden_page

TEACH = ["teach", "--robot", "sim", "--world", "circuit24", "--driver", "scripted"]
KEYS = {"wall_s", "lap_s", "frames", "detections", "low_observability_frames", "two_tags_fraction", "distance_m",
        "closed_loop", "mappable", "warnings"}


class Teach(InFolder):
    def teach(self, name, *words):
        return self.run_here(*TEACH, "-o", name, *words)

    def test_a_lap_is_recorded(self):
        outcome = self.teach("lap.mcap", "--seed", 3, "--json")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        (lap,) = outcome.records
        self.assertLessEqual(KEYS, lap.keys())
        self.assertEqual((lap["closed_loop"], lap["mappable"], lap["tags"], lap["warnings"]), (True, True, 24, []))
        self.assertGreaterEqual(lap["two_tags_fraction"], 0.98)
        self.assertGreater(lap["distance_m"], 16)
        self.assertAlmostEqual(lap["frames"], 15 * lap["lap_s"], delta=2)

    def test_the_report_states_whether_the_lap_can_be_mapped(self):
        outcome = self.teach("lap.mcap")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertIn("`waymark map lap.mcap -o map`", outcome.out)
        golden_page.expect(self, "teach", outcome.out)

    def test_same_seed_same_bytes(self):
        for name, seed in (("a.mcap", 7), ("b.mcap", 7), ("c.mcap", 8)):
            self.teach(name, "--seed", seed)
        files = [(self.folder / name).read_bytes() for name in ("a.mcap", "b.mcap", "c.mcap")]
        self.assertEqual(files[0], files[1])
        self.assertNotEqual(files[0], files[2])

    def test_mistakes(self):
        self.teach("lap.mcap")
        before = (self.folder / "lap.mcap").read_bytes()
        for words, code, part in (
                ([*TEACH, "-o", "lap.mcap"], 1, "lap.mcap: "),
                ([*TEACH, "-o", "none/lap.mcap"], 1, "none/lap.mcap: "),
                (["teach", "--world", "circuit42", "-o", "x"], 2, "'circuit24'?"),
                (["teach", "--world", "none.yaml", "-o", "x"], 1, "none.yaml: "),
                (["teach", "--world", "circuit24", "--robot", "smi", "-o", "x"], 2, "'sim'?"),
                (["teach", "--world", "circuit24", "--robot-file", "lima", "-o", "x"], 2, "'limo'?"),
                (["teach", "--world", "circuit24", "--driver", "scriptd", "-o", "x"], 2, "'scripted'?"),
                ([*TEACH, "-o", "x.bag"], 2, "x.bag: "),
                ([*TEACH, "-o", "x", "--speed-m-s", "3"], 2, "limo, 1 m/s"),
                ([*TEACH, "-o", "x", "--speed-m-s", "nan"], 2, "(--speed-m-s): 'nan'"),
                ([*TEACH, "-o", "x", "--set", "camera.exposure_ms=20"], 2, "--images"),
                ([*TEACH, "-o", "x", "--images", "--set", "camera.exposure=20"], 2, "'exposure_ms'?"),
                ([*TEACH, "-o", "x", "--exposure-ms", "20"], 2, "'--exposure-ms'"),
                (["teach", "--world", "circuit24"], 2, "--output"),
                (["teach", "-o", "x"], 2, "--world")):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (code, ""), outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "teach", outcome.err)
            self.assertFalse(list(self.folder.glob("x*")))
        self.assertEqual((self.folder / "lap.mcap").read_bytes(), before)

    def test_a_custom_world(self):
        found = self.run_here("info", "--json", "lap.mcap")
        self.assertEqual(found.code, 1)
        yaml = ("name: line\ntag_family: tag36h11\ntag_size_m: 0.2\nanchor_id: 5\ntags:\n"
                "  - {id: 5, x_m: 4, y_m: 0.6, z_m: 0.3, facing_deg: 180}\npath_closed: false\npath_m: [[0, 0], [1, 0], [2, 0]]\n")
        (self.folder / "line.yaml").write_text(yaml)
        outcome = self.run_here("teach", "--world", "line.yaml", "-o", "line.mcap")
        self.assertEqual(outcome.code, 1, "one tag is not enough for a map")
        golden_page.expect(self, "teach", outcome.out + outcome.err)
        (self.folder / "bad.yaml").write_text(yaml.replace("x_m: 4", "x_n: 4"))
        outcome = self.run_here("teach", "--world", "bad.yaml", "-o", "bad.mcap")
        self.assertEqual(outcome.code, 1)
        self.assertIn("bad.yaml:6 (tags[0].x_n): ", outcome.err)

    def test_a_name_without_an_extension_gets_one(self):
        outcome = self.teach("lap")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertIn("waymark map lap.mcap", outcome.out)
        self.assertTrue((self.folder / "lap.mcap").exists())

    def test_ctrl_c_and_a_closed_terminal_stop_the_robot_and_close_the_file(self):
        for number, name in ((signal.SIGINT, "Ctrl-C"), (signal.SIGHUP, "the closed terminal"), (signal.SIGTERM, "SIGTERM")):
            self.stop_by(number, name)

    def stop_by(self, number, name):
        # A path so long that the lap has not ended when the signal arrives.
        points = ", ".join(f"[{20 * i}, {i % 2}]" for i in range(200))
        (self.folder / "long.yaml").write_text(
            "name: long\ntag_family: tag36h11\ntag_size_m: 0.2\nanchor_id: 5\ntags:\n"
            "  - {id: 5, x_m: 3, y_m: 0.6, z_m: 0.3, facing_deg: 180}\n"
            f"path_closed: false\npath_m: [{points}]\n")
        process = subprocess.Popen([PROGRAM, "teach", "--world", "long.yaml", "-o", "long.mcap"], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and not ((self.folder / "long.mcap").exists()
                                                   and (self.folder / "long.mcap").stat().st_size > 30_000):
            time.sleep(0.005)
        process.send_signal(number)
        _, words = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, words)
        self.assertIn(f" by {name}: ", words)
        golden_page.expect(self, "teach", words)
        (info,) = self.run_here("info", "--json", "long.mcap").records
        self.assertTrue(info["complete"])
        (self.folder / "long.mcap").unlink()


class Info(InFolder):
    def setUp(self):
        super().setUp()
        self.run_here(*TEACH, "-o", "lap.mcap", "--seed", 3)

    def test_info_lists_the_contents_of_a_recording(self):
        (info,) = self.run_here("info", "--json", "lap.mcap").records
        topics = {t["topic"]: t for t in info["topics"]}
        self.assertEqual((info["profile"], info["complete"], info["problems"]), ("ros2", True, []))
        self.assertEqual(topics["/tag_detections"]["type"], "apriltag_msgs/msg/AprilTagDetectionArray")
        for topic, rate in (("/tag_detections", 15), ("/odom", 50), ("/imu", 100), ("/joint_states", 50), ("/cmd_vel", 20),
                            ("/truth/pose", 50)):
            self.assertAlmostEqual(topics[topic]["rate_hz"], rate, delta=0.05 * rate, msg=topic)
        self.assertEqual(sum(t["messages"] for t in info["topics"]), info["messages"])
        self.assertEqual(info["metadata"]["waymark"]["seed"], "3")
        self.assertEqual([a["name"] for a in info["attachments"]], ["robot.yaml", "truth/world.yaml", "options.yaml"])
        words = self.run_here("info", "lap.mcap").out
        for part in ("/tag_detections", "100.0", "tag36h11:0", "  waymark"):
            self.assertIn(part, words)

    def test_a_truncated_file_is_read_with_a_warning(self):
        data = (self.folder / "lap.mcap").read_bytes()
        (whole,) = self.run_here("info", "--json", "lap.mcap").records
        for size in (len(data) - 1, len(data) // 2, 20_000):
            (self.folder / "cut.mcap").write_bytes(data[:size])
            outcome = self.run_here("info", "--json", "cut.mcap")
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertFalse(outcome.records[0]["complete"])
            self.assertLessEqual(outcome.records[0]["messages"], whole["messages"])
            self.assertIn("cut.mcap", outcome.err)
            golden_page.expect(self, "recording", outcome.err)
        (self.folder / "cut.mcap").write_bytes(data[:len(data) // 2])
        self.assertAlmostEqual(self.run_here("info", "--json", "cut.mcap").records[0]["duration_s"],
                               whole["duration_s"] / 2, delta=3)

    def test_other_files_are_errors(self):
        (self.folder / "text.mcap").write_text("not a recording, but long enough to hold a magic\n")
        (self.folder / "empty.mcap").touch()
        for name in ("text.mcap", "empty.mcap", "none.mcap", "photograph.png", "photos"):
            outcome = self.run_here("info", name)
            self.assertEqual((outcome.code, outcome.out), (1, ""), name)
            self.assertIn(name, outcome.err)
            golden_page.expect(self, "recording", outcome.err)

    def test_damage_never_crashes_the_program(self):
        data = bytearray((self.folder / "lap.mcap").read_bytes()[:60_000])
        for at in range(9, 5000, 97):
            damaged = bytearray(data)
            damaged[at] ^= 0xFF
            (self.folder / "damaged.mcap").write_bytes(damaged)
            outcome = self.run_here("info", "--json", "damaged.mcap")
            self.assertIn(outcome.code, (0, 1))
            if outcome.code == 0:
                json.loads(outcome.out)


if __name__ == "__main__":
    unittest.main()
