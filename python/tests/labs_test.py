#!/usr/bin/python3
"""Each lab gives nothing for an empty answer, all points for its solution, and fewer for each of at least five wrong answers; neither a notebook nor
the message for a wrong answer shows the right one.

usage: labs_test.py SOURCE DATA [NN]     (PYTHONPATH names the package). DATA: a folder with samples/ (`waymark samples`), where plant/ is written.
NN: only this lab. With WAYMARK_FULL the notebooks are executed by nbclient as well.
"""
import contextlib
import functools
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np

from waymark import labs

SOURCE = pathlib.Path(sys.argv.pop(1)).resolve()
DATA = pathlib.Path(sys.argv.pop(1)).resolve()
LABS = sorted((SOURCE / "labs").glob(f"{sys.argv.pop(1) if sys.argv[1:] and sys.argv[1].isdigit() else '[0-9]'}*.py"))
CHECK = "# ## Check\n"
STUB = re.compile(r"^def (\w+)\(.*\):\n(?: .*\n)*?    raise NotImplementedError", re.M)
os.environ["WAYMARK_LAB_DATA"] = str(DATA)


@functools.cache
def prepared(lab, before):
    """The cells before the check, run once for all answers."""
    names = {}
    exec(compile(before, lab.name, "exec"), names)  # noqa: S102
    return names


def numbers_in(values, most):
    """The numbers of arguments or results, also in tuples, lists and arrays of at most so many."""
    for value in values:
        if isinstance(value, (int, float, np.number)) and not isinstance(value, bool):
            yield float(value)
        elif isinstance(value, (tuple, list)) and len(value) <= most:
            yield from numbers_in(value, most)
        elif isinstance(value, np.ndarray) and value.size <= most:
            yield from numbers_in(value.ravel().tolist(), value.size)
        elif hasattr(value, "log"):
            yield from numbers_in([value.log()], 6)


def recorded(function, given, results, most):
    """The function, which notes the numbers it was given and those it returned."""
    def noting(*arguments):
        given.update(numbers_in(arguments, most))
        result = function(*arguments)
        results.update(numbers_in([result], most))
        return result
    return noting


def numbers_of(words):
    """(digits after the point, number as written) of the numbers in a text."""
    for text in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.]*\d)", words):
        yield len(text.partition(".")[2]), text


def shows(words, numbers):
    """Which of the numbers the text contains, at its printed precision."""
    return [text for digits, text in numbers_of(words) if any(f"{number:.{digits}f}" == text for number in numbers)]


def points_of(lab, answer="", notes=None):
    """(points, possible, what was printed) of a lab with an answer before its check. notes: sets for the numbers its functions get and give, longest list."""
    before, after = lab.read_text().split("# %% [markdown]\n" + CHECK)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        names = dict(prepared(lab, before))
        own = {name: types.FunctionType(value.__code__, names, name) for name, value in names.items() if isinstance(value, types.FunctionType)}
        names.update(own)
        exec(compile(answer, "answer", "exec"), names)  # noqa: S102
        if notes is not None:
            names.update({name: recorded(names[name], *notes) for name in STUB.findall(before)})
        exec(compile(after, lab.name, "exec"), names)  # noqa: S102
    return names["lab"].points, names["lab"].possible, printed.getvalue()


class Labs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        subprocess.run(["/usr/bin/python3", SOURCE / "tests" / "plant" / "generate_log.py", DATA / "plant"], check=True)

    def test_there_are_labs(self):
        self.assertGreaterEqual(len(LABS), 1)

    def test_missing_data_names_the_command_that_creates_it(self):
        with self.assertRaisesRegex(FileNotFoundError, "waymark samples samples"):
            labs.data("samples/none.mcap")
        with self.assertRaisesRegex(FileNotFoundError, "make_notebooks.py"):
            labs.data("plant/none.csv")

    def test_notebooks_with_answers_are_not_overwritten(self):
        with tempfile.TemporaryDirectory() as folder:
            mine = pathlib.Path(folder) / f"{LABS[0].stem}.ipynb"
            mine.write_text("my answers")
            done = subprocess.run([SOURCE / "tools" / "make_notebooks.py", folder], check=True, capture_output=True, text=True)
            self.assertIn("stays as it is", done.stdout)
            self.assertEqual(mine.read_text(), "my answers")
            self.assertTrue((mine.parent / "plant" / "odometry.csv").exists())

    def test_what_an_answer_raises_names_its_line(self):
        names = {}
        exec(compile("def answer():\n    a = 1\n    return a / 0\n", "cell", "exec"), names)  # noqa: S102
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            labs.Lab("x").check("division", 1, lambda: names["answer"]())
        self.assertIn("ZeroDivisionError: division by zero (line 3 of answer)", printed.getvalue())

    def test_an_answer_that_ends_the_program_is_reported(self):
        lab = labs.Lab("x")
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            lab.check("first", 1, lambda: sys.exit(0))
            lab.check("second", 1, lambda: None)
        self.assertIn("WRONG 0/1  first: it ended the program", printed.getvalue())
        self.assertEqual(lab.points, 1)

    def test_an_answer_that_raises_anything_is_a_wrong_answer(self):
        lab = labs.Lab("x")

        def raises():
            raise GeneratorExit

        with contextlib.redirect_stdout(io.StringIO()) as printed:
            lab.check("first", 1, raises)
        self.assertIn("it raised GeneratorExit", printed.getvalue())

    def test_an_unknown_lab_is_named(self):
        for number in ("1", 0, 13, None, True, 1.5):
            with self.assertRaisesRegex(ValueError, "the labs are 1 to 12"):
                labs.check(number, {})
        self.assertEqual(len(list((SOURCE / "labs").glob("[0-9]*.py"))), labs.LABS)
        with self.assertRaisesRegex(TypeError, "the names of the notebook"):
            labs.check(1, None)

    def test_a_folder_without_a_name_is_refused(self):
        done = subprocess.run([SOURCE / "tools" / "make_notebooks.py", ""], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr.startswith("Turns labs")), (2, True))

    def test_lab_7_calibrates_on_the_student_s_own_recording(self):
        lab = next((lab for lab in LABS if lab.name.startswith("07")), None)
        if lab is None:
            self.skipTest("another lab was asked for")
        solution = (SOURCE / "labs" / "solutions" / lab.name).read_text()
        own = DATA / "own.mcap"
        self.assertNotIn("own.mcap", points_of(lab, solution)[2])
        try:
            own.symlink_to(DATA / "samples" / "other.mcap")  # whose truth the lab compares as well
            printed = points_of(lab, solution)[2]
            found, true = (re.search(rf"^{name}.mcap: distances x ([\d.]+), turns x ([\d.]+)", printed, re.M).groups() for name in ("own", "other"))
            for a, b in zip(found, true):
                self.assertAlmostEqual(float(a), float(b), delta=0.01)
        finally:
            own.unlink(missing_ok=True)

    def test_lab_10_allows_other_values_without_losing_points(self):
        lab = next((lab for lab in LABS if lab.name.startswith("10")), None)
        if lab is None:
            self.skipTest("another lab was asked for")
        solution = (SOURCE / "labs" / "solutions" / lab.name).read_text()
        self.assertEqual(points_of(lab, solution)[2].count("looking 0.4 m ahead"), 1)
        points, possible, printed = points_of(lab, solution + "\nLOOK_AHEAD_M = 1.2\n")
        self.assertEqual(points, possible, printed)
        self.assertIn("looking 0.4 m ahead", printed)
        self.assertIn("looking 1.2 m ahead", printed)

    def test_a_figure_without_matplotlib_prints_one_message(self):
        script = ("import sys, importlib.util as u; real = u.find_spec; u.find_spec = lambda name, *rest: None if name == 'matplotlib' else real(name, *rest)\n"
                  "from waymark import labs\nfor _ in range(2): labs.figure('t', 'x', 'y', curve=[(0, 1)])")
        done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
        self.assertEqual(done.stdout, "No figure: Matplotlib is not installed (Debian: python3-matplotlib).\n")

    def test_a_python_without_numpy_is_reported(self):
        blocked = "import sys, importlib.util as u; real = u.find_spec; u.find_spec = lambda name, *rest: None if name == 'numpy' else real(name, *rest)\nimport waymark"
        done = subprocess.run([sys.executable, "-c", blocked], check=False, capture_output=True, text=True)
        self.assertIn(f"waymark needs NumPy, and {sys.executable} does not have it", done.stderr)

    def test_notebooks_that_cannot_be_written_are_named(self):
        for folder, words in (("/dev/null", "/dev/null: "), ("/proc/course", "/proc/course: ")):
            done = subprocess.run([SOURCE / "tools" / "make_notebooks.py", folder], check=False, capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            self.assertIn(words, done.stderr)
            self.assertNotIn("Traceback", done.stderr)
        with tempfile.TemporaryDirectory() as folder:  # a full disk
            (pathlib.Path(folder) / f"{LABS[0].stem}.ipynb.part").symlink_to("/dev/full")
            done = subprocess.run([SOURCE / "tools" / "make_notebooks.py", folder], check=False, capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            self.assertIn("No space left on device", done.stderr)
            self.assertNotIn("Traceback", done.stderr)
            self.assertFalse((pathlib.Path(folder) / f"{LABS[0].stem}.ipynb").exists())

    def test_empty_answers_get_no_points(self):
        for lab in LABS:
            points, possible, printed = points_of(lab)
            self.assertEqual((lab.name, points, possible), (lab.name, 0, 10), printed)
            self.assertIn("not done yet", printed)

    def test_answers_of_the_wrong_type_are_named_and_get_no_points(self):
        for lab in LABS:
            stubs = STUB.findall(lab.read_text().split(CHECK)[0])
            self.assertGreaterEqual(len(stubs), 3, lab.name)
            for answer in ("None", "float('nan')", "'words'"):
                points, _, printed = points_of(lab, "\n".join(f"def {name}(*given): return {answer}" for name in stubs))
                self.assertLessEqual(points, 1, f"{lab.name}, {answer}:\n{printed}")
                self.assertNotIn("it raised", printed, f"{lab.name}, {answer}")

    def test_solutions_get_all_points(self):
        for lab in LABS:
            points, possible, printed = points_of(lab, (SOURCE / "labs" / "solutions" / lab.name).read_text())
            self.assertEqual((lab.name, points), (lab.name, possible), printed)

    def test_wrong_answers_are_caught(self):
        for lab in LABS:
            solution = (SOURCE / "labs" / "solutions" / lab.name).read_text()
            answer, _, wrong = solution.partition("\nWRONG = ")
            mistakes = eval(wrong)  # noqa: S307  our own file
            self.assertGreaterEqual(len(mistakes), 5, lab.name)
            right_numbers = set()
            points_of(lab, answer, (set(), right_numbers, 6))
            for what, (right, mistake, words) in mistakes.items():
                self.assertEqual(answer.count(right), 1, f"{lab.name}: {what}")
                given, own = set(), set()
                points, possible, printed = points_of(lab, answer.replace(right, mistake), (given, own, 50))
                printed_mistakes = "\n".join(line for line in printed.splitlines() if line.startswith("WRONG"))
                self.assertLess(points, possible, f"{lab.name}: {what}\n{printed}")
                self.assertIn(words, printed_mistakes, f"{lab.name}: {what}")
                self.assertNotIn("it raised", printed, f"{lab.name}: {what}")
                printed_mistakes = re.sub(r"^WRONG \d+/\d+ ", "", printed_mistakes, flags=re.M)
                shown = set(shows(printed_mistakes, right_numbers)) - set(shows(printed_mistakes, given | own))
                self.assertEqual(shown, set(), f"{lab.name}: {what} reveals the right answer:\n{printed_mistakes}")

    def test_numbers_in_messages_are_found(self):
        self.assertEqual(shows("it is 0.60 s, and it returns 0.4", [0.6, 2.0]), ["0.60"])
        self.assertEqual(list(numbers_in([(1, [2.5, True]), None, "3"], 6)), [1, 2.5])

    def test_notebooks_show_no_answer(self):
        for lab in LABS:
            text, number = lab.read_text(), int(lab.name[:2])
            before, after = text.split(CHECK)
            self.assertRegex(after, rf"^# %%\nlab = labs\.check\({number}, globals\(\)\)\n", lab.name)
            functions = STUB.findall(before)
            for name in functions:  # what follows may call them, and defines none of them
                self.assertEqual(text.count(f"def {name}("), 1, f"{lab.name}: {name}")
            shown = {line.strip() for line in text.splitlines()}
            answer = (SOURCE / "labs" / "solutions" / lab.name).read_text().partition("\nWRONG = ")[0]
            for line in answer.splitlines():
                if line.strip() and not line.startswith(("import", "def ")) and len(line.strip()) > 12:
                    self.assertNotIn(line.strip(), shown, f"{lab.name} shows a line of its solution")

    def test_a_cell_that_was_not_run_is_named(self):
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            lab = labs.check(1, {})
        self.assertEqual(lab.points, 0)
        self.assertIn("inverse: inverse is not defined: run the cells from the top", printed.getvalue())

    @unittest.skipUnless("WAYMARK_FULL" in os.environ, "takes long: WAYMARK_FULL")
    def test_notebooks_run(self):
        import nbclient
        import nbformat

        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, SOURCE / "tools" / "make_notebooks.py", folder, "--solved"], check=True, capture_output=True)
            for path in sorted(pathlib.Path(folder).glob("*.ipynb")):
                book = nbformat.read(path, as_version=4)
                nbclient.NotebookClient(book, timeout=120).execute()
                output = "".join(part.get("text", "") for cell in book.cells if cell.cell_type == "code" for part in cell.outputs)
                self.assertIn("10 of 10 points", output, path.name)


if __name__ == "__main__":
    unittest.main()
