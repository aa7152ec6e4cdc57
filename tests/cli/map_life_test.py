#!/usr/bin/python3
"""Maps that change: a second lap, frozen and removed tags, formats of other programs; and a log that contains only tag poses.

usage: map_life_test.py PROGRAM [unittest options]
"""
import json
import math
import os
import pathlib
import shutil
import unittest

from harness import InFolder
from laps import LAP, MAP, OTHER_LAP, made, put
import golden_page


class Extend(InFolder):
    def test_a_second_lap_improves_a_map(self):
        for name, lap in (("lap2", LAP), ("lap3", OTHER_LAP)):
            shutil.copy(made(*lap) / "lap.mcap", self.folder / f"{name}.mcap")
        (first,) = self.run_here("map", "lap2.mcap", "-o", "map", "--json").records
        before = (self.folder / "map/map.yaml").read_bytes()
        refused = self.run_here("map", "lap3.mcap", "-o", "map", "--extend", "map", "--freeze", "99")
        self.assertEqual(refused.code, 2)
        self.assertIn("(--freeze): tag36h11:99 ", refused.err)
        self.assertEqual((self.folder / "map/map.yaml").read_bytes(), before, "a failed run does not change the map")
        self.assertFalse((self.folder / "map/map.1.yaml").exists())
        outcome = self.run_here("map", "lap3.mcap", "-o", "map", "--extend", "map", "--freeze", "5,6", "--remove", "tag36h11:7", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (second,) = outcome.records
        self.assertEqual((second["tags"], second["extended_tags_agreeing"]), (23, 23))
        self.assertLess(second["tag_rmse_m"], 1.1 * first["tag_rmse_m"])
        self.assertEqual((self.folder / "map/map.1.yaml").read_bytes(), before)
        text = (self.folder / "map/map.yaml").read_text()
        self.assertIn("extends: lap2.mcap", text)
        self.assertNotIn("tag36h11:7\"", text)
        frozen = before.decode().split('tag: "tag36h11:5"')[1].split("quaternion")[0]
        self.assertIn(frozen, text, "frozen tags do not move")
        again = self.run_here("map", "lap3.mcap", "-o", "again", "--extend", "map")
        self.assertEqual(again.code, 0, again.err)
        self.assertRegex(again.err, r"warning: .*\blap3\.mcap")
        golden_page.expect(self, "map", again.err)
        self.assertNotIn("lap3.mcap", outcome.err)
        for words, part in ((["--freeze", "5"], "--extend"), (["--remove", "5"], "--extend"),
                            (["--extend", "map", "--anchor", "5"], "(--anchor)"),
                            (["--extend", "map", "--freeze", "3,4", "--remove", "4"], "tag36h11:4 "),
                            (["--extend", "map", "--remove", "x"], "x"),
                            (["--model", "tagslam"], "`waymark map scene`"), (["--against", "map"], "`waymark map scene`")):
            mistake = self.run_here("map", "lap3.mcap", "-o", "other", *words)
            self.assertEqual(mistake.code, 2, mistake.err)
            self.assertIn(part, mistake.err)
        missing = self.run_here("map", "lap3.mcap", "-o", "other", "--extend", "none.yaml")
        self.assertEqual(missing.code, 1, "as for every unusable file")
        self.assertIn("none.yaml", missing.err)
        size = self.run_here("map", "lap3.mcap", "-o", "other", "--extend", "map", "--tag-size-m", 0.2)
        self.assertIn("--tag-size-m 0.2", size.err)
        chain = self.run_here("map", "lap3.mcap", "-o", "other", "--extend", "map", "--method", "chain")
        self.assertEqual(chain.code, 2)
        self.assertIn("(--method): ", chain.err)
        golden_page.expect(self, "map", chain.err)


class TransformsOfRos1(InFolder):
    def test_tags_on_tf_static_of_a_bag(self):
        import genpy  # Debian: python3-rosbag
        import rosbag
        from geometry_msgs.msg import TransformStamped
        from tf2_msgs.msg import TFMessage
        with rosbag.Bag(str(self.folder / "tf.bag"), "w", compression="bz2") as bag:
            for k, (topic, parent, child, x) in enumerate((
                    ("/tf", "map", "tag36h11:4", 9.0), ("/tf_static", "map", "tag36h11:3", 1.5), ("/tf", "map", "tag36h11:4", 2.5),
                    ("/tf", "camera_optical", "tag36h11:5", 0.7), ("/tf", "map", "base_link", 0.1))):
                transform = TransformStamped(child_frame_id=child)
                transform.header.frame_id, transform.header.stamp = parent, genpy.Time(100 + k)
                transform.transform.translation.x, transform.transform.translation.z = x, 0.3
                transform.transform.rotation.x, transform.transform.rotation.w = math.sqrt(0.5), -math.sqrt(0.5)
                bag.write(topic, TFMessage(transforms=[transform]), genpy.Time(100 + k))
        mistake = self.run_here("map", "convert", "tf.bag", "map.yaml")
        self.assertEqual(mistake.code, 1)
        self.assertIn("--tag-size-m", mistake.err)
        outcome = self.run_here("map", "convert", "tf.bag", "map.yaml", "--tag-size-m", 0.16, "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual((outcome.records[0]["from"], outcome.records[0]["tags"]), ("tf", 2))
        self.assertIn("tag36h11:5 (from camera_optical)", outcome.err)
        text = (self.folder / "map.yaml").read_text()
        self.assertIn("2.5", text, "the last transform of a tag is used")
        self.assertNotIn("9.0", text)
        back = self.run_here("map", "convert", "map.yaml", "back.yaml", "--to", "tf", "--json")
        self.assertEqual(back.code, 0, back.err)
        self.assertIn("1.5", (self.folder / "back.yaml").read_text())


class TablesOfDetections(InFolder):
    def test_a_table_alone_contains_no_camera_parameters(self):
        (self.folder / "detections.csv").write_text(
            "t_ns,cam,tag,x0,y0,x1,y1,x2,y2,x3,y3,hamming\n1000,cam0,3,10,10,50,10,50,50,10,50,0\n")
        outcome = self.run_here("map", "detections.csv", "-o", "map")
        self.assertEqual(outcome.code, 1)
        self.assertIn("/camera_info", outcome.err)
        self.assertIn("`waymark map --tagslam FOLDER`", outcome.err)


class Convert(InFolder):
    def test_there_and_back(self):
        put(self.folder, *MAP)
        for form in ("academy", "tagslam", "tf"):
            there = self.run_here("map", "convert", "map", f"{form}.yaml", "--to", form, "--json")
            self.assertEqual(there.code, 0, there.err)
            self.assertEqual((there.records[0]["from"], there.records[0]["tags"]), ("waymark", 24))
            size = [] if form == "tagslam" else ["--tag-size-m", 0.16]
            back = self.run_here("map", "convert", f"{form}.yaml", f"{form}_back.yaml", *size, "--json")
            self.assertEqual(back.code, 0, back.err)
            self.assertEqual((back.records[0]["from"], back.records[0]["tags"]), (form, 24))
            mapped = self.run_here("map", "lap.mcap", "-o", "again", "--prior", f"{form}_back.yaml", "--json")
            self.assertEqual(mapped.code, 0, mapped.err)
            self.assertEqual(mapped.records[0]["prior_tags_agreeing"], 24)
            self.assertLess(mapped.records[0]["prior_rms_m"], 0.01)
        limelight = self.run_here("map", "convert", "map", "field.fmap")
        self.assertEqual(limelight.code, 0, limelight.err)
        self.assertEqual(json.loads((self.folder / "field.fmap").read_text(encoding="utf-8"))["type"], "frc")
        recorded = self.run_here("map", "convert", "map", "tf.mcap", "--to", "tf", "--json")
        self.assertEqual(recorded.code, 0, recorded.err)
        back = self.run_here("map", "convert", "tf.mcap", "tf_back2.yaml", "--tag-size-m", 0.16, "--json")
        self.assertEqual(back.code, 0, back.err)
        self.assertEqual((back.records[0]["from"], back.records[0]["tags"]), ("tf", 24))
        mapped = self.run_here("map", "lap.mcap", "-o", "again", "--prior", "tf_back2.yaml", "--json")
        self.assertEqual(mapped.records[0]["prior_tags_agreeing"], 24, mapped.err)
        loop = mapped.records[0]["loop_closure"]
        self.assertGreater(loop["way_m"], 8)
        self.assertGreater(loop["before_m"], 5 * loop["after_m"])
        rejected = mapped.records[0]["observations_rejected_by_tag"].values()
        self.assertEqual(sum(sum(tag.values()) - tag["used"] for tag in rejected), mapped.records[0]["observations_rejected"])
        again = self.run_here("map", "convert", "map", "tf.yaml", "--to", "tf")
        self.assertEqual(again.code, 1)
        self.assertIn("tf.yaml: ", again.err)
        self.assertEqual(self.run_here("map", "convert", "map", "tf.yaml", "--to", "tf", "--force", "--remove", "3").code, 0)
        for words, code, part in ((["map", "x.yaml", "--to", "tff"], 2, "'tf'?"), (["tf.yaml", "x.yaml"], 1, "--tag-size-m"),
                                  (["none", "x.yaml"], 1, "none"), (["map", "x.yaml", "--remove", "99"], 2, "(--remove): tag36h11:99 "),
                                  (["lap.mcap", "x.yaml"], 1, "lap.mcap: ")):
            mistake = self.run_here("map", "convert", *words)
            self.assertEqual(mistake.code, code, mistake.err)
            self.assertIn(part, mistake.err)
            golden_page.expect(self, "map", mistake.err)
            self.assertFalse((self.folder / "x.yaml").exists())


DATA = pathlib.Path(os.environ.get("WAYMARK_DATA", ""))
LOG = DATA / "lcm/lcmlog-2024-04-15.00"


def aligned_rmse(found, truth):
    """RMSE of points in the plane after least-squares alignment by a rotation and a translation."""
    n = len(found)
    cf, ct = (tuple(sum(p[k] for p in points) / n for k in (0, 1)) for points in (found, truth))
    c = sum((f[0] - cf[0]) * (t[0] - ct[0]) + (f[1] - cf[1]) * (t[1] - ct[1]) for f, t in zip(found, truth))
    s = sum((f[0] - cf[0]) * (t[1] - ct[1]) - (f[1] - cf[1]) * (t[0] - ct[0]) for f, t in zip(found, truth))
    a = math.atan2(s, c)
    off = [math.hypot(math.cos(a) * (f[0] - cf[0]) - math.sin(a) * (f[1] - cf[1]) + ct[0] - t[0],
                      math.sin(a) * (f[0] - cf[0]) + math.cos(a) * (f[1] - cf[1]) + ct[1] - t[1]) for f, t in zip(found, truth)]
    return math.sqrt(sum(d * d for d in off) / n)


class PosesOnly(InFolder):
    @unittest.skipUnless(LOG.is_file(), "WAYMARK_DATA has no lcm/")
    def test_an_mbot_maps_its_own_tags(self):
        landmarks = DATA / "lcm/landmarks.csv"
        outcome = self.run_here("map", LOG, "-o", "map", "--prior", landmarks, "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (summary,) = outcome.records
        self.assertEqual((summary["method"], summary["tags"], summary["route_closed"]), ("poses", 8, True))
        self.assertRegex(outcome.err, r"tagCustom48h12:5 .*tagCustom48h12:6")
        self.assertEqual(summary["prior_tags_agreeing"], 6)
        rows = [line.split(",") for line in landmarks.read_text().split()[1:]]
        tape = {int(row[0]): (float(row[1]), float(row[2])) for row in rows}
        tape[5], tape[6] = tape[6], tape[5]
        found = {}
        for entry in (self.folder / "map/map.yaml").read_text().split('tag: "tagCustom48h12:')[1:]:
            place = entry.split("position_m: [")[1].split("]")[0].split(",")
            found[int(entry.split('"')[0])] = (float(place[0]), float(place[1]))
        ids = sorted(tape)
        rmse = aligned_rmse([found[i] for i in ids], [tape[i] for i in ids])
        print(f"tags against the tape, after alignment: {rmse:.4f} m rmse")
        self.assertLess(rmse, 0.02)
        again = self.run_here("localize", LOG, "--map", "map", "-o", "there.mcap")
        self.assertEqual(again.code, 0, again.err)
        self.assertEqual(self.run_here("map", LOG, "-o", "other", "--anchor", "1").code, 1)


if __name__ == "__main__":
    unittest.main()
