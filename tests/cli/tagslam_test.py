"""`waymark map --tagslam` on TagSLAM's own tests: its cost is reached, nothing fails, ids without a configured tag are
skipped. The four smallest bags; all thirteen with WAYMARK_FULL.

usage: tagslam_test.py PROGRAM [unittest options]
"""
import os
import pathlib
import unittest

from harness import InFolder

SMALL = (1, 16, 22, 24)
ALL = (1, 2, 3, 4, 6, 7, 10, 15, 16, 18, 21, 22, 24)
TESTS = ALL if os.environ.get("WAYMARK_FULL") else SMALL
TAGS = {1: 4, 2: 13, 3: 13, 4: 4, 6: 35, 7: 9, 15: 18, 16: 5, 18: 14, 21: 23, 22: 2}
COSTS = {1: 404.69, 16: 27.91}  # published with the reference


def data():
    path = pathlib.Path(os.environ.get("WAYMARK_DATA", "/nonexistent")) / "tagslam"
    if path.exists():
        return path
    if os.environ.get("WAYMARK_REQUIRE_DATA"):
        raise AssertionError("WAYMARK_DATA does not hold tagslam")
    raise unittest.SkipTest("WAYMARK_DATA does not hold tagslam")


class Tagslam(InFolder):
    def of(self, number):
        bag = data() / f"test_{2 if number == 3 else number}" / "tag_detections.bag.bz2"
        return bag, "--tagslam", data() / f"test_{number}"

    def test_its_own_cost_is_reached(self):
        for number in TESTS:
            with self.subTest(number=number):
                outcome = self.run_here("map", *self.of(number), "-o", f"same{number}", "--json", "--model", "tagslam",
                                        "--against", data() / f"test_{number}")
                self.assertEqual(outcome.code, 0, outcome.err)
                (summary,) = outcome.records
                self.assertLessEqual(summary["cost"], 1.01 * summary["against"]["cost"])
                if number in COSTS:
                    self.assertAlmostEqual(summary["against"]["cost"], COSTS[number], delta=0.01)

    def test_our_model_maps_every_tag_with_small_residuals(self):
        for number in TESTS:
            with self.subTest(number=number):
                outcome = self.run_here("map", *self.of(number), "-o", f"ours{number}", "--json")
                self.assertEqual(outcome.code, 0, outcome.err)
                (summary,) = outcome.records
                if number in TAGS:
                    self.assertEqual(summary["tags"], TAGS[number])
                self.assertEqual(summary["unconnected_ids"], [])
                self.assertLess(summary["reprojection_median_px"], 1.0)
                self.assertLess(summary["rejected_observations"], 0.3 * summary["observations"])

    def test_ids_without_a_configured_tag_are_skipped(self):
        (summary,) = self.run_here("map", *self.of(4), "-o", "wand", "--json").records
        self.assertEqual((summary["tags"], len(summary["foreign_ids"])), (4, 84))

    def test_written_camera_poses_can_be_read(self):
        self.run_here("map", *self.of(16), "-o", "first")
        again = self.folder / "again"
        again.mkdir()
        for name in ("cameras.yaml", "tagslam.yaml"):
            (again / name).write_bytes((data() / "test_16" / name).read_bytes())
        (again / "camera_poses.yaml").write_bytes((self.folder / "first/camera_poses.yaml").read_bytes())
        bag, _, _ = self.of(16)
        outcome = self.run_here("map", bag, "--tagslam", again, "-o", "second")
        self.assertEqual(outcome.code, 0, outcome.err)
        names = {path.name for path in (self.folder / "second").iterdir()}
        self.assertEqual(names, {"map.yaml", "poses.yaml", "camera_poses.yaml", "trajectory_cam_rig.txt", "summary.json"})

    def test_flags_of_other_sub_verbs_are_refused(self):
        bag, _, folder = self.of(16)
        for flags in (["--tag-size-m", "0.1"], ["--anchor", "tag36h11:0"], ["--extend", "m"], ["--remove", "7"],
                      ["--prior", "m"], ["--method", "chain"], ["--no-estimate-noise"], ["--family", "tag36h11"],
                      ["--find-mounting"], ["--world", "circuit24"], ["--anchor-pose", *"000000"]):
            outcome = self.run_here("map", bag, "--tagslam", folder, "-o", "x", *flags)
            self.assertEqual((outcome.code, outcome.out), (2, ""), flags)
            for part in (f"'{flags[0]}'", "`waymark map scene`", "`waymark map lap`"):
                self.assertIn(part, outcome.err)
            self.assertFalse((self.folder / "x").exists())

    def test_estimated_intrinsics_are_close_to_the_given_ones(self):
        bag, _, folder = self.of(1)
        (held,) = self.run_here("map", bag, "--tagslam", folder, "-o", "held", "--json").records
        (free,) = self.run_here("map", bag, "--tagslam", folder, "-o", "free", "--free-intrinsics", "--json").records
        self.assertNotIn("intrinsics", held)
        self.assertLessEqual(free["reprojection_mean_px"], held["reprojection_mean_px"])
        for name in ("fx", "fy", "cx", "cy"):
            number = free["intrinsics"]["cam0"][name]
            self.assertGreater(number["sigma"], 0)
            self.assertLess(abs(number["value"] / number["given"] - 1), 0.05, name)
        for words in (["map", bag, "--tagslam", folder, "-o", "x", "--free-intrinsics", "--model", "tagslam"],
                      ["map", bag, "-o", "x", "--free-intrinsics"]):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (2, ""), outcome.err)
            self.assertIn("--free-intrinsics", outcome.err)

    def test_a_table_of_detections_is_refused_with_a_reason(self):
        _, _, folder = self.of(16)
        table = self.folder / "tags.csv"
        table.write_text("t_ns,cam,tag,x0,y0,x1,y1,x2,y2,x3,y3,hamming\n1000000,cam0,1,1,2,3,2,3,4,1,4,0\n")
        outcome = self.run_here("map", table, "--tagslam", folder, "-o", "x")
        self.assertEqual((outcome.code, outcome.out), (1, ""), outcome.err)
        self.assertIn("CSV", outcome.err)

    def test_mistakes(self):
        bag, _, folder = self.of(16)
        broken = self.folder / "broken"
        broken.mkdir()
        (broken / "tagslam.yaml").write_text((folder / "tagslam.yaml").read_text())
        (broken / "cameras.yaml").write_text((folder / "cameras.yaml").read_text().replace("/detector/tags", "/nothing"))
        for words, code, part in (
                (["map", bag, "--tagslam", "none", "-o", "x"], 1, "none"),
                (["map", bag, "--tagslam", folder, "-o", "x", "--model", "tagslm"], 2, "'tagslam'?"),
                (["map", "lap.mcap", "--tagslam", folder, "-o", "x"], 1, "lap.mcap"),
                (["map", data() / "test_4/tag_detections.bag.bz2", "--tagslam", broken, "-o", "x"], 1, "/nothing")):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (code, ""), outcome.err)
            self.assertIn(part, outcome.err)
            self.assertFalse((self.folder / "x").exists())


if __name__ == "__main__":
    unittest.main()
