#!/usr/bin/python3
"""`waymark explore`: random drives without collisions, localised; and `waymark run`."""
import json
import os
import pty
import signal
import subprocess
import threading
import time

from harness import PROGRAM, InFolder, event, rest_of, unittest
from laps import MAP, put
import golden_page

# Real-time factor 5 in lockstep: a busy machine also slows the robot down.
PACED = f"process:exec '{PROGRAM}' robot-sim --world circuit24 --lockstep --pace 5"
MINUTES = 60 if os.environ.get("WAYMARK_FULL") else 3


class Explore(InFolder):
    def test_has_no_collisions_and_is_localised(self):
        outcome = self.run_here("explore", "--world", "academy-house", "--minutes", MINUTES, "--seed", "1", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        report = outcome.records[0]
        self.assertEqual(report["collisions"], 0)
        self.assertGreater(report["nearest_m"], 0.02)
        self.assertGreater(report["distance_m"], 5 * MINUTES)
        self.assertGreaterEqual(len(report["tags_seen"]), 6 if MINUTES >= 60 else 3)
        self.assertGreater(report["certain_fraction"], 0.5)
        self.assertLess(report["position_rmse_m"], 0.15)

    def test_the_path_depends_on_the_seed(self):
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

    def test_a_missing_map_is_an_error(self):
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
        self.assertIn("--map session/map", again.err)
        self.assertIn("session/map.1", again.err)
        self.assertEqual((self.folder / "session/map.1/map.yaml").read_bytes(), before)
        for name in ("lap.mcap", "lap.2.mcap", "replay.mcap", "replay.2.mcap"):
            self.assertTrue((self.folder / "session" / name).exists(), name)
        older = self.run_here("replay", "session/map.1", "--world", "circuit24", "--json")
        self.assertTrue(older.records[0]["finished"], older.err)

    def test_a_program_drives_by_lines(self):
        process = subprocess.Popen([PROGRAM, "run", "--robot", PACED, "--world", "circuit24", "--driver", "lines", "-o", "session", "--json"],
                                   cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)

        def send(line, wait_s=0.2):
            process.stdin.write(line + "\n")
            process.stdin.flush()
            time.sleep(wait_s)

        words = event.Lines(process.stderr)
        words.wait_for("idle. ")
        send("drive 0.3 0")  # idle: refused, nothing moves
        send("drvie 0.3 0")
        send("stop")
        send("go")
        for _ in range(8):
            send("drive 0.3 0.1", 0.05)
        send("stop")  # the lap is dropped
        send("quit", 0)
        process.stdin.close()
        out = process.stdout.read()
        process.wait(60)
        err = words.rest()
        self.assertEqual(process.returncode, 0, err)
        self.assertIn("'drvie 0.3 0'", err)
        self.assertIn("go, stop, quit", err)
        report = json.loads(out)
        self.assertEqual((report["laps_taught"], report["state"]), (0, "over"))
        lap = self.run_here("info", "session/lap.mcap", "--json").records[0]
        self.assertGreater({topic["topic"]: topic for topic in lap["topics"]}["/odom"]["messages"], 20)

    def test_a_signal_during_a_replay_is_reported(self):
        put(self.folder, *MAP)
        process = subprocess.Popen([PROGRAM, "run", "--robot", PACED, "--driver", "lines", "--map", "map", "-o", "session", "--json"],
                                   cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        messages = [process.stderr.readline()]
        while "ready" not in messages[-1] and messages[-1]:
            messages.append(process.stderr.readline())
        self.assertIn("'go'", messages[-1], "buttons have the names of this driver")
        process.stdin.write("go\n")
        process.stdin.flush()
        while "replaying" not in messages[-1] and messages[-1]:
            messages.append(process.stderr.readline())
        time.sleep(0.5)  # it drives
        process.send_signal(signal.SIGINT)
        process.wait(timeout=60)  # its input stays open until then, because its end would also end the session
        out, err = rest_of(process)
        self.assertEqual(process.returncode, 130, err)
        (replay,) = json.loads(out)["replays"]
        self.assertFalse(replay["finished"])
        self.assertIn("signal", replay["reason"])
        golden_page.expect(self, "session", replay["reason"])
        self.assertEqual(self.run_here("info", "session/replay.mcap").code, 0, "the recording is closed")

    def test_usage(self):
        for words, part in ((["--world", "circuit24", "--driver", "hands"], "'hands'"),
                            (["--driver", "scripted"], "--world"),
                            (["--world", "circuit24", "--driver", "keyboard"], "terminal")):
            outcome = self.run_here("run", "-o", "session", *words, stdin=subprocess.DEVNULL)
            self.assertIn(outcome.code, (1, 2), outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "session", outcome.err)
        outcome = self.run_here("run", "-o", "session", "--world", "circuit24", "--driver", "lines", "--map", "nomap", stdin=subprocess.DEVNULL)
        self.assertEqual(outcome.code, 1)
        self.assertIn("nomap: ", outcome.err)
        self.assertNotIn("ready", outcome.err)
        self.assertFalse((self.folder / "session").exists(), "nothing was done, no folder is left")


class Keyboard(InFolder):
    def test_y_replays_pauses_and_resumes(self):
        put(self.folder, *MAP)
        keyboard, terminal = pty.openpty()
        process = subprocess.Popen([PROGRAM, "run", "--robot", PACED, "--driver", "keyboard", "--map", "map", "-o", "session", "--json"],
                                   cwd=self.folder, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)  # so that a failure ends the thread that reads its messages
        messages = []
        reader = threading.Thread(target=lambda: messages.extend(process.stderr))
        reader.start()

        def press(key, until):
            time.sleep(0.2)  # longer than the debouncing of buttons
            os.write(keyboard, key)
            deadline = time.monotonic() + 60
            while not any(until in line for line in messages) and time.monotonic() < deadline:
                time.sleep(0.05)
            self.assertTrue(any(until in line for line in messages), (key, messages))
            messages.clear()

        press(b"", "ready. ")
        press(b"y", "replaying. ")
        time.sleep(0.8)
        press(b"y", "paused. ")
        press(b"y", "replaying. ")
        time.sleep(0.3)
        press(b"b", "operator")
        os.write(keyboard, b"q")
        out = process.stdout.read()
        self.assertEqual(process.wait(60), 1, "the replay was not completed")
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
