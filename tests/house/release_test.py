#!/usr/bin/python3
"""tools/release.sh --check reports whether sources are ready for a release; tested on a small repository with and without each fault."""
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = {
    "CMakeLists.txt": "project(Waymark VERSION 1.2.3 LANGUAGES CXX)\n",
    "CHANGELOG.md": "# Changelog\n\n## 1.2.3: third\n2026-11-23\n\n- new\n\n## 1.2.2: second\n- old\n",
    "tests/golden/1.2.3/lap.mcap": "x", "tests/golden/1.2.3/map/map.yaml": "x", "tests/golden/1.2.3/symbols.txt": "x",
}


class Release(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.folder / "tools").mkdir()
        shutil.copy(ROOT / "tools/release.sh", self.folder / "tools")
        for name, text in FILES.items():
            self.write(name, text)
        self.git("init", "-q")
        self.commit()

    def write(self, name, text):
        (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / name).write_text(text, encoding="utf-8")

    def git(self, *words):
        subprocess.run(["git", "-c", "user.name=t", "-c", "user.email=t@example.org", "-c", "commit.gpgsign=false", *words], cwd=self.folder, check=True)

    def commit(self):
        self.git("add", "-A")
        self.git("commit", "-qm", "test: make a repository", "--allow-empty")

    def refused(self, words):
        done = subprocess.run(["tools/release.sh", "--check"], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn(words, done.stderr)

    def test_notes_are_the_section_of_the_version(self):
        done = subprocess.run(["tools/release.sh", "--check"], cwd=self.folder, capture_output=True, text=True, check=True)
        self.assertEqual(done.stdout, "## 1.2.3: third\n2026-11-23\n\n- new\n")

    def test_a_changelog_without_the_version(self):
        self.write("CHANGELOG.md", "# Changelog\n\n## 1.2.30: later\n- other\n")
        self.commit()
        self.refused("no section '## 1.2.3: …'")

    def test_an_unfinished_version(self):
        self.write("CHANGELOG.md", "# Changelog\n\n## 1.2.3: third\nNot released yet; what it will hold.\n")
        self.commit()
        self.refused("Not released yet")

    def test_missing_golden_files(self):
        (self.folder / "tests/golden/1.2.3/symbols.txt").unlink()
        self.commit()
        self.refused("symbols.txt is missing")

    def test_uncommitted_changes(self):
        self.write("more.txt", "x")
        self.refused("more.txt")


if __name__ == "__main__":
    unittest.main()
