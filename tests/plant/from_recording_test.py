#!/usr/bin/python3
"""`waymark world from-recording` on a drive of the MuJoCo rover: the true parameters of the plant are estimated within a fifth.

    tests/plant/from_recording_test.py build/check/bin/waymark

WAYMARK_FULL=1 also records images, whose blur makes the exposure observable.
"""
import json
import os
import pathlib
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import course
from corner_camera import CornerOptions
from image_camera import ImageOptions
from waymark_runs import Place

PROGRAM = ""
SHARE = 0.2
LATENCY_S = 0.08
TURN_RESPONSE = 0.38  # of the rover in MuJoCo: README.md


def corner_noise_px() -> float:
    """Robust standard deviation of the camera's noise per coordinate, from second differences in time of each tag."""
    errors = CornerOptions().sigma_px * np.random.default_rng(7).standard_t(3, (20000, 3, 4))
    bends = (errors[:, 2] - 2 * errors[:, 1] + errors[:, 0]) / np.sqrt(6)
    bends = (bends - bends.mean(axis=1, keepdims=True)) * np.sqrt(4 / 3)
    return 1.4826 * float(np.median(np.abs(bends - np.median(bends))))


class FromRecording(unittest.TestCase):
    def quantities(self, camera: str) -> dict[str, float | None]:
        """The estimates from a replay, and a check that the estimated world and robot can be driven."""
        with tempfile.TemporaryDirectory() as folder:
            place = Place(PROGRAM, pathlib.Path(folder))
            self.assertEqual(place.teach_fast(["--plant", "mujoco", "--camera", "corners", "--seed", "1"]).code, 0)
            self.assertEqual(place.map().code, 0)
            images = ["--record-images", "raw"] if camera == "images" else []
            drive = place.replay(["--plant", "mujoco", "--camera", camera, "--seed", "2", "--latency-s", str(LATENCY_S)], "-o", "drive.mcap",
                                 *images)
            self.assertEqual(drive.code, 0, drive.err)
            mapped = place.waymark("map", "drive.mcap", "-o", "drive", "--anchor", str(course.ANCHOR), "--tag-size-m", str(course.TAG_SIZE_M))
            self.assertEqual(mapped.code, 0, mapped.err)
            made = place.waymark("world", "from-recording", "drive.mcap", "--map", "drive", "-o", "twin", "--json")
            self.assertEqual(made.code, 0, made.err)
            taught = place.waymark("teach", "--world", "twin/world.yaml", "--robot-file", "twin/robot.yaml", "-o", "twin.mcap")
            self.assertEqual(taught.code, 0, taught.err)
            return made.report["quantities"]

    def near(self, found: float | None, hidden: float, words: str) -> None:
        self.assertIsNotNone(found, words)
        self.assertLess(abs(found - hidden), SHARE * hidden, f"{words}: {found} for {hidden}")

    def test_corners(self) -> None:
        found = self.quantities("corners")
        print(json.dumps(found))
        self.near(found["corner_sigma_px"], corner_noise_px(), "corner noise")
        self.near(found["image_latency_s"], LATENCY_S, "latency")
        self.near(found["miss_probability"], CornerOptions().miss, "missed tags")
        self.near(found["simulation.dynamics.turn_gain"], TURN_RESPONSE, "response to turns")

    @unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "a minute: with WAYMARK_FULL=1")
    def test_images(self) -> None:
        found = self.quantities("images")
        print(json.dumps(found))
        self.near(found["camera.exposure_ms"], 1e3 * ImageOptions().exposure_s, "exposure")
        self.near(found["image_latency_s"], LATENCY_S, "latency")


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main(verbosity=2)
