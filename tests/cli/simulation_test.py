#!/usr/bin/python3
"""Images, faults, worlds and robots of the simulator.

usage: simulation_test.py PROGRAM [unittest options]
"""
import math
import os
import pathlib
import pty
import subprocess
import time
import unittest

import recordings
from harness import PROGRAM, InFolder
from laps import MAP, put
import golden_page
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

    def test_images_do_not_depend_on_the_number_of_threads(self):
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

    def test_images_are_recorded(self):
        for how, topic, kind in (("raw", "/image_raw", "Image"), ("jpeg", "/image_raw/compressed", "CompressedImage")):
            outcome = self.teach(f"{how}.mcap", "--images", "--record-images", how)
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertEqual(self.topics(f"{how}.mcap")[topic]["messages"], outcome.records[0]["frames"])
            self.assertEqual(self.topics(f"{how}.mcap")[topic]["type"], f"sensor_msgs/msg/{kind}")
        outcome = self.teach("none.mcap", "--record-images", "raw")
        self.assertEqual(outcome.code, 2)
        self.assertIn("--images", outcome.err)
        golden_page.expect(self, "teach", outcome.err)

    def test_faults_are_applied(self):
        (self.folder / "f.yaml").write_text("faults:\n  - {fault: tag_removed, id: 2}\n"
                                            "  - {fault: camera_lost, at_s: 1, for_s: 1}\n")
        (whole,) = self.teach("whole.mcap").records
        outcome = self.teach("faults.mcap", "--faults", "f.yaml")
        (lap,) = outcome.records
        self.assertEqual(lap["tags"], 2)
        self.assertAlmostEqual(whole["frames"] - lap["frames"], 15, delta=1)
        (self.folder / "f.yaml").write_text("faults:\n  - {fault: tag_removd, id: 2}\n")
        outcome = self.teach("wrong.mcap", "--faults", "f.yaml")
        self.assertEqual(outcome.code, 1)
        self.assertIn("f.yaml:2 (faults[0].fault): ", outcome.err)
        self.assertIn("'tag_removed'?", outcome.err)
        golden_page.expect(self, "config", outcome.err)
        self.assertFalse((self.folder / "wrong.mcap").exists())

    def test_faults_are_applied_in_a_replay(self):
        put(self.folder, *MAP)
        (self.folder / "f.yaml").write_text("faults:\n  - {fault: camera_blackout, at_s: 5}\n")
        outcome = self.run_here("replay", "map", "--world", "circuit24", "--faults", "f.yaml", "--json")
        self.assertEqual(outcome.code, 1, "a robot without camera images does not complete the lap")
        self.assertFalse(outcome.records[0]["finished"])

    def test_a_simulation_like_the_real_mbot_has_its_statistics(self):
        log = pathlib.Path(os.environ.get("WAYMARK_DATA", "")) / "lcm/lcmlog-2024-04-15.00"
        if not os.environ.get("WAYMARK_DATA"):
            self.skipTest("needs WAYMARK_DATA")
        (like,) = self.run_here("simulate", "--like", log, "--world", "mbot-square", "--robot-file", "mbot", "-o", "like.mcap",
                                "--json").records
        real, made = ({key: value[side] for key, value in like["quantities"].items()} for side in ("recording", "simulation"))
        # Reference values, measured independently from rates and stamps of the channels in the log.
        for key, value, within in (("camera_rate_hz", 36.81, 0.02), ("odometry_rate_hz", 24.64, 0.02), ("imu_rate_hz", 24.64, 0.02),
                                   ("commands_rate_hz", 19.78, 0.02), ("duration_s", 183.98, 0.1),
                                   ("image_latency_s", 0.06545, 5e-5)):
            self.assertAlmostEqual(real[key], value, delta=within, msg=key)
        for key, share in (("camera_rate_hz", 0.002), ("odometry_rate_hz", 0.002), ("imu_rate_hz", 0.002), ("duration_s", 0.01),
                           ("image_latency_s", 0.001), ("gyro_noise_rad_s", 0.1), ("acceleration_noise_m_s2", 0.1),
                           ("miss_probability", 0.2), ("mean_speed_m_s", 0.05), ("p95_speed_m_s", 0.02),
                           ("standing_share", 0.05)):
            self.assertAlmostEqual(made[key] / real[key], 1, delta=share, msg=f"{key} {real[key]} {made[key]}")
        self.assertAlmostEqual(made["gyro_bias_rad_s"], real["gyro_bias_rad_s"], delta=0.001)
        self.assertAlmostEqual(made["command_delay_s"], real["command_delay_s"], delta=0.05)
        self.assertGreater(real["turning_share"], 0.1)  # the simulated path has no turns on the spot
        self.assertEqual(made["turning_share"], 0)

    def test_gaps_are_simulated_and_cameras_are_distinguished(self):
        (self.folder / "faults.yaml").write_text("faults:\n  - {fault: camera_lost, at_s: 5, for_s: 2}\n"
                                                 "  - {fault: odometry_lost, at_s: 20, for_s: 1.5}\n")
        self.run_here("teach", "--world", "circuit24", "--faults", "faults.yaml", "-o", "gaps.mcap")
        (like,) = self.run_here("simulate", "--like", "gaps.mcap", "-o", "like.mcap", "--json").records
        for key, longest in (("camera_longest_gap_s", 2), ("odometry_longest_gap_s", 1.5)):
            self.assertAlmostEqual(like["quantities"][key]["recording"], longest, delta=0.1)
            self.assertAlmostEqual(like["quantities"][key]["simulation"], longest, delta=0.1)
        self.assertNotIn("image_latency_s", like["quantities"], "log times are the stamps")
        seen = [(f"/{side}/detections", "apriltag_msgs/msg/AprilTagDetectionArray", t, recordings.no_tags(t, side))
                for side, ms in (("left", 100), ("right", 50)) for t in range(10**9, 21 * 10**9, ms * 10**6)]
        wheels = [("/odom", "nav_msgs/msg/Odometry", t, recordings.odometry(t)) for t in range(10**9, 21 * 10**9, 20 * 10**6)]
        recordings.write(self.folder / "two.mcap", seen + wheels)
        (like,) = self.run_here("simulate", "--like", "two.mcap", "-o", "one.mcap", "--json").records
        rates = {key: value["recording"] for key, value in like["quantities"].items() if key.endswith("rate_hz")}
        self.assertAlmostEqual(rates["camera_left_rate_hz"], 10, places=3)
        self.assertAlmostEqual(rates["camera_right_rate_hz"], 20, places=3)
        self.assertAlmostEqual(rates["camera_rate_hz"], 20, places=3)

    def test_weak_links_are_reported(self):
        # Two tags in front of the robot, and two that enter the view after the first ones have left it.
        (self.folder / "line.yaml").write_text(LINE.replace(
            "tags:\n", "tags:\n  - {id: 7, x_m: 5, y_m: 3.4, z_m: 0.3, facing_deg: -90}\n  - {id: 8, x_m: 5.3, y_m: 3.4, z_m: 0.3, facing_deg: -90}\n")
            .replace("[[0, 0], [0.3, 0], [0.6, 0]]", "[[0, 0], [1, 0], [2, 0], [4, 0], [5, 0.5], [5.1, 1.5]]"))
        outcome = self.teach("weak.mcap")
        self.assertIn("tag36h11:7, tag36h11:8", outcome.err)
        golden_page.expect(self, "teach", outcome.err)

    def test_installed_robots_and_worlds(self):
        for world, robot in (("limo-walls", ["--robot-file", "limo-ackermann"]), ("mbot-square", []), ("academy-house", [])):
            outcome = self.run_here("teach", "--world", world, *robot, "-o", f"{world}.mcap", "--json")
            self.assertIn(outcome.code, (0, 1), outcome.err)
            self.assertTrue(outcome.records[0]["finished"])
        self.assertAlmostEqual(self.topics("academy-house.mcap")["/scan"]["rate_hz"], 5, delta=0.1)
        demo = self.run_here("demo", "--world", "mbot-square", "-o", "demo")
        self.assertEqual(demo.code, 0, demo.err)
        self.assertIn("mbot-square, mbot:", demo.out)

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
        self.assertIn("gyro", self.run_here("simulate", "--like", "mbot.mcap", "-o", "again.mcap").out)

    def test_a_world_along_a_drawn_path(self):
        points = "".join(f"{2 * math.cos(a / 10):.3f},{2 * math.sin(a / 10):.3f}\n" for a in range(63))
        (self.folder / "drawn.csv").write_text("x,y\n" + points)
        outcome = self.run_here("world", "new", "--path", "drawn.csv", "-o", "mine.yaml", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (made,) = outcome.records
        self.assertGreaterEqual(made["two_tags_fraction"], 0.98)
        self.assertGreaterEqual(made["min_clearance_m"], 0.44)
        self.assertTrue(made["closed"])
        self.assertEqual(self.run_here("world", "check", "mine.yaml").code, 0)
        self.assertEqual(self.run_here("world", "new", "--path", "drawn.csv", "-o", "mine.yaml").code, 1, "never overwrites a file")
        (self.folder / "bad.csv").write_text("x,y\n1,2\n3,four\n")
        self.assertIn("bad.csv:3: ", self.run_here("world", "new", "--path", "bad.csv", "-o", "b.yaml").err)

    def test_a_keyboard_driver_needs_a_terminal(self):
        outcome = subprocess.run([PROGRAM, "teach", "--world", "line.yaml", "--driver", "keyboard", "-o", "k.mcap"],
                                 cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        self.assertEqual(outcome.returncode, 1)
        self.assertIn("terminal", outcome.stderr)
        golden_page.expect(self, "teach", outcome.stderr)
        self.assertFalse((self.folder / "k.mcap").exists())

    def test_a_person_drives_with_keys(self):
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
