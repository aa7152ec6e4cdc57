#!/usr/bin/python3
"""Tag sheets and calibration boards: files, summaries, and errors.

usage: tags_test.py PROGRAM [unittest options]
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import golden_page  # noqa: E402

PROGRAM = None
FAMILIES = ("tag16h5", "tag25h9", "tag36h10", "tag36h11", "tagCircle21h7", "tagCircle49h12", "tagCustom48h12",
            "tagStandard41h12", "tagStandard52h13")


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-tags-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def run_here(self, words):
        done = subprocess.run([PROGRAM, *words.split()], cwd=self.folder, capture_output=True, text=True, timeout=120,
                              stdin=subprocess.DEVNULL, check=False)
        self.assertGreaterEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("internal error", done.stderr)
        return done

    def ok(self, words):
        done = self.run_here(words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def summary(self, words):
        return json.loads(self.ok(words + " --json").stdout)

    def names(self):
        return sorted(path.name for path in self.folder.iterdir())


class Sheet(InFolder):
    def test_a_sheet_as_pdf(self):
        done = self.ok("tags sheet --family 36h11 --ids 0-23 --tag-size-m 0.16 --paper A4 -o tags.pdf")
        for part in (r"tags\.pdf: 24 .*A4", "tag36h11", r"0\.16 m"):
            self.assertRegex(done.stdout, part)
        golden_page.expect(self, "tags", done.stdout + done.stderr)
        info = subprocess.run(["pdfinfo", self.folder / "tags.pdf"], capture_output=True, text=True, check=True).stdout
        self.assertRegex(info, r"Pages: +24")
        self.assertRegex(info, r"Page size: +595\.\d+ x 841\.\d+ pts \(A4\)")

    def test_summary(self):
        summary = self.summary("tags sheet --ids 0-9 --tag-size-m 0.05 -o tags.svg")
        self.assertEqual(summary, {"pages": 2, "tags": 10, "tags_per_page": 9, "family": "tag36h11", "tag_size_m": 0.05,
                                   "paper": "A4", "paper_size_m": [0.21, 0.297], "ruler_m": 0.1,
                                   "files": ["tags-1.svg", "tags-2.svg"]})
        self.assertEqual(self.names(), ["tags-1.svg", "tags-2.svg"])

    def test_same_command_same_bytes(self):
        for suffix, dpi in (("pdf", ""), ("svg", ""), ("png", "--dpi 100")):
            for name in ("a", "b"):
                self.ok(f"tags sheet --ids 0-3 --tag-size-m 0.05 {dpi} -o {name}.{suffix}")
            self.assertEqual((self.folder / f"a.{suffix}").read_bytes(), (self.folder / f"b.{suffix}").read_bytes(), suffix)

    def test_detect_reads_every_family_back_in_its_size(self):
        dpi, size_m = 254, 0.02
        for family in FAMILIES:
            self.ok(f"tags sheet --family {family} --ids 0,3,7 --tag-size-m {size_m} --paper A5 --dpi {dpi} -o {family}.png")
            words = f"detect --json --max-hamming 0 --family {family} {family}.png"
            (record,) = [json.loads(line) for line in self.ok(words).stdout.splitlines()]
            self.assertEqual([d["tag"] for d in record["detections"]], [f"{family}:{i}" for i in (0, 3, 7)])
            for detection in record["detections"]:
                (left, top), (right, _), _, (_, bottom) = detection["corners_px"]
                for side in (right - left, bottom - top):  # upright: the first corner is the upper left one
                    self.assertLess(abs(side / dpi * 0.0254 - size_m), 1e-4, detection)

    def test_the_extension_may_be_in_upper_case(self):
        self.ok("tags sheet --ids 0 --tag-size-m 0.05 --dpi 50 -o a.PNG")
        self.assertEqual((self.folder / "a.PNG").read_bytes()[:4], b"\x89PNG")

    def test_errors_suggest_a_fix(self):
        usual = "tags sheet --ids 0 --tag-size-m 0.05 -o t.pdf"
        for words, answer in (
                ("tags sheet --ids 0 --tag-size-m 0.17 -o t.pdf", "Tabloid"),
                ("tags sheet --ids 0 --tag-size-m 160 -o t.pdf", "0.16"),
                ("tags sheet --ids 0 --tag-size-m 0 -o t.pdf", "(--tag-size-m): 0 m"),
                ("tags sheet --ids 0 --tag-size-m -0.1 -o t.pdf", "(--tag-size-m): -0.1 m"),
                ("tags sheet --ids 0 --tag-size-m nan -o t.pdf", "(--tag-size-m): 'nan'"),
                ("tags sheet --ids 0 --tag-size-m inf -o t.pdf", "(--tag-size-m): inf m"),
                ("tags sheet --ids 0 --tag-size-m big -o t.pdf", "--tag-size-m"),
                ("tags sheet --ids 0 -o t.pdf", "--tag-size-m"),
                ("tags sheet --tag-size-m 0.05 -o t.pdf", "--ids"),
                ("tags sheet --ids 0 --tag-size-m 0.05", "--output"),
                ("tags sheet --ids 587 --tag-size-m 0.05 -o t.pdf", "586"),
                ("tags sheet --ids 3-1 --tag-size-m 0.05 -o t.pdf", "1-3"),
                ("tags sheet --ids a --tag-size-m 0.05 -o t.pdf", "0-3,7,9"),
                ("tags sheet --ids 1,1 --tag-size-m 0.05 -o t.pdf", "--ids"),
                ("tags sheet --ids 0 --tag-size-m 0.05 -o t.jpg", ".pdf, .svg or .png"),
                (usual + " --paper A44", "'A4'?"),
                (usual + " --family 36h1", "'tag36h1"),
                (usual + " --orientation potrait", "'portrait'?"),
                (usual + " --per-page 50", "A4"),
                (usual + " --margin-m 2", "[0, 0.1]"),
                (usual + " --papper A4", "'--paper'?"),
                ("tags sheet --ids 0 --tag-size-m 0.05 --dpi 1 -o t.png", "(--dpi)"),
                ("tags shet --ids 0", "'sheet'?")):
            done = self.run_here(words)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(answer, done.stderr, words)
            golden_page.expect(self, "tags", done.stderr)
            self.assertEqual(done.stdout, "", words)
        self.assertEqual(self.names(), [])

    def test_an_unwritable_file_is_a_failure(self):
        for path in ("nowhere/t.pdf", "/proc/t.svg"):
            done = self.run_here(f"tags sheet --ids 0 --tag-size-m 0.05 -o {path}")
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(path, done.stderr)
        (self.folder / "t.pdf").mkdir()
        self.assertEqual(self.run_here("tags sheet --ids 0 --tag-size-m 0.05 -o t.pdf").returncode, 1)


    def test_an_existing_file_is_replaced_only_with_force(self):
        for words, name in (("tags sheet --ids 0 --tag-size-m 0.05 -o t.pdf", "t.pdf"),
                            ("tags sheet --ids 0-9 --tag-size-m 0.1 -o t.svg", "t-3.svg"),
                            ("tags board --tag-size-m 0.02 -o b.pdf", "b.pdf"),
                            ("tags board --tag-size-m 0.02 --kalibr-yaml -o c.pdf", "c.yaml")):
            (self.folder / name).write_text("mine")
            done = self.run_here(words)
            self.assertEqual((done.returncode, done.stdout), (1, ""), done.stderr)
            self.assertIn(f"{name}: ", done.stderr)
            self.assertIn("--force", done.stderr)
            golden_page.expect(self, "tags", done.stderr)
            self.assertEqual((self.folder / name).read_text(), "mine")
            self.ok(words + " --force")
            self.assertNotIn("mine", (self.folder / name).read_bytes()[:9].decode("latin1"))


class Board(InFolder):
    def test_with_its_target_for_kalibr(self):
        summary = self.summary("tags board --cols 6 --rows 5 --tag-size-m 0.024 --spacing 0.3 --kalibr-yaml -o board.pdf")
        self.assertEqual(summary["files"], ["board.pdf", "board.yaml"])
        self.assertEqual((self.folder / "board.yaml").read_text(),
                         "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.024\ntagSpacing: 0.3\n")

    def test_detect_reads_a_separate_board_back_from_the_lower_left_corner(self):
        done = self.ok("tags board --style separate --cols 4 --rows 3 --tag-size-m 0.03 --spacing 0.25 --dpi 100 -o board.png")
        self.assertIn("4 x 3", done.stdout)
        (record,) = [json.loads(line) for line in self.ok("detect --json board.png").stdout.splitlines()]
        places = {d["id"]: d["center_px"] for d in record["detections"]}
        self.assertEqual(sorted(places), list(range(12)))
        pitch_px = 37.5 / 25.4 * 100
        for number, (x, y) in places.items():
            self.assertLess(abs(x - places[0][0] - number % 4 * pitch_px), 0.2)
            self.assertLess(abs(places[0][1] - y - number // 4 * pitch_px), 0.2)

    def test_an_aprilgrid_has_a_note_about_its_detectors(self):
        done = self.ok("tags board --tag-size-m 0.02 -o board.svg")
        self.assertIn("--style separate", done.stderr)
        golden_page.expect(self, "tags", done.stderr)

    def test_errors_suggest_a_fix(self):
        for words, answer in (
                ("--tag-size-m 0.03 -o b.pdf", "0.0246 m"),
                ("--tag-size-m 0.02 --cols 0 -o b.pdf", "[1, 100]"),
                ("--tag-size-m 0.02 --spacing nan -o b.pdf", "(--spacing)"),
                ("--tag-size-m 0.02 --style grid -o b.pdf", "'grid'"),
                ("--tag-size-m 0.02 --family standard41h12 -o b.pdf", "'separate'"),
                ("--tag-size-m 0.02 --style separate --kalibr-yaml -o b.pdf", "'aprilgrid'"),
                ("--tag-size-m 0.02 --first-id 580 -o b.pdf", "615"),
                ("-o b.pdf", "--tag-size-m")):
            done = self.run_here("tags board " + words)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(answer, done.stderr, words)
            golden_page.expect(self, "tags", done.stderr)
        self.assertEqual(self.names(), [])


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
