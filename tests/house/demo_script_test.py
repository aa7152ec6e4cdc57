#!/usr/bin/python3
"""Runs ./demo.sh twice in a folder with a space in its name. A stub replaces CMake and copies programs of this build to where the script expects
them, and the first step renders no images; everything else is the script itself. tests/readme/test.sh does the same with a real build.

usage: demo_script_test.py PROGRAM EXAMPLES_FOLDER
"""
import os
import pathlib
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM, EXAMPLES = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
CMAKE = """#!/bin/bash
[ "$1" = --build ] || exit 0
mkdir -p build/release/bin build/release/examples
cp "$STUBS/waymark" build/release/bin/
for name in waymark_photograph waymark_photograph_sheet; do ln -sf "$EXAMPLES/$name" build/release/examples/; done
"""
WAYMARK = """#!/bin/bash
words=()
for word in "$@"; do [ "$word" = --images ] || words+=("$word"); done
if [ "$1" = demo ] && [ -n "${WITHOUT_LAP:-}" ]; then exit 0; fi
exec "$PROGRAM" "${words[@]}"
"""


class DemoScript(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name) / "a clone"
        stubs = pathlib.Path(folder.name) / "stubs"
        for target, text in ((stubs / "cmake", CMAKE), (stubs / "waymark", WAYMARK), (self.root / "tools/build_viewer.sh", "#!/bin/sh\nexit 1\n")):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text)
            target.chmod(target.stat().st_mode | stat.S_IXUSR)
        for name in ("demo.sh", "tools/packages.sh"):
            shutil.copy(ROOT / name, self.root / name)
        self.environment = {**os.environ, "PATH": f"{stubs}:{os.environ['PATH']}", "STUBS": str(stubs), "PROGRAM": str(PROGRAM), "EXAMPLES": str(EXAMPLES),
                            "WAYMARK_SKIP_INSTALL": "1"}

    def demo(self, *words, **variables):
        return subprocess.run([self.root / "demo.sh", *words], cwd=self.root, env={**self.environment, **variables}, capture_output=True, text=True, timeout=120,
                              stdin=subprocess.DEVNULL, check=False)

    def test_a_second_run_ends_like_the_first(self):
        outputs = []
        for run in ("first", "second"):
            done = self.demo()
            self.assertEqual(done.returncode, 0, f"{run} run: {done.stdout}{done.stderr}")
            outputs.append(done.stdout.splitlines())
            for name in ("loop/report.html", "annotated/photograph.png", "sheet.pdf", "sheet.png", "annotated/sheet_photo.png"):
                self.assertGreater((self.root / "out/demo" / name).stat().st_size, 0, name)
            (self.root / "out/demo/mine.txt").write_text("mine")
            (self.root / "out/demo/sheet.pdf").write_text("of the first run")
        self.assertEqual(outputs[0][-2:], outputs[1][-2:])
        self.assertIn("Look at it", outputs[0][-2])

    def test_files_of_the_user_are_kept(self):
        folder = self.root / "my folder"
        folder.mkdir()
        (folder / "sheet.pdf").write_text("mine")
        for run in ("first", "second"):
            done = self.demo("my folder", WITHOUT_LAP="1")
            self.assertEqual(done.returncode, 1, f"{run} run: {done.stdout}{done.stderr}")
            self.assertIn("sheet.pdf: ", done.stderr)
            self.assertEqual((folder / "sheet.pdf").read_text(), "mine")

    def test_printed_commands_can_be_copied(self):
        done = self.demo("my folder", WITHOUT_LAP="1")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        shown = [line.split("$ waymark ", 1)[1] for line in done.stdout.splitlines() if "$ waymark detect" in line]
        self.assertGreaterEqual(len(shown), 2)
        for line in shown:
            again = subprocess.run(["bash", "-c", f'"$PROGRAM" {line}'], cwd=self.root, env=self.environment, capture_output=True, text=True, check=False)
            self.assertEqual(again.returncode, 0, f"{line}: {again.stderr}")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
