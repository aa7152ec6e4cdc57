#!/usr/bin/python3
"""tools/build_site.py refuses dead links and missing images, includes linked files outside docs/, and does not change code."""
import pathlib
import sys
import tempfile
import unittest
import unittest.mock

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

    def test_linked_files_outside_docs_are_included(self):
        self.assertEqual(self.rewritten("[a](../../labs/README.md#x)"), "[a](../source/labs/README.md#x)")
        self.assertEqual(self.rewritten("[`a`](../conventions.md)"), "[`a`](../conventions.md)")
        self.assertEqual(self.rewritten("[robots](../../share/robots)"), "robots")

    def test_code_and_web_links_are_unchanged(self):
        for text in ("```\n[a](nothing.md)\n```", "    [a](nothing.md)", "[a](https://semver.org)", "[a](#below)"):
            self.assertEqual(self.rewritten(text), text)

    def test_the_cpp_reference_contains_the_public_headers(self):
        headers = build_site.public_headers()
        self.assertIn("waymark/geometry/se3.hpp", headers)
        self.assertNotIn("waymark/geometry/lie.hpp", headers)  # only included by others
        self.assertTrue(all((ROOT / header).is_file() for header in headers))

    def test_without_doxygen_the_page_has_a_note(self):
        with tempfile.TemporaryDirectory() as folder, unittest.mock.patch("shutil.which", return_value=None):
            page = pathlib.Path(folder) / "reference/cpp.md"
            page.parent.mkdir()
            page.write_text((ROOT / "docs/reference/cpp.md").read_text())
            build_site.put_cpp_reference(pathlib.Path(folder))
            self.assertIn("built without doxygen", page.read_text())
            self.assertNotIn(build_site.CPP, page.read_text())


if __name__ == "__main__":
    unittest.main()
