#!/usr/bin/python3
"""`waymark evaluate detections` as a user meets it: the table, the JSON, and truths that do not fit.

usage: evaluate_test.py PROGRAM [unittest options]
"""
import shutil
import unittest

import pictures
from harness import TAG_FAR, InFolder


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
        self.assertIn("not given: 1 picture", outcome.err)

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
                (["--truth", "none.csv", "photos"], ["none.csv: there is no such file"]),
                (["--truth", "bad.csv", "photos"], ["bad.csv:2 (y3): 'eight' is not a finite number"]),
                (["--truth", "photograph.png", "photos"], ["photograph.png"]),
                (["--truth", "truth.csv", "--detections", "truth.csv"], ["truth.csv: this is a table of true corners, not the output of `waymark detect`"])):
            outcome = self.run_here("evaluate", "detections", *words)
            self.assertEqual((outcome.code, outcome.out), (1, ""), outcome.err)
            for part in parts:
                self.assertIn(part, outcome.err)

    def test_pictures_the_truth_does_not_know(self):
        shutil.copy(self.folder / "photograph.png", self.folder / "unknown.png")
        alone = self.run_here("evaluate", "detections", "--truth", "truth.csv", "unknown.png")
        self.assertEqual(alone.code, 1)
        self.assertIn("'0001'", alone.err)
        both = self.run_here("evaluate", "detections", "--truth", "truth.csv", "--json", "unknown.png", "photograph.png")
        self.assertEqual((both.code, both.records[0]["false_positives"]), (0, 2))
        self.assertIn("no tag: 1 picture", both.err)

    def test_what_cannot_be_read_is_left_out_and_said(self):
        (self.folder / "photos/0004.png").touch()
        outcome = self.run_here("evaluate", "detections", "--truth", "truth.csv", "photos")
        self.assertEqual(outcome.code, 1)
        self.assertIn("skipped: 1 picture", outcome.err)
        self.assertIn("3 correct (recall 100.0 %)", outcome.out)


if __name__ == "__main__":
    unittest.main()
