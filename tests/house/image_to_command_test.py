#!/usr/bin/python3
"""The path from an image to a command in docs/architecture.md: files and functions exist, and no room is entered twice."""
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True

MOST_FILES_TO_A_COMMAND = 25
BEGIN, END = "<!-- path of an image: tests/house/image_to_command_test.py -->\n", "<!-- end of the path -->"


def path_rows(page):
    """(room, file, function) of the rows of the table."""
    rows = page.split(BEGIN)[1].split(END)[0].splitlines()[2:]
    return [[cell.strip().strip("`") for cell in row.strip("|").split("|")][:3] for row in rows]


def defines(text, function):
    """Whether a source defines the function: its name is at the beginning of a line that is not a call."""
    return re.search(r"^[A-Za-z][^;=\n]*\b%s\(" % re.escape(function), text, re.MULTILINE) is not None


class ImageToCommand(unittest.TestCase):
    def setUp(self):
        self.rows = path_rows((ROOT / "docs/architecture.md").read_text(encoding="utf-8"))

    def test_the_files_and_functions_exist(self):
        self.assertGreater(len(self.rows), 10)
        for _, file, function in self.rows:
            with self.subTest(file=file, function=function):
                self.assertTrue(defines((ROOT / "waymark" / file).read_text(encoding="utf-8"), function))

    def test_it_is_in_25_files_or_fewer(self):
        self.assertLessEqual(len({file for _, file, _ in self.rows}), MOST_FILES_TO_A_COMMAND)

    def test_every_room_is_entered_once(self):
        rooms = [room for room, _, _ in self.rows]
        entered = [room for before, room in zip([None] + rooms, rooms) if room != before]
        self.assertEqual(len(entered), len(set(entered)), entered)
        for room, file, _ in self.rows:
            self.assertTrue(file.startswith(room + "/"), file)

    def test_a_call_is_not_a_definition(self):
        self.assertFalse(defines("void f() {\n  g(1);\n}\n", "g"))
        self.assertTrue(defines("Status g(int x) {\n", "g"))


if __name__ == "__main__":
    unittest.main()
