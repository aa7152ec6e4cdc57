#!/usr/bin/python3
"""`waymark explore`: a robot that wanders, meets nothing, and knows where it is; and `waymark run`."""
import json
import os
import pty
import signal
import subprocess
import threading
import time

from harness import PROGRAM, InFolder, event, rest_of, unittest
from laps import MAP, put

# Five simulated seconds a second, in lockstep: a machine that is busy slows the robot down, too.
PACED = f"process:exec '{PROGRAM}' robot-sim --world circuit24 --lockstep --pace 5"
MINUTES = 60 if os.environ.get("WAYMARK_FULL") else 3


class Explore(InFolder):
    def test_meets_nothing_and_knows_where_it_is(self):
        outcome = self.run_here("explore", "--world", "academy-house", "--minutes", MINUTES, "--seed", "1", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        report = outcome.records[0]
        self.assertEqual(report["collisions"], 0)
        self.assertGreater(report["nearest_m"], 0.02)
        self.assertGreater(report["distance_m"], 5 * MINUTES)
        self.assertGreaterEqual(len(report["tags_seen"]), 6 if MINUTES >= 60 else 3)
        self.assertGreater(report["certain_fraction"], 0.5)
        self.assertLess(report["position_rmse_m"], 0.15)

    def test_the_same_seed_wanders_the_same_way(self):
        first, again, other = (self.run_here("explore", "--minutes", "0.3", "--seed", seed, "--json").records[0]
                               for seed in ("3", "3", "4"))
        for report in (first, again, other):
            del report["wall_s"]
        self.assertEqual(first, again)
        self.assertNotEqual(first, other)

    def test_records_and_stops_by_ctrl_c(self):
        process = subprocess.Popen([PROGRAM, "explore", "--minutes", "600", "-o", "walk.mcap", "--json"], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        walk = self.folder / "walk.mcap"
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and (not walk.exists() or walk.stat().st_size < 100_000):
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, err)
        self.assertGreater(json.loads(out)["distance_m"], 0)
        topics = {topic["topic"] for topic in self.run_here("info", "walk.mcap", "--json").records[0]["topics"]}
        self.assertLessEqual({"/scan", "/cmd_vel", "/truth/pose"}, topics)

    def test_a_map_of_somewhere_else_is_not_there(self):
        outcome = self.run_here("explore", "--map", "nowhere", "--minutes", "0.1")
        self.assertEqual(outcome.code, 1)
        self.assertIn("nowhere", outcome.err)


class Session(InFolder):
    def test_a_script_teaches_maps_and_replays(self):
        outcome = self.run_here("run", "--world", "circuit24", "--driver", "scripted", "-o", "session", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        report = outcome.records[0]
        self.assertEqual((report["laps_taught"], len(report["mapping_s"]), len(report["replays"])), (1, 1, 1))
        self.assertTrue(report["replays"][0]["finished"])
        self.assertEqual(report["state"], "over")
        for words in ("teaching. ", "mapping. ", "ready. ", "replaying. ", "done. "):
            self.assertIn("waymark run: " + words, outcome.err)
        self.assertTrue((self.folder / "session/map/route.yaml").exists())
        self.assertTrue((self.folder / "session/replay.mcap").exists())
        before = (self.folder / "session/map/map.yaml").read_bytes()
        again = self.run_here("run", "--world", "circuit24", "--driver", "scripted", "--seed", 2, "-o", "session")
        self.assertEqual(again.code, 0, again.err)
        self.assertIn("--map session/map begins with it", again.err)
        self.assertIn("the map that was there is kept: session/map.1", again.err)
        self.assertEqual((self.folder / "session/map.1/map.yaml").read_bytes(), before)
        for name in ("lap.mcap", "lap.2.mcap", "replay.mcap", "replay.2.mcap"):
            self.assertTrue((self.folder / "session" / name).exists(), name)
        older = self.run_here("replay", "session/map.1", "--world", "circuit24", "--json")
        self.assertTrue(older.records[0]["finished"], older.err)

    def test_a_program_is_in_charge_by_lines(self):
        process = subprocess.Popen([PROGRAM, "run", "--robot", PACED, "--world", "circuit24", "--driver", "lines", "-o", "session", "--json"],
                                   cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)

        def tell(line, wait_s=0.2):
            process.stdin.write(line + "\n")
            process.stdin.flush()
            time.sleep(wait_s)

        words = event.Lines(process.stderr)
        words.wait_for("idle. 'go'")
        tell("drive 0.3 0")  # idle: refused, nothing moves
        tell("drvie 0.3 0")
        tell("stop")
        tell("go")
        for _ in range(8):
            tell("drive 0.3 0.1", 0.05)
        tell("stop")  # the lap is dropped
        tell("quit", 0)
        process.stdin.close()
        out = process.stdout.read()
        process.wait(60)
        err = words.rest()
        self.assertEqual(process.returncode, 0, err)
        self.assertIn("already stopped", err)
        self.assertIn("'drvie 0.3 0'", err)
        report = json.loads(out)
        self.assertEqual((report["laps_taught"], report["state"]), (0, "over"))
        lap = self.run_here("info", "session/lap.mcap", "--json").records[0]
        self.assertGreater({topic["topic"]: topic for topic in lap["topics"]}["/odom"]["messages"], 20)

    def test_a_signal_in_a_replay_is_said(self):
        put(self.folder, *MAP)
        process = subprocess.Popen([PROGRAM, "run", "--robot", PACED, "--driver", "lines", "--map", "map", "-o", "session", "--json"],
                                   cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        said = [process.stderr.readline()]
        while "ready" not in said[-1] and said[-1]:
            said.append(process.stderr.readline())
        self.assertIn("'go': replay the lap", said[-1], "buttons are called as this driver calls them")
        process.stdin.write("go\n")
        process.stdin.flush()
        while "replaying" not in said[-1] and said[-1]:
            said.append(process.stderr.readline())
        time.sleep(0.5)  # it drives
        process.send_signal(signal.SIGINT)
        process.wait(timeout=60)  # its input stays open until then: the end of lines would end the session, too
        out, err = rest_of(process)
        self.assertEqual(process.returncode, 130, err)
        (replay,) = json.loads(out)["replays"]
        self.assertFalse(replay["finished"])
        self.assertEqual(replay["reason"], "stopped by a signal")
        self.assertEqual(self.run_here("info", "session/replay.mcap").code, 0, "the recording is closed")

    def test_usage(self):
        for words, said in ((["--world", "circuit24", "--driver", "hands"], "no driver 'hands'"),
                            (["--driver", "scripted"], "--world is required"),
                            (["--world", "circuit24", "--driver", "keyboard"], "not a terminal")):
            outcome = self.run_here("run", "-o", "session", *words, stdin=subprocess.DEVNULL)
            self.assertIn(outcome.code, (1, 2), outcome.err)
            self.assertIn(said, outcome.err)
        outcome = self.run_here("run", "-o", "session", "--world", "circuit24", "--driver", "lines", "--map", "nomap", stdin=subprocess.DEVNULL)
        self.assertEqual(outcome.code, 1)
        self.assertIn("nomap: there is no such folder", outcome.err)
        self.assertNotIn("ready", outcome.err)
        self.assertFalse((self.folder / "session").exists(), "nothing was done, nothing is left")


class Keyboard(InFolder):
    def test_y_replays_pauses_and_goes_on(self):
        put(self.folder, *MAP)
        keyboard, terminal = pty.openpty()
        process = subprocess.Popen([PROGRAM, "run", "--robot", PACED, "--driver", "keyboard", "--map", "map", "-o", "session", "--json"],
                                   cwd=self.folder, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)  # so that a failure ends the thread that reads what it says
        said = []
        reader = threading.Thread(target=lambda: said.extend(process.stderr))
        reader.start()

        def press(key, until):
            time.sleep(0.2)  # the button bounces
            os.write(keyboard, key)
            deadline = time.monotonic() + 60
            while not any(until in line for line in said) and time.monotonic() < deadline:
                time.sleep(0.05)
            self.assertTrue(any(until in line for line in said), (key, said))
            said.clear()

        press(b"", "ready. ")
        press(b"y", "replaying. ")
        time.sleep(0.8)
        press(b"y", "paused. ")
        press(b"y", "replaying. ")
        time.sleep(0.3)
        press(b"b", "run: stopped by the operator")
        os.write(keyboard, b"q")
        out = process.stdout.read()
        self.assertEqual(process.wait(60), 1, "the replay did not come to its end")
        reader.join()
        process.stdout.close()
        process.stderr.close()
        os.close(keyboard)
        os.close(terminal)
        (replay,) = json.loads(out)["replays"]
        self.assertFalse(replay["finished"])
        self.assertGreater(replay["distance_m"], 0.5)


if __name__ == "__main__":
    unittest.main()
