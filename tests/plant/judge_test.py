#!/usr/bin/python3
"""The second judge against cases computed by hand."""
import math
import pathlib
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import course
import fault_script
import faults
import frames
import judge


class TrajectoryJudge(unittest.TestCase):
    def test_three_poses_by_hand(self):
        """Truth along x; errors (3, 4), (0, 0), (0, 0) mm and 0.1 rad in the last: ATE sqrt(25 / 3) mm, NEES by hand."""
        truth = np.array([[0, 0, 0, 0], [1, 1, 0, 0], [2, 2, 0, 0]], float)
        estimate = truth.copy()
        estimate[0, 1:3] += [0.003, 0.004]
        estimate[2, 3] += 0.1
        covariance = np.array([np.diag([1e-6, 4e-6, 1e-2])] * 3)
        found = judge.trajectory_errors(truth, estimate, covariance)
        self.assertAlmostEqual(found.ate.rmse_m, 0.005 / math.sqrt(3), 12)
        self.assertAlmostEqual(found.ate.max_m, 0.005, 12)
        self.assertAlmostEqual(found.nees, (9 + 4 + 0 + 1) / 3, 9)
        # From the first to the second pose: error (-3, -4) mm; from the second to the third: 0.1 rad.
        self.assertAlmostEqual(found.rpe_m, math.sqrt((0.005 ** 2 + 0) / 2), 12)
        self.assertAlmostEqual(found.rpe_deg, math.degrees(0.1) / math.sqrt(2), 9)

    def test_truth_is_interpolated_and_yaw_wraps(self):
        truth = np.array([[0, 0, 0, math.pi - 0.1], [1, 2, 0, -math.pi + 0.1]])
        found = judge.trajectory_errors(truth, np.array([[0.5, 1, 0, -math.pi]]))
        self.assertAlmostEqual(found.ate.rmse_m, 0, 12)

    def test_alignment_gives_back_a_motion_and_a_scale(self):
        rng = np.random.default_rng(3)
        model = rng.standard_normal((7, 3))
        turned, shift = frames.roll_pitch_yaw(0.3, -0.2, 2.0), np.array([1.0, -2.0, 0.5])
        s, found_turn, found_shift = judge.align(model, 1.02 * model @ turned.T + shift, scale=True)
        self.assertAlmostEqual(s, 1.02, 9)
        np.testing.assert_allclose(found_turn, turned, atol=1e-9)
        np.testing.assert_allclose(found_shift, shift, atol=1e-9)


class TrackingJudge(unittest.TestCase):
    def test_distance_from_a_corner(self):
        line = np.array([[0, 0], [1, 0], [1, 1]], float)
        np.testing.assert_allclose(judge.distance_to_line(np.array([[0.5, 0.2], [2, 0], [-3, 4]], float), line), [0.2, 1.0, 5.0])

    def test_only_the_drive_counts(self):
        still = [0.0, 5, 5, 0, 0, 0]
        taught = np.array([[0.02 * i, 0.01 * i, 0, 0, 0.3, 0] for i in range(200)])
        driven = np.array([still] + [[0.02 * i, 0.01 * i, 0.03, 0, 0.3, 0] for i in range(200)])
        self.assertAlmostEqual(judge.tracking(taught, driven).max_m, 0.03, 9)


class TagJudge(unittest.TestCase):
    def test_an_anchored_map_that_is_right_and_one_that_leans(self):
        tags = course.tags()
        anchor = tags[course.ANCHOR].world_T_tag()
        mapped = {tag.number: frames.inverse(anchor) @ tag.world_T_tag() for tag in tags}
        self.assertLess(judge.tag_errors(mapped, tags, anchored=True).max_m, 1e-12)
        leaning = course.tags(math.radians(2))
        self.assertGreater(judge.tag_errors(mapped, leaning, anchored=True).rmse_m, 0.05)
        self.assertLess(judge.tag_errors(mapped, leaning, anchored=False).max_m, 1e-12)


class FaultJudge(unittest.TestCase):
    def setUp(self):
        self.taught = np.array([[0.02 * i, 0.006 * i, 0, 0, 0.3, 0] for i in range(2000)])
        self.fault = fault_script.parse("stuck_feed@10")

    def verdict(self, stop_s: float) -> faults.Verdict:
        driven = self.taught.copy()
        late = driven[:, 0] > stop_s
        driven[late, 1], driven[late, 4] = 0.3 * stop_s, 0
        return faults.judge_run(self.taught, driven, self.fault, "", "stuck_feed@10")

    def test_a_stop_in_time_is_right_and_a_late_one_is_not(self):
        self.assertTrue(self.verdict(11.4).right)
        self.assertFalse(self.verdict(11.7).right)

    def test_driving_on_after_a_stop_is_not_right(self):
        driven = self.taught.copy()
        driven[(driven[:, 0] > 11) & (driven[:, 0] < 20), 4] = 0
        self.assertFalse(faults.judge_run(self.taught, driven, self.fault, "", "").right)


class Course(unittest.TestCase):
    def test_lap_gate_and_views(self):
        line = course.lap()
        self.assertAlmostEqual(0.01 * len(line), course.LAP_M, 6)
        self.assertLess(line[:, 3].min(), -0.5)
        self.assertGreater(line[:, 3].max(), 0.5)
        count = sum(course._seen_from(tag).astype(int) for tag in course.tags())
        self.assertGreaterEqual(count.min(), 2)
        left, right = course.tags()[-2:]
        self.assertAlmostEqual(math.hypot(left.x_m - right.x_m, left.y_m - right.y_m) - course.TAG_SIZE_M * 10 / 8, course.GATE_M, 6)

    def test_a_recorded_line_keeps_its_angles_on_wider_arcs(self):
        s = np.arange(0, 3, 0.02)
        curvature = np.where((s > 1) & (s < 1.2), -8.0, 0.5)
        heading = np.concatenate([[0], np.cumsum(0.02 * curvature[:-1])])
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "line.csv"
            file.write_text("# s, x, y, theta, curvature\n" + "".join(f"{a},0,0,{b},{c}\n" for a, b, c in zip(s, heading, curvature)))
            with course.recorded(file):
                line = course.lap()
                self.assertAlmostEqual(0.01 * len(line), 3 - 0.02 + 0.2 * (8 / 3.8 - 1), delta=0.05)
                self.assertAlmostEqual(line[-1, 2] - line[0, 2], heading[-1], delta=0.1)
                self.assertLess(abs(line[:, 3]).max(), 4.2)
                self.assertGreaterEqual(np.median(sum(course._seen_from(tag).astype(int) for tag in course.tags())), 3)
        self.assertAlmostEqual(0.01 * len(course.lap()), course.LAP_M, 6)


if __name__ == "__main__":
    unittest.main()
