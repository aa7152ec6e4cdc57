#!/usr/bin/python3
"""`waymark samples`: other verbs read its files and find the ground truth.

usage: samples_test.py PROGRAM [FOLDER] [unittest options]     FOLDER: where the samples stay, for the labs' test
"""
import json
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

FOLDER = pathlib.Path(sys.argv.pop(2)).resolve() if len(sys.argv) > 2 and not sys.argv[2].startswith("-") else None

from harness import InFolder, waymark  # noqa: E402  it takes the program's name from sys.argv
import golden_page


def same_files(one, other):
    """The names of the files that differ, except summary.json of the map, which contains run times."""
    names = {p.relative_to(one) for p in one.rglob("*") if p.is_file()} | {p.relative_to(other) for p in other.rglob("*") if p.is_file()}
    return sorted(str(n) for n in names if n.name != "summary.json" and
                  not ((one / n).exists() and (other / n).exists() and (one / n).read_bytes() == (other / n).read_bytes()))


class Samples(InFolder):
    @classmethod
    def setUpClass(cls):
        cls.made = FOLDER or pathlib.Path(tempfile.mkdtemp()) / "samples"
        shutil.rmtree(cls.made, ignore_errors=True)
        cls.made.parent.mkdir(parents=True, exist_ok=True)
        cls.outcome = waymark("samples", cls.made, "--json")

    @classmethod
    def tearDownClass(cls):
        if FOLDER is None:
            shutil.rmtree(cls.made.parent)

    def test_the_folder_contains_the_listed_files(self):
        self.assertEqual((self.outcome.code, self.outcome.err), (0, ""))
        (report,) = self.outcome.records
        self.assertEqual(sorted(report["files"]), sorted(p.name for p in self.made.iterdir()))
        text = (self.made / "README.txt").read_text()
        for name in report["files"]:
            self.assertTrue(name == "README.txt" or f"\n{name}: " in text, name)
        self.assertFalse(pathlib.Path(f"{self.made}.part").exists())

    def test_detected_corners_agree_with_the_ground_truth(self):
        truth = json.loads((self.made / "images/truth.json").read_text())
        found = self.run_here("detect", "--json", self.made / "images").records
        self.assertEqual(len(found), 6)
        for image in found:
            right = {tag["tag"]: tag["corners_px"] for tag in truth[pathlib.Path(image["image"]).name]}
            self.assertEqual({d["tag"] for d in image["detections"]}, set(right))
            for seen in image["detections"]:
                apart = [abs(a - b) for s, t in zip(seen["corners_px"], right[seen["tag"]]) for a, b in zip(s, t)]
                self.assertLess(max(apart), 0.5, seen["tag"])

    def test_calibration_estimates_the_camera_model(self):
        outcome = self.run_here("calibrate", "camera", self.made / "calibration", "--cols", 6, "--rows", 5, "--tag-size-m", 0.03, "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        found = outcome.records[0]["parameters"]
        for name, right in (("fx", 612.4), ("fy", 611.1), ("cx", 325.7), ("cy", 236.2)):
            value = found[f"{name}_px"]
            self.assertLess(abs(value["value"] - right), 5 * value["sigma"], f"{name}: {value}")

    def test_both_laps_are_localised_with_the_map(self):
        for lap in ("lap.mcap", "other.mcap"):
            outcome = self.run_here("localize", self.made / lap, "--map", self.made / "map", "-o", self.folder / lap, "--json")
            self.assertEqual(outcome.code, 0, outcome.err)

    def test_existing_files_are_not_overwritten(self):
        (self.folder / "mine").mkdir()
        (self.folder / "mine/lap.mcap").write_text("mine")
        refused = self.run_here("samples", "mine")
        self.assertEqual(refused.code, 1)
        self.assertIn("mine: ", refused.err)
        golden_page.expect(self, "cli", refused.err)
        self.assertFalse((self.folder / "mine.part").exists())
        self.assertEqual((self.folder / "mine/lap.mcap").read_text(), "mine")
        (self.folder / "file").write_text("a file")
        self.assertEqual(self.run_here("samples", "file").code, 1)
        self.assertEqual(self.run_here("samples", "/proc/none").code, 1)
        self.assertEqual(self.run_here("samples").code, 2)

    @unittest.skipUnless("WAYMARK_FULL" in os.environ, "takes long: WAYMARK_FULL")
    def test_the_files_depend_on_the_seed(self):
        for seed in (1, 2):
            self.assertEqual(self.run_here("samples", f"again-{seed}", "--seed", seed).code, 0)
        self.assertEqual(same_files(self.made, self.folder / "again-1"), [])
        self.assertIn("lap.mcap", same_files(self.made, self.folder / "again-2"))


if __name__ == "__main__":
    unittest.main()
