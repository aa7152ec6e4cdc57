#!/usr/bin/python3
"""`waymark calibrate robot` on generated drives with a wrong camera mounting, focal length and latency: the error of each parameter over its
standard deviation, over drives. For consistent standard deviations its RMS is 1.

    tests/plant/calibration_test.py build/check/bin/waymark

WAYMARK_FULL=1 uses 50 drives instead of one (WAYMARK_DRIVES sets their number, WAYMARK_FIRST_SEED the first), each with newly printed tags, because
the errors of one set of tags are the same in all drives past it; and also calibrates by innovations.
"""
import collections
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import body
import kinematic_plant
import sensors

GENERATE = pathlib.Path(__file__).resolve().parent / "generate_log.py"
PROGRAM = ""
FULL = os.environ.get("WAYMARK_FULL") is not None
DRIVES = int(os.environ.get("WAYMARK_DRIVES", 50)) if FULL else 1
FIRST_SEED = int(os.environ.get("WAYMARK_FIRST_SEED", 1))
ONE_SIDED_DRIVES, ONE_SIDED_RATE_HZ = (20, "15") if FULL else (4, "7.5")
# The point about which the robot turns, which is the calibrated base.
PIVOT_M = kinematic_plant.KinematicOptions().pivot_m
CAMERA_M = {"mounting_x_m": body.Camera().x_m - PIVOT_M, "mounting_y_m": body.Camera().y_m, "mounting_z_m": body.Camera().z_m}
# The goal. Over n drives the RMS of a consistent parameter has a standard deviation of 1 / sqrt(2 n), of which two are allowed.
SMALLEST_RMS, LARGEST_RMS = 0.9, 1.15
ENOUGH_DRIVES = 10
LARGEST_OF_ONE = 4.0
MIN_OBSERVABLE_SHARE = 0.8  # of the drives; nothing is written if the estimates do not fit the held-out third better
MAX_CALLED_MOVED = 0.5  # of 24 tags, none of which was; mean of the drives


def calibrated(seed: int, by: str, folder: pathlib.Path, *course: str) -> tuple[dict[str, tuple[float, float]], str]:
    """Error and stated standard deviation of each observable parameter of the drive, and the messages."""
    rng = np.random.default_rng([seed, 11])
    moved = np.clip(rng.standard_normal(3), -2, 2) * 0.01
    turned_deg = np.clip(rng.standard_normal(3), -2, 2) * 1.0
    latency_s, focal = float(rng.uniform(0, 0.06)), float(1 + 0.01 * rng.standard_normal())
    subprocess.run(["/usr/bin/python3", str(GENERATE), str(folder), "--seed", str(seed), "--speeds", "0.25", "0.55", "--latency-s", f"{latency_s:.6f}",
                    "--focal-scale", f"{focal:.6f}", "--printing", str(seed), "--mounting", *(f"{offset:.6f}" for offset in (*moved, *turned_deg)), *course],
                   check=True)
    logs = [str(folder / f"{name}.csv") for name in ("detections", "odometry", "imu")]
    done = subprocess.run([PROGRAM, "calibrate", "robot", *logs, "--map", str(folder / "map.yaml"), "--robot", str(folder / "robot.yaml"), "--by", by,
                           "-o", str(folder / "calibration.yaml"), "--json"], capture_output=True, text=True, check=False)
    if done.returncode != 0 and "nothing was written" in done.stderr:
        return {}, done.stderr
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
    truth = {name: CAMERA_M[name] + off for name, off in zip(CAMERA_M, moved)}
    truth |= {f"mounting_{axis}_rad": math.radians(angle) for axis, angle in zip(("roll", "pitch", "yaw"), turned_deg)}
    truth |= {"camera_latency_s": latency_s, "focal_scale": focal, "odometry_scale": length(folder / "truth.csv") / length(folder / "odometry.csv"),
              "yaw_scale": 1 / sensors.SensorOptions().gyro_scale}
    found = json.loads(done.stdout)["values"]
    return {name: (number["value"] - truth[name], number["sigma"]) for name, number in found.items()
            if name in truth and number.get("verdict", "known") == "known"}, done.stderr


def length(table: pathlib.Path) -> float:
    way = np.loadtxt(table, delimiter=",", skiprows=1)
    return float(np.hypot(np.diff(way[:, 1]), np.diff(way[:, 2])).sum())


class Numbers(unittest.TestCase):
    def check(self, by: str, always_observable: set[str]) -> None:
        scores = collections.defaultdict(list)
        called_moved = observable = 0
        for seed in range(FIRST_SEED, FIRST_SEED + DRIVES):
            with tempfile.TemporaryDirectory() as folder:
                found, words = calibrated(seed, by, pathlib.Path(folder))
            observable += 1 if found else 0
            called_moved += words.count("it was moved")
            for name, (error, sigma) in found.items():
                scores[name].append(error / sigma)
                print(f"{by}, seed {seed}: {name} {error:+.5f} +- {sigma:.5f}", flush=True)
        print(f"{by}: {observable} of {DRIVES} drives had an observable parameter, {called_moved / DRIVES:.2f} tags per drive called moved", flush=True)
        for name, values in scores.items():
            print(f"{by}: {name}: RMS {rms(values):.2f}, mean {np.mean(values):+.2f} deviations, {len(values)} drives", flush=True)
        self.assertGreaterEqual(observable, MIN_OBSERVABLE_SHARE * DRIVES)
        self.assertLess(called_moved, MAX_CALLED_MOVED * DRIVES)
        for name, values in scores.items():
            chance = 2 / math.sqrt(2 * len(values))
            enough = len(values) >= ENOUGH_DRIVES
            with self.subTest(name):
                self.assertLess(rms(values), LARGEST_RMS + chance if enough else LARGEST_OF_ONE)
                if enough and name in always_observable:
                    self.assertGreater(rms(values), SMALLEST_RMS - chance)
        self.assertLessEqual(always_observable, set(scores))

    def test_the_turning_scale_of_one_sided_bends_is_consistent(self) -> None:
        """A constant gyro bias and a wrong scale are nearly indistinguishable there, and the bias drifts."""
        scores = []
        for seed in range(FIRST_SEED, FIRST_SEED + ONE_SIDED_DRIVES):
            with tempfile.TemporaryDirectory() as folder:
                found, _ = calibrated(seed, "lap", pathlib.Path(folder), "--one-sided", "--image-rate-hz", ONE_SIDED_RATE_HZ)
            if "yaw_scale" in found:
                error, sigma = found["yaw_scale"]
                scores.append(error / sigma)
                print(f"one-sided, seed {seed}: yaw_scale {error:+.5f} +- {sigma:.5f}", flush=True)
        if scores:
            print(f"one-sided: yaw_scale: RMS {rms(scores):.2f}, {len(scores)} of {ONE_SIDED_DRIVES} drives observe it", flush=True)
            self.assertLess(rms(scores), LARGEST_RMS + 2 / math.sqrt(2 * len(scores)))

    def test_parameters_by_lap_are_consistent(self) -> None:
        self.check("lap", {"mounting_x_m", "mounting_yaw_rad", "mounting_pitch_rad", "mounting_roll_rad", "focal_scale", "yaw_scale"})

    @unittest.skipUnless(FULL, "takes minutes")
    def test_parameters_by_innovations_are_consistent(self) -> None:
        self.check("innovations", {"mounting_pitch_rad", "mounting_roll_rad", "camera_latency_s", "focal_scale"})


def rms(values: list[float]) -> float:
    return math.sqrt(np.mean(np.square(values)))


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
