#!/usr/bin/python3
"""tools/check_words.py finds planted words, sentences and lines in a small repository, and accepts what it must."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True


class Words(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)
        self.write("tools/check_words.py", (ROOT / "tools/check_words.py").read_text(encoding="utf-8"))
        shutil.copy(ROOT / "tools/banned_words.txt", self.root / "tools")
        self.write("README.md", "# Planted\nA map has tags.\n")
        subprocess.run(["git", "init", "-q", self.root], check=True)

    def tearDown(self):
        self.folder.cleanup()

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def check(self, *words):
        done = subprocess.run([sys.executable, self.root / "tools/check_words.py", *words], capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    def test_clean_text_passes(self):
        self.assertEqual(self.check()[0], 0, self.check()[1])
        self.assertEqual(self.check("--measure")[0], 0, self.check("--measure")[1])

    def test_a_banned_word_is_found_with_its_place(self):
        self.write("waymark/a.cpp", "int x;\n// Nobody knows the size.\n")
        code, text = self.check("--list")
        self.assertEqual(code, 1)
        self.assertIn("waymark/a.cpp:2: 'Nobody knows'", text)

    def test_an_identifier_is_found(self):
        self.write("waymark/a.hpp", "bool is_said(); constexpr int kMostTags = 3;\n")
        self.assertEqual(self.check("waymark")[0], 1)

    def test_the_list_allows_a_word_in_one_file_only(self):
        self.write("docs/a.md", "The key is `said`.\n")
        self.write("tools/allowed_words.txt", "# a comment\ndocs/a.md | said | a key of the protocol\n")
        self.assertEqual(self.check()[0], 0, self.check()[1])
        self.write("docs/b.md", "The key is `said`.\n")
        code, text = self.check()
        self.assertEqual(code, 1)
        self.assertIn("docs/b.md: 1", text)
        self.assertNotIn("docs/a.md", text)

    def test_a_line_of_the_list_without_a_use_is_found(self):
        self.write("tools/allowed_words.txt", "README.md | said | no longer there\n")
        code, text = self.check()
        self.assertEqual(code, 1)
        self.assertIn("README.md does not use 'said'", text)

    def test_a_line_of_the_list_without_a_reason_is_found(self):
        self.write("docs/a.md", "The key is `said`.\n")
        self.write("tools/allowed_words.txt", "docs/a.md | said\n")
        self.assertEqual(self.check()[0], 1)

    def test_a_long_sentence_of_a_document_is_found(self):
        self.write("docs/a.md", "A tag " + "is seen and " * 10 + "ends.\n")
        code, text = self.check("--measure")
        self.assertEqual(code, 1)
        self.assertIn("33 docs/a.md: A tag is seen", text)

    def test_a_long_sentence_over_lines_of_a_comment_is_found(self):
        self.write("waymark/a.hpp", "/// A tag " + "is seen and " * 5 + "\n/// then " + "is seen and " * 6 + "ends.\nint x;\n")
        self.assertIn("waymark/a.hpp: A tag is seen", self.check("--measure")[1])

    def test_a_long_docstring_is_found(self):
        self.write("python/a.py", '"""A tag ' + "is seen and\n" * 10 + 'ends."""\n')
        self.assertIn("python/a.py: A tag is seen", self.check("--measure")[1])

    def test_comments_of_members_are_apart(self):
        member = "  int x = 0;  ///< number of tags in the image that lie within the limits of the map and of the range\n"
        self.write("waymark/a.hpp", "struct A {\n" + 3 * member + "};\n")
        self.assertEqual(self.check("--measure")[0], 0, self.check("--measure")[1])

    def test_what_is_not_prose_is_not_measured(self):
        words = "one two three four five six seven eight nine ten "
        self.write("docs/a.md", f"# {4 * words}\n| {4 * words} |\n\n```text\n{4 * words}\n```\n\n    {4 * words}\n\nRun `{4 * words}`.\n")
        self.write("waymark/a.cpp", f'const char* a = "CREATE TABLE {4 * words}";\nconst char* b = "usage: program {4 * words}";\n')
        self.assertEqual(self.check("--measure")[0], 0, self.check("--measure")[1])

    def test_a_citation_does_not_count(self):
        words = "one two three four five six seven eight nine ten "
        self.write("docs/a.md", f'A tag is {2 * words}\n(Author and Other, "{words}", A Journal 30(2), 2014).\n')
        self.assertEqual(self.check("--measure")[0], 0, self.check("--measure")[1])
        self.write("docs/a.md", f"A tag is {2 * words}\n({words}).\n")
        self.assertEqual(self.check("--measure")[0], 1)

    def test_a_wide_line_is_found_unless_it_cannot_break(self):
        link = "[word](" + "x" * 130 + ")"
        self.write("docs/a.md", f"- {link}\n\n| {'a ' * 70}|\n\n`{'a ' * 70}`\n")
        self.assertEqual(self.check("--measure")[0], 0, self.check("--measure")[1])
        self.write("docs/a.md", f"A link {link}\n")
        code, text = self.check("--measure")
        self.assertEqual(code, 1)
        self.assertIn("docs/a.md:1", text)


if __name__ == "__main__":
    unittest.main()
