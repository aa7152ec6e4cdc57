#!/usr/bin/python3
"""`waymark evaluate detections` on the command line: the table, the JSON output, and a ground truth that does not match.

usage: evaluate_test.py PROGRAM [unittest options]
"""
import shutil
import unittest

import images
from harness import TAG_FAR, InFolder
import golden_page


class Evaluate(InFolder):
    def test_every_tag_of_a_clean_scene_is_detected(self):
        outcome = self.run_here("evaluate", "detections", "--json", "--truth", "truth.csv", "photos")
        self.assertEqual(outcome.code, 0, outcome.err)
        (scores,) = outcome.records
        counts = {key: scores[key] for key in ("images", "truth", "detections", "correct", "wrong_ids", "false_positives")}
        self.assertEqual(counts, {"images": 3, "truth": 3, "detections": 3, "correct": 3, "wrong_ids": 0, "false_positives": 0})
        self.assertEqual(scores["recall"], 1)
        self.assertLess(scores["corners"]["rmse_px"], TAG_FAR)
        self.assertEqual(sum(row["truth"] for row in scores["by_size"]), 3)
        self.assertRegex(outcome.err, r"\b1 \w+\n")
        golden_page.expect(self, "evaluate", outcome.err)

    def test_stored_detections_give_the_same_result_as_images(self):
        saved = self.run_here("detect", "--json", "--covariance", "photos").out
        (self.folder / "tags.jsonl").write_text(saved)
        direct = self.run_here("evaluate", "detections", "--truth", "truth.csv", "photos")
        stored = self.run_here("evaluate", "detections", "--truth", "truth.csv", "--detections", "tags.jsonl")
        piped = self.run_here("evaluate", "detections", "--truth", "truth.csv", "--detections", "-", input=saved)
        self.assertEqual((stored.code, piped.code), (0, 0), stored.err + piped.err)
        self.assertEqual(stored.out, direct.out)
        self.assertEqual(piped.out, direct.out)
        self.assertRegex(direct.out, r"^3 .* 3 .* 3 .* 3 .*\b100\.0 %")

    def test_a_wrong_ground_truth_reduces_the_score(self):
        moved = [("tag36h11", 8 - 1, 40, 50, 6), ("tag36h11", 42, 100, 90, 10)]  # the second one elsewhere
        text = images.truth_csv({"photograph": moved}).replace("tag36h11,7,", "tag36h11,8,")
        (self.folder / "other.csv").write_text(text)
        outcome = self.run_here("evaluate", "detections", "--json", "--truth", "other.csv", "photograph.png")
        (scores,) = outcome.records
        self.assertEqual([scores[k] for k in ("correct", "wrong_ids", "false_positives", "recall")], [0, 1, 1, 0])
        self.assertIsNone(scores["corners"])

    def test_unusable_truth_and_detections_are_errors(self):
        (self.folder / "bad.csv").write_text("image,id,x0,y0,x1,y1,x2,y2,x3,y3\nphotograph,7,1,2,3,4,5,6,7,eight\n")
        for words, part in (
                (["--truth", "none.csv", "photos"], "none.csv: "),
                (["--truth", "bad.csv", "photos"], "bad.csv:2 (y3): 'eight'"),
                (["--truth", "photograph.png", "photos"], "photograph.png"),
                (["--truth", "truth.csv", "--detections", "truth.csv"], "truth.csv: ")):
            outcome = self.run_here("evaluate", "detections", *words)
            self.assertEqual((outcome.code, outcome.out), (1, ""), outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "evaluate", outcome.err)

    def test_images_without_ground_truth(self):
        shutil.copy(self.folder / "photograph.png", self.folder / "unknown.png")
        alone = self.run_here("evaluate", "detections", "--truth", "truth.csv", "unknown.png")
        self.assertEqual(alone.code, 1)
        self.assertIn("'0001'", alone.err)
        both = self.run_here("evaluate", "detections", "--truth", "truth.csv", "--json", "unknown.png", "photograph.png")
        self.assertEqual((both.code, both.records[0]["false_positives"]), (0, 2))
        golden_page.expect(self, "evaluate", both.err)

    def test_unreadable_images_are_skipped_and_reported(self):
        (self.folder / "photos/0004.png").touch()
        outcome = self.run_here("evaluate", "detections", "--truth", "truth.csv", "photos")
        self.assertEqual(outcome.code, 1)
        self.assertIn("photos/0004.png", outcome.err)
        golden_page.expect(self, "evaluate", outcome.err)
        self.assertRegex(outcome.out, r" 3 \w+ \(\w+ 100\.0 %\)")


if __name__ == "__main__":
    unittest.main()
