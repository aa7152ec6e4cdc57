#!/usr/bin/python3
"""The built program as a user meets it: good input, bad input, exit codes, pipes, Ctrl-C.

usage: cli_test.py PROGRAM [unittest options]
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
import zlib

import pictures

PROGRAM = None
TAG_FAR = 0.5  # px: the tests ask whether it is the right tag in the right place, not how accurately


class Outcome:
    def __init__(self, process):
        self.code, self.out, self.err = process.returncode, process.stdout, process.stderr

    @property
    def records(self):
        return [json.loads(line) for line in self.out.splitlines()]


def waymark(*words, cwd=None, **options):
    options.setdefault("stdout", subprocess.PIPE)
    process = subprocess.run([PROGRAM, *map(str, words)], stderr=subprocess.PIPE, text=True, errors="replace", cwd=cwd,
                             timeout=120, check=False, **options)
    return Outcome(process)


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-cli-"))
        self.addCleanup(shutil.rmtree, self.folder)
        pictures.fill(self.folder)

    def run_here(self, *words, **options):
        outcome = waymark(*words, cwd=self.folder, **options)
        self.assertGreaterEqual(outcome.code, 0, f"killed by signal {-outcome.code}: {outcome.err}")
        self.assertNotIn("internal error", outcome.err)
        return outcome

    def assert_tags(self, record, tags):
        self.assertEqual([d["tag"] for d in record["detections"]], [f"{family}:{number}" for family, number, *_ in tags])
        for detection, tag in zip(record["detections"], tags):
            found = [value for corner in detection["corners_px"] for value in corner]
            for a, b in zip(found, pictures.corners(*tag)):
                self.assertLess(abs(a - b), TAG_FAR, detection)


class Detect(InFolder):
    def test_json_has_the_documented_keys(self):
        outcome = self.run_here("detect", "--json", "photograph.png")
        self.assertEqual(outcome.code, 0, outcome.err)
        (record,) = outcome.records
        self.assertEqual((record["image"], record["width_px"], record["height_px"]), ("photograph.png", 320, 240))
        self.assert_tags(record, pictures.SCENE_TAGS)
        first = record["detections"][0]
        self.assertEqual((first["family"], first["id"], first["hamming"]), ("tag36h11", 7, 0))
        self.assertLess(abs(first["center_px"][0] - 64) + abs(first["center_px"][1] - 74), TAG_FAR)
        self.assertGreater(first["decision_margin"], 10)

    def test_refined_corners_have_an_uncertainty(self):
        refined = self.run_here("detect", "--json", "--covariance", "photograph.png").records[0]["detections"][0]
        self.assertEqual(refined["refinement"], "refined")
        self.assertTrue(all(0 < s < 1 for corner in refined["corner_sigma_px"] for s in corner))
        covariance = refined["corner_covariance_px2"]
        self.assertEqual([len(row) for row in covariance], [8] * 8)
        self.assertEqual(covariance, [list(column) for column in zip(*covariance)])
        self.assertAlmostEqual(covariance[0][0] ** 0.5, refined["corner_sigma_px"][0][0], places=6)
        found = self.run_here("detect", "--json", "--covariance", "--no-refine", "photograph.png").records[0]["detections"][0]
        self.assertFalse({"refinement", "corner_sigma_px", "corner_covariance_px2"} & found.keys())
        self.assertNotEqual(found["corners_px"], refined["corners_px"])

    def test_tables_name_every_picture_and_tag(self):
        outcome = self.run_here("detect", "photos")
        self.assertEqual(outcome.code, 0)
        for part in ("photos/0001.png: 2 tags in 320 x 240 px", "tag36h11:42", "photos/0003.ppm: 0 tags"):
            self.assertIn(part, outcome.out)
        self.assertIn("3 pictures, 3 tags, 0 failed", outcome.err)

    def test_same_input_same_bytes(self):
        first = self.run_here("detect", "--json", "--covariance", "photos")
        self.assertEqual(first.out, self.run_here("detect", "--json", "--covariance", "photos").out)

    def test_formats(self):
        rows = pictures.scene(320, 240, pictures.SCENE_TAGS)
        pictures.write_pgm16(self.folder / "deep.pgm", rows)
        pictures.write_png(self.folder / "deep.png", rows, depth=16)
        pictures.write_ppm(self.folder / "colour.ppm", rows)
        (self.folder / "cmyk.jpg").write_bytes(pictures.CMYK_JPEG)
        outcome = self.run_here("detect", "--json", "deep.pgm", "deep.png", "colour.ppm", "cmyk.jpg")
        self.assertEqual(outcome.code, 0, outcome.err)
        for record in outcome.records[:3]:
            self.assert_tags(record, pictures.SCENE_TAGS)
        self.assertEqual((outcome.records[3]["width_px"], outcome.records[3]["detections"]), (64, []))

    def test_smallest_and_widest(self):
        pictures.write_pgm(self.folder / "one.pgm", [bytes([7])])
        far = [("tag36h11", 7, 19900, 20, 8)]
        pictures.write_pgm(self.folder / "wide.pgm", pictures.scene(20000, 110, far))
        outcome = self.run_here("detect", "--json", "--annotate", "seen", "one.pgm", "wide.pgm")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(outcome.records[0]["detections"], [])
        self.assert_tags(outcome.records[1], far)

    def test_other_families(self):
        tags = [("tag16h5", 3, 40, 40, 10)]
        pictures.write_png(self.folder / "small.png", pictures.scene(200, 160, tags))
        outcome = self.run_here("detect", "--json", "--family", "16h5", "--family", "tag36h11", "small.png", "photograph.png")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assert_tags(outcome.records[0], tags)
        self.assertIn("tag36h11:42", [d["tag"] for d in outcome.records[1]["detections"]])
        none = self.run_here("detect", "--json", "--family", "tag25h9", "photograph.png")
        self.assertEqual((none.code, none.records[0]["detections"]), (0, []))

    def test_patterns_and_folders(self):
        (self.folder / "photos/inner").mkdir()
        shutil.copy(self.folder / "photograph.png", self.folder / "photos/inner/deep.png")
        names = [r["image"] for r in self.run_here("detect", "--json", "photos/*.p?m").records]
        self.assertEqual(names, ["photos/0002.pgm", "photos/0003.ppm"])
        self.assertEqual(len(self.run_here("detect", "--json", "photos").records), 3)
        self.assertEqual(len(self.run_here("detect", "--json", "--recursive", "photos").records), 4)


class Annotate(InFolder):
    def test_every_picture_once_and_in_colour(self):
        for side in ("left", "right"):
            (self.folder / side).mkdir()
            shutil.copy(self.folder / "photograph.png", self.folder / side / "0001.png")
        outcome = self.run_here("detect", "--annotate", "out/seen", "left", "right", "photograph.png")
        self.assertEqual(outcome.code, 0, outcome.err)
        names = sorted(p.name for p in (self.folder / "out/seen").iterdir())
        self.assertEqual(names, ["left__0001.png.png", "photograph.png", "right__0001.png.png"])
        data = (self.folder / "out/seen/photograph.png").read_bytes()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual((int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big"), data[25]), (320, 240, 2))

    def test_a_folder_that_cannot_be_made_loses_no_results(self):
        (self.folder / "file").write_text("in the way")
        outcome = self.run_here("detect", "--json", "--annotate", "file/seen", "photos")
        self.assertEqual(outcome.code, 1)
        self.assertEqual(len(outcome.records), 3)
        self.assertIn("file/seen: cannot make the folder for annotated pictures", outcome.err)

    def test_one_that_cannot_be_written_fails_alone(self):
        (self.folder / "seen/0001.png").mkdir(parents=True)  # a folder where the file should go
        outcome = self.run_here("detect", "--json", "--annotate", "seen", "photos")
        self.assertEqual(outcome.code, 1)
        self.assertEqual([r.get("error", {}).get("code") for r in outcome.records], ["unwritable", None, None])
        self.assertEqual(len(outcome.records[0]["detections"]), 2)
        self.assertTrue((self.folder / "seen/0002.png").exists())

    def test_never_over_the_pictures(self):
        before = (self.folder / "photograph.png").read_bytes()
        for folder, source in ((".", "photograph.png"), ("photos/../photos", "photos")):
            outcome = self.run_here("detect", "--annotate", folder, source)
            self.assertEqual(outcome.code, 2)
            self.assertIn("holds the pictures themselves", outcome.err)
        self.assertEqual((self.folder / "photograph.png").read_bytes(), before)


class BadInput(InFolder):
    """Each says what is wrong, fails alone, and the good picture after it is processed."""

    def check(self, source, code, words):
        outcome = self.run_here("detect", "--json", source, "photograph.png")
        self.assertEqual(outcome.code, 1, outcome.err)
        failed, good = outcome.records
        self.assertEqual(failed["error"]["code"], code)
        self.assertNotIn("detections", failed)
        self.assertIn(words, outcome.err)
        self.assertIn(os.path.basename(source), outcome.err)
        self.assert_tags(good, pictures.SCENE_TAGS)
        table = self.run_here("detect", source, "photograph.png")
        self.assertEqual(table.code, 1)
        self.assertIn("photograph.png: 2 tags", table.out)

    def test_missing(self):
        self.check("photogarph.png", "not_found", "Did you mean 'photograph.png'?")

    def test_empty_file(self):
        (self.folder / "empty.png").touch()
        self.check("empty.png", "unreadable", "empty")

    def test_truncated(self):
        data = (self.folder / "photograph.png").read_bytes()
        (self.folder / "cut.png").write_bytes(data[: len(data) // 2])
        self.check("cut.png", "unreadable", "byte")
        (self.folder / "cut.pgm").write_bytes((self.folder / "photos/0002.pgm").read_bytes()[:-1])
        self.check("cut.pgm", "unreadable", "byte")
        (self.folder / "cut.jpg").write_bytes(pictures.CMYK_JPEG[:-40])
        self.check("cut.jpg", "unreadable", "")

    def test_not_a_picture(self):
        (self.folder / "words.jpg").write_text("This is not a picture.")
        self.check("words.jpg", "unreadable", "words.jpg")

    def test_hostile_size(self):
        pictures.write_png(self.folder / "huge.png", [bytes(8)])
        data = bytearray((self.folder / "huge.png").read_bytes())
        data[16:24] = (90000).to_bytes(4, "big") * 2
        data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
        (self.folder / "huge.png").write_bytes(data)
        self.check("huge.png", "limit_exceeded", "90000")

    def test_folder_without_pictures(self):
        (self.folder / "none").mkdir()
        self.check("none", "not_found", "no picture in this folder")

    def test_pattern_without_match(self):
        self.check("lap*.png", "not_found", "nothing matches this pattern")

    def test_video(self):
        (self.folder / "lap.mp4").write_bytes(b"\0\0\0\x18ftypmp42")
        self.check("lap.mp4", "unsupported", "video and cameras are not in this build yet. Extract frames first")

    @unittest.skipIf(os.geteuid() == 0, "root may read everything")
    def test_no_permission(self):
        (self.folder / "secret.png").write_bytes(b"")
        (self.folder / "secret.png").chmod(0)
        self.check("secret.png", "unreadable", "ermission")

    def test_a_name_that_is_not_utf8(self):
        name = os.fsdecode(b"caf\xe9.png")
        shutil.copy(self.folder / "photograph.png", self.folder / name)
        outcome = self.run_here("detect", "--json", name)
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assert_tags(outcome.records[0], pictures.SCENE_TAGS)


class Usage(InFolder):
    def check(self, words, *parts):
        outcome = self.run_here(*words)
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertEqual(outcome.out, "")
        for part in parts:
            self.assertIn(part, outcome.err)

    def test_each_mistake_says_the_nearest_right_word(self):
        self.check([], "no verb given", "Verbs:")
        self.check(["detcet", "photograph.png"], "unknown verb 'detcet'. Did you mean 'detect'?")
        self.check(["evaluate"], "See `waymark evaluate --help`")
        self.check(["evaluate", "detection"], "Did you mean 'detections'?")
        self.check(["detect"], "SOURCE is required")
        self.check(["detect", "--anotate", "x", "photograph.png"], "unknown flag '--anotate'. Did you mean '--annotate'?")
        self.check(["detect", "--family", "tag36h12", "photograph.png"], "tag36h12", "tag36h1")
        self.check(["detect", "--quad-decimate", "0", "photograph.png"], "(--quad-decimate): 0 is outside")
        self.check(["detect", "--quad-decimate", "much", "photograph.png"], "--quad-decimate")
        self.check(["evaluate", "detections", "photograph.png"], "--truth is required")
        self.check(["evaluate", "detections", "--truth", "truth.csv"], "give either pictures to detect in, or --detections")
        self.check(["evaluate", "detections", "--truth", "truth.csv", "--detections", "x", "photograph.png"], "give either")
        self.check(["evaluate", "detections", "--truth", "truth.csv", "--size-edges-px", "9,3", "photos"], "ascending")

    def test_configuration(self):
        def write(text):
            (self.folder / "detect.yaml").write_text(text)
            return ["detect", "--json", "--config", "detect.yaml", "photograph.png"]
        outcome = self.run_here(*write("detector:\n  families: [tag25h9]\n"))
        self.assertEqual((outcome.code, outcome.records[0]["detections"]), (0, []))
        outcome = self.run_here(*write("detector:\n  families: [tag25h9]\n"), "--family", "tag36h11")  # a flag overrides
        self.assertEqual(len(outcome.records[0]["detections"]), 2)
        self.check(write("detector:\n  quad_decimat: 2\n"), "detect.yaml:2 (detector.quad_decimat)", "'quad_decimate'")
        self.check(write("detector:\n  quad_decimate: 99\n"), "detect.yaml:2 (detector.quad_decimate)")
        self.check(write("refinement:\n  max_shift: 2\n"), "(refinement.max_shift)", "'max_shift_px'")
        self.check(write("detektor:\n"), "detect.yaml:1", "'detector'")
        self.check(write("detector: ["), "detect.yaml")
        self.check(["detect", "--config", "none.yaml", "photograph.png"], "none.yaml: cannot open: No such file")

    def test_help_and_version(self):
        for words in (["--help"], ["detect", "--help"], ["evaluate", "detections", "-h"], ["help", "detect"]):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.err), (0, ""))
            self.assertIn("waymark detect" if "evaluate" not in words else "waymark evaluate detections", outcome.out)
        self.assertRegex(self.run_here("--version").out, r"^waymark \d+\.\d+\.\d+\n$")

    def test_the_examples_in_help_run(self):
        count = 0
        for words in (["detect"], ["evaluate"], ["evaluate", "detections"]):
            text = self.run_here(*words, "--help").out
            for example in re.findall(r"^  (waymark .*)$", text[text.index("Example"):], re.M):
                path = f"{os.path.dirname(PROGRAM)}:{os.environ['PATH']}"
                done = subprocess.run(["bash", "-c", example], cwd=self.folder, env={**os.environ, "PATH": path},
                                      capture_output=True, text=True, timeout=120, check=False)
                self.assertEqual(done.returncode, 0, f"{example}\n{done.stderr}")
                count += 1
        self.assertGreaterEqual(count, 7)


class Evaluate(InFolder):
    def test_a_clean_scene_is_found_whole(self):
        outcome = self.run_here("evaluate", "detections", "--json", "--truth", "truth.csv", "photos")
        self.assertEqual(outcome.code, 0, outcome.err)
        (scores,) = outcome.records
        counts = {key: scores[key] for key in ("images", "truth", "detections", "correct", "wrong_ids", "false_positives")}
        self.assertEqual(counts, {"images": 3, "truth": 3, "detections": 3, "correct": 3, "wrong_ids": 0, "false_positives": 0})
        self.assertEqual(scores["recall"], 1)
        self.assertLess(scores["corners"]["rmse_px"], TAG_FAR)
        self.assertEqual(sum(row["truth"] for row in scores["by_size"]), 3)
        self.assertIn("1 pictures of the truth were not given", outcome.err)

    def test_from_detections_as_from_pictures(self):
        saved = self.run_here("detect", "--json", "--covariance", "photos").out
        (self.folder / "tags.jsonl").write_text(saved)
        direct = self.run_here("evaluate", "detections", "--truth", "truth.csv", "photos")
        stored = self.run_here("evaluate", "detections", "--truth", "truth.csv", "--detections", "tags.jsonl")
        piped = self.run_here("evaluate", "detections", "--truth", "truth.csv", "--detections", "-", input=saved)
        self.assertEqual((stored.code, piped.code), (0, 0), stored.err + piped.err)
        self.assertEqual(stored.out, direct.out)
        self.assertEqual(piped.out, direct.out)
        self.assertIn("3 pictures, 3 true tags, 3 reported: 3 correct (recall 100.0 %)", direct.out)

    def test_wrong_truth_shows(self):
        moved = [("tag36h11", 8 - 1, 40, 50, 6), ("tag36h11", 42, 100, 90, 10)]  # the second one elsewhere
        text = pictures.truth_csv({"photograph": moved}).replace("tag36h11,7,", "tag36h11,8,")
        (self.folder / "other.csv").write_text(text)
        outcome = self.run_here("evaluate", "detections", "--json", "--truth", "other.csv", "photograph.png")
        (scores,) = outcome.records
        self.assertEqual([scores[k] for k in ("correct", "wrong_ids", "false_positives", "recall")], [0, 1, 1, 0])
        self.assertIsNone(scores["corners"])

    def test_bad_truth_and_bad_detections(self):
        (self.folder / "bad.csv").write_text("image,id,x0,y0,x1,y1,x2,y2,x3,y3\nphotograph,7,1,2,3,4,5,6,7,eight\n")
        for words, parts in (
                (["--truth", "none.csv", "photos"], ["none.csv: cannot open"]),
                (["--truth", "bad.csv", "photos"], ["bad.csv:2 (y3): 'eight' is not a finite number"]),
                (["--truth", "photograph.png", "photos"], ["photograph.png"]),
                (["--truth", "truth.csv", "--detections", "truth.csv"], ["truth.csv:1: is not a JSON object"])):
            outcome = self.run_here("evaluate", "detections", *words)
            self.assertEqual((outcome.code, outcome.out), (1, ""), outcome.err)
            for part in parts:
                self.assertIn(part, outcome.err)

    def test_pictures_the_truth_does_not_know(self):
        shutil.copy(self.folder / "photograph.png", self.folder / "unknown.png")
        alone = self.run_here("evaluate", "detections", "--truth", "truth.csv", "unknown.png")
        self.assertEqual(alone.code, 1)
        self.assertIn("none of the pictures is in the truth. The truth names '0001', for example.", alone.err)
        both = self.run_here("evaluate", "detections", "--truth", "truth.csv", "--json", "unknown.png", "photograph.png")
        self.assertEqual((both.code, both.records[0]["false_positives"]), (0, 2))
        self.assertIn("1 pictures are not in the truth", both.err)

    def test_what_cannot_be_read_is_left_out_and_said(self):
        (self.folder / "photos/0004.png").touch()
        outcome = self.run_here("evaluate", "detections", "--truth", "truth.csv", "photos")
        self.assertEqual(outcome.code, 1)
        self.assertIn("1 pictures failed: left out", outcome.err)
        self.assertIn("3 correct (recall 100.0 %)", outcome.out)


class PipesAndSignals(InFolder):
    COPIES = 200

    def setUp(self):
        super().setUp()
        rows = pictures.scene(640, 480, pictures.SCENE_TAGS)
        pictures.write_pgm(self.folder / "one.pgm", rows)
        (self.folder / "many").mkdir()
        for number in range(self.COPIES):
            (self.folder / f"many/{number:03}.pgm").symlink_to("../one.pgm")

    def start(self):
        return subprocess.Popen([PROGRAM, "detect", "--json", "many"], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def test_a_closed_pipe_ends_quietly(self):
        process = self.start()
        process.stdout.readline()
        process.stdout.close()
        words = process.stderr.read()
        process.stderr.close()
        self.assertEqual(process.wait(timeout=60), 0, words)
        self.assertNotIn("cannot write", words)

    def test_a_full_disk_is_a_failure(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            outcome = self.run_here("detect", "--json", "photograph.png", stdout=full)
            self.assertEqual(outcome.code, 1)
            self.assertIn("cannot write to standard output: No space left on device", outcome.err)
            self.assertEqual(self.run_here("--help", stdout=full).code, 1)

    def test_ctrl_c_keeps_what_was_done(self):
        process = self.start()
        first = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest, words = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, words)
        records = [json.loads(line) for line in (first + rest).splitlines()]
        self.assertLess(len(records), self.COPIES)
        self.assertIn(f"stopped after {len(records)} of {self.COPIES} inputs", words)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
