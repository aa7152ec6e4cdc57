#!/usr/bin/python3
"""`waymark localize` as a user meets it: our recordings, tables, real logs, and files that cannot work.

usage: localize_test.py PROGRAM [unittest options]
"""
import math
import os
import pathlib
import re
import unittest

from harness import InFolder
from laps import LAP, MAP, OTHER_LAP, made, put

KEYS = {"method", "estimates", "certain", "first_fix_s", "observations", "accepted", "nis_mean", "duration_s", "wall_s", "last",
        "problems"}


class OurRecordings(InFolder):
    def test_a_map_whose_origin_is_the_centre_of_its_anchor(self):
        """As a robot of one's own has it: the floor is 0.3 m below."""
        put(self.folder, *LAP)
        for anchor in (["--anchor", "5"], ["--anchor-pose", "0", "0", "0", "-90", "0", "-90"]):
            made = self.run_here("map", "lap.mcap", "-o", "centred", *anchor)
            self.assertEqual(made.code, 0, made.err)
            floor = re.search(r"floor:\n  z_m: (\S+)", (self.folder / "centred/map.yaml").read_text())
            self.assertAlmostEqual(float(floor[1]), -0.3, delta=0.02)
            outcome = self.run_here("localize", "lap.mcap", "--map", "centred", "--json")
            self.assertEqual(outcome.code, 0, outcome.err)
            report = outcome.records[0]
            self.assertGreater(report["certain"], 0.9 * report["estimates"])

    def test_every_method_on_a_mapped_lap_beside_the_truth(self):
        put(self.folder, *MAP)
        for method in ("riekf", "ekf", "smoother", "anchor"):
            outcome = self.run_here("localize", "lap.mcap", "--map", "map", "--method", method, "-o", method + ".mcap", "--json")
            self.assertEqual(outcome.code, 0, outcome.err)
            (report,) = outcome.records
            self.assertLessEqual(KEYS, report.keys())
            self.assertEqual((report["method"], report["problems"]), (method, []))
            self.assertGreater(report["certain"], 0.97 * report["estimates"])
            judged = self.run_here("evaluate", method + ".mcap", "lap.mcap", "--json")
            self.assertEqual(judged.code, 0, judged.err)
            (figures,) = judged.records
            self.assertLess(figures["ate_rmse_m"], 0.1 if method == "anchor" else 0.03)
            if method != "anchor":
                self.assertGreater(figures["nis_mean"], 0.3)
                self.assertLess(figures["nis_mean"], 1.5)
                self.assertGreater(figures["observations"], 1000)
            self.assertEqual(figures["uncertain"], report["estimates"] - report["certain"])
        self.assertIn("NIS ", self.run_here("evaluate", "riekf.mcap", "lap.mcap").out)
        self.assertEqual(self.run_here("localize", "lap.mcap", "--map", "map/map.yaml", "-o", "riekf.mcap").code, 1)
        self.hindsight_with_a_lag()
        self.name_of_the_output_says_what_it_is()
        self.what_does_not_fit_is_said()
        self.a_tag_that_is_kilometres_off_in_the_map_is_named()
        self.a_file_of_another_kind_is_named()
        outcome = self.run_here("localize", "lap.mcap", "--map", "map", "--method", "kalman")
        self.assertEqual(outcome.code, 2)
        self.assertIn("there is no method", outcome.err)
        (self.folder / "clash.yaml").write_text((self.folder / "map/map.yaml").read_text() + """
  - tag: "tag36h11:99"
    size_m: 0.16
    position_m: [0, 0, 0]
    quaternion_xyzw: [0, 0, 0, 1]
  - tag: "tag36h11:98"
    size_m: 0.16
    position_m: [0, 0, 0.01]
    quaternion_xyzw: [0, 0, 0, 1]
""")
        outcome = self.run_here("localize", "lap.mcap", "--map", "clash.yaml", "--robot", "limo")
        self.assertEqual(outcome.code, 1)
        self.assertIn("the map is inconsistent", outcome.err)
        points = self.folder / "points.csv"
        points.write_text("id,x,y\n1,2,3\n")
        self.assertIn("tag poses", self.run_here("localize", "lap.mcap", "--map", "points.csv").err)


    def name_of_the_output_says_what_it_is(self):
        outcome = self.run_here("localize", "lap.mcap", "--map", "map", "-o", "poses.txt")
        self.assertEqual(outcome.code, 0, outcome.err)
        last = (self.folder / "poses.txt").read_text().splitlines()[-1]
        self.assertEqual(len([float(word) for word in last.split()]), 8)
        (figures,) = self.run_here("evaluate", "poses.txt", "lap.mcap", "--json").records
        self.assertLess(figures["ate_rmse_m"], 0.03)
        self.assertIsNone(figures["nis_mean"])
        before = (self.folder / "poses.txt").read_text()
        outcome = self.run_here("localize", "lap.mcap", "--map", "map", "-o", "poses.txt")
        self.assertEqual(outcome.code, 1)
        self.assertIn("poses.txt: the file already exists", outcome.err)
        self.assertEqual((self.folder / "poses.txt").read_text(), before)
        outcome = self.run_here("localize", "lap.mcap", "--map", "map", "-o", "poses.csv")
        self.assertEqual(outcome.code, 2)
        self.assertIn(".tum", outcome.err)

    def hindsight_with_a_lag(self):
        outcome = self.run_here("localize", "lap.mcap", "--map", "map", "--method", "smoother", "--lag-s", 1, "-o", "lagged.mcap", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        scores = {}
        for name in ("riekf", "smoother", "lagged"):
            (scores[name],) = self.run_here("evaluate", name + ".mcap", "lap.mcap", "--json").records
        for name in ("smoother", "lagged"):
            self.assertLess(scores[name]["ate_rmse_m"], scores["riekf"]["ate_rmse_m"])
            self.assertGreater(scores[name]["coverage"], 0.97)

    def a_file_of_another_kind_is_named(self):
        for words, part in (
                (["localize", "lap.mcap", "--map", "lap.mcap"], "lap.mcap: this is a recording (MCAP), not a tag map. `waymark map lap.mcap`"),
                (["localize", "lap.mcap", "--map", "map", "--robot", "lap.mcap"], "this is a recording (MCAP), not a robot file"),
                (["localize", "lap.mcap", "--map", "map", "--calibration", "lap.mcap"], "this is a recording (MCAP), not a calibration.yaml"),
                (["localize", "map", "--map", "map"], "map: this is a map folder, not a recording"),
                (["info", "map"], "map: this is a map folder, not a recording"),
                (["info", "map/map.yaml"], "map.yaml: this is a map, not a recording"),
                (["localize", "map/map.yaml", "--map", "map"], "map.yaml: this is a map, not a recording")):
            outcome = self.run_here(*words)
            self.assertEqual(outcome.code, 1, words)
            self.assertIn(part, outcome.err, words)

    def a_tag_that_is_kilometres_off_in_the_map_is_named(self):
        text = (self.folder / "map/map.yaml").read_text()
        for x_m in (5000.0, -5000.0):
            head, entry = text.split('tag: "tag36h11:7"')
            entry = re.sub(r"position_m: \[[-\d.e]+", f"position_m: [{x_m}", entry, count=1)
            (self.folder / "off.yaml").write_text(f'{head}tag: "tag36h11:7"{entry}')
            outcome = self.run_here("localize", "lap.mcap", "--map", "off.yaml", "--robot", "limo", "--json")
            self.assertEqual(outcome.code, 0, outcome.err)
            (problem,) = outcome.records[0]["problems"]
            self.assertRegex(problem, r"^tag36h11:7 is (499|500)\d\.\d\d m .*correct the map")
            self.assertIn(problem, outcome.err)

    def what_does_not_fit_is_said(self):
        outcome = self.run_here("localize", "lap.mcap", "--map", "map", "--tag-size-m", 0.3)
        self.assertEqual(outcome.code, 0)
        self.assertIn("--tag-size-m is ignored", outcome.err)
        outcome = self.run_here("localize", "lap.mcap", "--map", "map", "--start", 30, 30, 90)
        self.assertEqual(outcome.code, 0)
        self.assertIn("assumed start", outcome.err)
        outcome = self.run_here("localize", "lap.mcap", made(*OTHER_LAP) / "lap.mcap", "--map", "map")
        self.assertEqual(outcome.code, 1)
        self.assertIn("two recordings contain odometry", outcome.err)


class Tables(InFolder):
    def write(self, landmarks=((1, 3, 1), (2, 3, -1), (3, 5, 0.5))):
        (self.folder / "landmarks.csv").write_text("id,x,y\n" + "".join(f"{n},{x},{y}\n" for n, x, y in landmarks))
        seen, moved = ["t_s,landmark,range_m,bearing_rad"], ["t_s,v_m_s,omega_rad_s"]
        for i in range(100):
            t, x = 0.1 * i, 0.02 * i
            moved.append(f"{t:.1f},0.2,0")
            seen += [f"{t:.1f},{n},{math.hypot(a - x, b):.6f},{math.atan2(b, a - x):.6f}" for n, a, b in
                     ((1, 3, 1), (2, 3, -1), (3, 5, 0.5))]
        (self.folder / "seen.csv").write_text("\n".join(seen) + "\n")
        (self.folder / "moved.csv").write_text("\n".join(moved) + "\n")

    def test_ranges_and_speeds(self):
        self.write()
        outcome = self.run_here("localize", "seen.csv", "moved.csv", "--map", "landmarks.csv", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (report,) = outcome.records
        self.assertAlmostEqual(report["last"]["x_m"], 0.02 * 99, delta=0.02)
        self.assertAlmostEqual(report["last"]["y_m"], 0, delta=0.02)
        self.assertIn("--sensor-pose", outcome.err)

    def test_a_calibration_says_where_the_sensor_sits(self):
        self.write()
        (self.folder / "calibration.yaml").write_text(
            "format: waymark-calibration-1\nvalues:\n  mounting_y_m: {value: 0.3, sigma: 0.002, verdict: known}\n")
        outcome = self.run_here("localize", "seen.csv", "moved.csv", "--map", "landmarks.csv", "--sensor-pose", 0.1, 0, 0,
                                "--calibration", "calibration.yaml", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (report,) = outcome.records
        self.assertAlmostEqual(report["last"]["x_m"], 0.02 * 99 - 0.1, delta=0.02)
        self.assertAlmostEqual(report["last"]["y_m"], -0.3, delta=0.02)

    def test_what_cannot_work_is_said(self):
        self.write()
        empty = self.folder / "empty.csv"
        empty.write_text("t_s,landmark,range_m,bearing_rad\n")
        outcome = self.run_here("localize", "empty.csv", "--map", "landmarks.csv")
        self.assertEqual(outcome.code, 1)
        self.assertIn("neither tags nor motion", outcome.err)
        outcome = self.run_here("localize", "moved.csv", "--map", "landmarks.csv")
        self.assertEqual(outcome.code, 1)
        self.assertIn("neither tags nor landmark observations", outcome.err)
        self.assertEqual(self.run_here("localize", "seen.csv", "--map", "nowhere.csv").code, 1)
        self.write(landmarks=((7, 3, 1), (8, 3, -1)))
        outcome = self.run_here("localize", "seen.csv", "moved.csv", "--map", "landmarks.csv")
        self.assertEqual(outcome.code, 1)
        self.assertIn("none of the observed tags is in the map", outcome.err)
        self.write(landmarks=((1, 3, 1), (2, 30, -1), (3, -50, 9)))
        outcome = self.run_here("localize", "seen.csv", "moved.csv", "--map", "landmarks.csv")
        self.assertEqual(outcome.code, 1)
        self.assertIn("agreed", outcome.err)


@unittest.skipUnless(os.environ.get("WAYMARK_DATA"), "WAYMARK_DATA is not set")
class RealLogs(InFolder):
    def test_an_mbot_whose_map_has_two_tags_swapped(self):
        data = pathlib.Path(os.environ["WAYMARK_DATA"]) / "lcm"
        outcome = self.run_here("localize", data / "lcmlog-2024-04-15.00", "--map", data / "landmarks.csv", "--robot", "mbot",
                                "-o", "mbot.mcap", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (report,) = outcome.records
        self.assertIn("tag 5 and tag 6 are swapped", report["problems"][0])
        # The robot's file guesses where the camera sits: calibration finds it 2 cm further ahead and to the right.
        for problem in report["problems"][1:]:
            self.assertRegex(problem, "wrong sensor mounting|accounts for this")
        self.assertGreater(report["duration_s"], 180)


if __name__ == "__main__":
    unittest.main()
