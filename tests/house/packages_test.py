#!/usr/bin/python3
"""tools/packages.sh waits for the lock of apt with a message, reports other failures at once, and needs no sudo if nothing is missing. apt-get is a stub."""
import os
import pathlib
import stat
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LISTS = "E: Could not get lock /var/lib/apt/lists/lock. It is held by process 7 (apt-get)"
DPKG = "E: Could not get lock /var/lib/dpkg/lock-frontend. It is held by process 7 (unattended-upgr)\\nE: Unable to acquire the dpkg frontend lock"
# Fails with WORDS as often as the file `fails` has lines; keeps its arguments.
APT = """#!/bin/bash
echo "$@" >>calls
if [ -s fails ]; then sed -i 1d fails; printf "$WORDS\\n" >&2; exit 100; fi
"""
INSTALL = "source tools/packages.sh; waymark_install one-package"


class Packages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name) / "a clone"
        (self.folder / "tools").mkdir(parents=True)
        (self.folder / "tools/packages.sh").write_text((ROOT / "tools/packages.sh").read_text())
        self.stub("apt-get", APT)
        self.stub("dpkg-query", "#!/bin/sh\nexit 1\n")  # nothing is installed
        self.stub("sleep", "#!/bin/sh\necho slept >>calls\n")
        self.stub("id", "#!/bin/sh\necho 0\n")

    def stub(self, name, text):
        path = self.folder / "stubs" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        path.chmod(path.stat().st_mode | stat.S_IXUSR)

    def run_script(self, script, fails=0, words="", path="/usr/bin:/bin"):
        (self.folder / "fails").write_text("fail\n" * fails)
        environment = {"PATH": f"{self.folder / 'stubs'}:{path}", "WORDS": words, "HOME": os.environ["HOME"]}
        done = subprocess.run(["/bin/bash", "-euo", "pipefail", "-c", script], cwd=self.folder, env=environment, capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL,
                              check=False)
        calls = self.folder / "calls"
        return done, calls.read_text().splitlines() if calls.exists() else []

    def test_a_free_lock_is_taken_at_once(self):
        done, calls = self.run_script(INSTALL)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([call.split()[2] for call in calls], ["update", "install"])
        self.assertEqual(done.stderr, "")

    def test_waits_for_a_lock_and_prints_one_message(self):
        for words in (LISTS, DPKG):
            (self.folder / "calls").unlink(missing_ok=True)
            done, calls = self.run_script(INSTALL, 3, words)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(calls.count("slept"), 3)
            self.assertEqual(done.stderr.count("Another program is installing packages"), 1)

    def test_every_call_waits_for_the_lock_of_dpkg(self):
        _, calls = self.run_script(INSTALL)
        for call in calls:
            self.assertIn("-o DPkg::Lock::Timeout=", call)
        for name in ("demo.sh", "test.sh", "tools/packages.sh"):
            for line in (ROOT / name).read_text().splitlines():
                if "apt-get " in line and "echo" not in line and not line.lstrip().startswith("#") and "read -r" not in line:
                    self.assertIn("DPkg::Lock::Timeout", line, name)

    def test_any_other_failure_is_reported_at_once(self):
        done, calls = self.run_script(INSTALL, 1, "E: Unable to locate package one-package")
        self.assertEqual(done.returncode, 1)
        self.assertNotIn("slept", calls)
        self.assertIn("Unable to locate package", done.stderr)

    def test_without_sudo_it_prints_the_command(self):
        self.stub("id", "#!/bin/sh\necho 1000\n")
        for name in ("bash", "grep", "mktemp", "tail", "rm", "env"):
            self.stub(name, f'#!/bin/sh\nexec /usr/bin/{name} "$@"\n')
        done, calls = self.run_script(INSTALL, path="/nowhere")
        self.assertEqual((done.returncode, calls), (1, []))
        self.assertIn("apt-get install one-package", done.stderr)

    def test_calls_nothing_if_nothing_is_missing(self):
        self.stub("id", "#!/bin/sh\necho 1000\n")
        self.stub("dpkg-query", "#!/bin/sh\necho installed\n")
        done, calls = self.run_script(INSTALL)
        self.assertEqual((done.returncode, calls, done.stdout, done.stderr), (0, [], "", ""))


if __name__ == "__main__":
    unittest.main()
