"""Messages for small mistakes and for badly damaged files."""
import json
import subprocess
import sys
import unittest

import harness
from laps import LAP, made
import golden_page


class Messages(harness.InFolder):
    def test_an_empty_name_is_refused(self):
        for name in ("", "./"):
            outcome = self.run_here("teach", "--world", "circuit24", "-o", name)
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn("-o " if not name else "'./'", outcome.err)
            golden_page.expect(self, "cli", outcome.err)
        self.assertFalse((self.folder / ".mcap").exists())

    def test_an_unknown_section_and_an_unknown_key_are_distinguished(self):
        outcome = self.run_here("optimize", "map", "--set", "nosuch.key=1")
        self.assertEqual(outcome.code, 2)
        self.assertIn("'nosuch'", outcome.err)
        golden_page.expect(self, "cli", outcome.err)
        outcome = self.run_here("optimize", "map", "--set", "profile.nosuch=1")
        self.assertIn("'nosuch'", outcome.err)
        golden_page.expect(self, "cli", outcome.err)

    def test_the_example_of_set_is_an_option_of_the_verb(self):
        for verb in ("optimize", "localize log", "detect", "replay"):
            words = self.run_here(*verb.split(), "--help").out.split("--set SECTION.KEY=VALUE")[1].split()
            example = words[words.index("example") + 1]
            if verb == "replay":
                self.assertTrue(example.startswith(("filter.", "camera.", "follower.")), example)
            outcome = self.run_here(*verb.split(), "nothing-there", "--set", example)
            self.assertNotIn("unknown", outcome.err, f"{verb} {example}")

    def test_a_missing_map_is_reported_before_a_missing_world(self):
        outcome = self.run_here("replay", "nosuch-map")
        self.assertEqual(outcome.code, 1, outcome.err)
        self.assertIn("nosuch-map", outcome.err)
        self.assertNotIn("--world", outcome.err)

    def test_an_invalid_video_is_not_reported_as_an_image(self):
        (self.folder / "empty.mp4").write_bytes(b"")
        (self.folder / "garbage.mp4").write_bytes(bytes(range(256)) * 40)
        for name in ("empty.mp4", "garbage.mp4"):
            outcome = self.run_here("detect", name)
            self.assertEqual(outcome.code, 1, outcome.err)
            self.assertIn(name, outcome.err)
            self.assertNotIn("JPEG", outcome.err, "not the message for images")

    def test_a_badly_damaged_recording_is_reported_in_few_lines(self):
        data = bytearray((made(*LAP) / "lap.mcap").read_bytes())
        chunks = 0
        at = 8  # after the magic bytes; a record is an opcode, its length in 8 bytes, and its content
        while at + 9 <= len(data) - 8:
            length = int.from_bytes(data[at + 1:at + 9], "little")
            if data[at] == 0x06:  # a chunk: damage its content or, in each second one, its unpacked size; a damaged length would hide all later records
                data[at + 9 + (length // 2 if chunks % 2 else 16)] ^= 0x55
                chunks += 1
            if data[at] == 0x08:  # an entry of the summary: without it the file is read sequentially
                data[at + 9] ^= 0x55
            at += 9 + length
        (self.folder / "torn.mcap").write_bytes(data)
        outcome = self.run_here("info", "torn.mcap")
        self.assertLess(len(outcome.err.splitlines()), 18, outcome.err)
        whole = json.loads(self.run_here("info", "torn.mcap", "--json").out)
        if len(whole["problems"]) > 13:
            self.assertRegex(outcome.err, rf"\b{len(whole['problems']) + len(whole['traps']) - 12} more: .*--json")
        else:
            self.fail("expected damage in more than 13 places")

    def test_the_example_robot_ignores_a_line_that_is_not_json(self):
        robot = subprocess.run([sys.executable, harness.pathlib.Path(__file__).resolve().parents[2] / "examples/process_robot.py"],
                               input='velocity 0.1\n{"type": "bye"}\n', capture_output=True, text=True, timeout=20, check=False)
        self.assertEqual(robot.returncode, 0, robot.stderr)
        self.assertIn("velocity 0.1", robot.stderr)
        self.assertNotIn("Traceback", robot.stderr)


if __name__ == "__main__":
    unittest.main()
