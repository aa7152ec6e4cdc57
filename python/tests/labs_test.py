#!/usr/bin/python3
"""Each lab gives nothing for an empty answer, all points for its solution, and fewer for each of at least five wrong answers.

usage: labs_test.py SOURCE DATA [NN]     (PYTHONPATH names the package). DATA: a folder with samples/ (`waymark samples`), where plant/ is written.
NN: only this lab. With WAYMARK_FULL the notebooks are executed by nbclient as well.
"""
import contextlib
import functools
import importlib.util
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types
import unittest

from waymark import labs

SOURCE = pathlib.Path(sys.argv.pop(1)).resolve()
DATA = pathlib.Path(sys.argv.pop(1)).resolve()
LABS = sorted((SOURCE / "labs").glob(f"{sys.argv.pop(1) if sys.argv[1:] and sys.argv[1].isdigit() else '[0-9]'}*.py"))
CHECK = "# ## Check\n"
STUB = re.compile(r"^def (\w+)\(.*\):\n(?: .*\n)*?    raise NotImplementedError", re.M)
os.environ["WAYMARK_LAB_DATA"] = str(DATA)


@functools.cache
def prepared(lab, before):
    """What stands before the check, run once for all answers."""
    names = {}
    exec(compile(before, lab.name, "exec"), names)  # noqa: S102
    return names


def points_of(lab, answer=""):
    """(points, possible, what was printed) of a lab with an answer before its check."""
    before, after = lab.read_text().split("# %% [markdown]\n" + CHECK)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        names = dict(prepared(lab, before))
        names["lab"] = labs.Lab(lab.name)
        own = {name: types.FunctionType(value.__code__, names, name) for name, value in names.items() if isinstance(value, types.FunctionType)}
        names.update(own)
        exec(compile(answer, "answer", "exec"), names)  # noqa: S102
        exec(compile(after, lab.name, "exec"), names)  # noqa: S102
    return names["lab"].points, names["lab"].possible, printed.getvalue()


class Labs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        subprocess.run(["/usr/bin/python3", SOURCE / "tests" / "plant" / "generate_log.py", DATA / "plant"], check=True)

    def test_there_are_labs(self):
        self.assertGreaterEqual(len(LABS), 1)

    def test_data_that_is_missing_says_how_to_make_it(self):
        with self.assertRaisesRegex(FileNotFoundError, "waymark samples samples"):
            labs.data("samples/none.mcap")
        with self.assertRaisesRegex(FileNotFoundError, "make_notebooks.py"):
            labs.data("plant/none.csv")

    def test_notebooks_with_answers_are_not_written_over(self):
        if importlib.util.find_spec("nbformat") is None:
            self.skipTest("nbformat is missing (Debian: python3-nbformat)")
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

    def test_empty_answers_get_nothing(self):
        for lab in LABS:
            points, possible, printed = points_of(lab)
            self.assertEqual((lab.name, points, possible), (lab.name, 0, 10), printed)
            self.assertIn("not done yet", printed)

    def test_answers_of_another_kind_are_named_and_get_nothing(self):
        for lab in LABS:
            stubs = STUB.findall(lab.read_text().split(CHECK)[0])
            self.assertGreaterEqual(len(stubs), 3, lab.name)
            for answer in ("None", "float('nan')", "'words'"):
                points, _, printed = points_of(lab, "\n".join(f"def {name}(*given): return {answer}" for name in stubs))
                self.assertLessEqual(points, 1, f"{lab.name}, {answer}:\n{printed}")
                self.assertNotIn("it raised", printed, f"{lab.name}, {answer}")

    def test_solutions_get_everything(self):
        for lab in LABS:
            points, possible, printed = points_of(lab, (SOURCE / "labs" / "solutions" / lab.name).read_text())
            self.assertEqual((lab.name, points), (lab.name, possible), printed)

    def test_wrong_answers_are_caught(self):
        for lab in LABS:
            solution = (SOURCE / "labs" / "solutions" / lab.name).read_text()
            answer, _, wrong = solution.partition("\nWRONG = ")
            mistakes = eval(wrong)  # noqa: S307  our own file
            self.assertGreaterEqual(len(mistakes), 5, lab.name)
            for what, (right, mistake) in mistakes.items():
                self.assertEqual(answer.count(right), 1, f"{lab.name}: {what}")
                points, possible, printed = points_of(lab, answer.replace(right, mistake))
                self.assertLess(points, possible, f"{lab.name}: {what}\n{printed}")
                self.assertIn("WRONG", printed)
                self.assertNotIn("it raised", printed, f"{lab.name}: {what}")

    @unittest.skipUnless("WAYMARK_FULL" in os.environ, "takes long: WAYMARK_FULL")
    def test_notebooks_run(self):
        if importlib.util.find_spec("nbclient") is None or importlib.util.find_spec("ipykernel") is None:
            self.skipTest("nbclient or ipykernel is missing (Debian: python3-nbclient python3-ipykernel)")
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
