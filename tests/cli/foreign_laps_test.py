#!/usr/bin/python3
"""Laps as other robots record them: two clocks, odometry only in transforms, a robot that moves sideways; and a lap too close to a tag.

usage: foreign_laps_test.py PROGRAM [unittest options]

The laps are simulated without Waymark (tests/support/room_lap.py).
"""
import math
import pathlib
import re
import sys
import unittest

from harness import InFolder
import golden_page

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import ros2_bag as bag  # noqa: E402
import room_lap  # noqa: E402

TAGS = ["--tag-size-m", room_lap.TAG_SIZE_M, "--anchor", 0]
GOOD_M = 0.03  # root mean square error of the tags of a good map
WALL_CLOCK_S = room_lap.START_NS // 10**9


class ForeignLap(InFolder):
    def record(self, name, **how):
        bag.write(self.folder / name, room_lap.lap(**how))
        return name

    def map(self, lap, folder="map"):
        outcome = self.run_here("map", lap, *TAGS, "-o", folder, "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (report,) = outcome.records
        return report, outcome.err

    def tags_rmse_m(self, folder="map"):
        text = (self.folder / folder / "map.yaml").read_text()
        found = {}
        for entry in text.split("- tag:")[1:]:
            number = int(re.search(r"tag36h11:(\d+)", entry).group(1))
            found[number] = [float(v) for v in re.search(r"position_m: \[(.*?)\]", entry).group(1).split(",")]
        errors = room_lap.tag_errors_m(found)
        return math.sqrt(sum(e * e for e in errors) / len(errors))

    def route(self, folder="map"):
        """(x, y, yaw) of the points."""
        lines = (self.folder / folder / "route.yaml").read_text().splitlines()
        rows = [[float(v) for v in line[5:-1].split(",")] for line in lines if line.startswith("  - [")]
        return [(x, y, yaw) for _, x, y, yaw, *_ in rows]

    def trajectory(self, folder="map"):
        """(x, y, yaw) of the poses."""
        poses = []
        for line in (self.folder / folder / "trajectory.txt").read_text().splitlines():
            if line.startswith("#"):
                continue
            _, x, y, _, qx, qy, qz, qw = map(float, line.split())
            poses.append((x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))))
        return poses


class TwoClocks(ForeignLap):
    """Odometry by simulated time, images by the wall clock."""

    def setUp(self):
        super().setUp()
        self.two = self.record("two_clocks.db3", motion_ahead_s=-WALL_CLOCK_S, blind_s=(14, 19))

    def test_one_clock_is_not_reported(self):
        report, err = self.map(self.record("one_clock.db3"))
        self.assertEqual(report["odometry"], "/odom")
        self.assertLess(self.tags_rmse_m(), GOOD_M)
        self.assertAlmostEqual(report["odometry_distance_scale"], 1 / 1.01, delta=0.01)
        self.assertNotIn("clock", err)

    def test_map_does_not_use_the_odometry(self):
        report, err = self.map(self.two)
        self.assertEqual(report["odometry"], "")
        named = [w for w in report["warnings"] if f"{WALL_CLOCK_S} s" in w]
        self.assertEqual(len(named), 1, report["warnings"])
        self.assertIn(named[0], err)
        self.assertFalse([w for w in report["warnings"] if "odometry alone" in w], "odometry was not used")
        self.assertLess(self.tags_rmse_m(), GOOD_M)
        golden_page.expect(self, "map", err)

    def test_localize_does_not_use_the_odometry(self):
        self.map(self.record("one_clock.db3"))
        outcome = self.run_here("localize", self.two, "--map", "map", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (report,) = outcome.records
        self.assertLess(report["duration_s"], room_lap.LAP_S * room_lap.LAPS)
        self.assertLess(report["first_fix_s"], 5)
        self.assertIn(f"{WALL_CLOCK_S} s", outcome.err)
        self.assertNotIn("mounting", outcome.err + " ".join(report["problems"]), "the mounting is right")

    def test_calibrate_refuses_it(self):
        outcome = self.run_here("calibrate", "robot", self.two, *TAGS[:2], "-o", "calibration.yaml")
        self.assertEqual(outcome.code, 1)
        self.assertIn(f"{self.two}: ", outcome.err)
        self.assertIn(f"{WALL_CLOCK_S} s", outcome.err)
        self.assertFalse((self.folder / "calibration.yaml").exists())

    def test_info_names_it(self):
        (report,) = self.run_here("info", self.two, "--json").records
        (trap,) = [t for t in report["traps"] if t["key"] == "clocks"]
        self.assertIn(f"{WALL_CLOCK_S} s", trap["message"])


class OdometryInTransforms(ForeignLap):
    def test_it_is_used_and_named(self):
        lap = self.record("transforms.db3", topic=False, transforms=True)
        report, err = self.map(lap)
        self.assertEqual(report["odometry"], "/tf (odom to base_link)")
        self.assertIn("/tf (odom to base_link)", err)
        self.assertAlmostEqual(report["odometry_distance_scale"], 1 / 1.01, delta=0.01)
        self.assertLess(self.tags_rmse_m(), GOOD_M)
        (info,) = self.run_here("info", lap, "--json").records
        self.assertEqual(info["odometry"], "/tf (odom to base_link)")
        self.assertIn("odometry", info["contents"])
        outcome = self.run_here("localize", lap, "--map", "map", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertGreater(outcome.records[0]["certain"], 0.9 * outcome.records[0]["estimates"])

    def test_a_topic_takes_precedence(self):
        both, _ = self.map(self.record("both.db3", transforms=True), "both")
        topic, _ = self.map(self.record("topic.db3"), "topic")
        self.assertEqual(both["odometry"], "/odom")
        self.assertEqual(self.route("both"), self.route("topic"))

    def test_a_lap_without_odometry_is_reported(self):
        report, _ = self.map(self.record("none.db3", topic=False))
        self.assertEqual(report["odometry"], "")
        self.assertTrue([w for w in report["warnings"] if "odometry" in w], report["warnings"])
        golden_page.expect(self, "map", "\n".join(report["warnings"]))


class Sideways(ForeignLap):
    def assert_taught_headings(self):
        poses = self.trajectory()
        for x, y, yaw in self.route():
            nearest = min(poses, key=lambda pose, x=x, y=y: math.hypot(pose[0] - x, pose[1] - y))
            self.assertLess(abs(math.remainder(yaw - nearest[2], 2 * math.pi)), math.radians(5))

    def test_a_mecanum_robot_that_moves_to_its_left(self):
        report, err = self.map(self.record("mecanum.db3", turned_rad=-math.pi / 2))
        self.assertLess(self.tags_rmse_m(), GOOD_M)
        self.assertAlmostEqual(report["route_sideways_deg"], 90, delta=5)
        self.assert_taught_headings()
        self.assertTrue(report["route_closed"])
        outcome = self.run_here("replay", "map", "--robot", "sim", "--world", "circuit24", "-o", "replay.mcap")
        self.assertEqual((outcome.code, outcome.out), (1, ""), outcome.err)
        self.assertIn("map/route.yaml", outcome.err)
        refusal = outcome.err
        self.assertFalse((self.folder / "replay.mcap").exists())
        outcome = self.run_here("optimize", "map", "--name", "fast")
        self.assertEqual(outcome.code, 1, outcome.out)
        self.assertIn("map/route.yaml", outcome.err)
        golden_page.expect(self, "map", err + refusal)

    def test_a_small_angle_is_kept_and_allowed(self):
        report, _ = self.map(self.record("turned.db3", turned_rad=math.radians(15)))
        self.assertNotIn("route_sideways_deg", report)
        self.assert_taught_headings()

    def test_a_robot_that_faces_ahead(self):
        report, err = self.map(self.record("ahead.db3"))
        self.assertNotIn("route_sideways_deg", report)
        self.assertNotIn("sideways", err)
        self.assert_taught_headings()


class TooCloseToATag(InFolder):
    """A corridor with a tag 0.10 m beside the hull of the robot, which is 0.22 m wide."""

    WORLD = """name: narrow
tag_family: tag36h11
tag_size_m: 0.16
anchor_id: 0
tags:
  - {id: 0, x_m: 4, y_m: 0.4, z_m: 0.3, facing_deg: 180}
  - {id: 1, x_m: 4, y_m: -0.4, z_m: 0.3, facing_deg: 180}
  - {id: 2, x_m: 4, y_m: 0, z_m: 0.5, facing_deg: 180}
  - {id: 3, x_m: 1.6, y_m: SIDE, z_m: 0.2, facing_deg: 270}
path_closed: false
path_m: [[0, 0], [0.9, 0], [1.8, 0], [2.7, 0]]
"""

    def teach_and_map(self, side_m):
        (self.folder / "narrow.yaml").write_text(self.WORLD.replace("SIDE", str(side_m)))
        taught = self.run_here("teach", "--world", "narrow.yaml", "--wander-m", 0, "-o", "lap.mcap", "--json")
        self.assertTrue(taught.records, taught.err)
        mapped = self.run_here("map", "lap.mcap", "-o", "map", "--json")
        self.assertEqual(mapped.code, 0, mapped.err)
        return taught.records[0], mapped.records[0]

    def replay(self, *words):
        return self.run_here("replay", "map", "--robot", "sim", "--world", "narrow.yaml", "--json", *words)

    def test_teach_and_map_report_what_replay_stops_at(self):
        taught, mapped = self.teach_and_map(0.21)
        self.assertAlmostEqual(taught["min_clearance_m"], 0.10, delta=0.03)
        self.assertAlmostEqual(mapped["route_clearance_m"], 0.10, delta=0.02)
        for report in (taught, mapped):
            named = [w for w in report["warnings"] if "tag36h11:3 " in w and "0.15 m" in w]
            self.assertEqual(len(named), 1, report["warnings"])
        outcome = self.replay()
        self.assertEqual(outcome.code, 1)
        self.assertIn("(limit 0.15 m)", outcome.records[0]["reason"])
        self.assertIn("tag36h11:3", outcome.err, "reported before the drive")
        outcome = self.replay("--min-clearance-m", 0.03)
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertNotIn("tag36h11:3", outcome.err)

    def test_a_tag_at_a_distance_is_not_reported(self):
        taught, mapped = self.teach_and_map(0.36)
        self.assertGreater(taught["min_clearance_m"], 0.2)
        self.assertGreater(mapped["route_clearance_m"], 0.2)
        for report in (taught, mapped):
            self.assertFalse([w for w in report["warnings"] if "tag36h11:3 " in w], report["warnings"])
        self.assertEqual(self.replay().code, 0)


if __name__ == "__main__":
    unittest.main()
