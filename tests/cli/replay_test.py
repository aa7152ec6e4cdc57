#!/usr/bin/python3
"""`waymark replay` and `waymark routes`.

usage: replay_test.py PROGRAM [unittest options]
"""
import pathlib
import re
import shutil
import unittest

from laps import REPLAY_KEYS, WithMap
import golden_page

ROOT = pathlib.Path(__file__).resolve().parents[2]
CALIBRATION = "format: waymark-calibration-1\nvalues:\n  yaw_scale: {value: 0.6, sigma: 0.01, verdict: known}\n"


class Replay(WithMap):
    def replay(self, *words):
        return self.run_here("replay", "map", "--robot", "sim", "--world", "circuit24", *words)

    def test_replays_the_route(self):
        outcome = self.replay("--seed", 12, "--json", "-o", "replay.mcap")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        (summary,) = outcome.records
        self.assertLessEqual(REPLAY_KEYS, summary.keys())
        self.assertEqual((summary["laps_completed"], summary["stops"]), (1, 0))
        self.assertLess(summary["cross_track_rmse_m"], 0.10)
        self.assertGreater(summary["min_clearance_m"], 0.15)
        (info,) = self.run_here("info", "--json", "replay.mcap").records
        self.assertIn("/waymark/pose", [t["topic"] for t in info["topics"]])
        self.assertLessEqual({"map.yaml", "route.yaml", "robot.yaml"}, {a["name"] for a in info["attachments"]})
        again = self.replay("--seed", 12, "--json", "--taught", "lap.mcap").records[0]
        for key in REPLAY_KEYS - {"wall_s"}:  # the ground truth in the folder is text: its last bits may differ
            if isinstance(summary[key], float):
                self.assertAlmostEqual(again[key], summary[key], 9, key)
            else:
                self.assertEqual(again[key], summary[key], key)

    def test_two_laps(self):
        (summary,) = self.replay("--laps", 2, "--json").records
        self.assertEqual(summary["laps_completed"], 2)

    def test_a_stop_is_reported_and_is_a_failure(self):
        outcome = self.replay("--json", "--min-clearance-m", 5)
        self.assertEqual(outcome.code, 1)
        self.assertFalse(outcome.records[0]["finished"])
        self.assertIn("(limit 5.00 m)", outcome.records[0]["reason"])
        self.assertIn(outcome.records[0]["reason"], outcome.err)

    def test_a_tag_with_an_error_of_kilometres_in_the_map_is_reported(self):
        text = (self.folder / "map/map.yaml").read_text()
        head, entry = text.split('tag: "tag36h11:7"')
        (self.folder / "map/map.yaml").write_text(f'{head}tag: "tag36h11:7"' + re.sub(r"position_m: \[[-\d.e]+", "position_m: [5000", entry, count=1))
        outcome = self.replay("--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (warning,) = outcome.records[0]["warnings"]
        self.assertRegex(warning, r"^tag36h11:7 .*\b(499|500)\d\.\d\d m ")
        self.assertIn(warning, outcome.err)

    def test_a_route_at_another_place_is_refused(self):
        shutil.copytree(self.folder / "map", self.folder / "elsewhere")
        text = (self.folder / "map/route.yaml").read_text().splitlines()
        moved = [line if not line.startswith("  - [") else
                 "  - [" + ", ".join([n if i != 1 else str(float(n) + 30) for i, n in enumerate(line[5:-1].split(", "))]) + "]"
                 for line in text]
        (self.folder / "elsewhere/route.yaml").write_text("\n".join(moved) + "\n")
        outcome = self.run_here("replay", "elsewhere", "--world", "circuit24")
        self.assertEqual(outcome.code, 1)
        self.assertIn("route.yaml", outcome.err)
        golden_page.expect(self, "replay", outcome.err)
        moved = [line for line in moved if not line.startswith("points_checksum")]
        (self.folder / "elsewhere/route.yaml").write_text("\n".join(moved) + "\n")
        outcome = self.run_here("replay", "elsewhere", "--world", "circuit24")
        self.assertEqual(outcome.code, 1)
        golden_page.expect(self, "replay", outcome.out)

    def test_three_controllers_drive_it(self):
        for name, most in (("follower", 0.012), ("pursuit", 0.03), ("pose", 0.03)):
            (summary,) = self.replay("--controller", name, "--json", "--seed", 12, "--speed-m-s", 0.4).records
            self.assertTrue(summary["finished"], name)
            self.assertLess(summary["cross_track_rmse_m"], most, name)
        outcome = self.replay("--controller", "folower")
        self.assertEqual(outcome.code, 2)
        self.assertIn("'follower'?", outcome.err)

    def test_a_permanent_stop_is_reported(self):
        (self.folder / "faults.yaml").write_text("faults: [{fault: clock_jump, at_s: 5, jump_s: 0.6}]")
        outcome = self.replay("--json", "--faults", "faults.yaml")
        self.assertEqual(outcome.code, 1)
        self.assertIn("+0.65 s", outcome.records[0]["reason"])
        golden_page.expect(self, "replay", outcome.records[0]["reason"])

    def test_an_optimised_route_is_faster_and_can_be_replayed(self):
        missing = self.run_here("replay", "map", "--world", "circuit24", "--route", "fast")
        self.assertEqual(missing.code, 2)
        self.assertIn("waymark optimize map --name fast", missing.err)
        outcome = self.run_here("optimize", "map", "--name", "fast", "--speed-m-s", 0.8, "--rounds", 1, "--json")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        (summary,) = outcome.records
        taught, best = summary["taught"], summary["optimized"]
        self.assertLess(best["lap_s"], taught["lap_s"])
        self.assertGreaterEqual(best["min_clearance_m"], taught["min_clearance_m"] - 0.001)
        self.assertGreaterEqual(best["two_tags_fraction"], taught["two_tags_fraction"])
        self.assertTrue((self.folder / "map/route-fast.svg").exists())
        again = self.run_here("optimize", "map", "--name", "fast", "--speed-m-s", 0.7, "--rounds", 1)
        self.assertIn("route-fast.svg, route-fast.yaml", again.err)
        self.assertTrue((self.folder / "map/route-fast.1.yaml").exists())
        promised_s = float(re.search(r"lap \[s\] +\S+ +(\S+)", again.out)[1])
        command = re.search(r"`waymark replay map (.+)`", again.out)[1].split()
        (driven,) = self.replay(*command, "--json").records
        self.assertTrue(driven["finished"])
        self.assertLess(driven["cross_track_rmse_m"], 0.03)
        self.assertAlmostEqual(driven["lap_s"], promised_s, delta=2, msg="the command replays the optimised speed")
        self.run_here("map", "lap.mcap", "-o", "map")  # another map: the routes of the old one are renamed
        self.assertFalse((self.folder / "map/route-fast.yaml").exists())
        self.assertTrue((self.folder / "map/route-fast.2.yaml").exists())
        (self.folder / "weights.yaml").write_text("corridor: 0.1\n")
        wrong = self.run_here("optimize", "map", "--weights", "weights.yaml")
        self.assertEqual(wrong.code, 1)
        self.assertIn("'corridor_m'?", wrong.err)

    def test_without_ground_truth_no_errors_are_reported(self):
        (self.folder / "map/truth_trajectory.txt").unlink()
        outcome = self.replay("--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertIsNone(outcome.records[0]["cross_track_rmse_m"])
        self.assertIn("--taught", outcome.err)

    def test_mistakes(self):
        self.edit("map/map.yaml", "size_m:", "sise_m:")
        outcome = self.replay()
        self.assertEqual((outcome.code, outcome.out), (1, ""))
        self.assertRegex(outcome.err, r"map/map.yaml:\d+ \(tags\[0\]\.sise_m\): .*'size_m'\?")
        self.edit("map/map.yaml", "sise_m:", "size_m:")
        self.edit("map/route.yaml", "closed: true", "closed: maybe")
        self.assertIn("route.yaml:3 (closed): 'maybe'", self.replay().err)
        self.edit("map/route.yaml", "closed: maybe", "closed: true")
        for words, code, part in ((["--method", "anchr"], 2, "'anchor'?"),
                                  (["--controller", "persuit"], 2, "'pursuit'?"),
                                  (["--laps", "0"], 2, "(--laps)"),
                                  (["--taught", "none.mcap"], 1, "none.mcap"),
                                  (["--calibration", "none.yaml"], 1, "none.yaml"),
                                  (["-o", "lap.mcap"], 1, "lap.mcap: "),
                                  (["--robot-file", "none"], 2, "'none'")):
            outcome = self.replay(*words)
            self.assertEqual((outcome.code, outcome.out), (code, ""), outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "replay", outcome.err)
        self.assertEqual(self.run_here("map", "lap.mcap", "-o", "open", "--closing-distance-m", "0").code, 0)
        laps = self.run_here("replay", "open", "--world", "circuit24", "--laps", "2")
        self.assertEqual((laps.code, laps.out), (2, ""), laps.err)
        self.assertIn("(--laps): ", laps.err)
        (self.folder / "empty").mkdir()
        for where, part in (("nowhere", "nowhere: "),
                            ("lap.mcap", "`waymark map lap.mcap`"),
                            ("empty", "waymark map lap.mcap -o empty"),
                            (".", "./map?")):
            outcome = self.run_here("replay", where, "--world", "circuit24")
            self.assertEqual(outcome.code, 1)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "replay", outcome.err)


class Routes(WithMap):
    """Several routes in one map, and stations."""

    def replay(self, *words):
        return self.run_here("replay", "map", "--world", "circuit24", "--json", *words)

    def test_the_robot_stops_at_stations_and_continues_by_itself(self):
        for words in (["--station", "shelf", "--at-m", 4.5, "--pause-s", 6], ["--station", "door", "--at-tag", 9, "--pause-s", 1.5],
                      ["--station", "gone", "--at-m", 1]):
            outcome = self.run_here("routes", "map", *words)
            self.assertEqual(outcome.code, 0, outcome.err)
        (listed,) = self.run_here("routes", "map", "--remove-station", "gone", "--json").records
        self.assertEqual([(s["name"], s["pause_s"]) for s in listed["stations"]], [("shelf", 6), ("door", 1.5)])
        (moved,) = self.run_here("routes", "map", "--station", "door", "--at-tag", 9, "--json").records
        self.assertEqual(moved["stations"][1]["pause_s"], 1.5, "a moved station keeps its dwell time")
        self.assertIn("(--pause-s): ", self.run_here("routes", "map", "--pause-s", 3).err)
        for controller in ("follower", "pursuit", "pose"):
            outcome = self.replay("--seed", 12, "--laps", 2 if controller == "follower" else 1, "--controller", controller, "-o", f"{controller}.mcap")
            self.assertEqual(outcome.code, 0, outcome.err)
            (driven,) = outcome.records
            self.assertEqual((driven["finished"], driven["stops"]), (True, 0))
            laps = 2 if controller == "follower" else 1
            self.assertEqual([s["name"] for s in driven["stations"]], ["shelf", "door"] * laps)
            for visit, pause in zip(driven["stations"], [6, 1.5] * laps):
                self.assertGreaterEqual(visit["stationary_s"], pause)
                self.assertLess(visit["stationary_s"], pause + 1.2)
            self.assertRegex(outcome.err, r"'shelf'.* 4\.50 m .* 6 s\n")
            self.assertEqual(outcome.err.count("'door'"), 2 * laps)
        played = self.run_here("play", "--speed", 0, "--messages", "--topics", "/diagnostics", "follower.mcap").out
        # Waiting, driving, four times stopped at a station and driving, finished: each change is a message.
        self.assertEqual(played.count("DiagnosticArray"), 2 + 4 * 2 + 1, played)

    def test_another_lap_is_another_route_of_the_map(self):
        text = (ROOT / "share/worlds/circuit24.yaml").read_text().split("path_closed:")[0]
        (self.folder / "across.yaml").write_text(text + "path_closed: false\npath_m: [[2.53, -1.45], [2.89, -0.98], [3.04, -0.4], "
                                                "[3.02, 0.2], [2.6, 0.8], [1.8, 1.1], [0.8, 1.0], [0, 0.6]]\n")
        self.assertEqual(self.run_here("teach", "--world", "across.yaml", "--seed", 5, "-o", "across.mcap").code, 0)
        taught = (self.folder / "map/route.yaml").read_bytes()
        outcome = self.run_here("map", "across.mcap", "-o", "map", "--extend", "map", "--route-name", "across", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual((self.folder / "map/route.yaml").read_bytes(), taught, "the taught route is unchanged")
        routes = self.run_here("routes", "map", "--json").records
        self.assertEqual([(r["route"], r["closed"]) for r in routes], [("", True), ("across", False)])
        self.assertIn("across", self.run_here("routes", "map").out)
        (first,) = self.replay("--seed", 12).records
        outcome = self.run_here("replay", "map", "--world", "across.yaml", "--route", "across", "--seed", 12, "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (second,) = outcome.records
        for driven in (first, second):
            self.assertTrue(driven["finished"])
            self.assertLess(driven["cross_track_rmse_m"], 0.02)
        self.assertLess(second["distance_m"], 7)
        moved = self.run_here("map", "across.mcap", "-o", "map2", "--extend", "map", "--route-name", "again")
        self.assertEqual(moved.code, 0, moved.err)
        self.assertEqual([r["route"] for r in self.run_here("routes", "map2", "--json").records], ["", "across", "again"])
        self.assertEqual((self.folder / "map2/route.yaml").read_bytes(), taught)
        third = self.run_here("map", "across.mcap", "-o", "map2", "--extend", "map", "--route-name", "third")
        self.assertEqual(third.code, 0, third.err)
        self.assertEqual([r["route"] for r in self.run_here("routes", "map2", "--json").records], ["", "across", "third"],
                         "routes of the replaced map do not apply to the new map")

    def test_stations_of_an_older_route_are_reported(self):
        self.assertEqual(self.run_here("routes", "map", "--station", "shelf", "--at-m", 4.5).code, 0)
        again = self.run_here("map", "lap.mcap", "-o", "map")
        self.assertIn("(shelf)", again.err)
        golden_page.expect(self, "map", again.err)

    def test_mistakes(self):
        self.run_here("optimize", "map", "--name", "fast", "--rounds", 1)
        for words, code, part in (
                (["replay", "map", "--world", "circuit24", "--route", "fats"], 2, "'fast'?"),
                (["routes", "map", "--route", "fats"], 2, "'fast'?"),
                (["routes", "nowhere"], 1, "nowhere: "),
                (["routes", "lap.mcap"], 1, "lap.mcap: "),
                (["routes", "map", "--route", ""], 2, "(NAME)"),
                (["routes", "map", "--route", "a/b"], 2, "'a/b'"),
                (["routes", "map", "--station", "a"], 2, "--at-tag"),
                (["routes", "map", "--at-m", 3], 2, "--station"),
                (["routes", "map", "--station", "a", "--at-m", 99], 2, "(--station): 'a'"),
                (["routes", "map", "--station", "a", "--at-tag", "99"], 2, "(--at-tag): 99 "),
                (["routes", "map", "--remove-station", "a"], 2, "'a'"),
                (["map", "lap.mcap", "-o", "m", "--route-name", "a"], 2, "--extend"),
                (["map", "lap.mcap", "-o", "m", "--extend", "map", "--route-name", "a/b"], 2, "'a/b'")):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (code, ""), outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "replay", outcome.err)
        self.edit("map/route.yaml", "points:", "stations:\n  - {name: a, arc_length_m: 3, pause: 1}\npoints:")
        self.assertRegex(self.replay().err, r"route.yaml:\d+ \(stations\[0\].pause\): .*'pause_s'")

    def test_a_speed_above_the_limit_is_a_warning(self):
        limited = self.replay("--speed-m-s", 0.8).err
        self.assertRegex(limited, r"0\.8 m/s.* 0\.5 m/s .*--max-speed-m-s")
        golden_page.expect(self, "replay", limited)
        self.assertEqual(self.replay("--speed-m-s", 0.8, "--max-speed-m-s", 1).err, "")

    def test_a_calibrated_turn_gain_is_the_initial_value(self):
        (self.folder / "robot.yaml").write_text((ROOT / "share/robots/limo.yaml").read_text() + "simulation:\n  dynamics: {turn_gain: 0.6}\n")
        (self.folder / "calibration.yaml").write_text(CALIBRATION)
        begins = []
        for flags in ([], ["--calibration", "calibration.yaml"]):
            (driven,) = self.replay("--robot-file", "robot.yaml", "--turn-gain-time-s", 0, *flags).records  # the gain is not estimated
            self.assertTrue(driven["finished"])
            begins.append(driven["cross_track_rmse_m"])
        self.assertLess(begins[1], 0.7 * begins[0])
        self.assertEqual(self.replay("--calibration", "none.yaml").code, 1)


if __name__ == "__main__":
    unittest.main()
