#!/usr/bin/python3
"""The public checks (.github/workflows/ci.yml) run the commands of README on the system that README names, after only the packages that a checkout needs."""
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/ci"))
sys.dont_write_bytecode = True
import workflow  # noqa: E402

BEFORE = ["apt-get update", "apt-get install -y --no-install-recommends git ca-certificates", "git config --system --add safe.directory '*'", workflow.CHECKOUT]


def readme_commands(text):
    """The commands of the first block below "Try it"."""
    return re.search(r"^## Try it\n.*?^```sh\n(.*?)^```", text, re.M | re.S).group(1).split("\n")[:-1]


def wrong(text, readme):
    expected = BEFORE + readme_commands(readme)
    found = workflow.lines(text)
    return [] if found == expected else [f"{found} instead of {expected}"]


class Ci(unittest.TestCase):
    def setUp(self):
        self.text, self.readme = workflow.FILE.read_text(), (ROOT / "README.md").read_text()

    def test_its_commands_are_those_of_the_readme(self):
        self.assertEqual(readme_commands(self.readme), ["./demo.sh", "./test.sh"])
        self.assertEqual(wrong(self.text, self.readme), [])

    def test_another_command_is_found(self):
        self.assertNotEqual(wrong(self.text.replace("run: ./test.sh", "run: ./test.sh --quick"), self.readme), [])
        self.assertNotEqual(wrong(self.text.replace("git ca-certificates", "git ca-certificates g++"), self.readme), [])
        self.assertNotEqual(wrong(self.text, self.readme.replace("./demo.sh\n./test.sh", "./demo.sh")), [])

    def test_its_system_is_that_of_the_readme(self):
        name, version = re.search(r"## Try it\nYou need (\w+) (\d+)", self.readme).groups()
        for job in workflow.jobs(self.text).values():
            self.assertEqual(job["container"], f"{name.lower()}:{version}")
            self.assertIn("timeout-minutes", job)

    def test_it_may_only_read(self):
        self.assertIn("permissions:\n  contents: read\n", self.text)

    def test_clang_tidy_has_a_commit_to_compare_with(self):
        self.assertIn("fetch-depth: 2", self.text)


if __name__ == "__main__":
    unittest.main()
