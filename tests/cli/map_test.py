#!/usr/bin/python3
"""`waymark map` on the command line.

usage: map_test.py PROGRAM [unittest options]
"""
import json
import pathlib
import re
import resource
import shutil
import unittest
import xml.etree.ElementTree

import images
from laps import MAP, MAP_KEYS, OTHER_LAP, WithLap, made, put
import golden_page

MAP_FILES = {"map.yaml", "route.yaml", "trajectory.txt", "trajectory_covariance.csv", "truth_trajectory.txt",
             "robot.yaml", "odometry.yaml", "summary.json", "map.svg", "before_after.svg", "error.svg", "tags_in_view.svg"}


class Map(WithLap):
    def test_a_map_and_its_errors(self):
        outcome = self.run_here("map", "lap.mcap", "-o", "map", "--json")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        (summary,) = outcome.records
        self.assertLessEqual(MAP_KEYS, summary.keys())
        self.assertEqual((summary["method"], summary["tags"], summary["route_closed"]), ("bundle", 24, True))
        self.assertLess(summary["tag_rmse_m"], 0.03)
        self.assertLess(summary["tag_orientation_rmse_deg"], 1)
        self.assertLess(summary["trajectory_rmse_m"], 0.03)
        self.assertGreater(summary["corner_noise_ratio"], 0.9)
        self.assertLess(summary["corner_noise_ratio"], 1.1)
        (chain,) = self.run_here("map", "lap.mcap", "-o", "chain", "--method", "chain", "--json").records
        self.assertEqual(chain["method"], "chain")
        self.assertIsNone(chain["corner_noise_ratio"])
        self.assertLess(summary["trajectory_rmse_m"], chain["trajectory_rmse_m"])
        self.assertEqual({p.name for p in (self.folder / "map").iterdir()}, MAP_FILES)
        for svg in (self.folder / "map").glob("*.svg"):
            self.assertTrue(xml.etree.ElementTree.parse(svg).getroot().tag.endswith("svg"))
        for name in ("trajectory.txt", "truth_trajectory.txt"):
            lines = [line for line in (self.folder / "map" / name).read_text().splitlines() if not line.startswith("#")]
            self.assertTrue(all(len(line.split()) == 8 for line in lines))
            self.assertGreater(len(lines), 800)

    def test_tags_of_several_sizes(self):
        world = (pathlib.Path(__file__).resolve().parents[2] / "share/worlds/circuit24.yaml").read_text()
        (self.folder / "sizes.yaml").write_text(re.sub(r"({id: 5,[^}]*)}", r"\1, size_m: 0.12}", world))
        self.assertEqual(self.run_here("teach", "--world", "sizes.yaml", "-o", "sizes.mcap").code, 0)
        outcome = self.run_here("map", "sizes.mcap", "-o", "sizes", "--json")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        self.assertLess(outcome.records[0]["tag_max_m"], 0.02)
        self.assertEqual((self.folder / "sizes/map.yaml").read_text().count("size_m: 0.12"), 1)
        by_hand = ("map", "sizes.mcap", "--json", "--tag-size-m", "0.16", "--tag-size-m", "5=0.16")
        wrong = self.run_here(*by_hand, "-o", "wrong", "--tag-size-sigma-percent", "0")
        self.assertGreater(wrong.records[0]["tag_max_m"], 0.1, "a size given by hand overrides the recording")
        found = self.run_here(*by_hand, "-o", "found")
        self.assertIn("tag36h11:5: its observations fit a side of 0.12", found.err)
        self.assertEqual([(size["tag"], size["given_m"]) for size in found.records[0]["wrong_sizes"]], [("tag36h11:5", 0.16)])
        self.assertAlmostEqual(found.records[0]["wrong_sizes"][0]["found_m"], 0.12, delta=0.003 * 0.12)
        self.assertLess(found.records[0]["tag_max_m"], 0.02)
        self.assertEqual((self.folder / "found/map.yaml").read_text().count("size_m: 0.12"), 1)

    def test_an_older_map_is_kept(self):
        shutil.copytree(made(*MAP) / "map", self.folder / "twice")
        for size in (["--tag-size-m", "0.17"], []):
            self.run_here("map", "lap.mcap", "-o", "twice", *size)
        names = {p.name for p in (self.folder / "twice").iterdir()}
        self.assertLessEqual({"map.1.yaml", "map.2.yaml", "route.1.yaml", "route.2.yaml"}, names)
        first, second, last = ((self.folder / "twice" / name).read_text() for name in ("map.1.yaml", "map.2.yaml", "map.yaml"))
        self.assertEqual(first, last)
        self.assertNotEqual(first, second)

    def test_existing_files_in_the_folder_are_renamed(self):
        put(self.folder, *MAP)
        (self.folder / "map/robot.yaml").write_text("# mine\n")
        (self.folder / "map/notes.txt").write_text("mine")
        self.run_here("optimize", "map", "--name", "best")
        was = {p.name: p.read_bytes() for p in (self.folder / "map").iterdir()}
        self.run_here("convert", "lap.mcap", "blind.mcap", "--topics", "/tag_detections,/odom,/camera_info,/tf_static")
        again = self.run_here("map", "blind.mcap", "-o", "map", "--method", "chain", "--tag-size-m", 0.16, "--anchor", 0)
        self.assertEqual(again.code, 0, again.err)
        self.assertIn("map.1.yaml", again.out)
        now = {p.name for p in (self.folder / "map").iterdir() if ".1." not in p.name}
        self.assertEqual(now, {"map.yaml", "route.yaml", "trajectory.txt", "summary.json", "map.svg", "tags_in_view.svg",
                               "robot.yaml", "notes.txt"}, "no file of the older map has a name of the new one")
        for name, data in was.items():
            stem, suffix = name.rsplit(".", 1)
            kept = name == "notes.txt"
            self.assertEqual((self.folder / "map" / (name if kept else f"{stem}.1.{suffix}")).read_bytes(), data, name)
        self.run_here("map", "lap.mcap", "-o", "map")
        self.assertFalse((self.folder / "map/robot.2.yaml").exists(), "an identical robot file is not renamed")
        self.assertTrue((self.folder / "map/map.2.yaml").exists())

    def test_a_map_is_written_completely_or_not_at_all(self):
        self.run_here("map", "lap.mcap", "-o", "map", "--method", "chain")
        before = {p.name: p.read_bytes() for p in (self.folder / "map").iterdir()}
        size = len(before["trajectory.txt"]) // 2  # as on a full disk: map.yaml fits, the trajectory does not
        for folder in ("map", "fresh/folder"):
            full = self.run_here("map", "lap.mcap", "-o", folder,
                                 preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)))
            self.assertEqual(full.code, 1, full.err)
            self.assertIn(f"{folder}/trajectory.txt: ", full.err)
        self.assertEqual({p.name: p.read_bytes() for p in (self.folder / "map").iterdir()}, before)
        self.assertFalse((self.folder / "fresh").exists())
        (self.folder / "file").touch()
        unwritable = self.run_here("map", "none.mcap", "-o", "file/m")
        self.assertIn("file/m: ", unwritable.err)
        self.assertNotIn("none.mcap", unwritable.err, "the output is checked before any work")

    def test_a_folder_with_copies_of_a_recording(self):
        (self.folder / "laps").mkdir()
        data = (self.folder / "lap.mcap").read_bytes()
        (self.folder / "laps/lap.mcap").write_bytes(data)
        (self.folder / "laps/cut.mcap").write_bytes(data[:2 * len(data) // 3])
        self.run_here("recover", "laps/cut.mcap", "-o", "laps/recovered.mcap")
        self.assertTrue((self.folder / "laps/recovered.mcap").exists())
        alone = json.loads((made(*MAP) / "map/summary.json").read_text())
        outcome = self.run_here("map", "laps", "-o", "all", "--json")
        self.assertEqual(outcome.records[0]["frames"], alone["frames"], outcome.err)
        copies = [warning for warning in outcome.records[0]["warnings"] if "laps/lap.mcap" in warning]
        self.assertEqual([warning.split(":")[0] for warning in copies], ["laps/cut.mcap", "laps/recovered.mcap"])
        golden_page.expect(self, "map", outcome.err)
        shutil.copy(made(*OTHER_LAP) / "lap.mcap", self.folder / "laps/another.mcap")
        outcome = self.run_here("map", "laps", "-o", "all")
        self.assertEqual(outcome.code, 1)
        self.assertRegex(outcome.err, r"laps/another\.mcap: .*laps/lap\.mcap")
        golden_page.expect(self, "map", outcome.err)

    def test_differences_from_an_older_map_are_reported(self):
        shutil.copytree(made(*MAP) / "map", self.folder / "old")
        text = (self.folder / "old/map.yaml").read_text()
        swapped = text.replace("tag36h11:5", "A").replace("tag36h11:6", "tag36h11:5").replace("A", "tag36h11:6")
        (self.folder / "old.yaml").write_text(swapped)
        outcome = self.run_here("map", "lap.mcap", "-o", "new", "--prior", "old.yaml")
        self.assertEqual(outcome.code, 0)
        (warning,) = [line for line in outcome.err.splitlines() if "prior" in line]
        self.assertRegex(warning, r"warning: tag36h11:5 .*tag36h11:6")
        golden_page.expect(self, "map", warning)
        self.assertEqual(self.run_here("map", "lap.mcap", "-o", "new", "--prior", "none.yaml").code, 1)

    def test_a_wrong_tag_size_is_reported(self):
        outcome = self.run_here("map", "lap.mcap", "-o", "wrong", "--tag-size-m", "0.2")
        self.assertEqual(outcome.code, 0)
        self.assertRegex(outcome.err, r" 2\d % .*0\.16")

    def test_the_anchor_may_have_any_pose(self):
        plain = json.loads((made(*MAP) / "map/summary.json").read_text())
        (moved,) = self.run_here("map", "lap.mcap", "-o", "there", "--json",
                                 "--anchor-pose", "10", "20", "0.3", "-90", "0", "0").records
        self.assertAlmostEqual(plain["route_length_m"], moved["route_length_m"], 3)
        self.assertIsNone(moved["tag_rmse_m"])

    def test_same_lap_same_bytes(self):
        self.run_here("map", "lap.mcap", "-o", "again")
        for name in MAP_FILES - {"summary.json"}:
            self.assertEqual((made(*MAP) / "map" / name).read_bytes(), (self.folder / "again" / name).read_bytes(), name)

    def test_the_intact_part_of_a_truncated_recording_is_mapped(self):
        data = (self.folder / "lap.mcap").read_bytes()
        (self.folder / "cut.mcap").write_bytes(data[:len(data) // 2])
        outcome = self.run_here("map", "cut.mcap", "-o", "half", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (summary,) = outcome.records
        self.assertLess(summary["tags"], 24)
        self.assertFalse(summary["route_closed"])
        self.assertRegex(summary["warnings"][0], r"^cut\.mcap at byte \d+: ")
        golden_page.expect(self, "map", outcome.err)

    def test_another_anchor_moves_the_map_and_is_not_compared(self):
        (summary,) = self.run_here("map", "lap.mcap", "-o", "map5", "--anchor", "5", "--json").records
        self.assertIsNone(summary["tag_rmse_m"])
        golden_page.expect(self, "map", "\n".join(summary["warnings"]))
        self.assertIn('anchor: "tag36h11:5"', (self.folder / "map5/map.yaml").read_text())

    def test_a_line_without_a_sub_verb_chooses_one(self):
        (self.folder / "walk.bin").write_bytes(b"\0\0\0\x18ftypmp42")
        for words, chosen in ((["lap.mcap"], "lap"), (["lap.mcap", "--robot", "limo"], "lap"), (["none.mp4"], "video"), (["-o", "map"], "lap"),
                              (["walk.bin"], "video"), (["-o", "map", "walk.bin", "lap.mcap"], "video"), (["lap.mcap", "--camera", "c.yaml"], "video"),
                              (["lap.mcap", "--camera=c.yaml"], "video"), (["lap.mcap", "--tagslam", "config"], "scene"),
                              (["--tagslam=config", "--camera", "c.yaml", "walk.bin"], "scene"), (["convert", "map", "x"], "convert")):
            outcome = self.run_here("map", *words, "--help")
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertIn(f"Usage: waymark map {chosen} ", outcome.out, words)
        for flag in ("--help", "--help-all"):
            self.assertIn("Usage: waymark map [", self.run_here("map", flag).out, "the list of sub-verbs")
        same = self.run_here("map", "lap", "lap.mcap", "-o", "same", "--json")
        self.assertEqual((same.code, same.err), (0, ""))
        self.assertEqual((self.folder / "same/map.yaml").read_bytes(), (made(*MAP) / "map/map.yaml").read_bytes())

    def test_the_lap_of_a_robot_is_no_video(self):
        (self.folder / "camera.yaml").write_text(images.CAMERA)
        for words in (["map", "lap.mcap", "-o", "m", "--camera", "camera.yaml", "--tag-size-m", "0.16"], ["map", "video", "lap.mcap", "-o", "m"]):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (2, ""), outcome.err)
            self.assertIn("(lap.mcap): ", outcome.err)
            self.assertNotIn("--robot", outcome.err)

    def test_mistakes(self):
        (self.folder / "bad.yaml").write_text("name: x\n")
        (self.folder / "file").touch()
        for words, code, part in (
                (["none.mcap", "-o", "m"], 1, "none.mcap"),
                (["photograph.png", "-o", "m"], 1, "`waymark detect photograph.png`"),
                (["lap.mcap"], 2, "--output"),
                (["-o", "m"], 2, "LAP"),
                (["lap.mcap", "-o", "m", "--tag-size-m", "0"], 2, "'0'"),
                (["lap.mcap", "-o", "m", "--method", "chian"], 2, "'chain'?"),
                (["lap.mcap", "-o", "m", "--anchor-pose", "0", "0", "nan", "0", "0", "0"], 2, "--anchor-pose"),
                (["lap.mcap", "-o", "m", "--anchor-pose", "0", "0"], 2, "--anchor-pose"),
                (["lap.mcap", "-o", "m", "--anchor-pose", "1e15", "0", "0", "-90", "0", "0"], 2, "10 km"),
                (["lap.mcap", "-o", "m", "--anchor-pose", "0", "0", "0.3", "0", "0", "0"], 1, "roll -90"),
                (["lap.mcap", "-o", "m", "--anchor", "99"], 1, "tag36h11:99"),
                (["lap.mcap", "-o", "m", "--anchor", "tag36h12:1"], 2, "tag36h12"),
                (["lap.mcap", "-o", "m", "--tag-size-m", "-1"], 2, "'-1'"),
                (["lap.mcap", "-o", "m", "--step-m", "9"], 2, "(--step-m): 9 "),
                (["lap.mcap", "-o", "m", "--world", "bad.yaml"], 1, "bad.yaml:1 (tag_family): "),
                (["lap.mcap", "-o", "file/m"], 1, "file/m: ")):
            outcome = self.run_here("map", *words)
            self.assertEqual((outcome.code, outcome.out), (code, ""), outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "map", outcome.err)


if __name__ == "__main__":
    unittest.main()
