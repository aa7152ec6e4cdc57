"""A lap stored as tables, and files of other programs: merged, mapped, used for calibration, read."""
import gzip
import json
import os
import pathlib
import unittest

from harness import InFolder
from laps import WithLap
import golden_page

HOW = ["--tag-size-m", 0.16, "--anchor", 0, "--anchor-pose", 0, 0, 0.3, -90, 0, -90]
DATA = pathlib.Path(os.environ.get("WAYMARK_DATA", "/nonexistent"))


def tags_of(path):
    text = path.read_text()
    parts = text.split("  - tag: ")[1:]
    position = lambda part: [float(x) for x in part.split("position_m: [")[1].split("]")[0].split(",")]
    return {part.split('"')[1]: position(part) for part in parts}


class Tables(WithLap):
    def ok(self, *words):
        done = self.run_here(*words)
        self.assertEqual(done.code, 0, (words, done.err))
        return done

    def tables(self):
        for kind in ("detections", "odometry", "imu"):
            self.ok("convert", "lap.mcap", f"{kind}.csv", "--kind", kind)
        (self.folder / "detections.csv.gz").write_bytes(gzip.compress((self.folder / "detections.csv").read_bytes()))
        self.ok("map", "lap.mcap", "-o", "whole", *HOW)
        self.robot = self.folder / "whole/robot.yaml"

    def farthest(self, a, b):
        a, b = tags_of(self.folder / a / "map.yaml"), tags_of(self.folder / b / "map.yaml")
        self.assertEqual(a.keys(), b.keys())
        return max(sum((p - q) ** 2 for p, q in zip(a[tag], b[tag])) ** 0.5 for tag in a)

    def test_a_lap_in_tables(self):
        self.tables()
        # Directly from the tables; the robot file contains the parameters that tables lack.
        self.assertIn("--robot", self.run_here("map", "detections.csv", "odometry.csv", "-o", "none", *HOW).err)
        self.ok("map", "detections.csv.gz", "odometry.csv", "imu.csv", "--robot", self.robot, "-o", "tables", *HOW)
        self.assertTrue((self.folder / "tables/robot.yaml").exists())
        # Merged into one recording, which contains everything.
        done = self.ok("convert", "detections.csv.gz", "odometry.csv", "imu.csv", "merged.mcap", "--robot", self.robot, "--json")
        self.assertEqual(done.records[0]["input"], ["detections.csv.gz", "odometry.csv", "imu.csv"])
        stamps = [json.loads(line)["stamp_ns"] for line in self.ok("play", "merged.mcap", "--json", "--speed", 0).out.splitlines()]
        self.assertEqual(stamps, sorted(stamps))
        self.ok("map", "merged.mcap", "-o", "merged", *HOW)
        self.assertLess(self.farthest("tables", "merged"), 1e-6)
        # Tables contain no corner covariances: the map differs, but is as accurate.
        self.assertLess(self.farthest("whole", "tables"), 0.02)
        found = self.ok("calibrate", "robot", "detections.csv", "odometry.csv", "imu.csv", "--robot", self.robot,
                        "--tag-size-m", 0.16, "-o", "calibration.yaml")
        self.assertTrue((self.folder / "calibration.yaml").exists(), found.err)

    def test_recordings_of_two_drives_are_not_merged(self):
        (self.folder / "again.mcap").write_bytes((self.folder / "lap.mcap").read_bytes())
        for words in (["map", "lap.mcap", "again.mcap", "-o", "none", *HOW], ["convert", "lap.mcap", "again.mcap", "both.mcap"]):
            done = self.run_here(*words)
            self.assertNotEqual(done.code, 0, words)
            self.assertIn("--extend", done.err)
            golden_page.expect(self, "recording", done.err)
        self.assertFalse((self.folder / "none").exists() or (self.folder / "both.mcap").exists())

    def test_info_suggests_the_next_commands(self):
        self.ok("convert", "lap.mcap", "odometry.csv", "--kind", "odometry")
        steps = " ".join(step["command"] for step in json.loads(self.ok("info", "--json", "lap.mcap").out)["next"])
        self.assertIn("waymark map lap.mcap", steps)
        self.assertIn("waymark localize lap.mcap", steps)
        steps = " ".join(step["command"] for step in json.loads(self.ok("info", "--json", "odometry.csv").out)["next"])
        self.assertIn("waymark localize odometry.csv", steps)


class OtherPrograms(InFolder):
    def test_a_pipe_is_not_a_recording(self):
        os.mkfifo(self.folder / "pipe")
        for words in (["info", "pipe"], ["convert", "pipe", "out.mcap"]):
            done = self.run_here(*words)
            self.assertEqual(done.code, 1)
            self.assertIn("pipe: ", done.err)
            golden_page.expect(self, "recording", done.err)

    def test_calibrations_and_layouts_of_frc(self):
        if not (DATA / "photonvision").exists():
            raise unittest.SkipTest("WAYMARK_DATA does not hold photonvision")
        packed = DATA / "photonvision/lifecam480p.json.gz"
        (self.folder / "lifecam.json").write_bytes(gzip.decompress(packed.read_bytes()))
        done = self.run_here("detect", DATA / "photonvision/tag1_640_480.jpg", "--camera", "lifecam.json", "--tag-size-m", 0.1651,
                             "--json")
        self.assertEqual(done.code, 0, done.err)
        self.assertTrue(done.records[0]["detections"], done.out)
        layout = DATA / "wpical/2024-crescendo.json"
        done = self.run_here("map", "convert", layout, "map.yaml", "--json")
        self.assertEqual((done.code, done.records[0]["tags"], done.records[0]["from"]), (0, 16, "wpilib"), done.err)
        done = self.run_here("map", "convert", "map.yaml", "again.json", "--to", "wpilib")
        self.assertEqual(done.code, 0, done.err)
        ours = {tag["ID"]: tag["pose"] for tag in json.loads((self.folder / "again.json").read_text())["tags"]}
        for tag in json.loads(layout.read_text())["tags"]:
            pose = ours[tag["ID"]]
            for axis in "xyz":
                self.assertAlmostEqual(pose["translation"][axis], tag["pose"]["translation"][axis], 9)
            a, b = pose["rotation"]["quaternion"], tag["pose"]["rotation"]["quaternion"]
            self.assertAlmostEqual(abs(sum(a[k] * b[k] for k in "WXYZ")), 1, 9)


if __name__ == "__main__":
    unittest.main()
