#!/usr/bin/python3
"""tools/build_site.py refuses a dead link and a missing picture, brings what lies outside docs/, and leaves code alone."""
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
sys.dont_write_bytecode = True
import build_site  # noqa: E402

PAGE = ROOT / "docs" / "howto" / "python.md"


class Links(unittest.TestCase):
    def rewritten(self, text):
        with tempfile.TemporaryDirectory() as folder:
            return build_site.Stage(pathlib.Path(folder)).rewritten(PAGE, text)

    def test_dead_links_are_refused(self):
        for text in ("[a](nothing.md)", "![a](../images/nothing.png)", "[a](../../../outside.md)"):
            with self.assertRaises(SystemExit, msg=text):
                self.rewritten(text)

    def test_what_lies_outside_comes_with_it(self):
        self.assertEqual(self.rewritten("[a](../../labs/README.md#x)"), "[a](../source/labs/README.md#x)")
        self.assertEqual(self.rewritten("[`a`](../conventions.md)"), "[`a`](../conventions.md)")
        self.assertEqual(self.rewritten("[robots](../../share/robots)"), "robots")

    def test_code_and_the_web_stay(self):
        for text in ("```\n[a](nothing.md)\n```", "    [a](nothing.md)", "[a](https://semver.org)", "[a](#below)"):
            self.assertEqual(self.rewritten(text), text)


if __name__ == "__main__":
    unittest.main()
