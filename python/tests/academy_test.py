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

    def test_a_loop_that_only_sleeps_ends(self):
        result = scored("import time, HAL\nstart = time.time()\nwhile True:\n    HAL.setV(0.1)\n    time.sleep(0.5)\n", 3)
        self.assertIsNone(result["error"])
        self.assertEqual(result["points"], 0)
        self.assertGreater(result["driven_m"], 0.1)


if __name__ == "__main__":
    unittest.main()
