#!/usr/bin/python3
"""Hostile input: shell syntax in names, decompression bombs, pipes, links, journals, one changed byte, deeply nested lines of a robot."""
import contextlib
import gzip
import http.client
import json
import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import time
import unittest
import urllib.parse

import harness
from recordings import LINE

MEBIBYTE = gzip.compress(bytes(1 << 20))


def open_files(pid):
    """Names of the files that a process has open, without those that it closes meanwhile."""
    names = []
    for link in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):
            names.append(os.readlink(link))
    return names


class Hostile(harness.InFolder):
    def bomb(self, mebibytes):
        path = self.folder / "bomb.csv.gz"
        path.write_bytes(MEBIBYTE * mebibytes)
        return path

    def test_names_are_not_passed_to_a_shell(self):
        world = self.folder / "x'$(touch pwned)'.yaml"
        world.write_text(LINE, encoding="utf-8")
        process = subprocess.Popen([harness.PROGRAM, "run", "--world", world.name, "--driver", "scripted", "-o", "session"], cwd=self.folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        words = ""
        while "teaching" not in words and process.poll() is None:
            words += process.stderr.readline()
        process.send_signal(signal.SIGINT)
        with process.stderr:
            words += process.stderr.read()
        process.wait(60)
        self.assertIn("teaching", words)
        self.assertFalse((self.folder / "pwned").exists())

    def test_deeply_nested_lines_of_a_robot_are_an_error(self):
        (self.folder / "deep.py").write_text(
            """import time
print('{"type": "hello", "protocol_version": 1, "name": "deep"}')
print('{"type": "log", "text": ' + '[' * 60000, flush=True)
time.sleep(20)
""")
        robot = f"process:{sys.executable} deep.py"
        done = self.run_here("teach", "--robot", robot, "--world", "circuit24", "--driver", "scripted", "-o", "lap.mcap")
        self.assertEqual(done.code, 1)
        self.assertRegex(done.err, r":2: .*\b16\b")

    def test_unpacking_of_a_bomb_stops_at_the_maximum_ratio(self):
        temporary = self.folder / "temporary"
        temporary.mkdir()
        done = self.run_here("info", self.bomb(1024), env=os.environ | {"TMPDIR": str(temporary)})
        self.assertEqual(done.code, 1)
        self.assertRegex(done.err, r"bomb\.csv\.gz.* 268435456 ")
        self.assertEqual(list(temporary.iterdir()), [])

    def test_no_files_are_left_when_unpacking_is_interrupted_or_killed(self):
        temporary = self.folder / "temporary"
        temporary.mkdir()
        bomb = self.bomb(10240)
        for ending in (signal.SIGINT, signal.SIGKILL):
            process = subprocess.Popen([harness.PROGRAM, "info", bomb], env=os.environ | {"TMPDIR": str(temporary)},
                                       stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            while process.poll() is None and not any("(deleted)" in name for name in open_files(process.pid)):
                time.sleep(0.01)
            start = time.monotonic()
            process.send_signal(ending)
            words = process.communicate(timeout=60)[1]
            self.assertLess(time.monotonic() - start, 2, "one second, and the machine may be busy")
            if ending == signal.SIGINT:
                self.assertEqual(process.returncode, 130, words)
                self.assertIn("unpacking", words)
            self.assertEqual(list(temporary.iterdir()), [])

    def test_pipes_are_refused_at_once(self):
        os.mkfifo(self.folder / "pipe")
        for words in (["info", "pipe"], ["convert", "pipe", "out.mcap"], ["detect", "pipe"]):
            start = time.monotonic()
            done = self.run_here(*words)
            self.assertNotEqual(done.code, 0, words)
            self.assertLess(time.monotonic() - start, 10, words)
            self.assertIn("pipe", done.err)

    def test_a_signal_ends_the_wait_for_a_pipe_of_text(self):
        os.mkfifo(self.folder / "pipe")
        for ending in (signal.SIGINT, signal.SIGTERM):
            process = subprocess.Popen([harness.PROGRAM, "evaluate", "pipe", "pipe"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.addCleanup(process.kill)
            harness.event.until_it_catches(process, ending)
            time.sleep(0.5)  # it opens the pipe
            self.assertIsNone(process.poll(), "it waits for a writer")
            process.send_signal(ending)
            words = process.communicate(timeout=20)[1]
            self.assertNotEqual(process.returncode, 0)
            self.assertRegex(words, "pipe: .*interrupted")

    def test_text_is_read_from_a_pipe(self):
        rows = "".join(f"{i} {i} 0 0 0 0 0 1\n" for i in range(5))
        (self.folder / "lap.tum").write_text(rows, encoding="utf-8")
        os.mkfifo(self.folder / "pipe.tum")
        process = subprocess.Popen([harness.PROGRAM, "evaluate", "pipe.tum", "lap.tum", "--json"], cwd=self.folder, stdout=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        with open(self.folder / "pipe.tum", "w", encoding="utf-8") as pipe:
            for row in rows.splitlines(keepends=True):  # slowly
                pipe.write(row)
                pipe.flush()
                time.sleep(0.05)
        out = process.communicate(timeout=20)[0]
        self.assertEqual(process.returncode, 0, out)

    def test_binary_data_instead_of_text_is_an_error_at_once(self):
        start = time.monotonic()
        done = self.run_here("evaluate", "/dev/zero", "/dev/zero")
        self.assertEqual(done.code, 1)
        self.assertRegex(done.err, "/dev/zero: .*binary")
        self.assertLess(time.monotonic() - start, 5)

    def test_links_out_of_a_folder_are_not_shown(self):
        shown = self.folder / "shown"
        (shown / "map").mkdir(parents=True)
        (shown / "map" / "map.yaml").write_text("tags: []\n", encoding="utf-8")
        (shown / "map" / "robot.yaml").symlink_to("/etc/passwd")
        (shown / "lap.mcap").symlink_to("/etc/passwd")
        with Viewer("view", shown, "--port", "0") as server:
            names = [one["name"] for one in json.loads(server.ask("/session.json")[1])["files"]]
            self.assertEqual(names, ["map.yaml"])
            (shown / "map" / "map.yaml").unlink()
            (shown / "map" / "map.yaml").symlink_to("/etc/passwd")  # after it was offered
            self.assertEqual(server.ask("/files/0/map.yaml")[0], 404)
        for name in ("robot.yaml", "lap.mcap"):
            self.assertRegex(server.words, rf"{name}\b.*\blink\b")

    def test_printed_addresses_work(self):
        for flags, host in ((["--listen", "127.0.0.2", "--port", "0"], "127.0.0.2"), (["--listen", "::1", "--port", "0"], "::1"), (["--port", "80"], "127.0.0.1")):
            with Viewer("view", *flags) as server:
                self.assertEqual(server.url.hostname, host)
                name = f"[{host}]" if ":" in host else host
                hosts = [f"{name}:{server.url.port}"] + ([name] if server.url.port == 80 else [])  # browsers omit the port 80
                for one in hosts:
                    self.assertEqual(server.ask("/session.json?" + server.url.query, Host=one)[0], 200, one)

    def test_reading_a_bag_with_a_write_ahead_log_changes_no_files(self):
        bag = self.folder / "bag"
        bag.mkdir()
        file = bag / "bag_0.db3"
        writer = sqlite3.connect(file)
        writer.executescript("PRAGMA journal_mode=WAL; PRAGMA wal_autocheckpoint=0;"
                             "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT,type TEXT,serialization_format TEXT,offered_qos_profiles TEXT);"
                             "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER,timestamp INTEGER,data BLOB);"
                             "INSERT INTO topics VALUES(1,'/x','std_msgs/msg/String','cdr','')")
        writer.executemany("INSERT INTO messages VALUES(NULL,1,?,?)", [(i * 10**9, b"\0\1\0\0\2\0\0\0x\0") for i in range(1, 8)])
        writer.commit()
        copy = self.folder / "copy"
        for waiting in (True, False):
            copy.mkdir(exist_ok=True)
            (copy / "bag_0.db3").write_bytes(file.read_bytes())
            if waiting:
                (copy / "bag_0.db3-wal").write_bytes((bag / "bag_0.db3-wal").read_bytes())
            else:
                (copy / "bag_0.db3-wal").unlink()
                writer.execute("PRAGMA wal_checkpoint(TRUNCATE)")
                (copy / "bag_0.db3").write_bytes(file.read_bytes())
            before = {one.name: one.read_bytes() for one in copy.iterdir()}
            done = self.run_here("info", "--json", copy / "bag_0.db3")
            self.assertEqual({one.name: one.read_bytes() for one in copy.iterdir()}, before, waiting)
            self.assertEqual(sum(topic["messages"] for topic in done.records[0]["topics"]), 7, waiting)
        writer.close()

    def test_one_changed_byte_of_the_metadata_is_reported(self):
        (self.folder / "line.yaml").write_text(LINE, encoding="utf-8")
        self.run_here("teach", "--world", "line.yaml", "-o", "lap.mcap")
        data = bytearray((self.folder / "lap.mcap").read_bytes())
        self.assertEqual(self.run_here("info", "lap.mcap").err, "")
        at = data.index(b"tag_size_m") + len("tag_size_m") + 4 + 3
        self.assertEqual(data[at:at + 1], b"6")
        data[at] = ord("8")
        (self.folder / "changed.mcap").write_bytes(data)
        for words in (["info", "changed.mcap"], ["convert", "changed.mcap", "out.mcap"], ["map", "changed.mcap", "-o", "map"]):
            done = self.run_here(*words)
            self.assertRegex(done.err + done.out, r"metadata.* byte \d+.*checksum|checksum.*metadata.* byte \d+", words)


class Viewer:
    def __init__(self, *words):
        self.process = subprocess.Popen([harness.PROGRAM, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        address = self.process.stdout.readline().strip()
        if not address:
            err = self.process.stderr.read()
            if "tools/build_viewer.sh" not in err:
                raise AssertionError(err)
            raise unittest.SkipTest("npm has not built the page of the viewer")
        self.url = urllib.parse.urlsplit(address)
        self.words = ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.words = self.process.communicate(timeout=20)[1]

    def ask(self, target, **headers):
        connection = http.client.HTTPConnection(self.url.hostname, self.url.port, timeout=20)
        connection.request("GET", target, headers=headers)
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer.status, body


if __name__ == "__main__":
    unittest.main()
