#!/usr/bin/python3
"""Sizes of the house: no file above 300 lines but those listed here, the room of the program, and the way of a picture to its
command as docs/architecture.md draws it."""
import pathlib
import re
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True

MOST_LINES = 300
# Longer than that for now: a name leaves this list when its file is split. None is added.
LONG = {
    "benchmarks/solver_comparison.cpp", "tests/loop_test.cpp", "tests/support/degraded_tags.cpp",
    "waymark/config/map_file.cpp", "waymark/config/route_file.cpp", "waymark/robots/process/robot_messages_test.cpp",
    "waymark/cameras/v4l2/v4l2_camera_test.cpp", "waymark/localization/riekf_localizer_test.cpp",
    "waymark/localization/tracker.cpp", "waymark/mapping/lap/bundle_map.cpp", "waymark/mapping/scene/scene_map.cpp",
    "waymark/mapping/scene/scene_map_test.cpp", "waymark/media/video_test.cpp", "waymark/pipeline/replayer.cpp",
    "waymark/plot/figure.cpp", "waymark/recording/camera_choice.cpp", "waymark/recording/export_log_test.cpp",
    "waymark/recording/message_log_test.cpp", "waymark/runtime/robot_loop_test.cpp",
    "waymark/server/live_hub_test.cpp"}
LONGEST = 475  # of those

# Flags, help, printing and exit codes; with tests. What grows beyond it belongs into jobs/ or live/.
MOST_LINES_OF_CLI = 5988

MOST_FILES_TO_A_COMMAND = 25
BEGIN, END = "<!-- path of a picture: tests/house/sizes_test.py -->\n", "<!-- end of the path -->"


def sources(root):
    for top in ("waymark", "tests", "benchmarks", "examples", "fuzz", "python"):
        for suffix in ("*.cpp", "*.hpp"):
            yield from (root / top).rglob(suffix)


def lines_of(path):
    return path.read_bytes().count(b"\n")


def too_long(root, listed):
    """Files above the limit, of those listed the ones above theirs."""
    found = []
    for path in sources(root):
        name = path.relative_to(root).as_posix()
        if lines_of(path) > (LONGEST if name in listed else MOST_LINES):
            found.append(name)
    return sorted(found)


def path_rows(page):
    """(room, file, function) of the rows of the table."""
    rows = page.split(BEGIN)[1].split(END)[0].splitlines()[2:]
    return [[cell.strip().strip("`") for cell in row.strip("|").split("|")][:3] for row in rows]


def defines(text, function):
    """Whether a source defines the function: its name stands at the head of a line that is no call."""
    return re.search(r"^[A-Za-z][^;=\n]*\b%s\(" % re.escape(function), text, re.MULTILINE) is not None


class Sizes(unittest.TestCase):
    def test_no_file_is_above_300_lines_but_those_listed(self):
        self.assertEqual(too_long(ROOT, LONG), [])

    def test_a_name_leaves_the_list_with_its_length(self):
        short = [name for name in sorted(LONG) if not (ROOT / name).exists() or lines_of(ROOT / name) <= MOST_LINES]
        self.assertEqual(short, [], "no longer too long: take them off the list")

    def test_the_program_itself_stays_small(self):
        lines = sum(lines_of(path) for path in (ROOT / "waymark/cli").iterdir() if path.suffix in (".cpp", ".hpp"))
        self.assertGreater(lines, 1000)
        self.assertLessEqual(lines, MOST_LINES_OF_CLI)

    def test_a_planted_file_of_301_lines_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "waymark/base").mkdir(parents=True)
            (root / "waymark/base/short.cpp").write_text("\n" * MOST_LINES)
            (root / "waymark/base/long.cpp").write_text("\n" * (MOST_LINES + 1))
            self.assertEqual(too_long(root, LONG), ["waymark/base/long.cpp"])
            self.assertEqual(too_long(root, {"waymark/base/long.cpp"}), [])


class PictureToCommand(unittest.TestCase):
    def setUp(self):
        self.rows = path_rows((ROOT / "docs/architecture.md").read_text(encoding="utf-8"))

    def test_the_files_and_functions_are_there(self):
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

    def test_a_function_that_is_only_called_is_not_there(self):
        self.assertFalse(defines("void f() {\n  g(1);\n}\n", "g"))
        self.assertTrue(defines("Status g(int x) {\n", "g"))


if __name__ == "__main__":
    unittest.main()
