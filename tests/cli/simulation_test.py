#!/usr/bin/python3
"""Pictures, faults, worlds and robots of the simulator as a user meets them.

usage: simulation_test.py PROGRAM [unittest options]
"""
import math
import os
import pty
import subprocess
import time
import unittest

from harness import PROGRAM, InFolder
from recordings import LINE


class Simulation(InFolder):
    def setUp(self):
        super().setUp()
        (self.folder / "line.yaml").write_text(LINE)

    def teach(self, name, *words):
        return self.run_here("teach", "--world", "line.yaml", "-o", name, "--json", *words)

    def topics(self, name):
        (info,) = self.run_here("info", "--json", name).records
        return {t["topic"]: t for t in info["topics"]}

    def test_pictures_are_the_same_whatever_the_number_of_threads(self):
        for threads in (1, 2):
            outcome = self.teach(f"{threads}.mcap", "--images", "--threads", threads)
            self.assertEqual(outcome.code, 0, outcome.err)
        (lap,) = outcome.records
        self.assertEqual((lap["tags"], lap["mappable"]), (3, True))
        self.assertGreater(lap["two_tags_fraction"], 0.98)
        self.assertEqual((self.folder / "1.mcap").read_bytes(), (self.folder / "2.mcap").read_bytes())
        topics = self.topics("1.mcap")
        self.assertEqual(topics["/truth/tag_detections"]["messages"], topics["/tag_detections"]["messages"])
        self.assertNotIn("/image_raw", topics)

    def test_pictures_are_recorded(self):
        for how, topic, kind in (("raw", "/image_raw", "Image"), ("jpeg", "/image_raw/compressed", "CompressedImage")):
            outcome = self.teach(f"{how}.mcap", "--images", "--record-images", how)
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertEqual(self.topics(f"{how}.mcap")[topic]["messages"], outcome.records[0]["frames"])
            self.assertEqual(self.topics(f"{how}.mcap")[topic]["type"], f"sensor_msgs/msg/{kind}")
        outcome = self.teach("none.mcap", "--record-images", "raw")
        self.assertEqual(outcome.code, 2)
        self.assertIn("Add --images", outcome.err)

    def test_faults_happen(self):
        (self.folder / "f.yaml").write_text("faults:\n  - {fault: tag_removed, id: 2}\n"
                                            "  - {fault: camera_lost, at_s: 1, for_s: 1}\n")
        (whole,) = self.teach("whole.mcap").records
        outcome = self.teach("faults.mcap", "--faults", "f.yaml")
        (lap,) = outcome.records
        self.assertEqual(lap["tags"], 2)
        self.assertAlmostEqual(whole["frames"] - lap["frames"], 15, delta=1)
        (self.folder / "f.yaml").write_text("faults:\n  - {fault: tag_removd, id: 2}\n")
        outcome = self.teach("wrong.mcap", "--faults", "f.yaml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("f.yaml:2 (faults[0].fault): there is no fault 'tag_removd'. Did you mean 'tag_removed'?", outcome.err)
        self.assertFalse((self.folder / "wrong.mcap").exists())

    def test_a_replay_meets_faults(self):
        self.assertEqual(self.run_here("teach", "--world", "circuit24", "-o", "lap.mcap").code, 0)
        self.assertEqual(self.run_here("map", "lap.mcap", "-o", "map").code, 0)
        (self.folder / "f.yaml").write_text("faults:\n  - {fault: camera_blackout, at_s: 5}\n")
        outcome = self.run_here("replay", "map", "--world", "circuit24", "--faults", "f.yaml", "--json")
        self.assertEqual(outcome.code, 1, "a robot that sees nothing any more does not get round")
        self.assertFalse(outcome.records[0]["finished"])

    def test_weak_links_are_said(self):
        # Two tags before the robot and two that come into view when these have left it.
        (self.folder / "line.yaml").write_text(LINE.replace(
            "tags:\n", "tags:\n  - {id: 7, x_m: 5, y_m: 3.4, z_m: 0.3, facing_deg: -90}\n  - {id: 8, x_m: 5.3, y_m: 3.4, z_m: 0.3, facing_deg: -90}\n")
            .replace("[[0, 0], [0.3, 0], [0.6, 0]]", "[[0, 0], [1, 0], [2, 0], [4, 0], [5, 0.5], [5.1, 1.5]]"))
        outcome = self.teach("weak.mcap")
        self.assertIn("placed by odometry alone: tag36h11:7, tag36h11:8", outcome.err)

    def test_robots_and_worlds_that_come_with_it(self):
        for world, robot in (("limo-walls", "limo-ackermann"), ("mbot-square", "mbot"), ("academy-house", "turtlebot3-waffle")):
            outcome = self.run_here("teach", "--world", world, "--robot-file", robot, "-o", f"{robot}.mcap", "--json")
            self.assertIn(outcome.code, (0, 1), outcome.err)
            self.assertTrue(outcome.records[0]["finished"])
        self.assertAlmostEqual(self.topics("turtlebot3-waffle.mcap")["/scan"]["rate_hz"], 5, delta=0.1)

    def test_a_simulation_like_a_recording(self):
        self.run_here("teach", "--world", "circuit24", "--robot-file", "mbot", "--speed-m-s", 0.4, "-o", "mbot.mcap")
        outcome = self.run_here("simulate", "--like", "mbot.mcap", "-o", "like.mcap", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        quantities = outcome.records[0]["quantities"]
        for key, tolerance in (("camera_rate_hz", 0.02), ("odometry_rate_hz", 0.02), ("imu_rate_hz", 0.02),
                               ("gyro_noise_rad_s", 0.15), ("mean_speed_m_s", 0.1), ("duration_s", 0.05)):
            both = quantities[key]
            self.assertLess(abs(math.log(both["simulation"] / both["recording"])), tolerance, (key, both))
        self.assertEqual(self.run_here("simulate", "--like", "none.mcap", "-o", "x.mcap").code, 1)
        self.assertIn("gyro noise", self.run_here("simulate", "--like", "mbot.mcap", "-o", "again.mcap").out)

    def test_a_world_along_a_drawn_line(self):
        points = "".join(f"{2 * math.cos(a / 10):.3f},{2 * math.sin(a / 10):.3f}\n" for a in range(63))
        (self.folder / "drawn.csv").write_text("x,y\n" + points)
        outcome = self.run_here("world", "new", "--path", "drawn.csv", "-o", "mine.yaml", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (made,) = outcome.records
        self.assertGreaterEqual(made["two_tags_fraction"], 0.98)
        self.assertGreaterEqual(made["min_clearance_m"], 0.44)
        self.assertTrue(made["closed"])
        self.assertEqual(self.run_here("world", "check", "mine.yaml").code, 0)
        self.assertEqual(self.run_here("world", "new", "--path", "drawn.csv", "-o", "mine.yaml").code, 2, "never over another")
        (self.folder / "bad.csv").write_text("x,y\n1,2\n3,four\n")
        self.assertIn("bad.csv:3: this line holds no point", self.run_here("world", "new", "--path", "bad.csv", "-o", "b.yaml").err)

    def test_a_keyboard_needs_a_terminal_and_a_pad_must_be_there(self):
        outcome = subprocess.run([PROGRAM, "teach", "--world", "line.yaml", "--driver", "keyboard", "-o", "k.mcap"],
                                 cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        self.assertEqual(outcome.returncode, 1)
        self.assertIn("is not a terminal", outcome.stderr)
        self.assertFalse((self.folder / "k.mcap").exists())

    def test_somebody_drives_with_keys(self):
        master, terminal = pty.openpty()
        process = subprocess.Popen([PROGRAM, "teach", "--world", "line.yaml", "--driver", "keyboard", "-o", "keys.mcap", "--json"],
                                   cwd=self.folder, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        os.close(terminal)
        for _ in range(8):
            os.write(master, b"w")
            time.sleep(0.15)
        os.write(master, b"q")
        words, _ = process.communicate(timeout=60)
        os.close(master)
        self.assertIn('"finished":true', words.replace(" ", ""))
        self.assertGreater(float(words.split('"distance_m":')[1].split(",")[0]), 0.05)


if __name__ == "__main__":
    unittest.main()
