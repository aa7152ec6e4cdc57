#!/usr/bin/python3
"""A student's file for the exercise of the Academy runs unchanged and gets the score it deserves.

usage: academy_test.py     (PYTHONPATH names the package). Exit code 77 without cv2.
"""
import importlib.util
import os
import pathlib
import sys
import tempfile
import unittest

from waymark import academy

if importlib.util.find_spec("cv2") is None or importlib.util.find_spec("yaml") is None:
    print("cv2 or yaml is not installed (Debian: python3-opencv python3-yaml)")
    sys.exit(77)

FULL = "WAYMARK_FULL" in os.environ
REFERENCE = (pathlib.Path(academy.__file__).parent / "nearest_tag.py").read_text()


def scored(text, seconds=60.0 if FULL else 4.0):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "solution.py"
        path.write_text(text)
        return academy.run_file(str(path), seconds=seconds, camera_rate_hz=5)


class Exercise(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.reference = scored(REFERENCE)

    def test_reference_solution_is_good(self):
        self.assertIsNone(self.reference["error"])
        self.assertGreater(self.reference["points"], 70)
        self.assertLess(self.reference["position_rmse_m"], 0.25)
        self.assertGreater(self.reference["driven_m"], 0.3)

    def test_same_file_same_score(self):
        self.assertEqual(scored(REFERENCE, 0.5), scored(REFERENCE, 0.5))

    @unittest.skipUnless(FULL, "takes long: WAYMARK_FULL")
    def test_wrong_solutions_get_fewer_points(self):
        for right, wrong in (("math.tan(FIELD_OF_VIEW_RAD / 2)", "1"), ("np.linalg.inv(T) @", "T @"), ("[[-s, 0, -c, x]", "[[s, 0, c, x]"),
                             ("world_T_odom @ odom_T_robot\n        WebGUI", "odom_T_robot\n        WebGUI")):
            self.assertIn(right, REFERENCE)
            result = scored(REFERENCE.replace(right, wrong), 6)
            self.assertIsNone(result["error"], wrong)
            self.assertLess(result["points"], 40, wrong)

    def test_errors_of_a_solution_are_its_result(self):
        for text, word in (("import HAL\nHAL.setV(float('nan'))", "finite"), ("import WebGUI\nWebGUI.showEstimatedPose((1, 2))", "(x, y, yaw)"),
                           ("import nothing_of_the_kind", "nothing_of_the_kind"), ("1 / 0", "ZeroDivisionError")):
            result = scored(text, 2)
            self.assertIn(word, result["error"])
            self.assertEqual(result["points"], 0)

    def test_a_loop_that_asks_no_sensor_is_ended_and_the_robot_stopped(self):
        for body in ("    pass\n", "    try:\n        1 + 1\n    except:\n        pass\n"):
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder) / "solution.py"
                path.write_text("import HAL\nHAL.setV(0.2)\nHAL.getImage()\nwhile True:\n" + body)
                result = academy.run_file(str(path), seconds=4, stall_s=0.5)
            self.assertIn("asked no sensor for 0.5 s", result["error"])
            self.assertRegex(result["error"], r"\(line [4-8]\)")
            self.assertIn("the robot was stopped", result["error"])

    def test_a_solution_that_catches_everything_ends_with_its_time(self):
        result = scored("import HAL\nwhile True:\n    try:\n        HAL.getImage()\n    except:\n        pass\n", 0.5)
        self.assertIsNone(result["error"])

    def test_estimates_that_are_not_finite_count_as_not_shown(self):
        result = scored("import HAL, WebGUI\nwhile True:\n    HAL.getImage()\n    WebGUI.showEstimatedPose((float('nan'), 0, 0))\n", 1)
        self.assertEqual((result["estimates"], result["points"]), (0, 0))
        self.assertGreater(result["estimates_not_finite"], 2)
        self.assertIn("NaN", " ".join(result["notes"]))

    def test_a_file_without_a_loop_is_told_so(self):
        once = "import HAL, WebGUI\nHAL.getImage()\nfor x in range(4):\n    WebGUI.showEstimatedPose((x, 0, 0))\n"
        for text in (once, once + "import sys\nsys.exit()\n"):
            self.assertIn("does it have a loop", " ".join(scored(text, 2)["notes"]))
        self.assertEqual(scored("import HAL\nwhile True:\n    HAL.getImage()\n", 0.5)["notes"], ["no estimate was shown: WebGUI.showEstimatedPose((x, y, yaw))"])

    def test_pictures_after_an_early_end_count(self):
        score = academy.Score()
        score.picture(0, (0, 0, 0))
        score.estimate(0, (0, 0, 0), (0, 0, 0))
        self.assertEqual(score.result(3)["points"], 25)

    def test_commands_that_are_no_numbers_are_named(self):
        for call in ("HAL.setV('fast')", "HAL.setW(None)", "HAL.setV([1])"):
            result = scored(f"import HAL\n{call}\n", 1)
            self.assertRegex(result["error"], rf"TypeError: {call[:8]} was given .*: a number is needed")

    def test_the_first_laser_data_are_not_empty(self):
        result = scored("import HAL\nlaser = HAL.getLaserData()\nassert len(laser.values) > 10 and laser.maxAngle > laser.minAngle\nHAL.getImage()\n", 1)
        self.assertIsNone(result["error"])

    def test_a_loop_that_only_sleeps_ends(self):
        result = scored("import time, HAL\nstart = time.time()\nwhile True:\n    HAL.setV(0.1)\n    time.sleep(0.5)\n", 3)
        self.assertIsNone(result["error"])
        self.assertEqual(result["points"], 0)
        self.assertGreater(result["driven_m"], 0.1)


if __name__ == "__main__":
    unittest.main()
