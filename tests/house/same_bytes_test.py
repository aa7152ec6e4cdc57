#!/usr/bin/python3
"""tools/same_bytes.py finds a changed number, word, file or exit code in every format, and reports no difference for equal outputs."""
import contextlib
import io
import json
import pathlib
import sqlite3
import struct
import sys
import tempfile
import unittest
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tests/cli")]
import recordings  # noqa: E402
import same_bytes  # noqa: E402
from same_bytes_fields import Rules, differences  # noqa: E402

X = 1.2345678901234567


def rules(relative=0.0, renames=""):
    return Rules(relative, *same_bytes.Renames(renames).of("map.1"))


def fields(name, before, after, how=None):
    as_bytes = (data if isinstance(data, bytes) else data.encode() for data in (before, after))
    return [found.field for found in differences(name, *as_bytes, how or rules())]


def mcap(x, y=2.0, note="as taught", pack=False):
    """A recording of three messages, with or without a chunk."""
    text, record = recordings.text, recordings.record
    schema = "float64 x  # m\nfloat64[] more\nstring LIMIT=far\nPart part\n" + "=" * 80 + "\nMSG: test_msgs/Part\nuint8 level\nint64 count\nstring words\n"
    out = record(3, struct.pack("<H", 1) + text("test_msgs/msg/Place") + text("ros2msg") + text(schema))
    out += record(4, struct.pack("<HH", 1, 1) + text("/place") + text("cdr") + struct.pack("<I", 0))
    for number in range(3):
        cdr = recordings.Cdr().number("d", x if number == 2 else 1.0).number("I", 1).number("d", y).number("B", 3).number("q", 7).text(note)
        out += record(5, struct.pack("<HIQQ", 1, number, number, number) + cdr.bytes())
    chunk = struct.pack("<QQQI", 0, 2, len(out), 0) + text("") + struct.pack("<Q", len(out)) + out
    return recordings.MAGIC + record(1, text("ros2") + text("test")) + (record(6, chunk) if pack else out) + record(15, struct.pack("<I", 0)) + record(2, bytes(20)) + recordings.MAGIC


def png(pixels, level):
    def part(kind, content):
        return struct.pack(">I4s", len(content), kind) + content + struct.pack(">I", zlib.crc32(kind + content))
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", bytes(13)) + part(b"IDAT", zlib.compress(pixels, level)) + part(b"IEND", b"")


def pdf(number, level=6):
    return b"%PDF-1.4\n1 0 obj\nstream\n" + zlib.compress(f"{number} 20 m\n30 40 l".encode(), level) + b"\nendstream\nstartxref\n9\n"


def database(value):
    with contextlib.closing(sqlite3.connect(":memory:")) as base:
        base.execute("CREATE TABLE messages(stamp INTEGER, data BLOB)")
        base.execute("INSERT INTO messages VALUES(5, ?)", (value,))
        base.commit()
        return base.serialize()


class Fields(unittest.TestCase):
    def test_equal_outputs_have_no_difference(self):
        for name, data in (("a.yaml", f"x: {X}\n"), ("stdout", "words\n"), ("a.json", '{"x": 1}'), ("a.mcap", mcap(X)), ("a.png", png(b"\0" * 9, 1)),
                           ("a.pdf", pdf(1)), ("a.db3", database(b"\1")), ("a.jpg", b"\xff\0\1")):
            self.assertEqual(fields(name, data, data), [], name)
            self.assertEqual(fields(name, data, data, rules(1e-9, "word walk -> run")), [], name)

    def test_a_number_of_a_map_changed_by_a_millionth_is_found_and_a_rounding_error_accepted(self):
        def of(x):
            return {"map.yaml": f"tags:\n  - position_m: [0.5, {x!r}]\n", "out.csv": f"t,x\n1,{x!r}\n", "stdout": json.dumps({"a": {"x": [x]}}),
                    "a.mcap": mcap(x), "a.pdf": pdf(x), "a.svg": f'<svg><path d="M0 {x!r}"/></svg>'}
        places = {"map.yaml": "line 2", "out.csv": "line 2", "stdout": "a.x[0]", "a.mcap": "messages./place[2].x"}
        for name, before in of(X).items():
            far, near = of(X * (1 + 1e-6))[name], of(X * (1 + 1e-12))[name]
            self.assertEqual(len(fields(name, before, far, rules(1e-9))), 1, name)
            self.assertEqual(len(fields(name, before, near)), 1, name)
            how = rules(1e-9)
            self.assertEqual(fields(name, before, near, how), [], name)
            self.assertAlmostEqual(how.largest[0], 1e-12, delta=1e-15)
            fields(name, before, far, how)
            self.assertAlmostEqual(how.worst[0], 1e-6, delta=1e-11)
            if name in places:
                self.assertEqual(fields(name, before, far, rules(1e-9)), [places[name]])

    def test_small_numbers_have_the_same_relative_tolerance(self):
        self.assertEqual(fields("a.csv", "1e-7", "1.000001e-7", rules(1e-9)), ["line 1"])
        self.assertEqual(fields("a.csv", "1.2e-17", "-3e-18", rules(1e-9)), [])

    def test_counts_signs_and_words_have_to_be_equal(self):
        for before, after in (("24 tags", "25 tags"), ("x -0.5", "x 0.5"), ("nan", "0.5"), ("one way", "one route"), ("tag36h11:7", "tag36h11:8"), ("a", "a\nb"),
                              ("1700000000000000000", "1700000000000000001")):
            self.assertEqual(fields("stdout", before, after, rules(1e-9)), ["line 1"] if after != "a\nb" else ["line 2"], (before, after))
        for before, after, places in (('{"n": 24}', '{"n": 25}', ["n"]), ('{"n": true}', '{"n": 1}', ["n"]), ('{"n": 1}', '{"m": 1}', ["n", "m"]),
                                      ('{"n": [1]}', '{"n": [1, 2]}', ["n.length"]), ('{"n": null}', '{"n": 0}', ["n"]), ('{"n": 1700000000000000000}', '{"n": 1700000000000000001}', ["n"])):
            self.assertEqual(fields("stdout", before, after, rules(1e-9)), places, (before, after))

    def test_only_the_last_printed_digit_may_differ_and_is_counted(self):
        how = rules(1e-9)
        self.assertEqual(fields("stdout", "rmse 0.0045 m", "rmse 0.0046 m", how), [])
        self.assertEqual(sum(how.accepted.values()), 1)
        self.assertEqual(fields("stdout", "rmse 0.0045 m", "rmse 0.0047 m", how), ["line 1"])
        self.assertEqual(fields("stdout", "rmse 0.0045 m", "rmse 0.0046 m"), ["line 1"])
        self.assertEqual(fields("stdout", '{"rmse": 0.0045}', '{"rmse": 0.0047}', how), ["rmse"])
        self.assertEqual(fields("stdout", '{"rmse": 0.0045678}', '{"rmse": 0.0045679}', how), ["rmse"])

    def test_an_added_line_is_one_difference(self):
        self.assertEqual(fields("stdout", "a\nb\nc\n", "a\nnew\nb\nc\n"), ["line 2"])
        self.assertEqual(fields("a.csv", "1\n" * 5000, "1\n" * 4000 + "2\n"), ["lines from 4001 on"])

    def test_only_measurements_of_the_run_are_masked(self):
        self.assertEqual(fields("s.json", '{"wall_s": 0.31, "x": 1}', '{"wall_s": 0.4, "x": 1}'), [])
        self.assertEqual(fields("s.json", '{"duration_s": 0.31}', '{"duration_s": 0.4}'), ["duration_s"])
        found = differences("stderr", b"in /tmp/a/x\n", b"in /tmp/b/x\n", rules(), ({"/tmp/a": "<here>"}, {"/tmp/b": "<here>"}))
        self.assertEqual(found, [])

    def test_the_same_fields_in_other_bytes_are_named(self):
        for name, before, after in (("a.json", '{"a":1}', '{"a": 1}'), ("a.png", png(b"\0" * 99, 1), png(b"\0" * 99, 9)), ("a.mcap", mcap(X), mcap(X, pack=True))):
            self.assertEqual(fields(name, before, after), ["layout"], name)

    def test_messages_texts_and_rows_inside_files(self):
        self.assertEqual(fields("a.mcap", mcap(X), mcap(X, y=2.5)), [f"messages./place[{n}].more[0]" for n in range(3)])
        self.assertEqual(fields("a.mcap", mcap(X), mcap(X, note="otherwise")), [f"messages./place[{n}].part.words" for n in range(3)])
        self.assertEqual(fields("a.png", png(b"\0", 1), png(b"\1", 1)), ["pixels"])
        self.assertEqual(fields("a.db3", database(b"\1"), database(b"\2")), ["messages[0][1]"])
        self.assertEqual(fields("a.jpg", b"\xff\0\1", b"\xff\0\2"), ["content"])


class Renames(unittest.TestCase):
    def test_words_keys_and_flags(self):
        table = same_bytes.Renames("# why\nword wall time -> run time\nkey reach_m -> look_m\nflag --laps -> --rounds\ncommand a.2 -> info x\n"
                                   "expect map.* files/*line_2 the axes are named\n")
        rename, renamed = table.of("replay.1")
        self.assertTrue(renamed)
        self.assertEqual(rename("wall\n  time reach_m --laps --laps-x the_reach_m"), "run time look_m --rounds --laps-x the_reach_m")
        self.assertEqual(table.line(same_bytes.Command("a.1", "replay --laps 2 --set follower.reach_m=1")), "replay --rounds 2 --set follower.look_m=1")
        self.assertEqual(same_bytes.Renames("line map convert -> map export").line(same_bytes.Command("a.1", "map convert x")), "map export x")
        self.assertEqual(table.line(same_bytes.Command("a.2", "replay --laps 2")), "info x")
        self.assertEqual(table.expects("map.1", "files/map/map.yaml line 2"), "the axes are named")
        self.assertIsNone(table.expects("map.1", "stdout line 2"))
        self.assertEqual(same_bytes.Renames("relative replay.* 1e-6 a loop amplifies\n").shares, [("replay.*", 1e-6)])

    def test_an_unused_rename_is_reported(self):
        for name, before, after in (("stdout", "the way", "the way"), ("a.json", '{"way": 1}', '{"way": 1}'), ("a.mcap", mcap(X, note="way"), mcap(X, note="way"))):
            self.assertNotEqual(fields(name, before, after, rules(renames="word way -> route")), [], name)
            self.assertEqual(fields(name, before, after, rules(renames="word[replay.*] way -> route")), [], name)

    def test_renamed_words_may_change_line_breaks(self):
        before, after = "Follow the way as far as\nit goes, then stop.\n", "Follow the trajectory\nas far as it goes, then stop.\n"
        self.assertEqual(fields("stdout", before, after, rules(renames="word way -> trajectory")), [])
        self.assertNotEqual(fields("stdout", before, after.replace("stop", "go"), rules(renames="word way -> trajectory")), [])
        self.assertEqual(fields("stdout", "a  table", "a table", rules(renames="word way -> trajectory")), ["line 1"], "no word of it was renamed")

    def test_an_invalid_line_is_refused(self):
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()) as words:
            same_bytes.Renames("word way route")
        self.assertIn("same_bytes_renames.txt:1", words.getvalue())


PROGRAM = """#!/bin/sh
case "$1" in
  --help*) echo "A program" ;;
  make) echo "made"; echo "x: 1.25" > made.yaml ;;
  use) cat made.yaml; date +%N ;;
  *) echo "wrong" >&2; exit 2 ;;
esac
"""


class WholeTool(unittest.TestCase):
    """The program is a script."""

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        for name, text in (("COMMANDS", "make : make\nuse < make : use\nreal : use data/none/x\n"), ("WRONG", "nosuch\n"), ("START", {"a.yaml": "a: 1\n"}), ("START_COMMANDS", ()), ("RATIOS", ["make"])):
            self.addCleanup(setattr, same_bytes.table, name, getattr(same_bytes.table, name))
            setattr(same_bytes.table, name, text)
        self.program("old")

    def program(self, name, changes=()):
        path, text = self.folder / name, PROGRAM
        for old, new, _ in changes:
            text = text.replace(old, new)
        path.write_text(text)
        path.chmod(0o755)

    def run_tool(self, task, program, *words):
        names = ("--old", str(self.folder / "old"), "--new") if task == "ratios" else ("--program",)
        options = same_bytes.options_of([task, *names, str(self.folder / program), "--folder", str(self.folder / "ref"), *words])
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            code = options.run(options)
        return code, printed.getvalue()

    def test_reports_only_a_changed_program(self):
        code, printed = self.run_tool("reference", "old")
        self.assertEqual(code, 0, printed)
        self.assertIn("not reproducible: use stdout line 2", printed)
        self.assertIn("WAYMARK_DATA does not hold its input: 1 (real)", printed)
        code, printed = self.run_tool("compare", "old")
        self.assertEqual(code, 0, printed)
        self.assertIn("0 differences", printed)
        number = ("1.25", "1.2500013", "make: files/made.yaml line 1: 'x: 1.25' -> 'x: 1.2500013'")
        name = ("made.yaml ;;", "other.yaml ;;", "make: files/made.yaml file: '8 bytes' -> 'not written'\nmake: files/other.yaml file: 'not written' -> '8 bytes'")
        code, words, verbs = ("exit 2", "exit 1", "wrong.01: exit"), ('"wrong"', '"wrongly"', "wrong.01: stderr line 1"), ("A program", "The program", "help.help: stdout")
        for changes in ((number, code, verbs), (name, words)):
            self.program("new", changes)
            code, printed = self.run_tool("compare", "new", "--relative", "1e-9")
            self.assertEqual(code, 1, printed)
            for _, _, place in changes:
                self.assertIn(place, printed)
            self.assertNotIn("use: ", printed, "uses the kept results")
        self.assertEqual(self.run_tool("compare", "new", "--only", "use,help.*")[0], 0)
        self.program("new", [number])
        (self.folder / "renames.txt").write_text("relative ma* 1e-5 the sum is made in another order\n")
        code, printed = self.run_tool("compare", "new", "--renames", str(self.folder / "renames.txt"))
        self.assertEqual(code, 0, printed)
        self.assertIn("largest relative difference accepted: 1.0e-06 (make line 1)", printed)
        self.assertRegex(self.run_tool("ratios", "new", "--repeat", "1")[1], r"\| make \| [\d.]+ \| [\d.]+ \| [\d.]+ \|")


if __name__ == "__main__":
    unittest.main()
