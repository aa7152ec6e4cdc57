#!/usr/bin/python3
"""`waymark evaluate EST REF` on the command line; every figure is also computed here by another method.

usage: evaluate_trajectory_test.py PROGRAM [unittest options]
"""
import math
import pathlib
import random
import shutil
import tempfile
import unittest

from harness import waymark
from laps import MAP, OTHER_LAP, made, put
import golden_page

SEED = 5


def drive(count=400, step_s=0.05):
    """(t, x, y, yaw) of a robot on an oval of 10 m."""
    poses = []
    for i in range(count):
        a = 2 * math.pi * i / count
        poses.append((i * step_s, 2 * math.cos(a), math.sin(a), math.atan2(math.cos(a), -2 * math.sin(a))))
    return poses


def tum(poses):
    return "# a remark\n" + "".join(
        f"{t:.9f} {x:.12f} {y:.12f} 0 0 0 {math.sin(yaw / 2):.15f} {math.cos(yaw / 2):.15f}\n" for t, x, y, yaw in poses)


def rmse(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def wrap(angle):
    return math.remainder(angle, 2 * math.pi)


def noisy(poses, seed):
    rng = random.Random(seed)
    return [(t, x + rng.gauss(0, 0.02), y + rng.gauss(0, 0.01), yaw + rng.gauss(0, 0.03)) for t, x, y, yaw in poses]


def fitted_plane(estimated, reference):
    """Estimated positions after least-squares alignment (rotation, translation) in the plane, by complex numbers."""
    e = [complex(x, y) for _, x, y, _ in estimated]
    r = [complex(x, y) for _, x, y, _ in reference]
    me, mr = sum(e) / len(e), sum(r) / len(r)
    turn = sum((b - mr) * (a - me).conjugate() for a, b in zip(e, r))
    turn /= abs(turn)
    return [turn * (a - me) + mr for a in e]


class EvaluateTrajectory(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-evaluate-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return name

    def run_here(self, *words):
        outcome = waymark("evaluate", *words, cwd=self.folder)
        self.assertGreaterEqual(outcome.code, 0, outcome.err)
        return outcome

    def scores(self, *words):
        outcome = self.run_here(*words, "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        return outcome.records[0]

    def test_figures_agree_with_an_independent_computation(self):
        truth, estimate = drive(), noisy(drive(), SEED)
        self.write("truth.txt", tum(truth))
        self.write("estimate.txt", tum(estimate))
        scores = self.scores("estimate.txt", "truth.txt")
        distances = [math.dist(e[1:3], r[1:3]) for e, r in zip(estimate, truth)]
        turns = [math.degrees(wrap(e[3] - r[3])) for e, r in zip(estimate, truth)]
        self.assertAlmostEqual(scores["ate_rmse_m"], rmse(distances), 9)
        self.assertAlmostEqual(scores["ate_max_m"], max(distances), 9)
        self.assertAlmostEqual(scores["heading_rmse_deg"], rmse(turns), 6)
        self.assertAlmostEqual(scores["rotation_rmse_deg"], rmse(turns), 6)
        self.assertAlmostEqual(scores["end_error_m"], distances[-1], 9)
        self.assertEqual((scores["alignment"], scores["paired"], scores["nees_mean"]), ("none", 400, None))
        self.assertAlmostEqual(scores["coverage"], 1)
        self.assertEqual(scores["time_to_first_fix_s"], 0)
        relative = []
        for i in range(len(truth) - 20):
            moved = []
            for poses in (estimate, truth):
                (_, x0, y0, a0), (_, x1, y1, _) = poses[i], poses[i + 20]
                dx, dy = x1 - x0, y1 - y0
                moved.append(complex(math.cos(a0) * dx + math.sin(a0) * dy, -math.sin(a0) * dx + math.cos(a0) * dy))
            relative.append(abs(moved[0] - moved[1]))
        self.assertAlmostEqual(scores["rpe_rmse_m"], rmse(relative), 9)

    def test_alignment_in_the_plane(self):
        truth = drive()
        c, s = math.cos(2.5), math.sin(2.5)
        elsewhere = [(t, 5 + c * x - s * y, -3 + s * x + c * y, yaw + 2.5) for t, x, y, yaw in noisy(truth, SEED + 1)]
        self.write("truth.txt", tum(truth))
        self.write("estimate.txt", tum(elsewhere))
        scores = self.scores("estimate.txt", "truth.txt", "--alignment", "se2")
        expected = rmse([abs(p - complex(r[1], r[2])) for p, r in zip(fitted_plane(elsewhere, truth), truth)])
        self.assertAlmostEqual(scores["ate_rmse_m"], expected, 9)
        self.assertGreater(self.scores("estimate.txt", "truth.txt")["ate_rmse_m"], 1)
        doubled = [(t, 2 * x, 2 * y, yaw) for t, x, y, yaw in truth]
        self.write("double.txt", tum(doubled))
        self.assertAlmostEqual(self.scores("double.txt", "truth.txt", "--alignment", "sim3")["scale"], 0.5, 9)

    def test_a_path_without_times(self):
        self.write("tape.csv", "x_m,y_m\n0,0\n1.32,0\n1.32,1.04\n0,1.04\n")
        self.write("estimate.txt", tum([(0, 0.5, 0.1, 0), (1, 1.4, 0.5, math.pi / 2), (2, 0.1, 0.5, -math.pi / 2)]))
        scores = self.scores("estimate.txt", "tape.csv", "--closed")
        self.assertAlmostEqual(scores["path_rmse_m"], rmse([0.1, 0.08, 0.1]), 9)
        self.assertAlmostEqual(scores["side_mean_m"], (0.1 - 0.08 + 0.1) / 3, 9)
        self.assertIsNone(scores["ate_rmse_m"])
        self.assertAlmostEqual(self.scores("estimate.txt", "tape.csv")["path_max_m"], 0.5, 9)
        self.assertEqual(self.scores("estimate.txt", "tape.csv", "--closed", "--from", "0.5", "--to", "1.5")["poses"], 1)

    def test_recordings_compared_with_odometry_and_figures(self):
        put(self.folder, *MAP, "replay map --world circuit24 --seed 12 -o replay.mcap")
        examples = [line.split()[2:] for line in self.run_here("--help").out.splitlines() if line.startswith("  waymark evaluate ")]
        for words in examples[:2]:
            self.assertEqual(self.run_here(*words).code, 0, words)
        replayed = self.scores("replay.mcap", "replay.mcap")
        self.assertGreater(replayed["nees_mean"], 0)
        self.assertLess(replayed["ate_rmse_m"], 0.1)
        outcome = self.run_here("map/trajectory.txt", "lap.mcap", "--odometry", "lap.mcap", "--map", "map/map.yaml",
                                "--figures", "figures")
        self.assertEqual(outcome.code, 0, outcome.err)
        for name in ("trajectories.svg", "trajectories.png", "position_error.svg", "position_error.png"):
            self.assertGreater((self.folder / "figures" / name).stat().st_size, 1000)
        scores = self.scores("map/trajectory.txt", "lap.mcap", "--odometry", "lap.mcap")
        (self.folder / "other.csv").write_text("t_s,v_m_s,omega_rad_s\n5000,0,0\n5001,0,0\n")
        other = self.run_here("map/trajectory.txt", "lap.mcap", "--odometry", "other.csv")
        self.assertEqual(other.code, 1)
        self.assertIn("other.csv: ", other.err)
        golden_page.expect(self, "evaluate", other.err)
        self.assertEqual([row["name"] for row in scores["beside"]], ["odometry", "odometry with gyro"])
        self.assertLess(10 * scores["ate_rmse_m"], scores["beside"][0]["ate_rmse_m"])
        against_file = self.scores("map/trajectory.txt", "map/truth_trajectory.txt")
        self.assertAlmostEqual(scores["ate_rmse_m"], against_file["ate_rmse_m"], 6)
        self.assertIsNone(scores["side_rmse_m"])
        self.assertEqual(self.scores("map/trajectory.txt", "map/route.yaml")["ate_rmse_m"], None)

    def test_questionable_comparisons_are_reported(self):
        truth = drive()
        self.write("truth.txt", tum(truth))
        self.write("fine.txt", tum(noisy(truth, SEED)))
        self.assertEqual(self.run_here("fine.txt", "truth.txt").err, "")
        self.write("later.txt", tum([(t + 15, x, y, yaw) for t, x, y, yaw in truth]))
        self.assertIn("100 of 400 ", self.run_here("later.txt", "truth.txt").err)
        self.write("elsewhere.txt", tum([(t, x + 3, y - 40, yaw) for t, x, y, yaw in truth]))
        outcome = self.run_here("elsewhere.txt", "truth.txt")
        self.assertEqual(outcome.code, 0)
        self.assertIn(" 40.1 m ", outcome.err)
        golden_page.expect(self, "evaluate", outcome.err)
        self.assertEqual(self.run_here("elsewhere.txt", "truth.txt", "--alignment", "se2").err, "")
        self.write("tape.csv", "x_m,y_m\n100,0\n102,0\n102,1\n")
        elsewhere = self.run_here("fine.txt", "tape.csv").err
        self.assertRegex(elsewhere, r"warning: .* 100\.0 m ")
        golden_page.expect(self, "evaluate", elsewhere)
        put(self.folder, *MAP, "localize lap.mcap --map map -o estimate.mcap")
        self.assertEqual(self.run_here("estimate.mcap", "lap.mcap").err, "")
        shutil.copy(made(*OTHER_LAP) / "lap.mcap", self.folder / "other.mcap")
        other = self.run_here("estimate.mcap", "other.mcap").err
        self.assertNotEqual(other, "")
        golden_page.expect(self, "evaluate", other)

    def test_impossible_comparisons_are_errors(self):
        self.write("truth.txt", tum(drive()))
        self.write("late.txt", tum([(t + 1000, x, y, yaw) for t, x, y, yaw in drive()]))
        self.write("two.txt", tum(drive()[:2]))
        self.write("bad.txt", "0 1 2 3\n")
        self.write("empty.txt", "")
        self.write("columns.csv", "a,b\n1,2\n")
        self.write("nan.csv", "x_m,y_m\n0,0\n1,nan\n")
        for words, part in (
                (["late.txt", "truth.txt"], "clock"),
                (["two.txt", "truth.txt", "--alignment", "se3"], " 2 poses "),
                (["bad.txt", "truth.txt"], "bad.txt:1"),
                (["empty.txt", "truth.txt"], "empty.txt"),
                (["truth.txt", "columns.csv"], "columns.csv:1: "),
                (["truth.txt", "nan.csv"], "nan.csv:3 (y_m)"),
                (["truth.txt", "none.txt"], "none.txt: "),
                (["truth.txt", "truth.txt", "--from", "500"], " 20.0 s")):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (1, ""), words)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "evaluate", outcome.err)
        for words in ([], ["truth.txt"], ["truth.txt", "truth.txt", "--alignment", "so3"], ["truth.txt", "truth.txt", "--jmup-m", "1"]):
            self.assertEqual(self.run_here(*words).code, 2)
        self.assertEqual(self.scores("late.txt", "truth.txt", "--time-offset-s", "1000")["ate_rmse_m"], 0)


if __name__ == "__main__":
    unittest.main()
