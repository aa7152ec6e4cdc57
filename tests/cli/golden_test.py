#!/usr/bin/python3
"""Files that released versions wrote are read by this one, and the JSON of its verbs keeps their keys (tests/golden/README.md).

usage: golden_test.py PROGRAM [unittest options]; exit code 77: no version has been released yet
"""
import json
import pathlib
import shutil
import sys
import unittest

from harness import InFolder

GOLDEN = pathlib.Path(__file__).resolve().parent.parent / "golden"
VERSIONS = sorted(folder for folder in GOLDEN.iterdir() if folder.is_dir())


def lost(old, new, place=""):
    """Places in `old` that `new` has not, or has with another type; null stands for any type, and of lists the first entries count."""
    if isinstance(old, dict) and isinstance(new, dict):
        return [gone for key in old for gone in (lost(old[key], new[key], f"{place}.{key}") if key in new else [f"{place}.{key}"])]
    if isinstance(old, list) and isinstance(new, list):
        return lost(old[0], new[0], f"{place}[0]") if old and new else []
    numbers = (int, float)
    same = old is None or new is None or type(old) is type(new) or (isinstance(old, numbers) and isinstance(new, numbers) and not isinstance(old, bool))
    return [] if same else [f"{place}: {type(old).__name__} became {type(new).__name__}"]


class Golden(InFolder):
    def test_the_comparison_finds_what_is_lost(self):
        self.assertEqual(lost({"a": [{"b": 1}], "c": "x", "d": 1}, {"a": [{"b": "1"}], "d": 2.5}), [".a[0].b: int became str", ".c"])

    def test_recordings_and_maps_of_released_versions(self):
        for version in VERSIONS:
            with self.subTest(version=version.name):
                shutil.rmtree(self.folder / "map", ignore_errors=True)
                shutil.copytree(version / "map", self.folder / "map")
                shutil.copy(version / "lap.mcap", self.folder / "lap.mcap")
                verbs = {
                    "info": ["info", "lap.mcap"],
                    "localize": ["localize", "lap.mcap", "--map", "map/map.yaml", "-o", "estimate.mcap"],
                    "evaluate": ["evaluate", "estimate.mcap", "lap.mcap"],
                    "map": ["map", "lap.mcap", "-o", "again"],
                    "replay": ["replay", "map", "--robot", "sim", "--world", "mbot-square", "--seed", "5", "-o", "drive.mcap"],
                }
                found = {}
                for verb, words in verbs.items():
                    outcome = self.run_here(*words, "--json")
                    self.assertEqual(outcome.code, 0, f"{verb}: {outcome.err}")
                    (found[verb],) = outcome.records
                    old = json.loads((version / "json" / f"{verb}.json").read_text(encoding="utf-8"))
                    self.assertEqual(lost(old, found[verb]), [], f"{verb} --json")
                old = json.loads((version / "json/info.json").read_text(encoding="utf-8"))
                for key in ("messages", "duration_s", "complete", "profile"):
                    self.assertEqual(found["info"][key], old[key], key)
                self.assertLess(found["evaluate"]["ate_rmse_m"], 0.02)
                self.assertTrue(found["replay"]["finished"])
                self.assertEqual(self.run_here("localize", "lap.mcap", "--map", "again/map.yaml", "-o", "second.mcap").code, 0)


if __name__ == "__main__":
    outcome = unittest.main(exit=False).result
    sys.exit(1 if not outcome.wasSuccessful() else 0 if VERSIONS else 77)
