"""`waymark convert` on the command line: our own lap and real recordings of other programs."""
import bz2
import csv
import gzip
import json
import os
import pathlib
import unittest

from harness import InFolder
from laps import LAP, put
import golden_page


def real_data(relative):
    path = pathlib.Path(os.environ.get("WAYMARK_DATA", "/nonexistent")) / relative
    if path.exists():
        return path
    if os.environ.get("WAYMARK_REQUIRE_DATA"):
        raise AssertionError(f"WAYMARK_DATA does not hold {relative}")
    raise unittest.SkipTest(f"WAYMARK_DATA does not hold {relative}")


class Convert(InFolder):
    def convert(self, *words, code=0):
        done = self.run_here("convert", *words)
        self.assertEqual(done.code, code, done.err)
        self.assertEqual([p.name for p in self.folder.iterdir() if p.name.endswith(".part")], [])
        return done

    def info(self, path):
        return json.loads(self.run_here("info", "--json", path).out)

    def counts(self, path):
        return {t["topic"]: t["messages"] for t in self.info(path)["topics"]}

    def lap(self):
        put(self.folder, *LAP)

    def test_our_own_lap(self):
        self.lap()
        lap = self.info("lap.mcap")
        all_of_it = json.loads(self.convert("lap.mcap", "again.mcap", "--json").out)
        self.assertEqual(all_of_it["messages"], lap["messages"])
        self.assertEqual(self.counts("again.mcap"), self.counts("lap.mcap"))
        again = self.info("again.mcap")
        self.assertEqual(again["attachments"], lap["attachments"])
        self.assertEqual(again["metadata"]["waymark"], lap["metadata"]["waymark"])
        self.assertEqual(again["metadata"]["waymark_convert"]["source"], "lap.mcap")

        self.convert("lap.mcap", "two.mcap", "--topics", "/odom,/imu", "--from", "2", "--to", "5.5")
        two = self.counts("two.mcap")
        self.assertEqual(set(two), {"/odom", "/imu"})
        rates = {t["topic"]: t["rate_hz"] for t in lap["topics"]}
        for topic, count in two.items():
            self.assertAlmostEqual(count, 3.5 * rates[topic], delta=0.02 * count + 2)

        self.convert("lap.mcap", "path.tum", "--topic", "/odom")
        lines = [[float(v) for v in line.split()] for line in (self.folder / "path.tum").read_text().splitlines()]
        self.assertEqual(len(lines), self.counts("lap.mcap")["/odom"])
        self.assertTrue(all(len(line) == 8 and abs(sum(q * q for q in line[4:]) - 1) < 1e-9 for line in lines))
        self.assertEqual([line[0] for line in lines], sorted(line[0] for line in lines))
        truth = self.convert("lap.mcap", "truth.txt", "--format", "tum", "--topic", "/truth/pose")
        self.assertIn("/truth/pose", truth.out)
        several = self.convert("lap.mcap", "some.tum", code=1)
        self.assertIn("--topics", several.err)
        self.assertFalse((self.folder / "some.tum").exists())

    def test_tables_round_trip(self):
        self.lap()
        for kind in ("detections", "odometry", "imu"):
            self.convert("lap.mcap", f"{kind}.csv", "--kind", kind)
            self.convert(f"{kind}.csv", f"{kind}.mcap")
            self.convert(f"{kind}.mcap", f"{kind}2.csv")
            first, second = ((self.folder / name).read_text().splitlines() for name in (f"{kind}.csv", f"{kind}2.csv"))
            self.assertEqual((len(first), first[0]), (len(second), second[0]))
            for a, b in zip(first[1:], second[1:]):
                for x, y in zip(a.split(","), b.split(",")):
                    if x != y:  # headings were converted to quaternions, pixels shifted by half a pixel and back
                        self.assertAlmostEqual(float(x), float(y), 9)
        with open(self.folder / "detections.csv", newline="", encoding="utf-8") as table:
            rows = list(csv.DictReader(table))
        self.assertGreater(len(rows), 1000)
        self.assertTrue(all(r["tag"].startswith("tag36h11:") and float(r["tl_x_px"]) < float(r["br_x_px"]) + 640 for r in rows))
        self.assertIn("--kind", self.convert("lap.mcap", "what.csv", code=1).err)

    def test_errors_contain_the_place_and_a_fix(self):
        self.lap()
        (self.folder / "there.mcap").write_text("mine")
        self.assertIn("there.mcap: ", self.convert("lap.mcap", "there.mcap", code=1).err)
        self.assertEqual((self.folder / "there.mcap").read_text(), "mine")
        self.assertIn("--format", self.convert("lap.mcap", "lap.xyz", code=2).err)
        self.assertIn("'/odom'", self.convert("lap.mcap", "out.mcap", "--topics", "/odm", code=1).err)
        self.assertIn("--from", self.convert("lap.mcap", "out.mcap", "--from", "noon", code=2).err)
        for source, target, place in (("there.mcap", "out.mcap", "there.mcap: "), ("nowhere.mcap", "out.mcap", "nowhere.mcap: "),
                                      ("lap.mcap", "no/such/folder/out.mcap", "no/such/folder/out.mcap: ")):
            failed = self.convert(source, target, code=1)
            self.assertIn(place, failed.err)
            golden_page.expect(self, "convert", failed.err)
        self.assertFalse((self.folder / "out.mcap").exists())

    def test_the_real_lcm_log(self):
        log = real_data("lcm/lcmlog-2024-04-15.00")
        done = json.loads(self.convert(log, "log.mcap", "--json").out)
        self.assertEqual(done["messages"], 24_019)
        problems = {p["key"]: p for p in done["problems"]}
        self.assertEqual(problems["mbot.millimetres"]["count"], 18_710)
        self.assertEqual(self.counts("log.mcap"), {"/odom": 4535, "/imu": 4535, "/joint_states": 4535, "/cmd_vel": 3640,
                                                   "/tag_poses": 6774})
        self.assertIn("mbot.publish_stamps", self.info("log.mcap")["metadata"]["waymark_import"])
        self.convert(log, "odom.tum")
        self.assertEqual(len((self.folder / "odom.tum").read_text().splitlines()), 4535)
        words = self.convert(log, "imu.csv", "--kind", "imu", "--from", "10", "--to", "20")
        self.assertIn("gravity", words.err)
        self.assertAlmostEqual(len((self.folder / "imu.csv").read_text().splitlines()), 247, delta=4)

    def test_truncation_is_reported(self):
        cut = self.folder / "cut"
        cut.write_bytes(real_data("lcm/lcmlog-2024-04-15.00").read_bytes()[:100_000])
        done = json.loads(self.convert(cut, "cut.mcap", "--json").out)
        self.assertEqual([p["key"] for p in done["problems"] if p["kind"] == "damage"], ["lcm.cut"])
        bag = real_data("tagslam/test_2/tag_detections.bag.bz2")
        cut.write_bytes(bz2.decompress(bag.read_bytes())[:700_000])
        for name in ("bag.mcap", "bag.csv"):
            done = json.loads(self.convert(cut, name, "--json").out)
            self.assertEqual({p["key"] for p in done["problems"] if p["kind"] == "damage"},
                             {"ros1bag.no_index", "ros1bag.cut", "ros1bag.chunk"})
            self.assertGreater(done["messages"], 700)
        self.assertIn("byte", self.convert(cut, "words.mcap").err)

    def test_every_real_bag(self):
        bags = sorted(real_data("tagslam").glob("test_*/tag_detections.bag.bz2"))
        self.assertEqual(len(bags), 12)
        for bag in bags:
            name = bag.parent.name
            with gzip.open(bag.parent / "detections.csv.gz", "rt") as table:
                expected = sum(1 for _ in table) - 1
            self.convert(bag, f"{name}.mcap")
            self.convert(f"{name}.mcap", f"{name}.csv", "--kind", "detections")
            lines = (self.folder / f"{name}.csv").read_text().splitlines()
            self.assertEqual(len(lines) - 1, expected, name)
            self.convert(bag, f"{name}_direct.csv", "--kind", "detections")
            self.assertEqual(lines, (self.folder / f"{name}_direct.csv").read_text().splitlines(), name)


if __name__ == "__main__":
    unittest.main()
