#!/usr/bin/python3
"""`waymark localize` on generated logs reports wrong parameters and only those, checked by the second judge.

    tests/plant/log_test.py build/check/bin/waymark

WAYMARK_FULL=1 uses 40 correct logs and 20 with each wrong parameter instead of one of each.
"""
import os
import pathlib
import statistics
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import judge
import log_table

FULL = os.environ.get("WAYMARK_FULL") is not None
PROGRAM = ""
REPORTED = 0.95  # of the logs


def localised(case: str, seed: int) -> tuple[judge.TrajectoryErrors, list[str]]:
    with tempfile.TemporaryDirectory() as folder:
        errors, words = log_table.run(PROGRAM, pathlib.Path(folder), log_table.CASES[case], seed)
    print(f"{case}, seed {seed}: RMSE {errors.ate.rmse_m:.4f} m, NEES {errors.nees:.1f} {words}", flush=True)
    return errors, words


class Parameters(unittest.TestCase):
    def expect_report(self, case: str, parameter: str, command: str, nees: float) -> None:
        seeds = range(1, 21 if FULL else 2)
        runs = [localised(case, seed) for seed in seeds]
        right = [any(parameter in line and command in line for line in lines) for _, lines in runs]
        self.assertGreaterEqual(sum(right), REPORTED * len(seeds), f"seeds {[s for s, found in zip(seeds, right) if not found]}")
        self.assertLessEqual(statistics.median(errors.nees for errors, _ in runs), nees)

    def test_nothing_is_reported_for_correct_logs(self) -> None:
        seeds = range(1, 41 if FULL else 2)
        silent = [not localised("nominal: t corners, persistent errors, slip bursts, wandering bias and latency", seed)[1] for seed in seeds]
        self.assertGreaterEqual(sum(silent), REPORTED * len(seeds), f"seeds {[s for s, quiet in zip(seeds, silent) if not quiet]}")

    def test_a_wrong_mounting_is_reported_and_the_covariance_is_consistent(self) -> None:
        self.expect_report("mounting 2 cm, 3 cm, 2 deg off", "mounting", "waymark calibrate robot", 8)

    def test_a_latency_is_estimated_and_used(self) -> None:
        self.expect_report("latency 60 ms, not configured", "latency", "--camera-latency-s", 6)

    def test_frozen_encoders_are_rejected(self) -> None:
        for seed in range(1, 7 if FULL else 2):
            errors, _ = localised("encoders stuck twice for 3 s", seed)
            self.assertLessEqual(errors.nees, 6)
            self.assertLessEqual(errors.ate.rmse_m, 0.012)

    @unittest.skipUnless(FULL, "long")
    def test_the_covariance_is_consistent_for_wrong_tags_stamps_and_slip(self) -> None:
        for case in ("five tags 0.4 m off", "five tags 0.4 m off, all the same way", "stamps up to 30 ms too early or too late",
                     "wheels only, slip bursts", "a duplicate tag id"):
            for seed in range(1, 4):
                errors, _ = localised(case, seed)
                self.assertLessEqual(errors.nees, 6)
                self.assertLessEqual(errors.ate.rmse_m, 0.008)

    @unittest.skipUnless(FULL, "long")
    def test_a_wrong_focal_length_is_reported_and_the_covariance_is_consistent(self) -> None:
        self.expect_report("focal length + 3 %", "focal", "waymark calibrate camera", 8)

    @unittest.skipUnless(FULL, "long")
    def test_unknown_noise_is_estimated(self) -> None:
        for seed in range(1, 6):
            errors, _ = localised("ranges and bearings, noise not configured", seed)
            self.assertLessEqual(errors.nees, 6)
            self.assertLessEqual(errors.ate.rmse_m, 0.06)


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
