#!/usr/bin/python3
"""`waymark info`, `play`, `recover`, `detect` and `map` on recordings: our own, truncated ones, and those of other programs.

usage: recording_test.py PROGRAM [unittest options]
"""
import bz2
import errno
import os
import pathlib
import re
import shlex
import signal
import subprocess
import time
import unittest

import laps
import recordings
from harness import PROGRAM, InFolder
import golden_page

SECOND = 10**9


class WithLap(laps.WithLap):
    MADE = (f"{laps.WithLap.MADE[0]} --durable",)


class Info(WithLap):
    def test_a_lap_can_be_mapped_and_has_no_problems(self):
        (info,) = self.run_here("info", "--json", "lap.mcap").records
        self.assertLessEqual({"tags", "odometry", "wheels", "imu", "commands", "truth"}, set(info["contents"]))
        self.assertIn("waymark map lap.mcap -o map", [step["command"] for step in info["next"]])
        self.assertEqual((info["format"], info["traps"]), ("mcap", []))
        for topic in info["topics"]:
            self.assertEqual((topic["zero_stamps"], topic["backward_stamps"], topic["clock_jumps"]), (0, 0, 0), topic)
            if topic["topic"] in ("/odom", "/imu", "/tag_detections"):
                self.assertTrue(topic["periodic"], topic)
                self.assertEqual((topic["stamps"], topic["gaps"], topic["dropped"]), ("header", 0, 0), topic)

    def test_quick_reports_the_same_counts(self):
        (full,) = self.run_here("info", "--json", "lap.mcap").records
        (quick,) = self.run_here("info", "--quick", "--json", "lap.mcap").records
        self.assertEqual([(t["topic"], t["messages"]) for t in full["topics"]],
                         [(t["topic"], t["messages"]) for t in quick["topics"]])
        self.assertNotIn("gaps", quick["topics"][0])

    def test_missing_messages_and_a_missing_calibration_are_reported(self):
        image = (self.folder / "photograph.png").read_bytes()
        times = [SECOND + i * SECOND // 20 for i in range(100) if not 40 <= i < 60 and i != 70]
        recordings.write(self.folder / "gaps.mcap", [
            ("/cam/compressed", "sensor_msgs/msg/CompressedImage", t, recordings.compressed_image(t, image)) for t in times])
        (info,) = self.run_here("info", "--json", "gaps.mcap").records
        (topic,) = info["topics"]
        self.assertEqual((topic["gaps"], topic["dropped"], topic["messages"]), (2, 21, 79))
        self.assertAlmostEqual(topic["longest_interval_s"], 1.05, places=6)
        self.assertEqual(info["contents"], ["images"])
        self.assertIn("waymark detect gaps.mcap", [step["command"] for step in info["next"]])
        words = self.run_here("info", "gaps.mcap").out
        self.assertRegex(words, r"\b21 .* 2 .* 1\.05 s")
        self.assertIn("calibration", words)

    def test_a_clock_that_jumped_back_is_reported_by_teach_info_and_map(self):
        (self.folder / "faults.yaml").write_text("faults:\n  - {fault: clock_jump, at_s: 20, jump_s: -3}\n")
        taught = self.run_here("teach", "--world", "circuit24", "--faults", "faults.yaml", "-o", "jump.mcap", "--json")
        self.assertEqual(taught.code, 1)
        (lap,) = taught.records
        self.assertFalse(lap["mappable"])
        self.assertAlmostEqual(lap["clock_back_s"], 3, delta=0.1)
        (warning,) = lap["warnings"]
        self.assertIn(f"{lap['clock_back_s']:.2f} s", warning)
        self.assertIn(warning, taught.err)
        (info,) = self.run_here("info", "--json", "jump.mcap").records
        self.assertIn("mcap.time_back", [trap["key"] for trap in info["traps"]])
        for topic in info["topics"]:
            if topic["messages"] > 1:
                self.assertEqual((topic["clock_jumps"], topic["backward_stamps"]), (1, 1), topic)
                self.assertAlmostEqual(topic["largest_clock_jump_s"], -3, delta=0.1)
        warnings = self.run_here("map", "jump.mcap", "-o", "map", "--json").records[0]["warnings"]
        self.assertEqual(len([warning for warning in warnings if re.match(r"jump\.mcap at byte \d+: .* (2\.9|3\.0)\d s", warning)]), 1, warnings)


class OtherFormats(InFolder):
    def test_info_and_convert_report_the_same_traps_of_an_lcm_log(self):
        log = pathlib.Path(os.environ.get("WAYMARK_DATA", "")) / "lcm/lcmlog-2024-04-15.00"
        if not os.environ.get("WAYMARK_DATA"):
            self.skipTest("needs WAYMARK_DATA")
        (info,) = self.run_here("info", "--json", log).records
        (converted,) = self.run_here("convert", "--json", log, "log.mcap").records
        traps = {trap["key"]: trap["count"] for trap in info["traps"]}
        self.assertEqual(traps, {p["key"]: p["count"] for p in converted["problems"] if p["kind"] == "trap"})
        self.assertEqual(len(traps), 10)
        for step in info["next"]:
            self.assertNotIn(f"{log}.", step["command"], "nothing is written beside the recording")

    def test_a_compressed_file_truncated_in_its_first_block_is_an_error(self):
        lap = laps.made(*laps.LAP) / "lap.mcap"
        packed = bz2.compress(lap.read_bytes()[:300_000])
        (self.folder / "cut.mcap.bz2").write_bytes(packed[:len(packed) // 2])
        outcome = self.run_here("info", "cut.mcap.bz2")
        self.assertEqual((outcome.code, outcome.out), (1, ""))
        self.assertIn("cut.mcap.bz2", outcome.err)
        golden_page.expect(self, "recording", outcome.err)
        blocks = b"".join(bz2.compress(lap.read_bytes()[at:at + 200_000]) for at in range(0, 600_000, 200_000))
        (self.folder / "blocks.mcap.bz2").write_bytes(blocks[:-1000])
        outcome = self.run_here("info", "blocks.mcap.bz2")
        self.assertEqual(outcome.code, 0)
        self.assertIn("/odom", outcome.out)
        self.assertIn("blocks.mcap.bz2", outcome.err)
        golden_page.expect(self, "recording", outcome.err)


class Play(WithLap):
    def test_samples_and_messages_of_a_time_interval(self):
        part = ("--from", 5, "--to", 7, "--topics", "/odom,/tag_detections", "--speed", 0)
        samples = self.run_here("play", "lap.mcap", *part, "--json").records
        messages = self.run_here("play", "lap.mcap", *part, "--json", "--messages").records
        self.assertEqual({s["kind"] for s in samples}, {"odometry", "tags"})
        self.assertEqual({m["topic"] for m in messages}, {"/odom", "/tag_detections"})
        self.assertEqual(len(samples), len(messages))
        self.assertEqual([s["stamp_ns"] for s in samples], [m["log_time_ns"] for m in messages])
        (info,) = self.run_here("info", "--json", "lap.mcap").records
        since = [m["log_time_ns"] - info["start_ns"] for m in messages]
        self.assertTrue(all(5 * SECOND <= at < 7 * SECOND for at in since), (since[0], since[-1]))
        self.assertAlmostEqual(len([s for s in samples if s["kind"] == "odometry"]), 100, delta=1)
        words = self.run_here("play", "lap.mcap", "--speed", 0, "--to", 3).out
        for kind in ("odometry", "tags", "imu", "wheels", "commands", "truth"):
            self.assertIn(kind, words)

    def test_invalid_arguments(self):
        outcome = self.run_here("play", "lap.mcap", "--topics", "/odm")
        self.assertEqual(outcome.code, 2)
        self.assertIn("'/odom'?", outcome.err)
        self.assertEqual(self.run_here("play", "lap.mcap", "--from", 5, "--to", 4).code, 2)
        self.assertEqual(self.run_here("play", "lap.mcap", "--speed", -1).code, 2)
        self.assertEqual(self.run_here("play", "none.mcap").code, 1)

    def test_the_intact_part_of_a_damaged_recording_is_played_and_is_a_failure(self):
        data = bytearray((self.folder / "lap.mcap").read_bytes())
        middle = len(data) // 2
        data[middle:middle + 64] = bytes(64)
        (self.folder / "damaged.mcap").write_bytes(data)
        whole = self.run_here("play", "lap.mcap", "--speed", 0, "--json")
        damaged = self.run_here("play", "damaged.mcap", "--speed", 0, "--json")
        self.assertEqual((whole.code, damaged.code), (0, 1), damaged.err)
        self.assertTrue(damaged.err)
        self.assertGreater(len(damaged.records), 0.3 * len(whole.records))
        self.assertLess(len(damaged.records), len(whole.records))

    def test_ctrl_c_ends_playing(self):
        process = subprocess.Popen([PROGRAM, "play", "lap.mcap", "--speed", "0.01"], cwd=self.folder, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
        self.assertEqual(process.returncode, 130)


class Recover(WithLap):
    def test_a_truncated_lap_is_recovered_into_another_file(self):
        data = (self.folder / "lap.mcap").read_bytes()
        (self.folder / "cut.mcap").write_bytes(data[:len(data) * 2 // 3])
        (cut,) = self.run_here("info", "--json", "cut.mcap").records
        self.assertIn("waymark recover cut.mcap", [step["command"] for step in cut["next"]])
        (outcome,) = self.run_here("recover", "cut.mcap", "--json").records
        self.assertEqual((outcome["output"], outcome["was_whole"]), ("cut.recovered.mcap", False))
        (whole,) = self.run_here("info", "--json", "cut.recovered.mcap").records
        self.assertTrue(whole["complete"])
        self.assertEqual((whole["messages"], whole["metadata"]), (cut["messages"], cut["metadata"]))
        self.assertEqual((self.folder / "cut.mcap").read_bytes(), data[:len(data) * 2 // 3])
        self.assertFalse(list(self.folder.glob("*.part")))
        recovered = (self.folder / "cut.recovered.mcap").read_bytes()
        again = self.run_here("recover", "cut.mcap")
        self.assertEqual(again.code, 1)
        self.assertIn("cut.recovered.mcap: ", again.err)
        golden_page.expect(self, "recording", again.err)
        self.assertEqual((self.folder / "cut.recovered.mcap").read_bytes(), recovered)

    def test_an_intact_lap_is_copied_unchanged(self):
        outcome = self.run_here("recover", "lap.mcap", "-o", "same.mcap", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertTrue(outcome.records[0]["was_whole"])
        self.assertEqual((self.folder / "same.mcap").read_bytes(), (self.folder / "lap.mcap").read_bytes())

    def test_a_file_without_a_complete_message_is_not_recovered(self):
        data = (self.folder / "lap.mcap").read_bytes()
        for size in (8, 60, 3000):
            (self.folder / "begun.mcap").write_bytes(data[:size])
            outcome = self.run_here("recover", "begun.mcap")
            self.assertEqual((outcome.code, outcome.out), (1, ""))
            self.assertIn("begun.mcap", outcome.err)
            golden_page.expect(self, "recording", outcome.err)
            self.assertFalse(list(self.folder.glob("begun.*m*.*")), "no file is left")

    def test_other_files_are_not_recovered(self):
        self.assertEqual(self.run_here("recover", "photograph.png").code, 1)
        self.assertEqual(self.run_here("recover", "none.mcap").code, 1)
        self.assertEqual(self.run_here("recover", "lap.mcap", "-o", "lap.txt").code, 2)
        self.assertFalse(list(self.folder.glob("*.part")) + list(self.folder.glob("*recovered*")))

    def test_the_recording_of_a_killed_program_is_recovered(self):
        process = subprocess.Popen([PROGRAM, "teach", "--world", "circuit24", "--seed", "1", "-o", "killed.mcap"],
                                   cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        path = self.folder / "killed.mcap"
        while process.poll() is None and not (path.exists() and path.stat().st_size > 30_000):
            time.sleep(0.002)
        process.kill()
        process.wait()
        (info,) = self.run_here("info", "--json", "killed.mcap").records
        self.assertGreater(info["messages"], 100)
        self.assertEqual(self.run_here("recover", "killed.mcap").code, 0)


# A file system of 300 KiB that only these commands see. Linux allows any user to create one, unless it is configured otherwise.
FULL_DISK = """
mount -t tmpfs -o size=300k tmpfs disk || exit 77
{program} teach --world circuit24 -o disk/lap.mcap; echo teach $?
{program} info --json disk/lap.mcap; echo info $?
{program} convert disk/lap.mcap disk/odometry.csv --kind odometry; echo convert $?
{program} recover disk/lap.mcap -o disk/whole.mcap; echo recover $?
{program} recover disk/lap.mcap -o whole.mcap; echo recover elsewhere $?
ls disk
"""


class FullDisk(InFolder):
    def test_the_recorded_part_is_kept_and_incomplete_files_are_removed(self):
        (self.folder / "disk").mkdir()
        done = subprocess.run(["unshare", "--user", "--map-root-user", "--mount", "sh", "-c",
                               FULL_DISK.format(program=shlex.quote(PROGRAM))], cwd=self.folder, capture_output=True, text=True, check=False)
        if done.returncode == 77 or "unshare:" in done.stderr:
            self.skipTest(f"no small file system can be created here: {done.stderr.strip()}")
        for what, code in (("teach", 1), ("info", 0), ("convert", 1), ("recover", 1), ("recover elsewhere", 0)):
            self.assertIn(f"\n{what} {code}\n", "\n" + done.stdout, done.stderr)
        for name in ("lap.mcap", "odometry.csv", "whole.mcap"):
            self.assertRegex(done.stderr, rf"disk/{name}: .*{os.strerror(errno.ENOSPC)}")
        self.assertEqual(done.stdout.splitlines()[-1], "lap.mcap")
        (whole,) = self.run_here("info", "--json", "whole.mcap").records
        self.assertTrue(whole["complete"])
        self.assertGreater(whole["duration_s"], 5)


class Images(InFolder):
    def setUp(self):
        super().setUp()
        image = (self.folder / "photograph.png").read_bytes()
        recordings.write(self.folder / "film.mcap", [
            ("/image/compressed", "sensor_msgs/msg/CompressedImage", t, recordings.compressed_image(t, image))
            for t in (12 * SECOND + 345, 13 * SECOND)], close=False)

    def test_detect_finds_the_tags_of_every_image(self):
        (still,) = self.run_here("detect", "--json", "photograph.png").records
        outcome = self.run_here("detect", "--json", "--annotate", "seen", "film.mcap", "photograph.png")
        self.assertEqual([r["image"] for r in outcome.records],
                         ["film.mcap#12.000000345", "film.mcap#13.000000000", "photograph.png"])
        for record in outcome.records:
            self.assertEqual(record["detections"], still["detections"])
        self.assertEqual({p.name for p in (self.folder / "seen").iterdir()},
                         {"film_12.000000345.png", "film_13.000000000.png", "photograph.png"})
        self.assertRegex(outcome.err, r": 3 \w+, 6 \w+, 1 ")

    def test_a_recording_without_images_is_an_error(self):
        recordings.write(self.folder / "none.mcap", [("/joy", "sensor_msgs/msg/Joy", 1, recordings.Cdr().bytes())])
        outcome = self.run_here("detect", "none.mcap")
        self.assertEqual(outcome.code, 1)
        self.assertIn("none.mcap", outcome.err)
        golden_page.expect(self, "recording", outcome.err)

    def test_a_lap_with_images_alone_is_mapped_with_the_options_of_the_detector(self):
        (self.folder / "line.yaml").write_text(recordings.LINE)
        taught = self.run_here("teach", "--world", "line.yaml", "--images", "--record-images", "jpeg", "-o", "all.mcap")
        self.assertEqual(taught.code, 0, taught.err)
        topics = "/image_raw/compressed,/camera_info,/tf_static,/odom"
        self.assertEqual(self.run_here("convert", "all.mcap", "images.mcap", "--topics", topics).code, 0)
        (info,) = self.run_here("info", "--json", "images.mcap").records
        self.assertEqual(set(info["contents"]), {"images", "odometry"})
        self.assertIn("waymark map images.mcap -o map", [step["command"] for step in info["next"]])
        maps = {}
        for name, words in (("as recorded", ("all.mcap",)), ("images", ("images.mcap",)),
                            ("again", ("all.mcap", "--detector", "waymark")),
                            ("coarse", ("images.mcap", "--detector", "apriltag3", "--quad-decimate", 3))):
            outcome = self.run_here("map", *words, "-o", name, "--json")
            self.assertEqual(outcome.code, 0, outcome.err)
            (maps[name],) = outcome.records
            self.assertEqual(maps[name]["tags"], 3)
        # The recorded tags were detected in the images before JPEG compression.
        self.assertAlmostEqual(maps["images"]["reprojection_rms_px"], maps["as recorded"]["reprojection_rms_px"], delta=0.1)
        self.assertNotEqual(maps["coarse"]["reprojection_rms_px"], maps["images"]["reprojection_rms_px"])
        outcome = self.run_here("map", "images.mcap", "--family", "tag16h5", "-o", "none")
        self.assertEqual(outcome.code, 1)
        self.assertFalse((self.folder / "none").exists())
        self.assertEqual(self.run_here("map", "images.mcap", "--family", "tag99", "-o", "none").code, 2)
        seen = self.run_here("detect", "images.mcap", "--json")
        frames = next(t["messages"] for t in info["topics"] if t["topic"] == "/image_raw/compressed")
        self.assertEqual((seen.code, len(seen.records)), (0, frames))

    def test_options_of_the_detector_are_an_error_without_images(self):
        laps.put(self.folder, *laps.LAP)
        outcome = self.run_here("map", "lap.mcap", "--min-white-black-diff", 20, "-o", "map")
        self.assertEqual(outcome.code, 1)
        self.assertIn("lap.mcap: ", outcome.err)
        golden_page.expect(self, "recording", outcome.err)

    def test_map_reports_missing_camera_parameters(self):
        image = (self.folder / "photograph.png").read_bytes()
        recordings.write(self.folder / "whole.mcap", [
            ("/image", "sensor_msgs/msg/CompressedImage", SECOND, recordings.compressed_image(SECOND, image))])
        outcome = self.run_here("map", "whole.mcap", "-o", "map")
        self.assertEqual(outcome.code, 1)
        self.assertIn("/camera_info", outcome.err)


if __name__ == "__main__":
    unittest.main()
