#!/usr/bin/python3
"""`waymark report` and `waymark plot` on the command line: the self-contained page of a demo.

usage: report_test.py PROGRAM [unittest options]
"""
import html.parser
import pathlib
import re
import shutil
import tempfile
import unittest

from harness import waymark
from laps import DEMO, made
import golden_page


def run(*words, code=0):
    outcome = waymark(*words)
    assert outcome.code == code, (words, outcome.code, outcome.err)
    return outcome


class Reader(html.parser.HTMLParser):
    """The page as a browser reads it: headings, rows of tables, the number of figures, and resources to fetch."""

    def __init__(self, text):
        super().__init__()
        self.headings, self.rows, self.figures, self.fetched, self.open = [], [], 0, [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.fetched += [value for name, value in attrs if name in ("src", "href", "xlink:href") and not value.startswith("#")]
        if tag == "tr":
            self.rows.append([])
        self.figures += tag == "svg"

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data):
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1].append(data)

    def row(self, first):
        return next(row for row in self.rows if row and row[0] == first)


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-report-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.demo = cls.folder / "demo"
        shutil.copytree(made(*DEMO) / "demo", cls.demo)

    def page(self, *arguments):
        file = self.folder / "page.html"
        result = run("report", *arguments, "-o", file)
        self.assertTrue(result.out.startswith(f"{file}: "), result.out)
        return Reader(file.read_text())

    def test_the_page_of_a_demo_needs_no_other_files(self):
        page = self.page(self.demo)
        self.assertEqual(page.fetched, [])
        self.assertEqual(len(page.headings), 4, page.headings)  # lap, replay, map, comparison
        self.assertGreaterEqual(page.figures, 12)
        self.assertNotIn("<script", (self.folder / "page.html").read_text())

    def test_adjustment_improves_the_map(self):
        page = self.page(self.demo)
        before, after = page.row("before (chain)"), page.row("after")
        self.assertLess(float(after[1]), float(before[1]))
        tags = [row for row in page.rows if row[0].startswith("tag36h11:")]
        self.assertEqual(len(tags), 24)
        for row in tags:
            self.assertLess(float(row[7]), 2, row)  # residual [px]
            self.assertGreater(int(row[5]), 0, row)

    def test_the_replay_is_compared_with_the_lap(self):
        rows = [row for row in self.page(self.demo).rows if row and row[0] == str(self.demo / "replay.mcap")]
        aside, beside = sorted(rows, key=len, reverse=True)
        self.assertEqual(beside[2], "1")  # laps
        self.assertLess(float(beside[3]), 60)  # cross-track error [mm]
        self.assertEqual(aside[1], "sim")
        self.assertGreater(float(aside[7]), 1)  # tags per image

    def test_drives_of_different_kinds_are_compared(self):
        estimate = self.folder / "estimate.mcap"
        run("localize", self.demo / "replay.mcap", "--map", self.demo / "map/map.yaml", "-o", estimate)
        rows = [row for row in self.page(self.demo / "lap.mcap", estimate).rows if row and row[0] == str(estimate)]
        aside = max(rows, key=len)
        self.assertEqual(len(rows), 2)
        self.assertEqual(aside[6:8], ["-", "-"])  # it contains no tags
        self.assertLess(float(aside[11]), 20)  # position sigma [mm]
        real = self.folder / "real.mcap"  # as of a real robot: without ground truth
        run("convert", estimate, real, "--topics", "/odom,/waymark/pose")
        beside = self.page(self.demo / "lap.mcap", real).row(f"{real} (estimate)")
        self.assertLess(float(beside[3]), 80)  # cross-track error [mm]

    def test_one_recording_alone(self):
        page = self.page(self.demo / "lap.mcap")
        self.assertEqual(page.headings, [str(self.demo / "lap.mcap")])
        self.assertEqual(page.row("tags observed")[1], "24")

    def test_the_page_of_a_map_alone_states_what_is_missing(self):
        self.page(self.demo / "map")
        (missing,) = re.findall(r"[^<>]*residuals[^<>]*missing[^<>]*", (self.folder / "page.html").read_text())
        golden_page.expect(self, "plot", missing)

    def test_the_same_runs_give_the_same_bytes(self):
        self.page(self.demo)
        first = (self.folder / "page.html").read_bytes()
        self.page(self.demo)
        self.assertEqual(first, (self.folder / "page.html").read_bytes())

    def test_unusable_inputs_and_outputs_are_errors(self):
        empty = self.folder / "empty"
        empty.mkdir()
        refused = run("report", empty, code=1)
        self.assertIn("empty: ", refused.err)
        golden_page.expect(self, "plot", refused.err)
        text = self.folder / "text.txt"
        text.write_text("no recording")
        self.assertIn("text.txt", run("report", text, code=1).err)
        self.assertIn("nowhere", run("report", self.folder / "nowhere", code=1).err)
        before = (self.demo / "lap.mcap").read_bytes()
        self.assertIn(".html", run("report", self.demo, "-o", self.demo / "lap.mcap", code=2).err)
        self.assertEqual((self.demo / "lap.mcap").read_bytes(), before)
        unwritable = self.folder / "no" / "such" / "folder" / "page.html"
        self.assertIn("page.html", run("report", self.demo / "lap.mcap", "-o", unwritable, code=1).err)

    def test_one_figure_alone(self):
        listed = run("plot", self.demo).out
        for name in ("floor", "floor_2", "error", "before_after", "drives", "cross_track_1"):
            self.assertRegex(listed, rf"(?m)^{name} ")
        for suffix, begin in ((".svg", b"<?xml"), (".png", b"\x89PNG"), (".pdf", b"%PDF")):
            file = self.folder / f"figure{suffix}"
            run("plot", self.demo, "--figure", "drives", "-o", file)
            self.assertTrue(file.read_bytes().startswith(begin))
        self.assertIn("'floor'?", run("plot", self.demo, "--figure", "flor", code=2).err)
        self.assertIn(".svg", run("plot", self.demo, "--figure", "floor", "-o", self.folder / "a.bmp", code=2).err)
        self.assertIn("--figure", run("plot", self.demo, "-o", self.folder / "b.svg", code=2).err)

    def test_other_files_are_replaced_only_with_force(self):
        page, figure = self.folder / "mine.html", self.folder / "mine.svg"
        for file in (page, figure):
            file.write_text("mine")
        refused = run("report", self.demo, "-o", page, code=1).err
        self.assertIn("mine.html: ", refused)
        self.assertIn("--force", refused)
        self.assertIn("--force", run("plot", self.demo, "--figure", "floor", "-o", figure, code=1).err)
        self.assertEqual((page.read_text(), figure.read_text()), ("mine", "mine"))
        run("plot", self.demo, "--figure", "floor", "-o", figure, "--force")
        run("report", self.demo, "-o", page, "--force")
        self.assertNotEqual((page.read_text(), figure.read_text()), ("mine", "mine"))
        run("report", self.demo, "-o", page)  # its own page is replaced without --force


if __name__ == "__main__":
    unittest.main()
