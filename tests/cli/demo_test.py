#!/usr/bin/python3
"""`waymark demo`.

usage: demo_test.py PROGRAM [unittest options]
"""
import pathlib
import unittest

from harness import InFolder
from laps import LAP, MAP, MAP_KEYS, REPLAY_KEYS, put
import golden_page

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Demo(InFolder):
    def test_the_loop_in_one_command(self):
        outcome = self.run_here("demo", "--seed", 4, "-o", "out", "--json")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        (report,) = outcome.records
        self.assertLessEqual(MAP_KEYS, report["map"].keys())
        self.assertLessEqual(REPLAY_KEYS, report["replay"].keys())
        self.assertEqual(report["replay"]["laps_completed"], 1)
        for path in report["figures"]:
            data = (self.folder / path).read_bytes()
            self.assertTrue(data.startswith(b"\x89PNG") if path.endswith(".png") else b"<svg" in data, path)
        (thrice,) = self.run_here("demo", "--seed", 4, "-o", "thrice", "--laps", 3, "--json").records
        self.assertEqual(thrice["replay"]["laps_completed"], 3)
        table = self.run_here("demo", "--seed", 4, "-o", "out")
        self.assertEqual(table.code, 0, "a second run overwrites its own files")
        put(self.folder / "mine", *LAP)
        refused = self.run_here("demo", "-o", "mine")
        self.assertEqual(refused.code, 1, "only its own files are overwritten")
        self.assertIn("'lap.mcap'", refused.err)
        golden_page.expect(self, "session", refused.err)
        put(self.folder, *MAP)
        before = {p.name: p.read_bytes() for p in (self.folder / "map").iterdir()}
        refused = self.run_here("demo", "-o", "map")
        self.assertEqual(refused.code, 1)
        self.assertIn("'map.yaml'", refused.err)
        self.assertEqual({p.name: p.read_bytes() for p in (self.folder / "map").iterdir()}, before)
        for words in (["--port", 9000], ["--listen", "0.0.0.0"], ["--open"], ["--token", "a-word-that-is-long"]):
            lonely = self.run_here("demo", "-o", "none", *words)
            self.assertEqual(lonely.code, 2, lonely.err)
            self.assertIn(words[0], lonely.err)
            self.assertIn("--view", lonely.err)
        for part in ("teach", "map", "replay", "rmse"):
            self.assertIn(part, table.out)

    def test_images_are_recorded(self):
        world = (ROOT / "share/worlds/circuit24.yaml").read_text().split("path_closed:")[0]
        (self.folder / "short.yaml").write_text(world + "path_closed: false\npath_m: [[2.89, -0.98], [3.04, -0.4], [3.02, 0.2]]\n")
        outcome = self.run_here("demo", "--world", "short.yaml", "--images", "-o", "out")
        self.assertEqual(outcome.code, 0, outcome.err)
        for name in ("lap.mcap", "replay.mcap"):
            (info,) = self.run_here("info", "--json", f"out/{name}").records
            self.assertIn("images", info["contents"], f"{name} contains images")


if __name__ == "__main__":
    unittest.main()
