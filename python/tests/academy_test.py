#!/usr/bin/python3
"""A student's file for the exercise of the Academy runs unchanged and gets the score it deserves.

usage: academy_test.py     (PYTHONPATH names the package)
"""
import contextlib
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from waymark import academy

FULL = "WAYMARK_FULL" in os.environ
# resources/exercises/marker_visual_loc/apriltags_poses.yaml of JdeRobot/RoboticsInfrastructure: x, y, z [m], yaw [rad].
PUBLISHED_TAGS = {
    "tag_0": [1.75, -3.535, 0.8, -1.57079], "tag_1": [2.2, 2.835, 0.8, 1.57079], "tag_2": [5.935, -2.89, 0.8, 0], "tag_3": [3.17, -6.14, 0.8, -1.57079],
    "tag_4": [-2.18, 1.5, 0.8, 3.14158], "tag_5": [4.59, -1.0, 0.8, 0], "tag_6": [-0.8, -2.85, 0.8, -1.57079], "tag_7": [1.98, -5.23, 0.8, 3.14158]}
PUBLISHED_METHOD = pathlib.Path(__file__).with_name("academy_published_method.py").read_text()
REFERENCE = (pathlib.Path(academy.__file__).parent / "nearest_tag.py").read_text()


def scored(text, seconds=60.0 if FULL else 4.0, **keywords):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "solution.py"
        path.write_text(text)
        return academy.run_file(str(path), seconds=seconds, camera_rate_hz=5, **keywords)


def command(*arguments):
    """(exit code, stdout, stderr) of python3 -m waymark.academy."""
    ran = subprocess.run([sys.executable, "-m", "waymark.academy", *arguments], capture_output=True, text=True, timeout=60)
    return ran.returncode, ran.stdout, ran.stderr


class Exercise(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.reference = scored(REFERENCE)

    def test_reference_solution_is_good(self):
        self.assertIsNone(self.reference["error"])
        self.assertGreater(self.reference["points"], 70)
        self.assertLess(self.reference["position_rmse_m"], 0.25)
        self.assertGreater(self.reference["driven_m"], 0.3)

    def test_tags_are_where_the_published_file_has_them(self):
        listing = "import yaml\nfor name, tag in yaml.safe_load(open('/resources/exercises/marker_visual_loc/apriltags_poses.yaml'))['tags'].items():\n"
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "tags.txt"
            self.assertIsNone(scored(listing + f"    print(name, *tag['position'], file=open({str(out)!r}, 'a'))\n", 1)["error"])
            rows = [line.split() for line in out.read_text().splitlines()]
        found = {name: list(map(float, values)) for name, *values in rows}
        self.assertEqual(found.keys(), PUBLISHED_TAGS.keys())
        for name, (*place, yaw) in PUBLISHED_TAGS.items():
            self.assertLess(math.dist(found[name][:3], place), 1e-4, name)
            self.assertLess(abs(math.remainder(found[name][3] - yaw, 2 * math.pi)), 1e-4, name)

    def test_a_solution_by_the_published_method_is_good(self):
        """Anything else means that the exercise here is another one: signs, angles, places, names."""
        for seed in (1, 2):
            result = scored(PUBLISHED_METHOD, seed=seed)
            self.assertIsNone(result["error"])
            self.assertGreaterEqual(result["points"], 90, result)

    def test_frequency_paces_a_loop(self):
        count = "import Frequency, HAL, time\nfor _ in range(5):\n    {ask}Frequency.tick({rate})\nassert abs(time.time() - {s}) < 0.21, time.time()\n"
        for ask, rate, s in (("", "2", 2.2), ("HAL.getImage(); ", "2", 2.2), ("HAL.getImage(); ", "", 1.0), ("", "ideal_rate=1000", 1.0)):  # images are 0.2 s apart
            self.assertIsNone(scored(count.format(ask=ask, rate=rate, s=s), 5)["error"], (ask, rate))
        for rate, word in (("0", "a rate above 0"), ("'fast'", "expected a number"), ("-1", "a rate above 0")):
            self.assertIn(word, scored(f"import Frequency\nFrequency.tick({rate})\n", 1)["error"])

    def test_same_file_same_score(self):
        self.assertEqual(scored(REFERENCE, 0.5), scored(REFERENCE, 0.5))

    @unittest.skipUnless(FULL, "takes long: WAYMARK_FULL")
    def test_wrong_solutions_get_fewer_points(self):
        for right, wrong in (("math.tan(FIELD_OF_VIEW_RAD / 2)", "1"), ("np.linalg.inv(T) @", "T @"), ("[[s, 0, c, x", "[[-s, 0, -c, x"),
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

    def test_a_solution_that_reads_no_sensor_is_ended(self):
        asked = "import HAL, threading\nHAL.setV(0.2)\nHAL.getImage()\n"
        for body in ("while True:\n    pass\n",
                     "while True:\n    try:\n        1 + 1\n    except:\n        pass\n",
                     "sum(range(10**12))\n",  # a call of C that holds the interpreter
                     "threading.Event().wait()\n"):
            result = scored(asked + body, stall_s=1.0)
            self.assertIn("read no sensor for 1 s", result["error"], body)
            self.assertRegex(result["error"], r"\(line [4-8]\)", body)
            self.assertIn("the robot was stopped", result["error"])
            self.assertGreater(result["images"], 0)

    def test_a_solution_that_catches_everything_ends_with_its_time(self):
        for caught in ("    try:\n        HAL.getImage()\n    except:\n        pass\n", "    try:\n        HAL.getImage()\n    finally:\n        continue\n"):
            result = scored("import HAL\nwhile True:\n" + caught, 0.5, stall_s=5)
            self.assertIsNone(result["error"])
            self.assertEqual(result["notes"], ["no estimate was shown: call WebGUI.showEstimatedPose((x, y, yaw))"])

    def test_threads_run_as_in_python(self):
        thread = "import threading, HAL, WebGUI\ndef work():\n    while True:\n        HAL.getImage()\n        WebGUI.showEstimatedPose((0, 0, 0))\n"
        with tempfile.TemporaryFile(mode="w+") as heard, contextlib.ExitStack() as put_back:
            kept = os.dup(2)
            put_back.callback(os.dup2, kept, 2)
            os.dup2(heard.fileno(), 2)
            result = scored(thread + "threading.Thread(target=work).start()\n", 1)
            heard.seek(0)
            self.assertEqual(heard.read(), "")  # no traceback of the end
        self.assertIsNone(result["error"])
        self.assertGreater(result["estimates"], 2)
        left = scored(thread + "threading.Thread(target=work, daemon=True).start()\n", 30)
        self.assertIn("the file ended after", left["notes"][0])

    def test_a_process_that_ends_keeps_its_score(self):
        shown = "import HAL, WebGUI, os, signal\nHAL.getImage()\nWebGUI.showEstimatedPose((0, 0, 0))\nHAL.getImage()\n"
        for end, word in (("os._exit(3)", "exit code 3"), ("os.kill(os.getpid(), signal.SIGSEGV)", "SIGSEGV")):
            result = scored(shown + end, 2)
            self.assertIn(word, result["error"])
            self.assertEqual(result["estimates"], 1)

    def test_a_solution_can_import_files_from_its_folder(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "beside_it.py").write_text("ANSWER = 42\n")
            path = pathlib.Path(folder) / "solution.py"
            path.write_text("import sys, beside_it\nassert beside_it.ANSWER == 42 and sys.argv == [__file__] and __name__ == '__main__'\n")
            self.assertIsNone(academy.run_file(str(path), seconds=1)["error"])

    def test_ctrl_c_scores_the_drive_so_far(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "solution.py"
            for caught in ("", "    except BaseException:\n        pass\n"):
                path.write_text("import HAL\nprint('runs', flush=True)\nwhile True:\n    try:\n        HAL.getImage()\n" + (caught or "    finally:\n        1\n"))
                process = subprocess.Popen([sys.executable, "-m", "waymark.academy", str(path), "--seconds", "3600", "--json"],
                                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
                self.assertEqual(process.stdout.readline(), "runs\n")
                time.sleep(0.3)
                process.send_signal(signal.SIGINT)
                printed, _ = process.communicate(timeout=30)
                result = json.loads(printed)
                self.assertEqual(result["error"], "stopped by Ctrl-C")
                self.assertGreater(result["images"], 0)

    def test_arguments_out_of_range_are_named(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "solution.py"
            path.write_text("import HAL\nHAL.getImage()\n")
            for flags, word in ((("--seed", "-1"), "seed is -1"), (("--seed", str(2**64)), "seed is"), (("--seconds", "nan"), "seconds is nan"),
                                (("--stall-s", "0"), "stall_s is 0")):
                code, _, printed = command(str(path), *flags)
                self.assertEqual((code, "Traceback" in printed), (2, False), printed)
                self.assertIn(word, printed)
            for file, word in (("/dev/zero", "not a file"), (folder, "not a file"), (folder + "/none.py", "none.py does not exist")):
                code, _, printed = command(file)
                self.assertEqual((code, "Traceback" in printed), (2, False), printed)
                self.assertIn(word, printed)
            path.write_text("while True print")
            self.assertEqual(command(str(path))[0], 1)

    def test_json_contains_no_infinity(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "solution.py"
            path.write_text("import HAL, WebGUI\nHAL.setV(1e300)\nwhile True:\n    HAL.getImage()\n    WebGUI.showEstimatedPose((1e308, -1e308, 1e300))\n")
            code, printed, _ = command(str(path), "--seconds", "1", "--json")
        result = json.loads(printed, parse_constant=self.fail)
        self.assertEqual((code, result["points"], result["error"]), (0, 0, None))
        self.assertLess(result["driven_m"], 2)

    def test_invalid_poses_and_images_are_named(self):
        for call, shown in (("showEstimatedPose('abc')", "'abc' (a str)"), ("showEstimatedPose(None)", "None"), ("showEstimatedPose((10**400, 0, 0))", "tuple"),
                            ("showImage(None)", "None"), ("showImage('x.png')", "'x.png' (a str)")):
            error = scored(f"import WebGUI\nWebGUI.{call}\n", 1)["error"]
            self.assertIn(f"WebGUI.{call.partition('(')[0]} was given", error)
            self.assertIn(shown, error)

    def test_estimates_that_are_not_finite_count_as_not_shown(self):
        result = scored("import HAL, WebGUI\nwhile True:\n    HAL.getImage()\n    WebGUI.showEstimatedPose((float('nan'), 0, 0))\n", 1)
        self.assertEqual((result["estimates"], result["points"]), (0, 0))
        self.assertGreater(result["estimates_not_finite"], 2)
        self.assertIn("NaN", " ".join(result["notes"]))

    def test_a_file_without_a_loop_gets_a_note(self):
        once = "import HAL, WebGUI\nHAL.getImage()\nfor x in range(4):\n    WebGUI.showEstimatedPose((x, 0, 0))\n"
        for text in (once, once + "import sys\nsys.exit()\n"):
            self.assertIn("does it have a loop", " ".join(scored(text, 2)["notes"]))
        self.assertEqual(scored("import HAL\nwhile True:\n    HAL.getImage()\n", 0.5)["notes"], ["no estimate was shown: call WebGUI.showEstimatedPose((x, y, yaw))"])

    def test_an_early_end_by_an_exception_gets_a_note(self):
        looks = "import HAL\nfor _ in range(5):\n    HAL.getImage()\n"
        for end, error in (("raise RuntimeError", "RuntimeError"), ("import os\nos._exit(3)", "exit code 3")):
            result = scored(looks + end, 3)
            self.assertIn(error, result["error"])
            self.assertRegex(result["notes"][0], r"the file ended after \d\.\d s of simulated time; the remaining time counts as without an estimate$")
        late = scored("import HAL\ntry:\n    while True:\n        HAL.getImage()\nexcept BaseException:\n    raise RuntimeError\n", 0.5)
        self.assertIn("RuntimeError", late["error"])
        self.assertNotIn("the file ended", " ".join(late["notes"]))

    def test_refused_calls_get_a_note_even_if_the_solution_catches_them(self):
        tried = ("import HAL, WebGUI, os\nwhile True:\n    HAL.getImage()\n"
                 "    try:\n        WebGUI.showEstimatedPose('bad')\n    except Exception:\n        pass\n")
        notes = " ".join(scored(tried, 1)["notes"])
        self.assertRegex(notes, r"[3-9] calls were refused and had no effect; the first: WebGUI.showEstimatedPose was given 'bad' \(a str\): expected one argument")
        killed = scored(tried + "    os._exit(0)\n", 1)  # its process writes no end
        self.assertIn("1 call was refused", " ".join(killed["notes"]))
        for letter in ("\\U0001F600", "\\\\", "\\x00"):  # as long as it gets
            self.assertIn("calls were refused", " ".join(scored(tried.replace("bad", letter * 400), 1)["notes"]))
        for call in ("HAL.setV('fast')", "WebGUI.showEstimatedPose('a' * 400)"):
            self.assertNotIn("refused", " ".join(scored(f"import HAL, WebGUI\n{call}\n", 1)["notes"]))  # the error reports it

    def test_other_numbers_of_arguments_are_named(self):
        for call, word in (("WebGUI.showEstimatedPose(0, 0, 0)", "3 arguments"), ("WebGUI.showEstimatedPose(x=1, y=2, yaw=3)", r"3 arguments \(x, y, yaw\)"),
                           ("WebGUI.showEstimatedPose()", "0 arguments")):
            error = scored(f"import WebGUI\n{call}\n", 1)["error"]
            self.assertRegex(error, rf"was given {word}: expected WebGUI.showEstimatedPose\(pose\), pose is a sequence \(x, y, yaw\) in metres and radians")
        self.assertIn("HAL.setV was given 2 arguments: expected HAL.setV(speed_m_s)", scored("import HAL\nHAL.setV(1, 2)\n", 1)["error"])

    def test_help_shows_the_calls(self):
        calls = {"HAL": ("getImage()", "getOdom()", "getLaserData()", "setV(speed_m_s)", "setW(yaw_rate_rad_s)", "[m/s]", "[rad/s]", "relative to the start pose"),
                 "WebGUI": ("showEstimatedPose(pose)", "showImage(image)", "in metres and radians in the map")}
        for module, words in calls.items():
            text = f"import {module}, pydoc\ntext = pydoc.plain(pydoc.render_doc({module}))\nfor word in {words}:\n    assert word in text, text\n"
            self.assertIsNone(scored(text, 1)["error"])

    def test_images_after_an_early_end_count(self):
        right = academy.ScoredImage(0, (0, 0, 0), (0, 0, 0), (0, 0, 0))
        self.assertEqual(academy.score([right], 3)["points"], 25)

    def test_non_numeric_commands_are_named(self):
        for call in ("HAL.setV('fast')", "HAL.setW(None)", "HAL.setV([1])"):
            result = scored(f"import HAL\n{call}\n", 1)
            self.assertRegex(result["error"], rf"TypeError: {call[:8]} was given .*: expected a number")

    def test_the_first_scan_is_not_empty(self):
        result = scored("import HAL\nlaser = HAL.getLaserData()\nassert len(laser.values) > 10 and laser.maxAngle > laser.minAngle\nHAL.getImage()\n", 1)
        self.assertIsNone(result["error"])

    def test_a_loop_that_only_sleeps_ends(self):
        result = scored("import time, HAL\nstart = time.time()\nwhile True:\n    HAL.setV(0.1)\n    time.sleep(0.5)\n", 3)
        self.assertIsNone(result["error"])
        self.assertEqual(result["points"], 0)
        self.assertGreater(result["driven_m"], 0.1)


if __name__ == "__main__":
    unittest.main()
